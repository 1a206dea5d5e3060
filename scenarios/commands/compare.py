"""`vfi compare`: one scene under several enforcements, guards, solvers, coordinations and seeds, on several arms."""

import json
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from scenarios.commands.errors import one_clear_line
from scenarios.commands.names import PlantName

SHARE_OF_RUNS = 0.9
"""Of the progress bar, where a report is written too."""


def compare(
    scene: Annotated[str, typer.Argument(help="A scene by name (see `vfi list`) or as a YAML file.")],
    enforcement: Annotated[
        str | None,
        typer.Option(help="Names with commas: none, admittance, vfi, both; default: all that the scene can have."),
    ] = None,
    robot: Annotated[str | None, typer.Option(help="Names with commas; default: the scene's.")] = None,
    guard: Annotated[str, typer.Option(help="Modes with commas: off, watch, act.")] = "watch",
    solver: Annotated[
        str | None, typer.Option(help="Of scenes that follow a trajectory, names with commas, see `vfi list`.")
    ] = None,
    coordination: Annotated[
        str | None, typer.Option(help="Of several arms, names with commas: central, static, velocity.")
    ] = None,
    seeds: Annotated[int, typer.Option(help="Runs of each, with seeds 0, 1, ..; the hand trembles.")] = 1,
    hand: Annotated[
        Path | None, typer.Option(help="Another hand than the scene's: a YAML file, or a recorded wrench as CSV.")
    ] = None,
    plant: Annotated[PlantName | None, typer.Option(help="Ideal joints, or physics; default: the scene's.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for traces, report.html and its figures.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one object a run instead of a table.")] = False,
) -> None:
    """Run a scene under several enforcements, and on several arms, alike but for these, and show what each did."""
    with one_clear_line():
        from rich.console import Console
        from rich.progress import Progress

        from scenarios.analysis.comparison_folder import Comparison, make_folder
        from scenarios.comparison import Plan, prepare_comparison, run_comparison
        from scenarios.jobs import Choices

        plan = Plan(
            enforcements=_names(enforcement),
            guards=_names(guard),
            robots=_names(robot) or (None,),
            solvers=_names(solver),
            coordinations=_names(coordination),
            seeds=seeds,
        )
        choices = Choices(plant=plant.value if plant is not None else None, hand=hand, out=out)
        jobs = prepare_comparison(scene, plan, choices)
        if out is not None:
            make_folder(out)
        with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
            task = bar.add_task(scene, total=1.0 if out is None else 1.0 / SHARE_OF_RUNS)
            results = run_comparison(jobs, lambda label, share: bar.update(task, description=label, completed=share))
            files: list[Path] = []
            if out is not None:
                from scenarios.analysis.report import write_report

                given = {
                    "enforcement": enforcement,
                    "robot": robot,
                    "guard": guard,
                    "solver": solver,
                    "coordination": coordination,
                    "seeds": seeds if seeds > 1 else None,
                    "hand": hand,
                    "plant": plant.value if plant is not None else None,
                    "out": out,
                }
                comparison = Comparison(out, _command(scene, given), results)
                comparison.save()
                bar.update(task, description="report", completed=1.0)
                files = write_report(comparison)
    if as_json:
        print(json.dumps(results, indent=2))
        return
    from scenarios.analysis.cells import gather
    from scenarios.comparison_table import print_comparison
    from scenarios.table import console_for_tables

    print_comparison(results[0]["scene"], gather(results), files[:1], console_for_tables())


def _names(text: str | None) -> list[str]:
    """Names that stand between commas."""
    return [name.strip() for name in text.split(",")] if text is not None else []


def _command(scene: str, given: Mapping[str, object]) -> str:
    """The command that makes a comparison again, for a shell."""
    options = [word for name, value in given.items() if value is not None for word in (f"--{name}", str(value))]
    return shlex.join(["vfi", "compare", scene, *options])
