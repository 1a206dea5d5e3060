"""A first scene on a file, tried by `vfi check` before it is handed over."""

import os
from pathlib import Path

from numpy.typing import ArrayLike

from primitives.errors import FileError, InputError
from primitives.robot import Robot
from scenarios.check import check_any
from scenarios.check.finding import Severity
from scenarios.check.report import Report
from scenarios.scene_file import load_any
from scenarios.starter.motion import first_motion
from scenarios.starter.text import hands_on_scene, quoted, trajectory_scene

SEGMENTS = 4.0, 8.0, 16.0
"""Seconds from one waypoint to the next: the shortest that no velocity limit holds back is taken."""
HANDS_ON_JOINTS = 6
"""A shaft through a port with a hand on it needs as many."""


def write_scene(
    model: Path, out: Path, *, tip: str | None = None, start: ArrayLike | None = None, hands_on: bool = False
) -> Report:
    """Write a first scene for the robot of a URDF file, and what `vfi check` says of it.

    Parameters
    ----------
    tip : its link that is the tip, whose z axis is the tool's; None for the last one.
    start : (n,) rad and m; None to have one looked for.
    hands_on : a scene that a hand leads, in place of one that follows a trajectory.

    Raises
    ------
    FileError : the model cannot be read, or out is there already or cannot be written.
    InputError, UnknownNameError : a tip or start that does not fit, or an arm that no scene is found for.
    """
    robot = Robot.from_urdf(model, tip=tip)
    if hands_on and robot.n < HANDS_ON_JOINTS:
        raise InputError(f'robot "{robot.name}": a hands-on scene needs {HANDS_ON_JOINTS} joints, it has {robot.n}')
    if out.suffix not in (".yaml", ".yml"):
        raise FileError(str(out), 'expected a file that ends in ".yaml"; that is how scenes are told from names')
    if out.exists():
        raise FileError(str(out), "is there already; name another file, or remove it")
    motion = first_motion(robot, start)
    file = Path(os.path.relpath(model.absolute(), out.absolute().parent)).as_posix()
    declared = f"robot: {{urdf: {quoted(file)}, tip: {quoted(robot.tip)}}}"
    texts = (
        [hands_on_scene(robot, declared, motion)]
        if hands_on
        else [trajectory_scene(robot, declared, motion, segment) for segment in SEGMENTS]
    )
    for text in texts:
        _write(out, text)
        report = check_any(load_any(out))
        if not any(f.severity != Severity.NOTE or "hold it back" in f.what for f in report.findings):
            break
    return report


def _write(out: Path, text: str) -> None:
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(str(out), f"cannot be written ({error.strerror}); name another place") from None
