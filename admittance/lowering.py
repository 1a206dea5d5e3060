"""From a robot, a port, regions and parameters to the memory of a cycle."""

from typing import NamedTuple

import numpy as np

from admittance.memory import Real, Whole
from admittance.outcome import Book, Form, Integrator, Option, Setting, Slot, Touch
from admittance.parameters import Parameters
from admittance.regions import Points, Region, lay_out
from primitives.active_set import work_rows
from primitives.checks import Array, number
from primitives.elements import Point
from primitives.errors import InputError
from primitives.memory import Memory
from primitives.robot import Robot

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
    handle: Point,
    group: str,
    settings: Settings,
) -> Lowered:
    """Everything as flat arrays. Raises InputError and UnknownNameError as `Admittance` says."""
    _check(settings, parameters)
    if len({region.name for region in regions}) != len(regions):
        raise InputError(f"regions: expected different names, got {[region.name for region in regions]}")
    for region in regions:
        if region.element.frame != shaft or region.element.entity is not None:
            raise InputError(
                f'region "{region.name}": its element must be on the shaft frame "{shaft}", got '
                f'"{region.element.entity or region.element.frame}"'
            )
    if handle.entity is not None:
        raise InputError(f'sensor: expected a Point on a robot frame, got one on entity "{handle.entity}"')
    flat = robot.flat([shaft])
    moves, joint = set(), int(flat.frame_joint[1])
    while joint >= 0:
        moves.add(joint)
        joint = int(flat.parent[joint])
    decided = _decided(robot, group, moves, shaft)
    points, table = lay_out(regions)
    memory = Memory(*_shapes(robot.n, len(decided), len(regions)))
    real, whole = memory.real, memory.whole
    on_shaft, on_sensor = robot.flat([shaft]), robot.flat([handle.frame])
    real[Real.PLACEMENT][:], whole[Whole.PARENT][:], whole[Whole.PRISMATIC][:] = (
        flat.placement,
        flat.parent,
        flat.prismatic,
    )
    for i, (source, frame) in enumerate(((on_shaft, 0), (on_shaft, 1), (on_sensor, -1))):
        real[Real.FRAME_PLACEMENT][i] = source.frame_placement[frame]
        whole[Whole.FRAME_JOINT][i] = source.frame_joint[frame]
    whole[Whole.DECIDED][:], whole[Whole.REGION][:] = decided, table
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


def _shapes(n: int, d: int, R: int) -> tuple[dict[Real, tuple[int, ...]], dict[Whole, tuple[int, ...]]]:
    """Shape of every block for n joints, d of them decided, and R regions."""
    m = d - 2
    real: dict[Real, tuple[int, ...]] = {
        Real.PLACEMENT: (n, 12),
        Real.FRAME_PLACEMENT: (3, 12),
        Real.PORT: (3,),
        Real.SENSOR: (3,),
        Real.WEIGHT: (d,),
        Real.INERTIA: (m,),
        Real.DAMPING: (5, 4),
        Real.REDUNDANT: (1,),
        Real.LIMITS: (3, d),
        Real.SETTINGS: (len(Setting),),
        Real.REGION: (R, 12),
        Real.REGION_POSE: (R, 12),
        Real.Q: (n,),
        Real.Q_TRIAL: (n,),
        Real.Q_LAST: (n,),
        Real.V: (m,),
        Real.V_REF: (m,),
        Real.V_NEXT: (m,),
        Real.COMMANDED: (m,),
        Real.QDOT: (d,),
        Real.RATE: (d,),
        Real.OFFSET: (d,),
        Real.WRENCH: (6,),
        Real.F_TH: (6,),
        Real.F_HAND: (m,),
        Real.F_R: (6,),
        Real.F_RX: (4,),
        Real.D: (m,),
        Real.STIFFNESS: (4, 4),
        Real.TOUCH: (len(Touch),),
        Real.SEGMENT: (6,),
        Real.AXIS: (3,),
        Real.FOUND: (3,),
        Real.LOCAL: (6,),
        Real.JOINT_POSE: (n, 12),
        Real.POSE: (3, 12),
        Real.JACOBIAN: (3, 6, n),
        Real.HANDLE: (12,),
        Real.HANDLE_LAST: (12,),
        Real.J: (6, d),
        Real.GRAM: (6, 6),
        Real.FACTOR: (6, 6),
        Real.SCRATCH: (6, 6),
        Real.P: (6, d),
        Real.X_C: (2,),
        Real.A_X: (2, 6),
        Real.A: (2, d),
        Real.A_PLUS: (d, 2),
        Real.Z_X: (4, 6),
        Real.G: (d - 6, d),
        Real.G_LAST: (d - 6, d),
        Real.Z: (m, d),
        Real.Z_PLUS_T: (m, d),
        Real.Z_WORK: (m, m),
        Real.Z_FACTOR: (m, m),
        Real.A_LAST: (2, d),
        Real.Z_PLUS_T_LAST: (m, d),
        Real.SINGULAR: (4,),
        Real.SINGULAR_ROW: (m,),
        Real.METRIC: (m, m),
        Real.METRIC_FACTOR: (m, m),
        Real.LOW: (2, d),
        Real.HIGH: (2, d),
        Real.LIMIT_ROWS: (2 * d + 1, m),
        Real.LIMIT_DEMAND: (2 * d + 1,),
        Real.LIMIT_COST: (m,),
        Real.LIMIT_GIVEN: (m,),
        Real.UNBOUNDED: (2 * m,),
        Real.LIMIT_MULTIPLIER: (2 * d + 1 + 2 * m,),
        Real.LIMIT_SCALE: (2 * d + 1,),
        Real.LIMIT_WORK: (work_rows(m), m),
        Real.TWIST: (6,),
        Real.J_RATE: (6, d),
        Real.P_RATE: (6, d),
        Real.Z_RATE: (m, d),
        Real.A_X_RATE: (2, 6),
        Real.ACCELERATION: (d,),
        Real.DIRECTION: (d,),
        Real.EIGEN: (6, 6),
        Real.FREE: (m,),
        Real.FREE_RATE: (m,),
        Real.PORT_RATE: (2,),
        Real.STAGE: (6, d),
        Real.LEDGER: (len(Book),),
        Real.LEDGER_LAST: (len(Book),),
        Real.PROGRESS: (3,),
    }
    whole: dict[Whole, tuple[int, ...]] = {
        Whole.PARENT: (n,),
        Whole.PRISMATIC: (n,),
        Whole.FRAME_JOINT: (3,),
        Whole.DECIDED: (d,),
        Whole.LIMIT_ACTIVE: (m + 2,),
        Whole.LIMIT_MASK: (2 * d + 1 + 2 * m,),
        Whole.REGION: (R, 7),
        Whole.OPTIONS: (len(Option),),
        Whole.OUTCOME: (len(Slot),),
    }
    return real, whole
