"""The declared constraints at one configuration: the barrier of `potential` on every margin, whatever its pair.

A margin stands where the clearance of a cloud point does. With J_m (1, d) its derivative by the decided joints, the
force is -V'(margin) Z J_m^T in all free coordinates: what lies beyond the shaft moves margins as well.
"""

import numpy as np

from admittance.memory import Real, Whole
from admittance.outcome import Reason, Setting, Slot, Touch
from admittance.potential import barrier
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.evaluate import evaluate_rows
from primitives.memory import MEMORY, cube, integer_matrix, integers, matrix, vector
from primitives.vectors import CONTACT, DEGENERATE

RANGE, SIGHT, LINEAR = 0, 1, 2
"""Columns of REACH (c, 3): range of the barrier, margin up to which a row is made, margin below which it is linear."""


@compiled(f"int64({MEMORY}, int64)")
def measure_margins(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, blocked: int) -> int:
    """Margins of all constraints at the present POSE and JACOBIAN, and the potential of the enforced ones.

    PUSH (c, 2) becomes -V' and V'' of each. blocked is the `Reason` found before; returns the graver one of both.
    """
    outcome, margin, push = integers(w, wl, Whole.OUTCOME), vector(f, fl, Real.MARGIN), matrix(f, fl, Real.PUSH)
    outcome[Slot.CONSTRAINT] = -1
    if margin.shape[0] == 0:
        return blocked
    enforced, status, reach = integers(w, wl, Whole.ENFORCED), integers(w, wl, Whole.STATUS), matrix(f, fl, Real.REACH)
    evaluate_rows(
        integers(w, wl, Whole.ADDRESS),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.GEOMETRY),
        vector(f, fl, Real.SIDE),
        vector(f, fl, Real.SAFE),
        matrix(f, fl, Real.POSE),
        cube(f, fl, Real.JACOBIAN),
        matrix(f, fl, Real.NO_TWIST),
        vector(f, fl, Real.NO_RATE),
        vector(f, fl, Real.DISTANCE),
        margin,
        matrix(f, fl, Real.ROW),
        vector(f, fl, Real.RESIDUAL),
        status,
    )
    k, touch = vector(f, fl, Real.SETTINGS)[Setting.STIFFNESS], vector(f, fl, Real.TOUCH)
    violated, least = False, np.inf
    for i in range(margin.shape[0]):
        push[i, 0] = 0.0
        push[i, 1] = 0.0
        if not enforced[i]:
            continue
        if not np.isfinite(margin[i]):
            return Reason.NOT_FINITE
        share = margin[i] / reach[i, RANGE]
        if share < least:
            least = share
            outcome[Slot.CONSTRAINT] = i
        # At contact there is no direction to push in, so the barrier cannot act.
        if margin[i] <= 0.0 or (status[i] == DEGENERATE and margin[i] <= CONTACT):
            violated = True
            if reach[i, LINEAR] <= 0.0:
                continue
        potential, push[i, 0], push[i, 1] = barrier(margin[i], k, reach[i, RANGE], reach[i, LINEAR])
        touch[Touch.POTENTIAL] += potential
    return Reason.VIOLATED if violated and not blocked else blocked


@compiled(f"int64({MEMORY})")
def push_off(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Add the constraints' force to F_RX (m,) and their Gauss-Newton stiffness to STIFFNESS (m, m); needs Z.

    FREE_ROW (c, m) becomes Z J_m^T of each enforced constraint within sight, and zero of the others. Returns 0 where a
    gradient is not finite.
    """
    margin, row, free = vector(f, fl, Real.MARGIN), matrix(f, fl, Real.ROW), matrix(f, fl, Real.FREE_ROW)
    enforced, decided = integers(w, wl, Whole.ENFORCED), integers(w, wl, Whole.DECIDED)
    reach, push, Z = matrix(f, fl, Real.REACH), matrix(f, fl, Real.PUSH), matrix(f, fl, Real.Z)
    F_rx, K = vector(f, fl, Real.F_RX), matrix(f, fl, Real.STIFFNESS)
    total = 0.0
    for i in range(margin.shape[0]):
        near = enforced[i] and margin[i] < reach[i, SIGHT]
        for r in range(F_rx.shape[0]):
            value = 0.0
            if near:
                for j in range(decided.shape[0]):
                    value += Z[r, j] * row[i, decided[j]]
            free[i, r] = value
            total += value
            F_rx[r] += push[i, 0] * value
        if push[i, 1] > 0.0:
            for r in range(F_rx.shape[0]):
                for s in range(F_rx.shape[0]):
                    K[r, s] += push[i, 1] * free[i, r] * free[i, s]
    return int(np.isfinite(total))
