"""From a robot, constraints, limits and settings to the memory of a cycle: what is alike with a port and without."""

from typing import NamedTuple

import numpy as np

from admittance.declared import Barrier, reaches
from admittance.layout import shapes
from admittance.memory import Real, Whole
from admittance.outcome import Form, Integrator, Option, Setting
from admittance.regions import Points
from primitives.checks import number
from primitives.constraint import ConstraintSet
from primitives.elements import Point
from primitives.errors import InputError
from primitives.kinematics import world_first
from primitives.memory import Memory
from primitives.robot import Robot
from primitives.table import check_influence, tabulate

FORMS = {"reduced": Form.REDUCED, "full": Form.ANALYTIC, "printed": Form.PRINTED}
INTEGRATORS = {
    "euler": Integrator.EULER,
    "semi-implicit": Integrator.SEMI_IMPLICIT,
    "rk4": Integrator.RK4,
    "robust": Integrator.ROBUST,
}


class Settings(NamedTuple):
    """What an admittance was asked for; see the parameters of `Admittance`."""

    period: float
    form: Form
    integrator: Integrator
    limit_gain: float
    condition_limit: float
    force_ceiling: float
    torque_ceiling: float
    linear_below: float
    sight: float
    implicit_stiffness: bool


class Lowered(NamedTuple):
    """The memory, its frames, the indices into q of the decided joints (d,), and the regions' points."""

    memory: Memory
    frames: tuple[str, ...]
    decided: np.ndarray
    points: Points


def check_settings(settings: Settings) -> None:
    """Raises InputError where a number is out of its range."""
    for value, what, low in (
        (settings.limit_gain, "limit_gain", 0.0),
        (settings.condition_limit, "condition_limit", 1.0),
        (settings.force_ceiling, "force_ceiling", 0.0),
        (settings.torque_ceiling, "torque_ceiling", 0.0),
        (settings.linear_below, "linear_below", 0.0),
        (settings.sight, "sight", 0.0),
    ):
        number(value, what, low=low)
    check_gain(settings.limit_gain, "limit_gain", settings.period)


def check_gain(gain: float, what: str, period: float) -> None:
    """Raises InputError where a gain, 1/s, takes more than all of it in a period."""
    if gain * period > 1.0:
        raise InputError(f"{what}: expected {what} T <= 1, got {gain:g} 1/s and T = {period:g} s")


def lay_down(
    robot: Robot,
    frames: tuple[str, ...],
    decided: np.ndarray,
    m: int,
    handle: Point,
    constraints: ConstraintSet,
    parameters: Barrier,
    settings: Settings,
    regions: int = 0,
) -> Memory:
    """A memory with all that is alike with a port and without: arm, constraints, limits and settings.

    frames : the world, the shaft and the sensor's frame, which may be the same twice, and those of the constraints.
    decided : (d,) indices into q. m : free coordinates.

    Raises
    ------
    InactiveConstraintError, InputError : a constraint that the decided joints cannot keep.
    """
    each = world_first(frames)
    flat = robot.flat(each)
    check_influence(constraints, each, flat, decided)
    memory = Memory(*shapes(robot.n, len(decided), m, regions, len(constraints), len(frames)))
    real, whole = memory.real, memory.whole
    real[Real.PLACEMENT][:], whole[Whole.PARENT][:], whole[Whole.PRISMATIC][:] = (
        flat.placement,
        flat.parent,
        flat.prismatic,
    )
    for i, name in enumerate(frames):
        real[Real.FRAME_PLACEMENT][i] = flat.frame_placement[each.index(name)]
        whole[Whole.FRAME_JOINT][i] = flat.frame_joint[each.index(name)]
    whole[Whole.DECIDED][:] = decided
    table = tabulate(constraints, frames, ())
    whole[Whole.ADDRESS][:], whole[Whole.FRAME][:] = table.address, table.frame
    whole[Whole.ENFORCED][:] = table.enforced
    real[Real.GEOMETRY][:], real[Real.SIDE][:], real[Real.SAFE][:] = table.geometry, table.side, table.safe
    real[Real.REACH][:] = reaches(constraints, parameters, settings.sight, settings.linear_below)
    real[Real.SENSOR][:] = handle.geometry[:3]
    real[Real.UNBOUNDED][:m], real[Real.UNBOUNDED][m:] = -np.inf, np.inf
    limits = robot.limits
    real[Real.LIMITS][:] = np.array([limits.lower, limits.upper, limits.velocity])[:, decided]
    for setting, value in (
        (Setting.PERIOD, settings.period),
        (Setting.STIFFNESS, parameters.k),
        (Setting.RANGE, parameters.d_0),
        (Setting.LINEAR_BELOW, settings.linear_below),
        (Setting.SIGHT, parameters.d_0 + settings.sight),
        (Setting.LIMIT_GAIN, settings.limit_gain),
        (Setting.CONDITION_LIMIT, settings.condition_limit),
        (Setting.FORCE_CEILING, settings.force_ceiling),
        (Setting.TORQUE_CEILING, settings.torque_ceiling),
    ):
        real[Real.SETTINGS][setting] = value
    options = whole[Whole.OPTIONS]
    options[Option.FORM], options[Option.INTEGRATOR] = settings.form, settings.integrator
    options[Option.IMPLICIT_STIFFNESS] = settings.implicit_stiffness
    return memory
