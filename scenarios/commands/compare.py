"""`vfi compare`: one scene under several enforcements, guards and seeds, on several arms."""

import json
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line
from scenarios.commands.names import PlantName

SHARE_OF_RUNS = 0.9
"""Of the progress bar, where a report is written too."""


def compare(
    scene: Annotated[str, typer.Argument(help="A hands-on scene by name (see `vfi list`) or as a YAML file.")],
    enforcement: Annotated[str, typer.Option(help="Names with commas: none, admittance, vfi, both.")] = (
        "none,admittance,vfi,both"
    ),
    robot: Annotated[str | None, typer.Option(help="Names with commas; default: the scene's.")] = None,
    guard: Annotated[str, typer.Option(help="Modes with commas: off, watch, act.")] = "watch",
    seeds: Annotated[int, typer.Option(help="Runs of each, with seeds 0, 1, ..; the hand trembles.")] = 1,
    plant: Annotated[PlantName | None, typer.Option(help="Ideal joints, or physics; default: the scene's.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for traces, report.html and its figures.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one object a run instead of a table.")] = False,
) -> None:
    """Run a scene under several enforcements, and on several arms, with the same hand, and show what each did."""
    with one_clear_line():
        from rich.console import Console
        from rich.progress import Progress

        from scenarios.analysis.comparison_folder import Comparison, make_folder
        from scenarios.hands_on.compare import prepare_comparison, run_comparison
        from scenarios.jobs import Choices

        choices = Choices(plant=plant.value if plant is not None else None, out=out)
        robots: list[str | None] = [*robot.split(",")] if robot else [None]
        jobs = prepare_comparison(scene, enforcement.split(","), robots, seeds, choices, guard.split(","))
        if out is not None:
            make_folder(out)
        with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
            task = bar.add_task(scene, total=1.0 if out is None else 1.0 / SHARE_OF_RUNS)
            results = run_comparison(jobs, lambda label, share: bar.update(task, description=label, completed=share))
            files: list[Path] = []
            if out is not None:
                from scenarios.analysis.report import write_report

                words = ["vfi", "compare", scene, "--enforcement", enforcement, "--guard", guard, "--seeds", str(seeds)]
                words += [*(["--robot", robot] if robot else []), *(["--plant", plant.value] if plant else [])]
                words += ["--out", str(out)]
                comparison = Comparison(out, shlex.join(words), results)
                comparison.save()
                bar.update(task, description="report", completed=1.0)
                files = write_report(comparison)
    if as_json:
        print(json.dumps(results, indent=2))
        return
    from scenarios.analysis.cells import gather
    from scenarios.hands_on_table import print_comparison
    from scenarios.table import console_for_tables

    print_comparison(results[0]["scene"], gather(results), files[:1], console_for_tables())
