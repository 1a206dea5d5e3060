"""How many rows the program has: those of constraints and the user's, then those of points of clouds, then cuts."""

import numpy as np

from primitives.compiled import compiled
from primitives.memory import integers
from vfi.memory import Real, Whole
from vfi.outcome import Basis, Option

_ROWS = (
    int(Real.A),
    int(Real.B),
    int(Real.DEMAND),
    int(Real.RATE),
    int(Real.SLACK),
    int(Real.DEFECT),
    int(Real.LAST_DEFECT),
    int(Real.ROW_TOLERANCE),
)
_SOLVED = (
    int(Real.SCALE),
    int(Real.RELAXED_A),
    int(Real.RELAXED_B),
    int(Real.RELAXED_SCALE),
    int(Real.FREE_A),
    int(Real.FREE_B),
    int(Real.FREE_DEMAND),
    int(Real.FREE_SLACK),
)


@compiled("void(int64[:,::1], int64[::1], int64[:,::1], int64)")
def set_rows(fl: np.ndarray, w: np.ndarray, wl: np.ndarray, rows: int) -> None:
    """Make the blocks that have a row for each inequality as long as there are any in this cycle."""
    variables = fl[Real.V, 1]
    solved = rows
    if integers(w, wl, Whole.OPTIONS)[Option.BASIS] != Basis.JOINTS:
        solved += 2 * variables
        variables = fl[Real.FREE, 1]
    for block in _ROWS:
        fl[block, 1] = rows
    for block in _SOLVED:
        fl[block, 1] = solved
    wl[Whole.SAFETY_CLASS, 1] = rows
    wl[Whole.FREE_CLASS, 1] = solved
    fl[Real.MULTIPLIER, 1] = solved + 2 * variables
    wl[Whole.MASK, 1] = solved + 2 * variables
    fl[Real.RELAXED_MULTIPLIER, 1] = solved + 2 * (variables + 1)
    wl[Whole.RELAXED_MASK, 1] = solved + 2 * (variables + 1)
