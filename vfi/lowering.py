"""From a robot, a constraint set and a task to the memory of a cycle, once per controller."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, known, number
from primitives.cloud_table import Spheres, tabulate_clouds
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.kinematics import world_first
from primitives.memory import Memory
from primitives.robot import Robot
from primitives.table import check_influence, movers, tabulate, used_entities, used_frames
from primitives.verification import TOLERANCE_ANGULAR, TOLERANCE_LINEAR
from vfi.forms import EQUALITY, ROWS, Soft, form_of_each
from vfi.memory import Real, Sizes, Whole, lay_out
from vfi.outcome import Basis, Blend, Form, Guard, Option, Setting
from vfi.recovery import RESOLVES
from vfi.rows import set_rows
from vfi.tasks import POSE, PROJECTION, VELOCITY, PoseTask, ProjectionTask, Task, VelocityTask


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
    reach: float
    forms: "Mapping[str, str | Soft]"


class Lowered(NamedTuple):
    """A filled memory, the entities it waits for, the frame index of the first of them, and the tasks' frames."""

    memory: Memory
    entities: tuple[str, ...]
    first_entity: int
    tips: tuple[str, ...]


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
        out.append(gain_of(given.get(name, given.get("", 0.0)), f'eta of constraint "{name}"', period))
    return np.array(out)


def gain_of(value: float, what: str, period: float) -> float:
    """A gain, 1/s, that goes with the period; raises InputError."""
    gain = number(value, what, positive=True)
    if gain * period > 1.0 + 1e-12:
        raise InputError(
            f"{what}: expected eta T <= 1, got eta = {gain:g} 1/s and T = {period:g} s, i.e. {gain * period:g}; "
            f"take eta <= {1.0 / period:g} 1/s or a shorter period"
        )
    return gain


def _pose_tasks(task: Task, robot: Robot) -> list[PoseTask]:
    """The pose tasks of a task; raises InputError where several do not go together."""
    if isinstance(task, PoseTask):
        return [task]
    if isinstance(task, VelocityTask | ProjectionTask):
        return []
    tasks = list(task) if isinstance(task, Sequence) else [task]
    if not tasks or not all(isinstance(t, PoseTask) for t in tasks):
        raise InputError(
            f"task: expected a PoseTask, several of them, a VelocityTask or a ProjectionTask, got {task!r}"
        )
    on = [t.frame or robot.tip for t in tasks]
    if len(set(on)) < len(on):
        raise InputError(f"task: expected pose tasks of different frames, got {', '.join(on)}")
    if len({t.damping for t in tasks}) > 1:
        raise InputError(f"task: expected pose tasks of one damping, got {', '.join(f'{t.damping:g}' for t in tasks)}")
    return tasks


def _sizes(robot: Robot, d: int, m: int, task: Task, tips: int, settings: Settings, equalities: int) -> Sizes:
    """Sizes of the memory but for frames and clouds."""
    given = isinstance(task, ProjectionTask)
    free = int(task.coordinates) if isinstance(task, ProjectionTask) else (d - equalities if equalities else 0)
    if given and not 1 <= free <= d:
        raise InputError(f"coordinates of ProjectionTask: expected 1 to {d}, the decided joints, got {free}")
    if equalities and free < 1:
        raise InputError(f"ports that must always be kept leave none of the {d} decided joints free")
    rows = 8 * tips if tips else (0 if given else d)
    return Sizes(
        n=robot.n,
        d=d,
        m=m,
        user=settings.user_rows,
        frames=0,
        robot_frames=0,
        reference=free if given else rows,
        task=rows,
        tips=tips,
        free=free,
        equalities=equalities,
        clouds=0,
        points=0,
        cells=0,
        largest=0,
        contacts=0,
        cuts=0,
    )


