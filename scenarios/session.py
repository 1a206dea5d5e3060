"""Several runs in one go: everything is checked before the first one starts, and before anything is written."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from primitives.errors import FileError, InputError, SolverError
from primitives.point_cloud import Gaps
from scenarios.analysis.metrics import summary
from scenarios.analysis.trace import Trace
from scenarios.hands_on.parts import FILES, AnatomySource, Part, build_parts
from scenarios.hands_on.plant import build_plant
from scenarios.hands_on.scene import HandsOnScene
from scenarios.robots import robots
from scenarios.run import build, run
from scenarios.scene import Scene
from scenarios.scene_file import load_any
from vfi.backends import solvers

ALL = "all"
Progress = Callable[[float], None] | None


@dataclass(frozen=True)
class Choices:
    """What the command line says beside the scenes; None where the scene decides.

    Attributes
    ----------
    solver, guard : of scenes that follow a trajectory. period : T, seconds. seed : of everything random.
    robot : another robot than the scene's. out : folder of traces.
    plant, integrator, form : of hands-on scenes. organ, vessels, unit : files in the place of their
        anatomy. fill_gaps : of files of points, instead of refusing them.
    """

    solver: str = "active-set"
    period: float | None = None
    guard: str = "act"
    seed: int = 0
    robot: str | None = None
    out: Path | None = None
    plant: str = "kinematic"
    integrator: str | None = None
    form: str | None = None
    organ: Path | None = None
    vessels: Path | None = None
    unit: str = "m"
    fill_gaps: bool = False


class Job(Protocol):
    """One run that has been checked."""

    @property
    def label(self) -> str:
        """What the run is called while it goes on."""

    @property
    def file(self) -> Path | None:
        """Where its trace goes."""

    def run(self, progress: Progress) -> Trace:
        """Do it."""

    def summary(self, trace: Trace) -> dict[str, Any]:
        """Its figures of merit."""


@dataclass(frozen=True)
class TrajectoryJob:
    """A run of a scene that follows a trajectory: the arguments of `scenarios.run.run`."""

    scene: Scene
    options: dict[str, Any]

    @property
    def label(self) -> str:
        """See `Job`."""
        return f"{self.scene.name} {self.options['solver']}"

    @property
    def file(self) -> Path | None:
        """See `Job`."""
        file: Path | None = self.options["out"]
        return file

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        return run(self.scene, **self.options, progress=progress)

    def summary(self, trace: Trace) -> dict[str, Any]:
        """See `Job`."""
        return summary(trace)


@dataclass(frozen=True)
class HandsOnJob:
    """A run of a hands-on scene."""

    scene: HandsOnScene
    plant: str
    seed: int
    file: Path | None

    @property
    def label(self) -> str:
        """See `Job`."""
        return f"{self.scene.name} {self.scene.robot} {self.plant}"

    @cached_property
    def parts(self) -> Mapping[str, Part]:
        """The anatomy, built once."""
        return build_parts(self.scene.anatomy, np.array(self.scene.port))

    def check(self) -> None:
        """Build everything that the run will need; raises where something does not fit."""
        robot = self.scene.build_robot()
        self.scene.build(robot, self.parts)
        clouds = {name: part.cloud for name, part in self.parts.items()}
        build_plant(self.plant, self.scene, robot, clouds, self.seed)

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        from scenarios.hands_on.run import run_hands_on

        return run_hands_on(
            self.scene, plant=self.plant, seed=self.seed, out=self.file, progress=progress, parts=self.parts
        )

    def summary(self, trace: Trace) -> dict[str, Any]:
        """See `Job`."""
        from scenarios.analysis.hands_on_metrics import summary as hands_on_summary

        return hands_on_summary(trace, self.scene, self.parts)


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


def _hands_on(scene: HandsOnScene, choices: Choices) -> HandsOnJob:
    if choices.robot not in (None, scene.robot):
        robots[choices.robot or ""]
        raise InputError(
            f'scene "{scene.name}" has no variant for robot "{choices.robot}"; it is for "{scene.robot}". '
            "Write one: a copy of its file with start, port and anatomy that suit the arm"
        )
    changes = {name: getattr(choices, name) for name in ("period", "integrator", "form")}
    scene = scene.with_changes(**{name: value for name, value in changes.items() if value is not None})
    if choices.organ or choices.vessels:
        scene = scene.with_changes(anatomy=_from_files(scene.anatomy, choices))
    file = choices.out / f"{scene.name}-{scene.robot}-{choices.plant}.mcap" if choices.out is not None else None
    job = HandsOnJob(scene, choices.plant, choices.seed, file)
    job.check()
    return job


def _from_files(anatomy: AnatomySource, choices: Choices) -> AnatomySource:
    organ, vessels = (str(path.absolute()) if path else "" for path in (choices.organ, choices.vessels))
    gaps: Gaps = "fill" if choices.fill_gaps else anatomy.gaps
    thickest = max(anatomy.cover.values())
    cover = {name: anatomy.cover.get(name, thickest) for name in ("organ", "vessels")}
    return replace(anatomy, kind=FILES, cover=cover, unit=choices.unit, organ=organ, vessels=vessels, gaps=gaps)


def _trajectory(scene: Scene, choices: Choices) -> list[TrajectoryJob]:
    jobs = []
    for chosen in solvers.names() if choices.solver == ALL else (choices.solver,):
        try:
            build(scene, solver=chosen, guard=choices.guard, period=choices.period)
        except SolverError as error:
            if choices.solver != ALL:
                raise
            print(f"vfi: left out: {error}", file=sys.stderr)
            continue
        suffix = f"-{chosen}" if choices.solver == ALL else ""
        file = choices.out / f"{scene.name}{suffix}.mcap" if choices.out is not None else None
        options = {"solver": chosen, "period": choices.period, "guard": choices.guard, "seed": choices.seed}
        jobs.append(TrajectoryJob(scene, {**options, "out": file}))
    return jobs


def prepare(scenes: Sequence[str], choices: Choices) -> list[Job]:
    """Load and build every scene once, so that bad input is found before anything runs or is written.

    solver "all" stands for every solver that is installed; those that are not are named on stderr.

    Raises
    ------
    InputError, UnknownNameError, FileError : the first thing that is wrong.
    """
    jobs: list[Job] = []
    names: set[str] = set()
    for name in scenes:
        scene = load_any(name, choices.robot)
        if scene.name in names:
            raise InputError(f'scene "{scene.name}" was named twice; its trace would be overwritten')
        names.add(scene.name)
        if isinstance(scene, HandsOnScene):
            jobs.append(_hands_on(scene, choices))
        else:
            jobs += _trajectory(_fit(scene, choices.robot), choices)
    if choices.out is not None and choices.out.exists() and not choices.out.is_dir():
        raise FileError(str(choices.out), "--out: expected a folder, got a file; name another place")
    return jobs


def run_all(jobs: Sequence[Job], *, show_progress: bool) -> list[Trace]:
    """Run the jobs one after another, with a progress bar on stderr where somebody looks."""
    if jobs and (file := jobs[0].file) is not None:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(str(file.parent), f"--out: cannot make this folder ({error})") from None
    traces = []
    with _bar() if show_progress else nullcontext() as bar:
        for job in jobs:
            report = None
            if bar is not None:
                task = bar.add_task(job.label, total=1.0)
                report = lambda share, task=task: bar.update(task, completed=share)  # noqa: E731
            traces.append(job.run(report))
    return traces


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import Progress

    return Progress(console=Console(stderr=True), transient=True)


def write_results(
    jobs: Sequence[Job], traces: Sequence[Trace], results: Sequence[dict[str, Any]], out: Path
) -> list[Path]:
    """Write summary.json and the figures beside the traces of the jobs; returns what is there."""
    from scenarios.analysis.figures import draw_all
    from scenarios.analysis.hands_on_figures import draw_hands_on

    table = out / "summary.json"
    table.write_text(json.dumps(list(results), indent=2) + "\n", encoding="utf-8")
    followed = [trace for job, trace in zip(jobs, traces, strict=True) if isinstance(job, TrajectoryJob)]
    figures = draw_all(followed, out) if followed else []
    for job, trace in zip(jobs, traces, strict=True):
        if isinstance(job, HandsOnJob):
            figures += draw_hands_on(trace, job.scene, job.parts, out)
    return [*(job.file for job in jobs if job.file is not None), table, *figures]
