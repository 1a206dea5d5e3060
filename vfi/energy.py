"""What a projected step does to the motion beyond what hand and damping do: the ports of the energy ledger.

With v+ the solution of the projection in the metric X, the constraints do v+^T X (v+ - v_ref), J, in a step. Where the
solver's answer is the command this is sum lambda_i b_i, which is shared out by what b_i consists of: the demanded rate
(keeping where it is <= 0, recovering above), the residual (moving), and the offset that leads back to the port.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers, matrix, vector
from vfi.memory import Real, Whole
from vfi.outcome import Option, Work


@compiled(f"void({MEMORY})")
def account(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Fill WORK_DONE for the command of a projection; zeros where it stands still."""
    work, y, reference = vector(f, fl, Real.WORK_DONE), vector(f, fl, Real.FREE), vector(f, fl, Real.REFERENCE)
    metric, multiplier = matrix(f, fl, Real.METRIC), vector(f, fl, Real.MULTIPLIER)
    A, b, demand, rate = (
        matrix(f, fl, Real.A),
        vector(f, fl, Real.B),
        vector(f, fl, Real.DEMAND),
        vector(f, fl, Real.RATE),
    )
    offset, low, high = vector(f, fl, Real.OFFSET), vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH)
    total, still, rows, d = 0.0, True, A.shape[0], offset.shape[0]
    cut, uncut = integers(w, wl, Whole.CUT), rows - integers(w, wl, Whole.OPTIONS)[Option.CUTS]
    for i in range(len(work)):
        work[i] = 0.0
    for i in range(y.shape[0]):
        still = still and y[i] == 0.0
        for j in range(y.shape[0]):
            total += y[i] * metric[i, j] * (y[j] - reference[j])
    if still:
        return
    for i in range(rows):
        if multiplier[i] > 0.0:
            for j in range(d):
                work[Work.PORT] -= multiplier[i] * A[i, j] * offset[j]
            of = i if i < uncut else cut[i - uncut]
            wanted = rate[of] if rate[of] > -np.inf else demand[of]
            declared = demand[of] if demand[of] > -np.inf else wanted
            work[Work.MOVING] += multiplier[i] * (declared - wanted)
            work[Work.RECOVERING] += multiplier[i] * max(wanted, 0.0)
            work[Work.KEEPING] += multiplier[i] * (min(wanted, 0.0) + b[i] - declared)
    for j in range(d):
        if multiplier[rows + j] > 0.0:
            work[Work.LIMITS] += multiplier[rows + j] * (low[j] - offset[j])
        if multiplier[rows + d + j] > 0.0:
            work[Work.LIMITS] += multiplier[rows + d + j] * (offset[j] - high[j])
    work[Work.GUARD] = total - np.sum(work[: Work.GUARD])
