"""Constraints of every kind, put near configurations of the pair of neurosurgical arms."""

from dataclasses import replace

import numpy as np

from admittance.parameters import NEURO8
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Segment
from scenarios.robots.neuro8 import configuration_for_shaft
from scenarios.robots.neuro8_pair import BASES
from tests.admittance.walls import PAIR, S5, SHAFT, Array, distance

ANGLE = Constraint("angle", Line.z_axis(SHAFT), Line.z_axis("parked/shaft"), "outside", 0.1, pair="line_line_angle")
CAPSULES = Constraint(
    "capsules",
    Segment.between([0, 0, -0.2], [0, 0, 0], frame="moving/tip"),
    Segment.between([0, 0, -0.2], [0, 0, 0], frame="parked/shaft"),
    "outside",
    0.0035,
)
CONE = Constraint(
    "cone", Line.z_axis("moving/tip"), Line.through([0, 0, 0], [0, 0, -1]), "inside", 0.5, "line_line_angle"
)
EVERY = ConstraintSet([*S5.constraints, ANGLE, CAPSULES, CONE])


def near(constraints: ConstraintSet, q: Array, rng: np.random.Generator) -> ConstraintSet:
    """The same pairs with safe distances that put q within the range of most of them: margins of 0.05 to 1.1 d_0."""
    k, out = PAIR.kinematics(q), []
    for c in constraints:
        share, d = rng.uniform(0.05, 1.1), distance(c, k)
        wanted = share * (NEURO8.d_0 if c.definition.unit == "m" else NEURO8.d_0_angle)
        if c.definition.name == "point_plane":
            plane = Plane.through([0, 0, d - 0.08 - wanted], [0, 0, 1])
            out.append(replace(c, second=plane))
        else:
            safe = d - wanted if c.keep == "outside" and d > wanted else d + wanted
            out.append(replace(c, keep="outside" if safe < d else "inside", safe_distance=safe))
    return ConstraintSet(out)


def random_start(rng: np.random.Generator) -> Array:
    low, high = np.maximum(PAIR.limits.lower, -2.0), np.minimum(PAIR.limits.upper, 2.0)
    return low + rng.uniform(0.05, 0.95, PAIR.n) * (high - low)


def parallel_start(tilt: float, rng: np.random.Generator) -> Array:
    """Both shafts along one direction but for a tilt, rad, a few millimetres apart."""
    through, end = np.array([-0.005, -0.011, 0.0]), np.array([0.0, -0.011, -0.045])
    shift = np.array([0.004, 0.006, 0.0])
    across = np.array([0.0, 1.0, 0.0])
    wrist = [0.0, *rng.uniform(-0.5, 0.5, 2)]
    moving = configuration_for_shaft(through, end, wrist, base=BASES["moving"])
    parked = configuration_for_shaft(through + shift + tilt * 0.045 * across, end + shift, wrist, base=BASES["parked"])
    return np.concatenate([moving, parked])
