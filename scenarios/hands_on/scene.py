"""`HandsOnScene`: an arm, its port, the anatomy, what must never happen, and the hand."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self, cast

import numpy as np

from admittance import TABLE_1, Admittance, Parameters, Region
from primitives.checks import Array, array, known, number
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Point, Segment
from primitives.robot import Robot
from scenarios.anatomy.parts import AnatomySource, Part, placed_cloud
from scenarios.enforcement import BY_ROWS, OPEN, Enforcement, InForce
from scenarios.hands_on.pull import Pull
from scenarios.hands_on.push import Push
from scenarios.own_robot import OwnRobot, SceneRobot, entry_of
from scenarios.plants import PLANTS
from scenarios.scene import LIMIT_ETA, check_clouds, check_duration, check_limits, check_name, check_seed, with_ranges

ETA_T = 0.25
"""eta T of the rows where no eta is given: a period may use up a quarter of a clearance."""
REACH = 0.005
"""How far beyond d_0 points get a row where no reach is given, metres."""


def _in(folder: Path, file: str) -> str:
    return str((folder / file).absolute()) if file else ""


@dataclass(frozen=True)
class HandsOnScene:
    """Everything a hands-on run needs.

    Attributes
    ----------
    name, summary : shown to people.
    robot, group, start : a registered robot or an `OwnRobot`, the joints that move, and (n,) the first configuration,
        rad and m.
    shaft : frame whose z axis is the shaft and whose origin is its end, p_t.
    port : (3,) p_c, world, metres. port_radius : clear radius of the ring that it is in a plant with contact, metres.
    parameters : of the target admittance.
    form, integrator : see `admittance.Admittance`.
    constraints : enforced and watched ones. An enforced one between a point or segment of the shaft frame and a part of
        the anatomy is a region of the admittance, see `regions`.
    hand : see `Pull` and `Push`. hand_on_files : another one for anatomy from files on the command line, whose places
        a scene cannot know; None for the same.
    anatomy : see `AnatomySource`, placed from the port; None where nothing lies under it.
    enforcement : how the constraints are kept. plant : "kinematic" or "mujoco". seed : of everything random.
    period : T, seconds. duration : seconds.
    limits : {joint: (lower, upper)} where they differ from the robot's.

    Raises
    ------
    InputError, UnknownNameError : a value out of its range, an unknown robot, a cloud that is no part of the anatomy.
    """

    name: str
    summary: str
    robot: SceneRobot
    start: tuple[float, ...]
    port: tuple[float, float, float]
    constraints: ConstraintSet
    hand: Pull | Push
    duration: float
    anatomy: AnatomySource | None = None
    hand_on_files: Pull | Push | None = None
    period: float = 0.004
    group: str = "all"
    shaft: str = "tip"
    port_radius: float = 0.005
    parameters: Parameters = field(default=TABLE_1)
    form: str = "reduced"
    integrator: str = "semi-implicit"
    enforcement: Enforcement = OPEN
    plant: str = PLANTS[0]
    seed: int = 0
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_name(self.name)
        entry_of(self.robot)
        object.__setattr__(self, "start", tuple(array(self.start, (None,), f"start of scene {self.name}").tolist()))
        object.__setattr__(self, "port", tuple(array(self.port, (3,), f"port of scene {self.name}").tolist()))
        for what in ("period", "duration", "port_radius"):
            number(getattr(self, what), f"{what} of scene {self.name}", positive=True)
        check_duration(self.duration, self.period)
        check_limits(self.limits, self.name)
        object.__setattr__(self, "constraints", ConstraintSet(self.constraints))
        check_seed(self.seed, self.name)
        check_clouds(self.constraints, self.anatomy)
        self.enforcement.check(self.constraints)
        known("plant", self.plant, PLANTS)

    @property
    def in_force(self) -> InForce:
        """The enforcement, with what hands-on scenes do by default."""
        method = self.enforcement.method or "admittance"
        guard, reach = "act" if method in BY_ROWS else "off", self.parameters.d_0 + REACH
        return self.enforcement.in_force(InForce(method, ETA_T / self.period, LIMIT_ETA, guard, "free", reach, {}))

    @property
    def regions(self) -> tuple[Constraint, ...]:
        """The enforced constraints that keep something out of a part of the anatomy."""
        return tuple(c for c in self.constraints if c.enforced and c.is_cloud)

    @property
    def forbidden_parts(self) -> tuple[str, ...]:
        """Names of the parts that some region is about, in the order of the regions."""
        return tuple(dict.fromkeys(c.second.name for c in self.regions if isinstance(c.second, Cloud)))

    def located(self, folder: Path) -> Self:
        """The scene with whole paths of the files that it names, from a folder where it does not say from where."""
        anatomy = self.anatomy.located(folder) if self.anatomy is not None else None
        hand, other = (
            replace(h, file=_in(folder, h.file)) if isinstance(h, Push) else h for h in (self.hand, self.hand_on_files)
        )
        robot = self.robot.located(folder) if isinstance(self.robot, OwnRobot) else self.robot
        return replace(self, robot=robot, anatomy=anatomy, hand=hand or self.hand, hand_on_files=other)

    def with_changes(self, **changes: Any) -> Self:
        """The scene with other values of some attributes."""
        return replace(self, **changes)

    def build_robot(self) -> Robot:
        """The robot with the scene's limits; raises where the scene does not fit it."""
        robot = with_ranges(entry_of(self.robot).build(), self.limits)
        known("joint group", self.group, robot.groups)
        known("frame", self.shaft, robot.frames)
        for frame in {e.frame for c in self.constraints for e in (c.first, c.second)}:
            known("frame", frame, robot.frames)
        array(self.start, (robot.n,), f'start of scene {self.name} for robot "{self.robot}"')
        return robot

    def build(self, robot: Robot, parts: Mapping[str, Part], **changes: Any) -> Admittance:
        """The admittance at the start, which the scene's constraints repel: those on clouds as regions.

        Parameters
        ----------
        parts : {name: part} of the anatomy, see `scenarios.anatomy.parts.build_parts`.
        changes : other arguments of `Admittance`.

        Raises
        ------
        InputError : see `Admittance`; among others a start inside a region.
        """
        regions = [
            Region(c.name, cloud := placed_cloud(c, parts), cast(Point | Segment, c.first), c.safe_distance, cloud.pose)
            for c in self.regions
        ]
        arguments: dict[str, Any] = {
            "port": self.port,
            "start": self.start,
            "shaft": self.shaft,
            "parameters": self.parameters,
            "period": self.period,
            "regions": regions,
            "constraints": ConstraintSet(c for c in self.constraints if not c.is_cloud),
            "form": self.form,
            "integrator": self.integrator,
            "group": self.group,
        }
        return Admittance(robot, **(arguments | changes))

    def first_end(self, robot: Robot) -> Array:
        """(3,) the shaft's end at the start, world, metres."""
        return np.array(robot.kinematics(self.start).translation(self.shaft))
