"""The KUKA LWR4+ with the 0.43 m tool of paper A along the axis of its last joint.

Its Denavit-Hartenberg table is that of DQ Robotics. Joint ranges and speeds come from one public URDF; no datasheet was
read. Frame "tip" is the tool tip, its z axis the tool's line; "flange" lies 0.078 m after joint 7.
"""

from math import pi, radians
from typing import TYPE_CHECKING

from primitives.dh import DHRow
from scenarios.robots import RobotEntry, mjcf_path, urdf_path

if TYPE_CHECKING:
    from primitives.robot import Robot

DH_TABLE = tuple(
    DHRow("revolute", alpha * pi / 2, 0.0, 0.0, d, -radians(span), radians(span), radians(speed))
    for alpha, d, span, speed in (
        (1, 0.31, 170, 110),
        (-1, 0.0, 120, 110),
        (-1, 0.4, 170, 128),
        (1, 0.0, 120, 128),
        (1, 0.39, 170, 204),
        (-1, 0.0, 120, 184),
        (0, 0.0, 170, 184),
    )
)
"""Standard Denavit-Hartenberg table (Rz theta, Tz d, Tx a, Rx alpha), metres and radians."""

FLANGE, TOOL = 0.078, 0.43
"""From joint 7 to the flange and from there to the tip, along z7, metres."""


def build() -> "Robot":
    """The arm with its tool and its base at the origin."""
    from primitives.robot import Robot

    return Robot.from_urdf(urdf_path("lwr4plus"), tip="tip", name="lwr4plus")


ROBOT = RobotEntry(
    "lwr4plus",
    "KUKA LWR4+, 7 joints, with a straight tool of 0.43 m",
    build,
    {"": urdf_path("lwr4plus")},
    {"": mjcf_path("lwr4plus")},
)
