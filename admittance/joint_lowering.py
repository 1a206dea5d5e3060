"""From a robot, constraints and parameters to the memory of a cycle without a port, where Z is the identity."""

import numpy as np

from admittance.declared import check_kinds
from admittance.joint_parameters import JointParameters
from admittance.lowering import Lowered, Settings, check_settings, lay_down
from admittance.memory import Real, Whole
from admittance.outcome import Option
from admittance.regions import lay_out
from primitives.constraint import ConstraintSet
from primitives.elements import WORLD, Point
from primitives.robot import Robot
from primitives.table import used_frames


def lower(
    robot: Robot,
    frame: str,
    parameters: JointParameters,
    constraints: ConstraintSet,
    group: str,
    settings: Settings,
) -> Lowered:
    """Everything as flat arrays. Raises InputError and UnknownNameError as `JointAdmittance` says."""
    check_settings(settings)
    check_kinds(constraints, port=False)
    decided = np.sort(robot.group(group))
    d = len(decided)
    first = (WORLD, frame, frame)
    frames = (*first, *(name for name in used_frames(constraints) if name not in first))
    held = Point.at([0.0, 0.0, 0.0], frame=frame)
    memory = lay_down(robot, frames, decided, d, held, constraints, parameters, settings)
    real = memory.real
    real[Real.INERTIA][:], real[Real.D][:] = parameters.masses(d), parameters.dampings(d)
    real[Real.Z][:] = np.eye(d)
    # No singularity of a shaft's Jacobian bounds the motion.
    real[Real.SINGULAR][3] = -np.inf
    memory.whole[Whole.OPTIONS][Option.IMPLICIT_DAMPING] = 1
    return Lowered(memory, frames, decided, lay_out(())[0])
