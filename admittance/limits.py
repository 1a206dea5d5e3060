"""Joint limits and singularities as limits of the free velocity: projected, then scaled, never pushed.

Every limit here allows standing still, so projecting v onto it in the metric of the step and scaling it take energy
out and never put any in, and both leave the port constraint alone.
"""

import numpy as np

from admittance.dense import inner
from admittance.outcome import Limited
from primitives.active_set import OPTIMAL, solve
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.verification import all_finite

ROUNDING = 1e-12
"""Excess over a bound, rad/s or m/s, that is none: where a bound leaves no room, rounding must not stop the arm."""


@compiled("void(float64[::1], int64[::1], float64[:,::1], float64, float64[:,::1], float64[:,::1])")
def fill_limits(q: Array, decided: np.ndarray, limits: Array, eta: float, low: Array, high: Array) -> None:
    """Bounds of each decided joint's velocity from limits (3, d): lower, upper, velocity.

    Row 0 of low and high (2, d) is what the position leaves, eta times the room to either end; row 1 that within the
    velocity limits. Zero always lies between them: a joint outside its range can only not go further out.
    """
    for j in range(decided.shape[0]):
        position = q[decided[j]]
        low[0, j] = -eta * max(0.0, position - limits[0, j])
        high[0, j] = eta * max(0.0, limits[1, j] - position)
        low[1, j] = max(low[0, j], -limits[2, j])
        high[1, j] = min(high[0, j], limits[2, j])


@compiled("float64(float64[::1], float64[:,::1], float64[:,::1])")
def fit_offset(offset: Array, low: Array, high: Array) -> float:
    """Scale the offset (d,) of qdot so that it keeps the bounds by itself; returns the factor, at most 1."""
    factor = 1.0
    for j in range(offset.shape[0]):
        if offset[j] > high[1, j]:
            factor = min(factor, high[1, j] / offset[j])
        elif offset[j] < low[1, j]:
            factor = min(factor, low[1, j] / offset[j])
    if factor < 1.0:
        for j in range(offset.shape[0]):
            offset[j] *= factor
    return factor


_LIMIT = (
    "int64(float64[::1], float64[:,::1], float64[::1], float64[:,::1], float64[:,::1], float64[::1], float64,"
    "float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], float64[::1],"
    "int64[::1], int64[::1], float64[::1], float64[:,::1])"
)


@compiled(_LIMIT)
def limit_velocity(
    v: Array,
    Z: Array,
    offset: Array,
    low: Array,
    high: Array,
    singular: Array,
    singular_low: float,
    metric: Array,
    A: Array,
    b: Array,
    cost: Array,
    given: Array,
    unbounded: Array,
    multiplier: Array,
    active: np.ndarray,
    mask: np.ndarray,
    row_scale: Array,
    work: Array,
) -> int:
    """Change a free velocity v (m,) so that qdot = Z^T v + offset keeps its bounds; returns bits of `Limited`.

    First the projection, in the metric X (m, m) of the step, onto the position limits (row 0 of low and high) and
    `singular` (m,) v >= singular_low <= 0; then v is scaled as a whole so that all bounds hold, to rounding (1e-12).
    What comes out has v^T X (v - v_given) <= 0: it takes energy out. Where the projection is not found, which only
    rounding can do as standing still is allowed, the scaling alone keeps the bounds.

    A and what follows is scratch of `primitives.active_set.solve` for 2 d + 1 rows; unbounded (2 m,) holds -inf m times
    and inf m times.
    """
    m, d = Z.shape
    done = 0
    violated = inner(singular, v) < singular_low
    for j in range(d):
        value = offset[j]
        for i in range(m):
            value += Z[i, j] * v[i]
        violated = violated or value < low[0, j] or value > high[0, j]
    for i in range(m):
        given[i] = v[i]
    if violated:
        for j in range(d):
            b[j], b[d + j] = low[0, j] - offset[j], offset[j] - high[0, j]
            for i in range(m):
                A[j, i], A[d + j, i] = Z[i, j], -Z[i, j]
        b[2 * d] = singular_low
        for i in range(m):
            A[2 * d, i] = singular[i]
            cost[i] = -inner(metric[i], given)
        active[0] = 0
        free_low, free_high = unbounded[:m], unbounded[m:]
        solved = solve(metric, cost, A, b, free_low, free_high, v, multiplier, active, mask, row_scale, work)
        if solved == OPTIMAL and all_finite(v):
            if multiplier[2 * d] > 0.0:
                done |= Limited.CONDITION
            for j in range(2 * d):
                if multiplier[j] > 0.0:
                    done |= Limited.POSITION
        else:
            for i in range(m):
                v[i] = given[i]
    scale = 1.0
    for j in range(d):
        value = 0.0
        for i in range(m):
            value += Z[i, j] * v[i]
        if value + offset[j] > high[1, j] + ROUNDING:
            scale = min(scale, max(0.0, high[1, j] - offset[j]) / value)
        elif value + offset[j] < low[1, j] - ROUNDING:
            scale = min(scale, min(0.0, low[1, j] - offset[j]) / value)
    along = inner(singular, v)
    if along < singular_low - ROUNDING:
        scale = min(scale, singular_low / along)
    if scale < 1.0 - 1e-9:
        done |= Limited.VELOCITY
    if done:
        own, mixed = 0.0, 0.0
        for i in range(m):
            for k in range(m):
                own += v[i] * metric[i, k] * v[k]
                mixed += v[i] * metric[i, k] * given[k]
        if mixed < scale * own:
            scale = max(mixed, 0.0) / own
    if scale < 1.0:
        for i in range(m):
            v[i] *= scale
    return done
