"""From a robot, a constraint set and a task to the memory of a cycle, once per controller."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives.active_set import work_rows
from primitives.checks import Array, array, known, number
from primitives.constraint import ConstraintSet
from primitives.elements import WORLD, Element
from primitives.errors import InactiveConstraintError, InputError
from primitives.kinematics import FlatModel, world_first
from primitives.memory import Memory
from primitives.robot import Robot
from primitives.table import tabulate, used_entities, used_frames
from primitives.verification import TOLERANCE_ANGULAR, TOLERANCE_LINEAR
from vfi.memory import Real, Whole
from vfi.outcome import Guard, Option, Setting, Slot
from vfi.tasks import POSE, VELOCITY, PoseTask, Task


class Settings(NamedTuple):
    """Numbers of a controller; see `vfi.controller.Controller`."""

    period: float
    eta: float | Mapping[str, float]
    limit_eta: float
    recovery_linear: float
    recovery_angular: float
    guard: Guard
    user_rows: int
    second_solver: bool


class Lowered(NamedTuple):
    """A filled memory, the entities it waits for, and the frame index of the first of them."""

    memory: Memory
    entities: tuple[str, ...]
    first_entity: int


def one_or_each(value: ArrayLike, n: int, what: str) -> Array:
    """An array (n,) from n numbers, or from one that stands for all of them; raises InputError."""
    return array(np.full(n, value) if np.isscalar(value) else value, (n,), what)


def _gains(eta: float | Mapping[str, float], names: tuple[str, ...], period: float) -> Array:
    """Gain of each constraint, checked against the period."""
    given = eta if isinstance(eta, Mapping) else {"": eta}
    for name in given:
        if name:
            known("constraint", name, names)
    out = []
    for name in names:
        if name not in given and "" not in given:
            raise InputError(f'no eta for constraint "{name}"; give one, or one for all others under the key ""')
        out.append(_gain(given.get(name, given.get("", 0.0)), f'eta of constraint "{name}"', period))
    return np.array(out)


def _gain(value: float, what: str, period: float) -> float:
    gain = number(value, what, positive=True)
    if gain * period > 1.0 + 1e-12:
        raise InputError(
            f"{what}: expected eta T <= 1, got eta = {gain:g} 1/s and T = {period:g} s, i.e. {gain * period:g}; "
            f"take eta <= {1.0 / period:g} 1/s or a shorter period"
        )
    return gain


def _check_influence(constraints: ConstraintSet, frames: tuple[str, ...], flat: FlatModel, decided: np.ndarray) -> None:
    """Refuse an enforced constraint whose elements no decided joint moves against each other: it yields no row."""

    def movers(element: Element) -> set[int]:
        found: set[int] = set()
        joint = -1 if element.entity is not None else int(flat.frame_joint[frames.index(element.frame)])
        while joint >= 0:
            if joint in decided:
                found.add(joint)
            joint = int(flat.parent[joint])
        return found

    for c in constraints:
        if c.enforced and movers(c.first) == movers(c.second):
            on = " and ".join(f'"{e.entity or e.frame}"' for e in (c.first, c.second))
            raise InactiveConstraintError(
                f'constraint "{c.name}" is enforced, but none of the decided joints moves its elements, on {on}, '
                "against each other: put one on another frame of the arm, or watch it"
            )


def lower(robot: Robot, constraints: ConstraintSet, task: Task, group: str, settings: Settings) -> Lowered:
    """Check everything, lay out the memory and fill what does not change from cycle to cycle.

    Raises
    ------
    InputError, UnknownNameError, InactiveConstraintError : see `vfi.controller.Controller`.
    """
    period = number(settings.period, "period", positive=True)
    limit_gain = _gain(settings.limit_eta, "limit_eta", period)
    recovery = (
        number(settings.recovery_linear, "recovery_linear", positive=True),
        number(settings.recovery_angular, "recovery_angular", positive=True),
    )
    tracks = isinstance(task, PoseTask)
    tip = (task.frame or robot.tip) if isinstance(task, PoseTask) else WORLD
    if isinstance(task, PoseTask):
        _gain(task.gain, "gain of PoseTask", period)
    frames = world_first((*used_frames(constraints), tip))
    entities, decided, flat = used_entities(constraints), robot.group(group), robot.flat(frames)
    for name in entities:
        if name in robot.frames:
            raise InputError(f'"{name}" is a frame of the robot and cannot be an entity too')
    _check_influence(constraints, frames, flat, decided)
    table = tabulate(constraints, frames, entities)
    n, d, m, f = robot.n, len(decided), len(constraints), len(frames) + len(entities)
    memory = _memory(n, d, m, m + int(settings.user_rows), f, len(frames), 8 if tracks else d)
    real, whole = memory.real, memory.whole

    whole[Whole.PARENT][:], whole[Whole.PRISMATIC][:] = flat.parent, flat.prismatic
    real[Real.PLACEMENT][:], real[Real.FRAME_PLACEMENT][:] = flat.placement, flat.frame_placement
    whole[Whole.FRAME_JOINT][:] = flat.frame_joint
    whole[Whole.ADDRESS][:], whole[Whole.FRAME][:] = table.address, table.frame
    whole[Whole.ENFORCED][:], whole[Whole.ANGULAR][:] = table.enforced, table.angular
    whole[Whole.SAFETY_CLASS][:m], whole[Whole.SAFETY_CLASS][m:] = table.safety_class, 0
    real[Real.GEOMETRY][:], real[Real.SIDE][:], real[Real.SAFE][:] = table.geometry, table.side, table.safe
    real[Real.ETA][:] = _gains(settings.eta, constraints.names, period)
    whole[Whole.DECIDED][:] = decided
    slides = flat.prismatic[decided] == 1
    rows = m + int(settings.user_rows)
    real[Real.TOLERANCE][:m] = np.where(table.angular == 1, TOLERANCE_ANGULAR, TOLERANCE_LINEAR)
    real[Real.TOLERANCE][m:rows] = TOLERANCE_LINEAR
    real[Real.TOLERANCE][rows:] = np.where(slides, TOLERANCE_LINEAR, TOLERANCE_ANGULAR)
    real[Real.LIMITS][:] = [limit[decided] for limit in robot.limits]
    real[Real.DEMAND][m:] = -np.inf

    real[Real.CLOCK][0] = -np.inf
    chosen = real[Real.SETTINGS]
    chosen[Setting.PERIOD], chosen[Setting.LIMIT_GAIN] = period, limit_gain
    chosen[Setting.RECOVERY_LINEAR], chosen[Setting.RECOVERY_ANGULAR] = recovery
    options = whole[Whole.OPTIONS]
    options[Option.GUARD], options[Option.ROBOT_FRAMES] = settings.guard, len(frames)
    options[Option.SECOND_SOLVER] = settings.second_solver
    options[Option.TASK], options[Option.TIP] = POSE if tracks else VELOCITY, frames.index(tip)
    if isinstance(task, PoseTask):
        chosen[Setting.GAIN], chosen[Setting.DAMPING] = task.gain, task.damping
        real[Real.WEIGHT][:] = array(task.weight, (8,), "weight")
    else:
        real[Real.WEIGHT][:] = one_or_each(task.weight, d, "weight of VelocityTask")
    return Lowered(memory, entities, len(frames))


def _memory(n: int, d: int, m: int, rows: int, frames: int, robot_frames: int, task: int) -> Memory:
    wide = d + 1
    real = {
        Real.PLACEMENT: (n, 12),
        Real.FRAME_PLACEMENT: (robot_frames, 12),
        Real.GEOMETRY: (2 * m, 8),
        Real.SIDE: (m,),
        Real.SAFE: (m,),
        Real.SETTINGS: (len(Setting),),
        Real.WEIGHT: (task,),
        Real.ETA: (m,),
        Real.TOLERANCE: (rows + d,),
        Real.LIMITS: (4, d),
        Real.CLOCK: (1,),
        Real.Q: (n,),
        Real.QDOT: (n,),
        Real.GIVEN: (n,),
        Real.REFERENCE: (task,),
        Real.TWIST: (frames, 6),
        Real.JOINT_POSE: (n, 12),
        Real.POSE: (frames, 12),
        Real.JACOBIAN: (frames, 6, n),
        Real.DISTANCE: (m,),
        Real.MARGIN: (m,),
        Real.ROW: (m, n),
        Real.RESIDUAL: (m,),
        Real.RATE: (m,),
        Real.DEMAND: (rows,),
        Real.SLACK: (rows,),
        Real.TIP: (8,),
        Real.ERROR: (8,),
        Real.TASK: (task, d),
        Real.TARGET: (task,),
        Real.POSE_JACOBIAN: (8, n),
        Real.H: (d, d),
        Real.G: (d,),
        Real.A: (rows, d),
        Real.B: (rows,),
        Real.LOW: (d,),
        Real.HIGH: (d,),
        Real.V: (d,),
        Real.CANDIDATE: (d,),
        Real.LAST: (d,),
        Real.MULTIPLIER: (rows + 2 * d,),
        Real.SCALE: (rows,),
        Real.WORK: (work_rows(d), d),
        Real.Q_NEXT: (n,),
        Real.JOINT_POSE_NEXT: (n, 12),
        Real.POSE_NEXT: (frames, 12),
        Real.DISTANCE_NEXT: (m,),
        Real.MARGIN_NEXT: (m,),
        Real.DEFECT: (rows,),
        Real.LAST_DEFECT: (rows,),
        Real.SHORTFALL: (1,),
        Real.RELAXED_H: (wide, wide),
        Real.RELAXED_G: (wide,),
        Real.RELAXED_A: (rows, wide),
        Real.RELAXED_B: (rows,),
        Real.RELAXED_LOW: (wide,),
        Real.RELAXED_HIGH: (wide,),
        Real.RELAXED_V: (wide,),
        Real.RELAXED_MULTIPLIER: (rows + 2 * wide,),
        Real.RELAXED_SCALE: (rows,),
        Real.RELAXED_WORK: (work_rows(wide), wide),
    }
    whole = {
        Whole.PARENT: (n,),
        Whole.PRISMATIC: (n,),
        Whole.FRAME_JOINT: (robot_frames,),
        Whole.ADDRESS: (m,),
        Whole.FRAME: (m, 2),
        Whole.ENFORCED: (m,),
        Whole.SAFETY_CLASS: (rows,),
        Whole.ANGULAR: (m,),
        Whole.STATUS: (m,),
        Whole.STATUS_NEXT: (m,),
        Whole.DECIDED: (d,),
        Whole.ACTIVE: (d + 2,),
        Whole.MASK: (rows + 2 * d,),
        Whole.RELAXED_ACTIVE: (wide + 2,),
        Whole.RELAXED_MASK: (rows + 2 * wide,),
        Whole.OPTIONS: (len(Option),),
        Whole.OUTCOME: (len(Slot),),
    }
    return Memory(real, whole)
