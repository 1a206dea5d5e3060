"""`Scene`: a robot, where it starts, what must never happen, what it should do, for how long."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from admittance.joint_parameters import JointParameters
from primitives.checks import array, known, number
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.by_hand.hand import Guide
from scenarios.own_robot import OwnRobot, SceneRobot, entry_of
from scenarios.trajectory import PoseTrajectory
from vfi.tasks import PoseTask

MAX_CYCLES = 10_000_000
NAME = "[A-Za-z0-9][A-Za-z0-9._-]{0,63}"
"""Regular expression of the names of scenes."""


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
    """Everything a run needs but the solver, the guard and the seed.

    Attributes
    ----------
    name, summary : shown to people; a run calls its scene and its files by the name.
    robot : the name of a registered robot, or an `OwnRobot`.
    group : joint group whose velocities are decided.
    start : (n,) first configuration of all joints, rad and m.
    constraints : enforced and watched ones.
    task : what the tool does. reference : the way it is led.
    eta : gain of the inequalities, 1/s, one number or {constraint: gain} with "" for the others.
    limit_eta : gain of the joint-position limits, 1/s.
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
    task: PoseTask
    reference: PoseTrajectory
    period: float
    duration: float
    eta: float | Mapping[str, float] = 0.5
    limit_eta: float = 5.0
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    hand: Guide | None = None
    admittance: JointParameters | None = None

    def __post_init__(self) -> None:
        check_name(self.name)
        entry_of(self.robot)
        start = array(self.start, (None,), f"start of scene {self.name}")
        object.__setattr__(self, "start", tuple(start.tolist()))
        for what in ("period", "duration", "limit_eta"):
            number(getattr(self, what), f"{what} of scene {self.name}", positive=True)
        check_duration(self.duration, self.period)
        for constraint, gain in self.eta.items() if isinstance(self.eta, Mapping) else [("", self.eta)]:
            if constraint:
                known("constraint", constraint, self.constraints.names)
            number(gain, f"eta of scene {self.name}", positive=True)
        check_limits(self.limits, self.name)
        if (self.hand is None) != (self.admittance is None):
            raise InputError(f"scene {self.name}: hand and admittance go together, got one of them")

    def build_robot(self) -> Robot:
        """The robot with the scene's limits; raises where the scene does not fit it."""
        robot = entry_of(self.robot).build()
        robot = with_ranges(robot, self.limits)
        known("joint group", self.group, robot.groups)
        array(self.start, (robot.n,), f'start of scene {self.name} for robot "{self.robot}"')
        return robot

    def located(self, folder: Path) -> Self:
        """The scene with whole paths of the files that it names, from a folder where it does not say from where."""
        return replace(self, robot=self.robot.located(folder)) if isinstance(self.robot, OwnRobot) else self

    def with_changes(self, **changes: Any) -> Self:
        """The scene with other values of some attributes."""
        return replace(self, **changes)
