"""`vfi init`: a first scene for an arm that is not in the project."""

from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line


def init(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT.urdf", help="The arm.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Scene to write, .yaml.")],
    tip: Annotated[
        str | None, typer.Option(help="Link at the tip, its z axis along the tool; default: the last.")
    ] = None,
    start: Annotated[str | None, typer.Option(help="First configuration, numbers with commas, rad and m.")] = None,
    hands_on: Annotated[bool, typer.Option("--hands-on", help="A scene that a hand leads.")] = False,
) -> None:
    """Write a first scene for an arm: a port on its tool, a plane ahead, and a short motion. It can be run at once."""
    with one_clear_line():
        from primitives.errors import InputError
        from scenarios.check.text import print_findings
        from scenarios.starter.write import write_scene
        from scenarios.table import console_for_tables

        numbers = None
        if start is not None:
            try:
                numbers = [float(word) for word in start.split(",")]
            except ValueError:
                raise InputError(f"--start: expected numbers with commas, got {start!r:.80}") from None
        report = write_scene(robot, out, tip=tip, start=numbers, hands_on=hands_on)
    print_findings(report, console_for_tables())
    print(f"{out}: run it with `vfi run {out}`")
