"""`Scene`: a robot, where it starts, what must never happen, what it should do, for how long."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from primitives.checks import array, known, number
from primitives.constraint import ConstraintSet
from primitives.robot import Robot
from scenarios.robots import robots
from scenarios.trajectory import PoseTrajectory
from vfi.tasks import PoseTask


@dataclass(frozen=True)
class Scene:
    """Everything a run needs but the solver, the guard and the seed.

    Attributes
    ----------
    name, summary : shown to people; a run calls its scene by the name.
    robot : a registered robot.
    group : joint group whose velocities are decided.
    start : (n,) first configuration of all joints, rad and m.
    constraints : enforced and watched ones.
    task : what the tool does; reference : its reference.
    eta : gain of the inequalities, 1/s, one number or {constraint: gain} with "" for the others.
    limit_eta : gain of the joint-position limits, 1/s.
    period : T, seconds. duration : seconds.
    limits : {joint: (lower, upper)} where they differ from the robot's.

    Raises
    ------
    InputError, UnknownNameError : a value out of its range, an unknown robot, group, joint or frame.
    """

    name: str
    summary: str
    robot: str
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

    def __post_init__(self) -> None:
        known("robot", self.robot, robots.names())
        number(self.period, f"period of scene {self.name}", positive=True)
        number(self.duration, f"duration of scene {self.name}", positive=True)

    def build_robot(self) -> Robot:
        """The robot with the scene's limits; raises where the scene does not fit it."""
        robot = robots[self.robot].build()
        if self.limits:
            lower = {joint: limit[0] for joint, limit in self.limits.items()}
            upper = {joint: limit[1] for joint, limit in self.limits.items()}
            robot = robot.with_limits(lower=lower, upper=upper)
        known("joint group", self.group, robot.groups)
        array(self.start, (robot.n,), f'start of scene {self.name} for robot "{self.robot}"')
        return robot

    def with_changes(self, **changes: Any) -> Self:
        """The scene with other values of some attributes."""
        return replace(self, **changes)
