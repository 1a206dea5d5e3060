"""Does this velocity keep these constraints for one period? The check that every command passes; it knows no solver.

Two questions, both answered as a *defect* per row in the margin's unit per second, so that one tolerance serves both:
by how much the linear row falls short, and by how much the margin that kinematics predicts for q + T v falls short.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled

TOLERANCE_LINEAR = 1e-6
"""m/s by which a row, a velocity limit or a predicted margin (per second) may fall short."""
TOLERANCE_ANGULAR = 1e-5
"""rad/s, likewise."""


@compiled("int64(float64[::1])")
def all_finite(values: Array) -> int:
    """1 where no value is NaN or infinite, else 0."""
    for i in range(values.shape[0]):
        if not np.isfinite(values[i]):
            return 0
    return 1


@compiled("float64(float64[::1], float64[::1], float64[::1], float64[::1])")
def bound_excess(v: Array, low: Array, high: Array, tolerance: Array) -> float:
    """Largest excess over the bounds (n,), in tolerances: at most 1 where v keeps them; NaN counts as infinite."""
    worst = 0.0
    for i in range(v.shape[0]):
        if np.isnan(v[i]) or np.isnan(low[i]) or np.isnan(high[i]):
            return np.inf
        worst = max(worst, (low[i] - v[i]) / tolerance[i], (v[i] - high[i]) / tolerance[i])
    return worst


@compiled("void(float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1])")
def row_defects(A: Array, demand: Array, slack: Array, v: Array, defect: Array) -> None:
    """defect = demand - slack - A v of each row (r, n); -inf for rows without a demand."""
    for i in range(A.shape[0]):
        if demand[i] == -np.inf:
            defect[i] = -np.inf
            continue
        value = demand[i] - slack[i]
        for j in range(v.shape[0]):
            value -= A[i, j] * v[j]
        defect[i] = value


@compiled("void(float64[::1], float64[::1], float64[::1], float64[::1], float64, float64[::1])")
def sampled_defects(margin: Array, predicted: Array, rate: Array, slack: Array, period: float, defect: Array) -> None:
    """Raise each defect (m,) to what the predicted margin falls short of margin + T (rate - slack), per second.

    rate is the demanded rate of the margin, -eta margin for a margin >= 0: the predicted margin is then asked to be
    at least (1 - eta T) margin. -inf for constraints that are not enforced. A predicted margin that is NaN makes the
    defect NaN.
    """
    for i in range(margin.shape[0]):
        if rate[i] == -np.inf:
            continue
        short = (margin[i] - predicted[i]) / period + rate[i] - slack[i]
        if not short <= defect[i] and not np.isnan(defect[i]):
            defect[i] = short


@compiled("float64(float64[::1], float64[::1])")
def worst_defect(defect: Array, tolerance: Array) -> float:
    """Largest defect in tolerances: at most 1 where every row is kept; NaN counts as infinite."""
    worst = 0.0
    for i in range(defect.shape[0]):
        value = defect[i] / tolerance[i]
        if np.isnan(value):
            return np.inf
        worst = max(worst, value)
    return worst


@compiled("void(float64[:,::1], float64[:,::1], int64, float64, float64[:,::1])")
def move_frames(pose: Array, twist: Array, first: int, period: float, out: Array) -> None:
    """Poses (F, 12) of the entities, frames from `first` on, after one period of their twists (F, 6)."""
    for f in range(first, pose.shape[0]):
        x, y, z = twist[f, 3] * period, twist[f, 4] * period, twist[f, 5] * period
        angle = np.sqrt(x * x + y * y + z * z)
        a = np.sin(angle) / angle if angle > 1e-9 else 1.0
        b = (1.0 - np.cos(angle)) / (angle * angle) if angle > 1e-5 else 0.5
        for c in range(3):
            u, v, w = pose[f, c], pose[f, 3 + c], pose[f, 6 + c]
            p, q, r = y * w - z * v, z * u - x * w, x * v - y * u
            out[f, c] = u + a * p + b * (y * r - z * q)
            out[f, 3 + c] = v + a * q + b * (z * p - x * r)
            out[f, 6 + c] = w + a * r + b * (x * q - y * p)
        for r_ in range(3):
            out[f, 9 + r_] = pose[f, 9 + r_] + period * twist[f, r_]
