"""Smallest slack when the rows contradict each other, by safety class: task yields first, patient last.

A row may yield only where standing still would not do either (its demand is positive): its margin is negative, or
something moves towards it. Velocity and joint limits never yield. Within a class the largest slack is minimised, then,
with the rows that need it settled, the largest slack of the others, and so on: a row that is in no conflict yields
nothing.
"""

import numpy as np

from primitives.active_set import OPTIMAL, solve
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.constraint import SAFETY_CLASSES

CLASSES = len(SAFETY_CLASSES)
REGULARISATION = 1e-12
"""Weight of the squared velocity against the squared slack, so that the program stays strictly convex."""
ROOM = 1e-8
"""Added to the slack found, so that the relaxed program is feasible beyond rounding; less counts as no slack."""
SHARE = 1e-6
"""Share of the class's multipliers, which add up to its slack, from which on a row counts as the cause of it."""


@compiled(
    "int64(float64[:,::1], float64[::1], float64[::1], float64[::1], int64[::1], float64[::1], float64[::1],"
    "float64[:,::1], float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1],"
    "float64[::1], int64[::1], int64[::1], float64[::1], float64[:,::1])"
)
def relax(
    A: Array,
    demand: Array,
    low: Array,
    high: Array,
    safety_class: np.ndarray,
    b: Array,
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
    """Lower b (r,), and raise slack (r,) by as much, so that A v >= b has a solution within the bounds; what is taken
    off is minimised from the largest share of each class down, the classes in lexicographic order.

    b is the demand (r,), or more than that where re-solving has raised it. What was raised is a guess, for which no row
    shall lose more than standing still would: where the bounds allow that, slack then grows up to the demand, and what
    the answer is short of beyond that fails verification. The arguments from H on are scratch of a program with one
    more variable, the slack of the class.

    Returns
    -------
    A `SolverStatus`: OPTIMAL, or that of the stage that failed; b and slack are of no use then.
    """
    rows, n = A.shape
    H[:, :] = 0.0
    g[:] = 0.0
    for j in range(n):
        H[j, j] = REGULARISATION
        low_wide[j] = low[j]
        high_wide[j] = high[j]
    still, raised = True, False
    for j in range(n):
        still = still and low[j] <= 0.0 <= high[j]
    for i in range(rows):
        raised = raised or b[i] + slack[i] > demand[i] + ROOM
    H[n, n] = 1.0
    low_wide[n] = 0.0
    high_wide[n] = np.inf
    for stage in range(CLASSES):
        unsettled = 0
        for i in range(rows):
            may_yield = demand[i] > 0.0
            for j in range(n):
                A_wide[i, j] = A[i, j]
            A_wide[i, n] = 1.0 if may_yield and safety_class[i] == stage else 0.0
            unsettled += int(A_wide[i, n])
            b_wide[i] = -np.inf if may_yield and safety_class[i] > stage else b[i]
        active[0] = 0
        while unsettled > 0:
            status = solve(H, g, A_wide, b_wide, low_wide, high_wide, v, multiplier, active, mask, scale, work)
            if status != OPTIMAL:
                return status
            if v[n] <= ROOM:
                break
            before, share = unsettled, float(SHARE * v[n])
            while unsettled == before:
                for i in range(rows):
                    if A_wide[i, n] == 1.0 and multiplier[i] > share:
                        A_wide[i, n] = 0.0
                        unsettled -= 1
                        most = max(slack[i], demand[i]) if raised and still else np.inf
                        slack[i] = min(slack[i] + v[n] + ROOM, most)
                        b[i] -= v[n] + ROOM
                        b_wide[i] = b[i]
                share = -1.0
    return OPTIMAL
