"""`vfi import`: constraints from the configuration of another program."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line


def import_vfi(
    file: Annotated[Path, typer.Argument(help="VFI configuration of robot_constraint_manager, version 2 or 3.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="File to write: constraints and eta, a scene's base.")],
    robot: Annotated[str | None, typer.Option(help="Robot whose frames may be named; default: any.")] = None,
    joint_frames: Annotated[
        str, typer.Option(help="Frames of their joints, with commas (version 3); default: frame1,frame2,..")
    ] = "",
) -> None:
    """Write the constraints of Adorno-Lab's VFI configuration as ours, and name what could not be carried over."""
    with one_clear_line():
        from primitives.errors import FileError
        from scenarios.imports import adorno_vfi
        from scenarios.robots import robots

        frames = robots[robot].build().frames if robot is not None else None
        names = joint_frames.split(",") if joint_frames else []
        imported = adorno_vfi.import_vfi(file, frames=frames, joint_frames=names)
        text = adorno_vfi.to_yaml(imported)
        try:
            out.write_text(text, encoding="utf-8")
        except OSError as error:
            raise FileError(str(out), f"cannot be written ({error.strerror}); name another place") from None
    print(f"{out}: {len(imported.constraints)} constraints")
    for what, notes in (("not carried over", imported.left_out), ("to check", imported.changed)):
        for note in notes:
            print(f"  {what}: {note.place}{f': {note.tag}' if note.tag else ''}: {note.text}", file=sys.stderr)
