"""The 8-dof neurosurgical arm of the scenes S1-S5, and its configuration for a given line of the shaft.

Paper V gives neither the arm's Denavit-Hartenberg parameters nor its poses; this arm was designed to give the paper's
pattern of violations. Frame "frame6" is the end of the shaft, its z axis the shaft's line; "shaft" is another name
for it. Joints 7 and 8, the wrist, lie beyond the shaft.
"""

from math import atan2, hypot, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, unit
from primitives.dh import DHRow
from primitives.errors import InputError
from scenarios.robots import RobotEntry, mjcf_path, urdf_path

if TYPE_CHECKING:
    from primitives.robot import Robot

DH_TABLE = (
    DHRow("prismatic", -pi / 2, 0.0, pi / 2, 0.0, -0.060, 0.060, 0.05),
    DHRow("prismatic", pi / 2, 0.0, 0.0, 0.0, -0.060, 0.060, 0.05),
    DHRow("revolute", -pi / 2, 0.050, 0.0, 0.0, -pi / 4, pi / 4, 0.5),
    DHRow("revolute", pi / 2, 0.040, pi / 2, 0.0, -pi / 4, pi / 4, 0.5),
    DHRow("prismatic", pi / 2, 0.0, 0.0, 0.0, 0.150, 0.320, 0.05),
    DHRow("revolute", 0.0, 0.0, 0.0, 0.0, -pi, pi, 2.0),
    DHRow("revolute", -pi / 2, 0.0, -pi / 2, 0.0, -1.4, 1.4, 2.0),
    DHRow("revolute", pi / 2, 0.004, 0.0, 0.0, -1.4, 1.4, 2.0),
)
"""Modified Denavit-Hartenberg table (Craig: Rx alpha, Tx a, Rz theta, Tz d), metres and radians."""

TIP_OFFSET = 0.012
"""The tip lies Tx(TIP_OFFSET) Ry(90 deg) after frame 8, metres."""


def configuration_for_shaft(
    through: ArrayLike, end: ArrayLike, wrist: ArrayLike, *, base: ArrayLike = (0.0, 0.0, 0.0)
) -> Array:
    """The configuration q (8,) whose shaft runs through one point down to another, in closed form.

    Joints 3 and 4 give the direction, joint 5 the height of the end, joints 1 and 2 its place across.

    Parameters
    ----------
    through : (3,) a point of the shaft's line, world, metres.
    end : (3,) the end of the shaft t6, world, metres; lower than `through`.
    wrist : (3,) q6, q7 and q8, rad.
    base : (3,) origin of the arm's base in the world, metres; the base is not turned.

    Raises
    ------
    InputError : not finite, `end` not below `through`, or out of the arm's range; names the joint.
    """
    end, base = array(end, (3,), "end of the shaft"), array(base, (3,), "base of the arm")
    direction = unit(end - array(through, (3,), "point of the shaft"), "shaft from its point to its end")
    x, y, z = direction
    if not z < 0.0:
        raise InputError(f"shaft: expected an end below the point it runs through, got the direction {direction}")
    swing, tilt = atan2(-x, -z), atan2(y, hypot(x, z))
    arm, fulcrum = DH_TABLE[3].a, base - [0.0, 0.0, DH_TABLE[2].a]
    depth = (end[2] - fulcrum[2] + arm * np.cos(swing)) / z
    across = end - depth * direction - fulcrum + [arm * np.sin(swing), 0.0, 0.0]
    q = np.array([across[1], across[0], swing, tilt, depth, *array(wrist, (3,), "wrist")])
    for i, (value, row) in enumerate(zip(q, DH_TABLE, strict=True), 1):
        if not row.lower <= value <= row.upper:
            raise InputError(
                f"joint{i} of neuro8: this shaft needs {value:g}, its range is {row.lower:g} to {row.upper:g}"
            )
    return q


def build() -> "Robot":
    """The arm with its base at the origin."""
    from primitives.robot import Robot

    return Robot.from_urdf(urdf_path("neuro8"), tip="tip", name="neuro8")


ROBOT = RobotEntry(
    "neuro8",
    "neurosurgical arm of 8 joints: two slides, two tilts, insertion, roll, wrist; a tool of 3.5 mm",
    build,
    {"": urdf_path("neuro8")},
    {"": mjcf_path("neuro8")},
)
