"""`OwnRobot`: a robot that a scene brings along as a file, with its tool, frames and limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

from primitives.checks import array, number
from primitives.errors import InputError
from scenarios.robots import RobotEntry, robots

if TYPE_CHECKING:
    from primitives.robot import Robot

TOOL = "tool"
"""Frame that the tool of an own robot adds, its tip."""


ROBOT_FILES = (".urdf", ".xml", ".mjcf")
"""How the files of own robots end, and so their names."""


@dataclass(frozen=True)
class Placement:
    """Where a frame lies on another one.

    Attributes
    ----------
    on : the frame that carries it.
    position : (3,) metres. rotation : (3,) rotation vector, rad, in the coordinates of the carrier.

    Raises
    ------
    InputError : no name, other shapes, or not finite.
    """

    on: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not isinstance(self.on, str) or not self.on:
            raise InputError(f"on of Placement: expected the name of a frame, got {self.on!r}")
        for name in ("position", "rotation"):
            object.__setattr__(self, name, tuple(array(getattr(self, name), (3,), f"{name} of Placement").tolist()))


@dataclass(frozen=True)
class OwnRobot:
    """A robot from a file of the scene; where a scene names a registered robot, it may have one of these.

    Attributes
    ----------
    urdf, mjcf : the file, one of them; it is simulated by no plant with dynamics and drawn by no video.
    tip : its link, body or site, or one of `frames`, that is the tip; empty for the last link.
    tool : adds a frame "tool", the new tip. frames : {name: where}, further frames, each may lie on those before it.
    limits : {joint: (lower, upper)}, rad and m. velocity_limits : {joint: largest speed}, rad/s and m/s.

    Raises
    ------
    InputError : neither or both files, or a speed that is not > 0. `build` raises what the file or a name deserves.
    """

    urdf: str = ""
    mjcf: str = ""
    tip: str = ""
    tool: Placement | None = None
    frames: Mapping[str, Placement] = field(default_factory=dict)
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    velocity_limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if bool(self.urdf) == bool(self.mjcf):
            raise InputError("own robot: expected the file of a URDF or of an MJCF, one of them")
        if not str(self).lower().endswith(ROBOT_FILES):
            raise InputError(f'own robot: expected a file that ends in {", ".join(ROBOT_FILES)}, got "{self}"')
        for joint, speed in self.velocity_limits.items():
            number(speed, f'velocity limit of joint "{joint}"', positive=True)

    def __str__(self) -> str:
        """By what runs and files call it: the name of its file, which no registered robot has."""
        return Path(self.urdf or self.mjcf).name

    def located(self, folder: Path) -> Self:
        """The robot with the whole path of its file, from a folder where it does not say from where."""
        file = {"urdf" if self.urdf else "mjcf": str((folder / (self.urdf or self.mjcf)).absolute())}
        return replace(self, **file)  # type: ignore[arg-type]

    def build(self) -> "Robot":
        """The robot; raises FileError, ModelError, InputError and UnknownNameError."""
        from primitives import dual_quaternion as dq
        from primitives.robot import Robot

        read = Robot.from_urdf if self.urdf else Robot.from_mjcf
        robot = read(self.urdf or self.mjcf, tip=None if self.tip in self.frames else self.tip or None)
        tool = {TOOL: self.tool} if self.tool is not None else {}
        for name, place in {**self.frames, **tool}.items():
            turn = dq.exponential(array([0.0, *(0.5 * angle for angle in place.rotation), 0, 0, 0, 0], (8,), "turn"))
            pose = dq.from_rotation_translation(turn[:4].copy(), array(place.position, (3,), "position"))
            with_frame = robot.with_tool(name, pose, on=place.on)
            robot = with_frame if name in (tool or (self.tip,)) else replace(with_frame, tip=robot.tip)
        lower, upper = ({joint: limit[i] for joint, limit in self.limits.items()} for i in (0, 1))
        return robot.with_limits(lower=lower, upper=upper, velocity=dict(self.velocity_limits))


SceneRobot = str | OwnRobot
"""What a scene may have as its robot: a registered one by its name, or its own."""


def entry_of(robot: SceneRobot) -> RobotEntry:
    """The entry of a scene's robot; an own one has neither pictures nor dynamics. Raises UnknownNameError."""
    if isinstance(robot, OwnRobot):
        return RobotEntry(str(robot), "a robot of the scene's own", robot.build)
    return robots[robot]
