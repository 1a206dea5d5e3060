"""Several runs in one go: everything is checked before the first one starts, and before anything is written."""

import json
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from primitives.errors import FileError, InputError, SolverError
from scenarios.analysis.metrics import summary
from scenarios.analysis.trace import Trace
from scenarios.robots import robots
from scenarios.run import build, run
from scenarios.scene import Scene
from scenarios.scene_file import load_scene
from vfi.backends import solvers

ALL = "all"


@dataclass(frozen=True)
class Job:
    """One run that has been checked: the arguments of `scenarios.run.run`."""

    scene: Scene
    options: dict[str, Any]


def _fit(scene: Scene, robot: str | None) -> Scene:
    """The scene on another robot; says why where that cannot be."""
    if robot is None or robot == scene.robot:
        return scene
    candidate = robots[robot].build()
    needed = {e.frame for c in scene.constraints for e in (c.first, c.second) if e.entity is None}
    missing = sorted(needed - set(candidate.frames))
    if missing or candidate.n != len(scene.start):
        frames = ", ".join(missing) or "none"
        raise InputError(
            f'robot "{robot}" cannot run scene "{scene.name}": it has {candidate.n} joints where the start has '
            f"{len(scene.start)}, and lacks the frames: {frames}"
        )
    return scene.with_changes(robot=robot)


def prepare(
    scenes: Sequence[str],
    *,
    solver: str,
    period: float | None,
    guard: str,
    seed: int,
    robot: str | None,
    out: Path | None,
) -> list[Job]:
    """Load and build every scene once, so that bad input is found before anything runs or is written.

    solver "all" stands for every solver that is installed; those that are not are named on stderr.

    Raises
    ------
    InputError, UnknownNameError, FileError : the first thing that is wrong.
    """
    jobs = []
    names: set[str] = set()
    for name in scenes:
        scene = _fit(load_scene(name), robot)
        if scene.name in names:
            raise InputError(f'scene "{scene.name}" was named twice; its trace would be overwritten')
        names.add(scene.name)
        for chosen in solvers.names() if solver == ALL else (solver,):
            try:
                build(scene, solver=chosen, guard=guard, period=period)
            except SolverError as error:
                if solver != ALL:
                    raise
                print(f"vfi: left out: {error}", file=sys.stderr)
                continue
            file = out / f"{scene.name}{f'-{chosen}' if solver == ALL else ''}.mcap" if out is not None else None
            jobs.append(Job(scene, {"solver": chosen, "period": period, "guard": guard, "seed": seed, "out": file}))
    if out is not None and out.exists() and not out.is_dir():
        raise FileError(str(out), "--out: expected a folder, got a file; name another place")
    return jobs


def run_all(jobs: Sequence[Job], *, show_progress: bool) -> list[Trace]:
    """Run the jobs one after another, with a progress bar on stderr where somebody looks."""
    if jobs and (file := jobs[0].options["out"]) is not None:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(str(file.parent), f"--out: cannot make this folder ({error})") from None
    traces = []
    with _bar() if show_progress else nullcontext() as bar:
        for job in jobs:
            report = None
            if bar is not None:
                task = bar.add_task(f"{job.scene.name} {job.options['solver']}", total=1.0)
                report = lambda share, task=task: bar.update(task, completed=share)  # noqa: E731
            traces.append(run(job.scene, **job.options, progress=report))
    return traces


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import Progress

    return Progress(console=Console(stderr=True), transient=True)


def write_results(jobs: Sequence[Job], traces: Sequence[Trace], out: Path) -> list[Path]:
    """Write summary.json and the figures beside the traces of the jobs; returns what is there."""
    from scenarios.analysis.figures import draw_all

    table = out / "summary.json"
    table.write_text(json.dumps([summary(trace) for trace in traces], indent=2) + "\n", encoding="utf-8")
    figures = draw_all(traces, out)
    return [*(job.options["out"] for job in jobs), table, *figures]
