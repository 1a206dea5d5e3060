"""From a robot, a port, regions, constraints and parameters to the memory of a cycle."""

from typing import NamedTuple

import numpy as np

from admittance.declared import check_kinds, reaches
from admittance.layout import shapes
from admittance.memory import Real, Whole
from admittance.outcome import Form, Integrator, Option, Setting
from admittance.parameters import Parameters
from admittance.regions import Points, Region, lay_out
from primitives.checks import Array, number
from primitives.constraint import ConstraintSet
from primitives.elements import WORLD, Point
from primitives.errors import InputError
from primitives.kinematics import world_first
from primitives.memory import Memory
from primitives.robot import Robot
from primitives.table import check_influence, movers, tabulate, used_frames

FORMS = {"reduced": Form.REDUCED, "full": Form.ANALYTIC, "printed": Form.PRINTED}
INTEGRATORS = {
    "euler": Integrator.EULER,
    "semi-implicit": Integrator.SEMI_IMPLICIT,
    "rk4": Integrator.RK4,
    "robust": Integrator.ROBUST,
}


class Settings(NamedTuple):
    """What `Admittance` was asked for; see its parameters."""

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
    """The memory, the indices into q of the decided joints (d,), and the regions' points."""

    memory: Memory
    decided: np.ndarray
    points: Points


def _check(settings: Settings, parameters: Parameters) -> None:
    T = settings.period
    for value, what, low in (
        (settings.limit_gain, "limit_gain", 0.0),
        (settings.condition_limit, "condition_limit", 1.0),
        (settings.force_ceiling, "force_ceiling", 0.0),
        (settings.torque_ceiling, "torque_ceiling", 0.0),
        (settings.linear_below, "linear_below", 0.0),
        (settings.sight, "sight", 0.0),
    ):
        number(value, what, low=low)
    for gain, what in ((settings.limit_gain, "limit_gain"), (parameters.port_gain, "port_gain")):
        if gain * T > 1.0:
            raise InputError(f"{what}: expected {what} T <= 1, got {gain:g} 1/s and T = {T:g} s")
    if settings.form != Form.REDUCED and settings.integrator == Integrator.ROBUST:
        raise InputError('integrator "robust" needs form "reduced"')
    if settings.form == Form.PRINTED and settings.integrator == Integrator.RK4:
        raise InputError('integrator "rk4" needs derivatives within a period: form "reduced" or "full"')


def _decided(robot: Robot, group: str, moves: set[int], shaft: str) -> np.ndarray:
    """Joints of the group in the robot's order, where they hold all that move the shaft."""
    decided = np.sort(robot.group(group))
    missing = [robot.joints[j] for j in sorted(moves - set(decided.tolist()))]
    if missing:
        raise InputError(f'group "{group}" lacks joints that move frame "{shaft}": {", ".join(missing)}')
    if len(moves) < 6:
        raise InputError(f'frame "{shaft}" is moved by {len(moves)} joints, expected at least 6')
    return decided


def lower(
    robot: Robot,
    port: Array,
    shaft: str,
    parameters: Parameters,
    regions: tuple[Region, ...],
    constraints: ConstraintSet,
    handle: Point,
    group: str,
    settings: Settings,
) -> Lowered:
    """Everything as flat arrays. Raises InputError and UnknownNameError as `Admittance` says."""
    _check(settings, parameters)
    check_kinds(constraints)
    names = [*(region.name for region in regions), *constraints.names]
    if len(set(names)) != len(names):
        raise InputError(f"regions and constraints: expected different names, got {names}")
    for region in regions:
        if region.element.frame != shaft or region.element.entity is not None:
            raise InputError(
                f'region "{region.name}": its element must be on the shaft frame "{shaft}", got '
                f'"{region.element.entity or region.element.frame}"'
            )
    if handle.entity is not None:
        raise InputError(f'sensor: expected a Point on a robot frame, got one on entity "{handle.entity}"')
    # The first three have their places: the world, the shaft and the sensor's frame, which may be the same twice.
    first = (WORLD, shaft, handle.frame)
    frames = (*first, *(name for name in used_frames(constraints) if name not in first))
    each = world_first(frames)
    flat = robot.flat(each)
    decided = _decided(robot, group, movers(shaft, each, flat), shaft)
    check_influence(constraints, each, flat, decided)
    points, regions_table = lay_out(regions)
    memory = Memory(*shapes(robot.n, len(decided), len(regions), len(constraints), len(frames)))
    real, whole = memory.real, memory.whole
    real[Real.PLACEMENT][:], whole[Whole.PARENT][:], whole[Whole.PRISMATIC][:] = (
        flat.placement,
        flat.parent,
        flat.prismatic,
    )
    for i, name in enumerate(frames):
        real[Real.FRAME_PLACEMENT][i] = flat.frame_placement[each.index(name)]
        whole[Whole.FRAME_JOINT][i] = flat.frame_joint[each.index(name)]
    whole[Whole.DECIDED][:], whole[Whole.REGION][:] = decided, regions_table
    table = tabulate(constraints, frames, ())
    whole[Whole.ADDRESS][:], whole[Whole.FRAME][:] = table.address, table.frame
    whole[Whole.ENFORCED][:] = table.enforced
    real[Real.GEOMETRY][:], real[Real.SIDE][:], real[Real.SAFE][:] = table.geometry, table.side, table.safe
    real[Real.REACH][:] = reaches(constraints, parameters, settings.sight, settings.linear_below)
    real[Real.PORT][:], real[Real.SENSOR][:] = port, handle.geometry[:3]
    real[Real.WEIGHT][:] = parameters.weights(len(decided))
    real[Real.INERTIA][:] = parameters.masses(len(decided) - 2)
    real[Real.UNBOUNDED][: len(decided) - 2], real[Real.UNBOUNDED][len(decided) - 2 :] = -np.inf, np.inf
    real[Real.DAMPING][:] = [parameters.D_c, parameters.Q, parameters.M, parameters.G, parameters.C]
    real[Real.REDUNDANT][:] = parameters.redundant_damping
    limits = robot.limits
    real[Real.LIMITS][:] = np.array([limits.lower, limits.upper, limits.velocity])[:, decided]
    for i, region in enumerate(regions):
        real[Real.REGION][i], real[Real.REGION_POSE][i] = region.row(), region.twelve()
    for setting, value in (
        (Setting.PERIOD, settings.period),
        (Setting.ALPHA, parameters.alpha),
        (Setting.BETA, parameters.beta),
        (Setting.PORT_GAIN, parameters.port_gain),
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
    options[Option.IMPLICIT_DAMPING] = parameters.implicit_damping
    options[Option.IMPLICIT_STIFFNESS] = settings.implicit_stiffness
    return Lowered(memory, decided, points)
