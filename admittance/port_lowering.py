"""From a robot, a port, regions, constraints and parameters to the memory of a cycle."""

import numpy as np

from admittance.declared import check_kinds
from admittance.lowering import Lowered, Settings, check_gain, check_settings, lay_down
from admittance.memory import Real, Whole
from admittance.outcome import Form, Integrator, Option, Setting
from admittance.parameters import Parameters
from admittance.regions import Region, lay_out
from primitives.checks import Array
from primitives.constraint import ConstraintSet
from primitives.elements import WORLD, Point
from primitives.errors import InputError
from primitives.kinematics import world_first
from primitives.robot import Robot
from primitives.table import movers, used_frames


def _check(settings: Settings, parameters: Parameters) -> None:
    check_settings(settings)
    check_gain(parameters.port_gain, "port_gain", settings.period)
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
    decided = _decided(robot, group, movers(shaft, each, robot.flat(each)), shaft)
    m = len(decided) - 2
    points, regions_table = lay_out(regions)
    memory = lay_down(robot, frames, decided, m, handle, constraints, parameters, settings, len(regions))
    real, whole = memory.real, memory.whole
    whole[Whole.REGION][:] = regions_table
    real[Real.PORT][:] = port
    real[Real.WEIGHT][:] = parameters.weights(len(decided))
    real[Real.INERTIA][:] = parameters.masses(m)
    real[Real.DAMPING][:] = [parameters.D_c, parameters.Q, parameters.M, parameters.G, parameters.C]
    real[Real.REDUNDANT][:] = parameters.redundant_damping
    for i, region in enumerate(regions):
        real[Real.REGION][i], real[Real.REGION_POSE][i] = region.row(), region.twelve()
    for setting, value in (
        (Setting.ALPHA, parameters.alpha),
        (Setting.BETA, parameters.beta),
        (Setting.PORT_GAIN, parameters.port_gain),
    ):
        real[Real.SETTINGS][setting] = value
    whole[Whole.OPTIONS][Option.IMPLICIT_DAMPING], whole[Whole.OPTIONS][Option.PORT] = parameters.implicit_damping, 1
    return Lowered(memory, frames, decided, points)
