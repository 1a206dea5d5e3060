"""One file a robot. `robots` finds every file of this folder that defines `ROBOT`; importing this loads no library.

From outside, `robots.register(RobotEntry(...))` or an entry point ``active_constraints.robots`` adds one.
"""

import sys
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from primitives.errors import InputError
from primitives.plugins import Registry

if TYPE_CHECKING:
    from primitives.robot import Robot


class RobotEntry(NamedTuple):
    """A robot that scenes can name.

    Attributes
    ----------
    name : by which scenes and the command line call it.
    summary : one line for people.
    build : makes the robot; it imports what it needs when called.
    urdf : what draws it: for each prefix of frame names ("" for none) the URDF whose link "x" is drawn at the
        frame "prefix/x". Empty for a robot without pictures.
    mjcf : what simulates it in MuJoCo: for each prefix the MJCF whose bodies and joints bear the names of the robot's
        frames and joints, with a position servo a joint, a body "handle" and a force and a torque sensor of these
        names. Empty for a robot without dynamics.
    """

    name: str
    summary: str
    build: "Callable[[], Robot]"
    urdf: Mapping[str, Path] = MappingProxyType({})
    mjcf: Mapping[str, Path] = MappingProxyType({})


def urdf_path(name: str) -> Path:
    """Path of the URDF of that name in this folder."""
    return Path(str(files(__name__).joinpath(f"{name}.urdf")))


def mjcf_path(name: str) -> Path:
    """Path of the MJCF of that name in this folder."""
    return Path(str(files(__name__).joinpath(f"{name}.xml")))


def _check(entry: RobotEntry) -> None:
    if not entry.name or not entry.summary or "\n" in entry.summary or not callable(entry.build):
        raise InputError(f"robot {entry.name!r}: expected a name, a summary of one line and a function build()")


robots: Registry[RobotEntry] = Registry("robot", sys.modules[__name__], "ROBOT", _check)
"""Every robot that scenes can name."""
