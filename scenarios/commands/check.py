"""`vfi check`: look at a scene without running it."""

import json
import sys
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line

FOUND = 1
"""Exit code where something is found that keeps the scene from running as it declares."""


def check(
    scene: Annotated[str, typer.Argument(help="A scene by name (see `vfi list`) or as a YAML file.")],
    robot: Annotated[str | None, typer.Option(help="The scene's variant for this robot.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Look at a scene without running it: margins, gains, conflicts, reach, clouds. Exits with 1 if it cannot run."""
    with one_clear_line():
        from rich.console import Console
        from rich.progress import Progress

        from scenarios.check import check_any
        from scenarios.check.places import places
        from scenarios.scene_file import load_any

        loaded = load_any(scene, robot)
        with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
            task = bar.add_task(scene, total=1.0)
            report = check_any(loaded, lambda label, share: bar.update(task, description=label, completed=share))
        report = report.placed(places(scene, robot))
    if as_json:
        print(json.dumps(report.data(), indent=2))
    else:
        from scenarios.check.text import print_report
        from scenarios.table import console_for_tables

        print_report(report, console_for_tables())
    if not report.ok:
        raise typer.Exit(FOUND)
