"""Smallest slack when the rows contradict each other, by safety class: task yields first, patient last.

A row may yield only where standing still would not do either (its demand is positive): its margin is negative, or
something moves towards it. Velocity and joint limits never yield.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.constraint import SAFETY_CLASSES
from vfi.active_set import OPTIMAL, solve

CLASSES = len(SAFETY_CLASSES)
REGULARISATION = 1e-8
"""Weight of the squared velocity against the squared slack, so that the program stays strictly convex."""
ROOM = 1e-8
"""Added to the slack found, so that the relaxed program is feasible beyond rounding."""


@compiled(
    "int64(float64[:,::1], float64[::1], float64[::1], float64[::1], int64[::1], float64[::1], float64[:,::1],"
    "float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], float64[::1], int64[::1],"
    "int64[::1], float64[::1], float64[:,::1])"
)
def relax(
    A: Array,
    demand: Array,
    low: Array,
    high: Array,
    safety_class: np.ndarray,
    slack: Array,
    H: Array,
    g: Array,
    A_wide: Array,
    b_wide: Array,
    low_wide: Array,
    high_wide: Array,
    v: Array,
    multiplier: Array,
    active: np.ndarray,
    mask: np.ndarray,
    scale: Array,
    work: Array,
) -> int:
    """Fill slack (r,) so that A v >= demand - slack has a solution within the bounds; the largest slack of each class
    is minimised, the classes in lexicographic order.

    The arguments from H on are scratch of a program with one more variable, the slack of the class.

    Returns
    -------
    A `SolverStatus`: OPTIMAL, or that of the stage that failed.
    """
    rows, n = A.shape
    H[:, :] = 0.0
    g[:] = 0.0
    for j in range(n):
        H[j, j] = REGULARISATION
        low_wide[j] = low[j]
        high_wide[j] = high[j]
    H[n, n] = 1.0
    low_wide[n] = 0.0
    high_wide[n] = np.inf
    slack[:] = 0.0
    for stage in range(CLASSES):
        needed = False
        for i in range(rows):
            may_yield = demand[i] > 0.0
            needed = needed or (may_yield and safety_class[i] == stage)
            for j in range(n):
                A_wide[i, j] = A[i, j]
            A_wide[i, n] = 1.0 if may_yield and safety_class[i] == stage else 0.0
            b_wide[i] = -np.inf if may_yield and safety_class[i] > stage else demand[i] - slack[i]
        if not needed:
            continue
        active[0] = 0
        status = solve(H, g, A_wide, b_wide, low_wide, high_wide, v, multiplier, active, mask, scale, work)
        if status != OPTIMAL:
            return status
        if v[n] > 0.0:
            for i in range(rows):
                if demand[i] > 0.0 and safety_class[i] == stage:
                    slack[i] = v[n] + ROOM
    return OPTIMAL
