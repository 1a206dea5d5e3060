"""`Scene`: a robot, where it starts, what must never happen, what it should do, for how long."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from admittance.joint_parameters import JointParameters
from primitives.checks import array, known, number
from primitives.constraint import ConstraintSet
from primitives.elements import Cloud
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.anatomy.parts import AnatomySource
from scenarios.by_hand.hand import Guide
from scenarios.enforcement import OPEN, Enforcement, InForce, check_led_along
from scenarios.own_robot import OwnRobot, SceneRobot, entry_of
from scenarios.plants import PLANTS
from scenarios.pose_record import PoseRecord
from scenarios.trajectory import PoseTrajectory
from vfi.tasks import PoseTask

MAX_CYCLES = 10_000_000
NAME = "[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
"""Regular expression of the names of scenes."""
ETA, LIMIT_ETA, REACH = 0.5, 5.0, 0.02
"""Where none is given: gains of the inequalities and of the joint limits, 1/s, and how far clouds get rows, metres."""
Reference = PoseTrajectory | PoseRecord
"""The way that a tool is led along."""
COORDINATIONS = ("central", "static", "velocity")
"""How arms that a scene moves together are decided; see `scenarios.coordination`."""


def check_name(name: str) -> str:
    """A name that may also name a file; raises InputError."""
    if not isinstance(name, str) or not re.fullmatch(NAME, name):
        raise InputError(f"name of a scene: expected 1 to 64 letters, digits, '.', '_' or '-', got {name!r:.80}")
    return name


def check_duration(duration: float, period: float) -> float:
    """A duration of at most `MAX_CYCLES` periods, seconds; raises InputError."""
    if duration > MAX_CYCLES * period:
        raise InputError(f"expected at most {MAX_CYCLES} periods of {period:g} s, got a duration of {duration:g} s")
    return duration


def check_seed(seed: int, scene: str) -> int:
    """A whole number >= 0; raises InputError."""
    if number(seed, f"seed of scene {scene}", low=0.0) != int(seed):
        raise InputError(f"seed of scene {scene}: expected a whole number, got {seed}")
    return int(seed)


def check_clouds(constraints: ConstraintSet, anatomy: AnatomySource | None) -> None:
    """Refuse constraints on clouds that are no part of the anatomy; raises UnknownNameError."""
    for c in constraints:
        if isinstance(c.second, Cloud):
            known("part of the anatomy", c.second.name, anatomy.parts if anatomy is not None else ())


def check_limits(limits: Mapping[str, tuple[float, float]], scene: str) -> None:
    """Ranges of joints, lower < upper; raises InputError."""
    for joint, (lower, upper) in limits.items():
        if not lower < upper:
            raise InputError(f"limits of {joint} in scene {scene}: expected lower < upper, got {lower}, {upper}")


def with_ranges(robot: Robot, limits: Mapping[str, tuple[float, float]]) -> Robot:
    """The robot with other ranges of some joints; raises UnknownNameError."""
    lower, upper = ({joint: limit[i] for joint, limit in limits.items()} for i in (0, 1))
    return robot.with_limits(lower=lower, upper=upper) if limits else robot


@dataclass(frozen=True)
class Scene:
    """Everything a run needs but the solver.

    Attributes
    ----------
    name, summary : shown to people; a run calls its scene and its files by the name.
    robot : the name of a registered robot, or an `OwnRobot`.
    group : joint group whose velocities are decided.
    start : (n,) first configuration of all joints, rad and m.
    constraints : enforced and watched ones.
    task : what the tool does; of several tools a tuple. reference : the way it is led; in the same order.
    arms : joint groups that can be decided each by a controller of its own, one a task; empty where there is none.
    coordination : "central", one program decides all joints; "static" or "velocity", one program an arm.
    anatomy : clouds of which the constraints may be about, placed from the world's origin; None for none.
    enforcement : how the constraints are kept. plant : "kinematic" or "mujoco". seed : of everything random.
    period : T, seconds. duration : seconds, at most `MAX_CYCLES` periods.
    limits : {joint: (lower, upper)} where they differ from the robot's.
    hand, admittance : the hand that leads the tool along the reference, and what the tool is like to it; None where
        the task follows the reference by itself.

    Raises
    ------
    InputError, UnknownNameError : a value out of its range, an unknown robot, group, joint or frame.
    """

    name: str
    summary: str
    robot: SceneRobot
    group: str
    start: tuple[float, ...]
    constraints: ConstraintSet
    task: PoseTask | tuple[PoseTask, ...]
    reference: Reference | tuple[Reference, ...]
    period: float
    duration: float
    anatomy: AnatomySource | None = None
    enforcement: Enforcement = OPEN
    plant: str = PLANTS[0]
    seed: int = 0
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    hand: Guide | None = None
    admittance: JointParameters | None = None
    arms: tuple[str, ...] = ()
    coordination: str = "central"

    def __post_init__(self) -> None:
        check_name(self.name)
        entry_of(self.robot)
        start = array(self.start, (None,), f"start of scene {self.name}")
        object.__setattr__(self, "start", tuple(start.tolist()))
        for what in ("period", "duration"):
            number(getattr(self, what), f"{what} of scene {self.name}", positive=True)
        check_duration(self.duration, self.period)
        check_limits(self.limits, self.name)
        check_seed(self.seed, self.name)
        check_clouds(self.constraints, self.anatomy)
        self.enforcement.check(self.constraints)
        check_led_along(self.enforcement, self.hand is not None)
        known("plant", self.plant, PLANTS)
        if (self.hand is None) != (self.admittance is None):
            raise InputError(f"scene {self.name}: hand and admittance go together, got one of them")
        self._check_tasks()
        if self.hand is not None and len(self.tasks) > 1:
            raise InputError(f"scene {self.name}: expected one task where a hand leads, got {len(self.tasks)}")
        if self.hand is not None and self.plant != PLANTS[0]:
            raise InputError(
                f'plant "{self.plant}" of scene {self.name}: a hand leads along a trajectory on the plant '
                f'"{PLANTS[0]}" only; leave out the hand, or have it lead through a port, as hands-on scenes do'
            )

    @property
    def in_force(self) -> InForce:
        """The enforcement, with what scenes with a trajectory do by default."""
        method = self.enforcement.method or "vfi"
        guard = "off" if method == "admittance" else "act"
        return self.enforcement.in_force(InForce(method, ETA, LIMIT_ETA, guard, "free", REACH, {}))

    @property
    def kept(self) -> ConstraintSet:
        """The constraints as inequalities see them: all watched where the enforcement has no inequalities."""
        return self.constraints if self.in_force.by_rows else self.constraints.enforcing([])

    @property
    def tasks(self) -> tuple[PoseTask, ...]:
        """The task, or the several."""
        return self.task if isinstance(self.task, tuple) else (self.task,)

    @property
    def references(self) -> tuple[Reference, ...]:
        """The reference of each task, in their order."""
        return self.reference if isinstance(self.reference, tuple) else (self.reference,)

    def _check_tasks(self) -> None:
        """Several tasks need as many references, and as many arms where there are any."""
        for name in ("task", "reference"):
            given = getattr(self, name)
            if isinstance(given, Sequence):
                object.__setattr__(self, name, given[0] if len(given) == 1 else tuple(given))
        tasks, references, what = len(self.tasks), len(self.references), f"scene {self.name}"
        if tasks != references or not tasks:
            raise InputError(f"reference of {what}: expected one a task, {tasks}, in their order, got {references}")
        if self.arms and len(self.arms) != tasks:
            raise InputError(f"arms of {what}: expected one joint group a task, {tasks}, got {', '.join(self.arms)}")
        known("coordination", self.coordination, COORDINATIONS)
        if self.coordination != "central" and len(self.arms) < 2:
            raise InputError(
                f'coordination of {what}: "{self.coordination}" is for several arms, got {len(self.arms)}; list their '
                'joint groups under the key arms, in the order of the tasks, or take "central"'
            )

    def build_robot(self) -> Robot:
        """The robot with the scene's limits; raises where the scene does not fit it."""
        robot = entry_of(self.robot).build()
        robot = with_ranges(robot, self.limits)
        known("joint group", self.group, robot.groups)
        joints = [int(i) for arm in self.arms for i in robot.group(arm)]
        if self.arms and sorted(joints) != sorted(robot.group(self.group)):
            raise InputError(
                f"arms of scene {self.name}: expected groups that share no joint and are {self.group} together, got "
                f"{', '.join(self.arms)}"
            )
        array(self.start, (robot.n,), f'start of scene {self.name} for robot "{self.robot}"')
        return robot

    def located(self, folder: Path) -> Self:
        """The scene with whole paths of the files that it names, from a folder where it does not say from where."""
        robot = self.robot.located(folder) if isinstance(self.robot, OwnRobot) else self.robot
        anatomy = self.anatomy.located(folder) if self.anatomy else None
        ways = tuple(r.located(folder) if isinstance(r, PoseRecord) else r for r in self.references)
        return replace(self, robot=robot, anatomy=anatomy, reference=ways)

    def with_changes(self, **changes: Any) -> Self:
        """The scene with other values of some attributes."""
        return replace(self, **changes)
