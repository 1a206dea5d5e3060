"""Joint limits as bounds on the velocity."""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled


@compiled(
    "int64(float64[::1], int64[::1], float64[:,::1], float64[::1], float64, float64, int64, float64[::1], float64[::1])"
)
def fill_bounds(
    q: Array,
    decided: np.ndarray,
    limits: Array,
    last: Array,
    eta: float,
    period: float,
    accelerate: int,
    low: Array,
    high: Array,
) -> int:
    """Bounds low, high (d,) from limits (4, d): lower, upper, velocity, acceleration.

    [I; -I] v <= eta [q_max - q; q - q_min] (paper V, W_l and w_l), within the velocity limits; a joint outside its
    range is driven back as fast as these allow. With acceleration limits a joint also keeps the distance it needs to
    brake, and changes its velocity by at most T a from the last command (`last`). accelerate = 0 leaves that out.

    Returns
    -------
    1 where the acceleration limits had to yield to the others, else 0.
    """
    yielded = 0
    for j in range(decided.shape[0]):
        position, speed, acceleration = q[decided[j]], limits[2, j], limits[3, j]
        below, above = position - limits[0, j], limits[1, j] - position
        down, up = eta * below, eta * above
        if acceleration < np.inf:
            down = min(down, np.sqrt(2.0 * acceleration * max(below, 0.0))) if below > 0.0 else down
            up = min(up, np.sqrt(2.0 * acceleration * max(above, 0.0))) if above > 0.0 else up
        low[j] = max(-speed, min(speed, -down))
        high[j] = min(speed, max(-speed, up))
        if acceleration < np.inf and accelerate:
            slowest, fastest = last[j] - period * acceleration, last[j] + period * acceleration
            if slowest > high[j] or fastest < low[j]:
                yielded = 1
                slowest = min(slowest, high[j])
                fastest = max(fastest, low[j])
            low[j] = max(low[j], slowest)
            high[j] = min(high[j], fastest)
    return yielded
