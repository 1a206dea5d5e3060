"""Two neurosurgical arms side by side, one that is moved and one that is parked: the robot of the scenes S1-S5."""

from typing import TYPE_CHECKING

import numpy as np

from primitives.checks import Array
from scenarios.robots import RobotEntry, mjcf_path, urdf_path
from scenarios.robots.neuro8 import configuration_for_shaft

if TYPE_CHECKING:
    from primitives.robot import Robot

BASES = {"moving": (-0.030, 0.0, 0.290), "parked": (0.030, 0.0, 0.290)}
"""Origins of the bases in the world, metres; they are not turned."""


def start() -> Array:
    """First configuration (16,) of the scenes S1-S5, rad and m: the moving arm, then the parked one.

    The moving arm's shaft runs through (-5, -11, 0) mm to (0, -11, -45) mm, the parked one's through (7, 2, 0) mm to
    (2, 2, -62) mm; the entry point is the origin.
    """
    moving = configuration_for_shaft(
        [-0.005, -0.011, 0.0], [0.0, -0.011, -0.045], [0.0, 0.15, 0.10], base=BASES["moving"]
    )
    parked = configuration_for_shaft(
        [0.007, 0.002, 0.0], [0.002, 0.002, -0.062], [0.0, 0.15, -0.10], base=BASES["parked"]
    )
    return np.concatenate([moving, parked])


def build() -> "Robot":
    """Both arms; joints, frames and groups are called "moving/..." and "parked/...", the tip is "moving/tip"."""
    from primitives import dual_quaternion as dq
    from primitives.robot import Robot
    from scenarios.robots.neuro8 import build as build_arm

    upright, arm = np.array([1.0, 0.0, 0.0, 0.0]), build_arm()
    return Robot.assemble(
        "neuro8-pair",
        {name: (arm, dq.from_rotation_translation(upright, np.array(base))) for name, base in BASES.items()},
    )


ROBOT = RobotEntry(
    "neuro8-pair",
    "two neurosurgical arms of 8 joints: the moving one and the parked one of S1-S5",
    build,
    {name: urdf_path("neuro8") for name in BASES},
    {name: mjcf_path("neuro8") for name in BASES},
)
