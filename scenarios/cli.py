"""The command `vfi`. Heavy imports wait inside the commands, so that `vfi --help` answers at once."""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import typer

from scenarios.commands.check import check
from scenarios.commands.compare import compare
from scenarios.commands.diff import diff
from scenarios.commands.errors import one_clear_line
from scenarios.commands.import_vfi import import_vfi
from scenarios.commands.init import init
from scenarios.commands.names import GuardMode, PlantName
from scenarios.commands.report import report
from scenarios.commands.schema import schema

app = typer.Typer(
    help="Active constraints for surgical robots: run scenes, compare enforcements, look at what happened.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _cite(wanted: bool) -> None:
    if wanted:
        from scenarios.citation import bibtex

        print(bibtex())
        raise typer.Exit


def _version(wanted: bool) -> None:
    if wanted:
        print(version("active-constraints"))
        raise typer.Exit


@app.callback()
def main_options(
    cite: Annotated[
        bool, typer.Option("--cite", callback=_cite, is_eager=True, help="Print how to cite, as BibTeX.")
    ] = False,
    show_version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Options of the program itself."""


@app.command()
def run(
    scenes: Annotated[list[str], typer.Argument(help="Scenes by name (see `vfi list`) or as YAML files.")],
    solver: Annotated[str, typer.Option(help="Solver, see `vfi list`; all: each in turn.")] = "active-set",
    period: Annotated[float | None, typer.Option(help="Control period in seconds; default: the scene's.")] = None,
    guard: Annotated[
        GuardMode | None,
        typer.Option(help="act on, only count, or skip what verification finds; default: the scene's"),
    ] = None,
    coordination: Annotated[
        str | None,
        typer.Option(help="Of several arms, names with commas: central, static, velocity; default: the scene's."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of everything random; default: the scene's.", min=0)] = None,
    robot: Annotated[str | None, typer.Option(help="Another robot than the scene's.")] = None,
    plant: Annotated[PlantName | None, typer.Option(help="Ideal joints, or physics; default: the scene's.")] = None,
    enforcement: Annotated[
        str | None,
        typer.Option(
            help="vfi (inequalities), none; with a hand also admittance (potentials), both; default: the scene's."
        ),
    ] = None,
    hand: Annotated[
        Path | None, typer.Option(help="Another hand than the scene's: a YAML file, or a recorded wrench as CSV.")
    ] = None,
    metric: Annotated[
        str | None,
        typer.Option(help="Of a hand's motion: project in the free coordinates, or in the joints' (not passive)."),
    ] = None,
    integrator: Annotated[
        str | None, typer.Option(help="Of hands-on scenes: semi-implicit, euler, rk4, robust; default: the scene's.")
    ] = None,
    form: Annotated[str | None, typer.Option(help="Of the target dynamics: reduced, full, printed.")] = None,
    organ: Annotated[Path | None, typer.Option(help="Of hands-on scenes: PLY, STL, OBJ, GLB or PCD file.")] = None,
    vessels: Annotated[Path | None, typer.Option(help="Likewise; what the tool must not touch.")] = None,
    unit: Annotated[str, typer.Option(help="Of these files: m, cm or mm.")] = "m",
    fill_gaps: Annotated[bool, typer.Option("--fill-gaps", help="Add points where a file of points has gaps.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for traces, summary and figures.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Run scenes and show which constraints were violated."""
    with one_clear_line():
        from scenarios.jobs import Choices
        from scenarios.session import prepare, run_all, write_results

        choices = Choices(
            solver=solver,
            period=period,
            guard=guard.value if guard is not None else None,
            coordination=coordination,
            seed=seed,
            robot=robot,
            out=out,
            hand=hand,
            plant=plant.value if plant is not None else None,
            enforcement=enforcement,
            metric=metric,
            integrator=integrator,
            form=form,
            organ=organ,
            vessels=vessels,
            unit=unit,
            fill_gaps=fill_gaps,
        )
        jobs = prepare(scenes, choices)
        traces = run_all(jobs, show_progress=sys.stderr.isatty())
        results = [job.summary(trace) for job, trace in zip(jobs, traces, strict=True)]
        files = write_results(jobs, traces, results, out) if out is not None else []
    _show(results, files, as_json)


def _show(results: list[dict[str, Any]], files: list[Path], as_json: bool) -> None:
    if as_json:
        print(json.dumps(results, indent=2))
        return
    from scenarios.table import print_results

    print_results(results, files)


@app.command()
def video(
    run_file: Annotated[Path, typer.Argument(metavar="RUN.mcap", help="Trace of a run, as `vfi run --out` writes it.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Video to write, .mp4.")],
    fps: Annotated[float, typer.Option(help="Frames a second.")] = 30.0,
    width: Annotated[int, typer.Option(help="Pixels, even.")] = 1280,
    height: Annotated[int, typer.Option(help="Pixels, even.")] = 720,
    camera: Annotated[str, typer.Option(help="tool, side, front, top: what the tool does; arm: all of it.")] = "tool",
) -> None:
    """Make a video of a run. Without a graphics card a frame takes about 0.2 s."""
    with one_clear_line():
        from rich.console import Console
        from rich.progress import Progress

        from scenarios.analysis.trace import Trace
        from scenarios.view.video import record

        trace = Trace.load(run_file)
        with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
            task = bar.add_task(out.name, total=1.0)
            count = record(
                trace,
                out,
                fps=fps,
                width=width,
                height=height,
                camera=camera,
                progress=lambda share: bar.update(task, completed=share),
            )
    print(f"{out}: {count} frames, {width} x {height}")


@app.command("list")
def list_names(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """List scenes, robots, solvers and primitives."""
    with one_clear_line():
        from scenarios.catalogue import catalogue

        found = catalogue()
    if as_json:
        print(json.dumps(found, indent=2))
        return
    for kind, entries in found.items():
        print(kind)
        for name, text in entries.items():
            print(f"  {name:<18} {text}")


app.command("compare")(compare)
app.command("report")(report)
app.command("diff")(diff)
app.command("check")(check)
app.command("import")(import_vfi)
app.command("init")(init)
app.command("schema")(schema)


def main() -> None:
    """Entry point of the command `vfi`."""
    app()
