"""`HandsOnScene`: an arm, its port, the anatomy, what must not be touched with what, and the hand."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from admittance import TABLE_1, Admittance, Parameters, Region
from primitives.checks import Array, array, known, number
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Point, Segment
from primitives.robot import Robot
from scenarios.hands_on.parts import AnatomySource, Part
from scenarios.hands_on.pull import Pull
from scenarios.hands_on.push import Push
from scenarios.robots import robots
from scenarios.scene import check_duration, check_name

ToolPart = Literal["tip", "tool"]
TOOL_PARTS = ("tip", "tool")


def _in(folder: Path, file: str) -> str:
    return str((folder / file).absolute()) if file else ""


@dataclass(frozen=True)
class Forbidden:
    """A part of the anatomy that the tool must not touch.

    Attributes
    ----------
    keeps_out : "tip", the end of the shaft, or "tool", a capsule from there back along the shaft.
    tool_radius : r of that capsule, metres; a tip has none.

    Raises
    ------
    UnknownNameError, InputError : another word, or a radius below zero.
    """

    keeps_out: ToolPart
    tool_radius: float = 0.0

    def __post_init__(self) -> None:
        known("part of the tool", self.keeps_out, TOOL_PARTS)
        object.__setattr__(self, "tool_radius", number(self.tool_radius, "tool_radius of Forbidden", low=0.0))


@dataclass(frozen=True)
class HandsOnScene:
    """Everything a hands-on run needs but the plant and the seed.

    Attributes
    ----------
    name, summary : shown to people.
    robot, group, start : a registered robot, the joints that move, and (n,) the first configuration, rad and m.
    shaft : frame whose z axis is the shaft and whose origin is its end, p_t.
    port : (3,) p_c, world, metres. port_radius : clear radius of the ring that it is in a plant with contact, metres.
    parameters : of the target admittance.
    form, integrator : see `admittance.Admittance`.
    anatomy : see `AnatomySource`.
    forbidden : {name of a part: what of the tool it keeps out}.
    hand : see `Pull` and `Push`. hand_on_files : another one for anatomy from files on the command line, whose places
        a scene cannot know; None for the same.
    period : T, seconds. duration : seconds.

    Raises
    ------
    InputError, UnknownNameError : a value out of its range, an unknown robot, or a forbidden part that is none.
    """

    name: str
    summary: str
    robot: str
    start: tuple[float, ...]
    port: tuple[float, float, float]
    anatomy: AnatomySource
    forbidden: Mapping[str, Forbidden]
    hand: Pull | Push
    duration: float
    hand_on_files: Pull | Push | None = None
    period: float = 0.004
    group: str = "all"
    shaft: str = "tip"
    port_radius: float = 0.005
    parameters: Parameters = field(default=TABLE_1)
    form: str = "reduced"
    integrator: str = "semi-implicit"

    def __post_init__(self) -> None:
        check_name(self.name)
        known("robot", self.robot, robots.names())
        object.__setattr__(self, "start", tuple(array(self.start, (None,), f"start of scene {self.name}").tolist()))
        object.__setattr__(self, "port", tuple(array(self.port, (3,), f"port of scene {self.name}").tolist()))
        for what in ("period", "duration", "port_radius"):
            number(getattr(self, what), f"{what} of scene {self.name}", positive=True)
        check_duration(self.duration, self.period)
        for name in self.forbidden:
            known("part of the anatomy", name, self.anatomy.parts)

    def located(self, folder: Path) -> Self:
        """The scene with whole paths of the files that it names, from a folder where it does not say from where."""
        source = self.anatomy
        anatomy = replace(source, organ=_in(folder, source.organ), vessels=_in(folder, source.vessels))
        hand, other = (
            replace(h, file=_in(folder, h.file)) if isinstance(h, Push) else h for h in (self.hand, self.hand_on_files)
        )
        return replace(self, anatomy=anatomy, hand=hand or self.hand, hand_on_files=other)

    def with_changes(self, **changes: Any) -> Self:
        """The scene with other values of some attributes."""
        return replace(self, **changes)

    def build_robot(self) -> Robot:
        """The robot; raises where the scene does not fit it."""
        robot = robots[self.robot].build()
        known("joint group", self.group, robot.groups)
        known("frame", self.shaft, robot.frames)
        array(self.start, (robot.n,), f'start of scene {self.name} for robot "{self.robot}"')
        return robot

    @property
    def constraints(self) -> ConstraintSet:
        """The forbidden parts as constraints."""
        return ConstraintSet(
            Constraint(name, self.element(f.keeps_out), Cloud.named(name), "outside", f.tool_radius)
            for name, f in self.forbidden.items()
        )

    def element(self, part: ToolPart) -> Point | Segment:
        """The part of the tool as an element on the shaft frame; the capsule ends before the handle."""
        if part == "tip":
            return Point.at([0.0, 0.0, 0.0], frame=self.shaft)
        return Segment.between([0.0, 0.0, 0.0], [0.0, 0.0, -self.parameters.shaft_length], frame=self.shaft)

    def build(self, robot: Robot, parts: Mapping[str, Part], **changes: Any) -> Admittance:
        """The admittance at the start.

        Parameters
        ----------
        parts : {name: part} of the anatomy, see `scenarios.hands_on.parts.build_parts`.
        changes : other arguments of `Admittance`.

        Raises
        ------
        InputError : see `Admittance`; among others a start inside a region.
        """
        regions = [
            Region(name, parts[name].cloud, self.element(f.keeps_out), f.tool_radius, parts[name].cloud.pose)
            for name, f in self.forbidden.items()
        ]
        arguments: dict[str, Any] = {
            "port": self.port,
            "start": self.start,
            "shaft": self.shaft,
            "parameters": self.parameters,
            "period": self.period,
            "regions": regions,
            "form": self.form,
            "integrator": self.integrator,
            "group": self.group,
        }
        return Admittance(robot, **(arguments | changes))

    def first_end(self, robot: Robot) -> Array:
        """(3,) the shaft's end at the start, world, metres."""
        return np.array(robot.kinematics(self.start).translation(self.shaft))