def lower(
    robot: Robot,
    constraints: ConstraintSet,
    task: Task,
    group: str,
    settings: Settings,
    clouds: Mapping[str, Spheres],
) -> Lowered:
    """Check everything, lay out the memory and fill what does not change from cycle to cycle.

    Raises
    ------
    InputError, UnknownNameError, InactiveConstraintError : see `vfi.controller.Controller`.
    """
    period = number(settings.period, "period", positive=True)
    limit_gain = gain_of(settings.limit_eta, "limit_eta", period)
    recovery = (
        number(settings.recovery_linear, "recovery_linear", positive=True),
        number(settings.recovery_angular, "recovery_angular", positive=True),
    )
    reach = number(settings.reach, "reach", positive=True)
    poses = _pose_tasks(task, robot)
    for t in poses:
        gain_of(t.gain, "gain of PoseTask", period)
    tips = [t.frame or robot.tip for t in poses]
    frames = world_first((*used_frames(constraints), *tips))
    entities, decided, flat = used_entities(constraints), robot.group(group), robot.flat(frames)
    for tip in tips:
        if movers(tip, frames, flat).isdisjoint(decided.tolist()):
            raise InputError(
                f'task: no joint of the group "{group}" moves the frame "{tip}"; choose a frame of an arm that is '
                "decided, or another group"
            )
    for name in entities:
        if name in robot.frames:
            raise InputError(f'"{name}" is a frame of the robot and cannot be an entity too')
    check_influence(constraints, frames, flat, decided)
    forms = form_of_each(constraints, settings.forms)
    table, spheres = tabulate(constraints, frames, entities), tabulate_clouds(constraints, clouds)
    m, always = (
        len(constraints),
        sum(2 for c, form in zip(constraints, forms, strict=True) if form == EQUALITY and c.enforced),
    )
    if always and isinstance(task, ProjectionTask):
        raise InputError("forms: a ProjectionTask's basis keeps its port already; leave out the equality")
    sizes = _sizes(robot, len(decided), m, task, len(tips), settings, always)._replace(
        frames=len(frames) + len(entities),
        robot_frames=len(frames),
        clouds=len(spheres.at),
        points=len(spheres.points),
        cells=len(spheres.cells),
        largest=spheres.largest,
        contacts=spheres.total,
        cuts=0 if settings.second_solver else RESOLVES * sum(c.keep == "inside" for c in constraints),
    )
    memory = lay_out(sizes)
    real, whole = memory.real, memory.whole

    whole[Whole.PARENT][:], whole[Whole.PRISMATIC][:] = flat.parent, flat.prismatic
    real[Real.PLACEMENT][:], real[Real.FRAME_PLACEMENT][:] = flat.placement, flat.frame_placement
    whole[Whole.FRAME_JOINT][:] = flat.frame_joint
    whole[Whole.ADDRESS][:], whole[Whole.FRAME][:] = table.address, table.frame
    whole[Whole.ENFORCED][:], whole[Whole.ANGULAR][:] = table.enforced, table.angular
    whole[Whole.SAFETY_CLASS][:m] = table.safety_class
    real[Real.GEOMETRY][:], real[Real.SIDE][:], real[Real.SAFE][:] = table.geometry, table.side, table.safe
    real[Real.ETA][:] = _gains(settings.eta, constraints.names, period)
    real[Real.FORCE][:], real[Real.BLEND][:, Blend.TIME] = table.enforced, 1.0
    whole[Whole.CLOUD][:], real[Real.SPHERE][:], real[Real.CLOUD_PLACEMENT][:] = (
        spheres.at,
        spheres.sphere,
        spheres.placement,
    )
    real[Real.POINTS][:], whole[Whole.CELLS][:] = spheres.points, spheres.cells
    whole[Whole.DECIDED][:] = decided
    real[Real.ROW_TOLERANCE][:] = TOLERANCE_LINEAR
    real[Real.ROW_TOLERANCE][:m] = np.where(table.angular == 1, TOLERANCE_ANGULAR, TOLERANCE_LINEAR)
    real[Real.JOINT_TOLERANCE][:] = np.where(flat.prismatic[decided] == 1, TOLERANCE_LINEAR, TOLERANCE_ANGULAR)
    real[Real.LIMITS][:] = [limit[decided] for limit in robot.limits]
    real[Real.DEMAND][m:], real[Real.RATE][m:] = -np.inf, -np.inf

    real[Real.CLOCK][0] = -np.inf
    chosen = real[Real.SETTINGS]
    chosen[Setting.PERIOD], chosen[Setting.LIMIT_GAIN], chosen[Setting.REACH] = period, limit_gain, reach
    chosen[Setting.RECOVERY_LINEAR], chosen[Setting.RECOVERY_ANGULAR] = recovery
    options = whole[Whole.OPTIONS]
    options[Option.GUARD], options[Option.ROBOT_FRAMES] = settings.guard, len(frames)
    options[Option.SECOND_SOLVER], options[Option.FIXED] = settings.second_solver, sizes.fixed
    options[Option.BASIS] = Basis.GIVEN if isinstance(task, ProjectionTask) else Basis.PORTS if always else Basis.JOINTS
    if sizes.free:
        real[Real.UNBOUNDED][: sizes.free], real[Real.UNBOUNDED][sizes.free :] = -np.inf, np.inf
    for i, form in enumerate(forms):
        if form is not ROWS:
            options[Option.PORTS] = 1
            whole[Whole.FORM][i] = Form.EQUALITY if form == EQUALITY else Form.SOFT
            real[Real.PORT_WEIGHT][i] = form.weight if isinstance(form, Soft) else 0.0
    whole[Whole.TIPS][:] = [frames.index(tip) for tip in tips]
    options[Option.TASK] = POSE if poses else VELOCITY
    if poses:
        chosen[Setting.DAMPING], real[Real.GAIN][:] = poses[0].damping, [t.gain for t in poses]
        real[Real.WEIGHT][:] = np.concatenate([array(t.weight, (8,), "weight") for t in poses])
    elif isinstance(task, VelocityTask):
        real[Real.WEIGHT][:] = one_or_each(task.weight, len(decided), "weight of VelocityTask")
    else:
        options[Option.TASK] = PROJECTION
    if sizes.rows > sizes.fixed:
        set_rows(memory.float_layout, memory.integers, memory.integer_layout, sizes.fixed)
    return Lowered(memory, entities, len(frames), tuple(tips))
