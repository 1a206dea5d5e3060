"""Joint limits as bounds on the velocity."""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled

YIELD = 1e-6
"""Share of T a by which rounding may push a bound past an acceleration limit before that counts as yielding."""


@compiled("float64(float64, float64, float64, float64)")
def approach_speed(room: float, eta: float, acceleration: float, period: float) -> float:
    """Fastest approach to a limit at a distance room >= 0: eta room, as far as braking keeps up with it.

    Slowing down by T a each period, a joint comes from v to v - T a while the room shrinks by T v. The parabola
    room = v^2 / (2 a) + T v / 2 + c is mapped onto itself by that; c is such that it touches the line v = eta room.
    """
    touch = acceleration * (1.0 / eta - 0.5 * period)
    if eta * room <= touch:
        return eta * room
    half = 0.5 * acceleration * period
    return float(np.sqrt(half * half + 2.0 * acceleration * room - touch * touch) - half)


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
    brake, and changes its velocity by at most T a from the last command (`last`); accelerate = 0 leaves the latter
    out. low <= high always: on its way back a joint is no faster than it could brake before the other end.

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
            if 0.0 < below < np.inf:
                down = approach_speed(below, eta, acceleration, period)
            if 0.0 < above < np.inf:
                up = approach_speed(above, eta, acceleration, period)
            if below < 0.0:
                down = max(down, -up)
            if above < 0.0:
                up = max(up, -down)
        low[j] = max(-speed, min(speed, -down))
        high[j] = min(speed, max(-speed, up))
        if acceleration < np.inf and accelerate:
            change = period * acceleration
            slowest, fastest = last[j] - change, last[j] + change
            if slowest > high[j] + YIELD * change or fastest < low[j] - YIELD * change:
                yielded = 1
            low[j], high[j] = max(low[j], min(slowest, high[j])), min(high[j], max(fastest, low[j]))
    return yielded
