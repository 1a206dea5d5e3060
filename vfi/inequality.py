"""A margin becomes a row: J v >= rate - residual, the rate being -eta times the margin; paper V, (12)-(14)."""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.vectors import DEGENERATE


@compiled("float64(float64, float64, float64)")
def demanded_rate(margin: float, eta: float, recovery: float) -> float:
    """Rate that a margin must at least have, per second: -eta margin, and out of a violation at most `recovery`."""
    return min(-eta * margin, recovery)


@compiled(
    "int64(float64[::1], float64[:,::1], float64[::1], int64[::1], int64[::1], int64[::1], float64[::1],"
    "float64[::1], float64, float64, int64[::1], float64[:,::1], float64[::1], float64[::1])"
)
def fill_rows(
    margin: Array,
    row: Array,
    residual: Array,
    status: np.ndarray,
    enforced: np.ndarray,
    angular: np.ndarray,
    side: Array,
    eta: Array,
    recovery_linear: float,
    recovery_angular: float,
    decided: np.ndarray,
    A: Array,
    demand: Array,
    rate: Array,
) -> int:
    """Rows A (m, d) and demands (m,) of the enforced constraints for the decided joints (d,).

    Where a gradient does not exist the row of a keep-inside constraint is void as long as its margin is >= 0: in the
    form multiplied by d it reads 0 <= 0. Any other constraint there cannot be written as a row.

    Returns
    -------
    -1, or the index of a constraint that cannot be written as a row.
    """
    for i in range(margin.shape[0]):
        demand[i] = -np.inf
        rate[i] = -np.inf
        if enforced[i] == 0:
            continue
        rate[i] = demanded_rate(margin[i], eta[i], recovery_angular if angular[i] else recovery_linear)
        if status[i] == DEGENERATE:
            if side[i] > 0.0 or margin[i] < 0.0:
                return i
            continue
        demand[i] = rate[i] - residual[i]
        for j in range(decided.shape[0]):
            A[i, j] = row[i, decided[j]]
    return -1
