"""Constraints that change while the controller runs: their numbers go over smoothly, so that the command does not jump.

A constraint that is being switched on or off has a force F between 0 and 1, and its row demands less by (1 / F - 1)
times the recovery speed: nothing at 0, everything at 1. One that is being switched on is never crossed on the way, its
margin keeping rate >= -margin / T. A safe distance that changes moves the boundary, whose speed joins the residual.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integer_matrix, integers, matrix, vector
from vfi.memory import Real, Whole
from vfi.outcome import Blend, Option, Setting

NEAR = 1e-5
"""A margin above minus this counts as kept, metres or radians."""


@compiled("float64(float64)")
def _share(time: float) -> float:
    """How far a change has come, from 0 to 1, at rest at both ends."""
    return time * time * (3.0 - 2.0 * time)


@compiled(f"void({MEMORY})")
def advance(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Take every change one period further; SAFE_RATE (m,) is how fast each safe distance grows in the coming one."""
    blend, force, eta = matrix(f, fl, Real.BLEND), vector(f, fl, Real.FORCE), vector(f, fl, Real.ETA)
    safe, rate = vector(f, fl, Real.SAFE), vector(f, fl, Real.SAFE_RATE)
    enforced, options = integers(w, wl, Whole.ENFORCED), integers(w, wl, Whole.OPTIONS)
    period = vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    options[Option.BLENDING] = 0
    for i in range(safe.shape[0]):
        rate[i] = 0.0
        if blend[i, Blend.TIME] >= 1.0:
            continue
        time = min(1.0, blend[i, Blend.TIME] + blend[i, Blend.STEP])
        share, next_share = _share(time), _share(min(1.0, time + blend[i, Blend.STEP]))
        blend[i, Blend.TIME] = time
        force[i] = blend[i, Blend.FORCE_FROM] + share * (blend[i, Blend.FORCE_TO] - blend[i, Blend.FORCE_FROM])
        eta[i] = blend[i, Blend.ETA_FROM] + share * (blend[i, Blend.ETA_TO] - blend[i, Blend.ETA_FROM])
        way = blend[i, Blend.SAFE_TO] - blend[i, Blend.SAFE_FROM]
        safe[i] = blend[i, Blend.SAFE_FROM] + share * way
        rate[i] = (next_share - share) * way / period
        enforced[i] = int(force[i] > 0.0)
        options[Option.BLENDING] = 1
    sphere, cloud = matrix(f, fl, Real.SPHERE), integer_matrix(w, wl, Whole.CLOUD)
    for c in range(sphere.shape[0]):
        sphere[c, 1] = safe[cloud[c, 0]]


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def eased(rate: float, force: float, rising: float, margin: float, speed: float, period: float) -> float:
    """The rate that a constraint demands of its margin at a force between 0 and 1."""
    if force >= 1.0:
        return rate
    if force <= 0.0:
        return -np.inf
    less = rate - (1.0 / force - 1.0) * speed
    return max(less, min(rate, -margin / period)) if rising > 0.0 and margin > -NEAR else less


@compiled(f"void({MEMORY})")
def foresee(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Take off the predicted margins (m,) and those of points what safe distances will have grown by then."""
    side, rate, predicted = vector(f, fl, Real.SIDE), vector(f, fl, Real.SAFE_RATE), vector(f, fl, Real.MARGIN_NEXT)
    period = vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    for i in range(side.shape[0]):
        predicted[i] -= period * side[i] * rate[i]
    cloud, owner, clearance = (
        integer_matrix(w, wl, Whole.CLOUD),
        integers(w, wl, Whole.OWNER),
        vector(f, fl, Real.CLEARANCE_NEXT),
    )
    for k in range(integers(w, wl, Whole.OPTIONS)[Option.CONTACTS]):
        clearance[k] -= period * rate[cloud[owner[k], 0]]


@compiled(f"void({MEMORY})")
def ease(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Ease the demands of the rows (m,), once they are filled."""
    blend, force, margin = matrix(f, fl, Real.BLEND), vector(f, fl, Real.FORCE), vector(f, fl, Real.MARGIN)
    demand, rate, settings = vector(f, fl, Real.DEMAND), vector(f, fl, Real.RATE), vector(f, fl, Real.SETTINGS)
    angular = integers(w, wl, Whole.ANGULAR)
    for i in range(margin.shape[0]):
        if rate[i] > -np.inf and force[i] < 1.0:
            speed = settings[Setting.RECOVERY_ANGULAR] if angular[i] else settings[Setting.RECOVERY_LINEAR]
            rising = blend[i, Blend.FORCE_TO] - blend[i, Blend.FORCE_FROM]
            less = eased(rate[i], force[i], rising, margin[i], speed, settings[Setting.PERIOD])
            if demand[i] > -np.inf:
                demand[i] += less - rate[i]
            rate[i] = less
