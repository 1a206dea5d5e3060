"""Several runs in one go: everything is checked before the first one starts, and before anything is written."""

import json
import sys
from collections.abc import Mapping, Sequence, Set
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from primitives.errors import FileError, InputError, SolverError
from scenarios.analysis.kept import kept_summary
from scenarios.analysis.metrics import summary
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, build_parts
from scenarios.hand_file import with_hand
from scenarios.jobs import Choices, Job, Progress
from scenarios.robots import robots
from scenarios.run import build, plant_of, run
from scenarios.scene import Scene
from scenarios.scene_file import load_any
from vfi.backends import solvers

ALL = "all"
FOLLOWING, BY_HAND, HANDS_ON = "that follow a trajectory", "that follow a trajectory by hand", "led by a hand"
HEEDED = {
    FOLLOWING: ("solver", "coordination", "plant", "enforcement"),
    BY_HAND: ("enforcement", "metric", "integrator", "hand"),
    HANDS_ON: ("plant", "enforcement", "metric", "integrator", "form", "organ", "vessels", "unit", "fill_gaps", "hand"),
}
"""Choices that not all kinds of scene heed, by the kind that does."""


@dataclass(frozen=True)
class TrajectoryJob:
    """A run of a scene that follows a trajectory by itself."""

    scene: Scene
    solver: str
    file: Path | None

    @property
    def label(self) -> str:
        """See `Job`."""
        coordination = f" {self.scene.coordination}" if self.scene.arms else ""
        return f"{self.scene.name} {self.scene.in_force.method} {self.solver}{coordination}"

    @cached_property
    def parts(self) -> Mapping[str, Part]:
        """The anatomy, built once."""
        return build_parts(self.scene.anatomy)

    def again(self, seed: int, file: Path | None) -> Self:
        """See `Job`."""
        other = replace(self, scene=self.scene.with_changes(seed=seed), file=file)
        other.__dict__["parts"] = self.parts
        return other

    def check(self) -> None:
        """Build everything that the run will need; raises where something does not fit."""
        robot = build(self.scene, solver=self.solver, parts=self.parts).robot
        plant_of(self.scene, robot, self.parts)
        for reference in self.scene.references:
            reference.check()

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        return run(self.scene, solver=self.solver, out=self.file, progress=progress, parts=self.parts)

    def summary(self, trace: Trace) -> dict[str, Any]:
        """See `Job`."""
        return summary(trace) | kept_summary(trace, self.scene, self.parts)

    def draw(self, trace: Trace, folder: Path) -> list[Path]:
        """Nothing alone: the figures of the VFI paper show several runs together."""
        return []


def fit(scene: Scene, robot: str | None) -> Scene:
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


def trajectory_job(scene: Scene, choices: Choices) -> TrajectoryJob:
    """The job of a scene as the command line changes it, with one solver and coordination, checked; without a file.

    Raises what is wrong with it.
    """
    (coordinated,) = _coordinated(choices.applied_to(scene), choices.coordination)
    job = TrajectoryJob(coordinated, choices.solver, None)
    job.check()
    return job


def _trajectory(scene: Scene, choices: Choices) -> list[TrajectoryJob]:
    jobs = []
    coordinated = _coordinated(scene, choices.coordination)
    for one in coordinated:
        for chosen in solvers.names() if choices.solver == ALL else (choices.solver,):
            suffix = f"-{one.coordination}" if len(coordinated) > 1 else ""
            suffix += f"-{choices.enforcement}" if choices.enforcement not in (None, "vfi") else ""
            suffix += f"-{chosen}" if choices.solver == ALL else ""
            file = choices.out / f"{scene.name}{suffix}.mcap" if choices.out is not None else None
            try:
                job = trajectory_job(one, replace(choices, solver=chosen, coordination=None))
            except SolverError as error:
                if choices.solver != ALL:
                    raise
                print(f"vfi: left out: {error}", file=sys.stderr)
                continue
            jobs.append(replace(job, file=file))
    return jobs


def _coordinated(scene: Scene, names: str | None) -> list[Scene]:
    """The scene, or the scene under each coordination of a list with commas."""
    if names is None:
        return [scene]
    listed = names.split(",")
    for name in listed:
        if listed.count(name) > 1:
            raise InputError(f'--coordination: "{name}" was named twice; its trace would be overwritten')
    return [scene.with_changes(coordination=name) for name in listed]


def _kind(scene: object) -> str:
    if not isinstance(scene, Scene):
        return HANDS_ON
    return FOLLOWING if scene.hand is None else BY_HAND


def _check_heeded(choices: Choices, kinds: Set[str]) -> None:
    """Refuse an option that changes nothing in any of these kinds of scene."""
    every = dict.fromkeys(name for names in HEEDED.values() for name in names)
    given = [name for name in every if getattr(choices, name) != getattr(Choices, name)]
    if not choices.organ and not choices.vessels and (lost := [n for n in given if n in ("unit", "fill_gaps")]):
        raise InputError(f"{_spelt(lost[0])}: it says something of files; name them with --organ or --vessels")
    for name in given:
        if kinds and not any(name in HEEDED[kind] for kind in kinds):
            fit = " or ".join(kind for kind, names in HEEDED.items() if name in names)
            raise InputError(f"{_spelt(name)}: it is for scenes {fit}, and none of these is one; see `vfi list`")


def _spelt(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def prepare(scenes: Sequence[str], choices: Choices) -> list[Job]:
    """Load and build every scene once, so that bad input is found before anything runs or is written.

    solver "all" stands for every solver that is installed; those that are not are named on stderr.

    Raises
    ------
    InputError, UnknownNameError, FileError : the first thing that is wrong.
    """
    loaded = [load_any(name, choices.robot) for name in scenes]
    names = [scene.name for scene in loaded]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f'scene "{name}" was named twice; its trace would be overwritten')
    _check_heeded(choices, {_kind(scene) for scene in loaded})
    if (file := choices.hand) is not None:
        loaded = [scene if _kind(scene) == FOLLOWING else with_hand(scene, file) for scene in loaded]
    jobs: list[Job] = []
    for scene in loaded:
        if isinstance(scene, Scene) and scene.hand is not None:
            from scenarios.by_hand.job import by_hand_job

            jobs.append(by_hand_job(fit(scene, choices.robot), choices))
        elif isinstance(scene, Scene):
            jobs += _trajectory(fit(scene, choices.robot), choices)
        else:
            from scenarios.hands_on.job import hands_on_job

            jobs.append(hands_on_job(scene, choices))
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

    table = out / "summary.json"
    table.write_text(json.dumps(list(results), indent=2) + "\n", encoding="utf-8")
    pairs = list(zip(jobs, traces, strict=True))
    together = [trace for job, trace in pairs if isinstance(job.scene, Scene)]
    figures = draw_all(together, out) if together else []
    for job, trace in pairs:
        figures += job.draw(trace, out)
    return [*(job.file for job in jobs if job.file is not None), table, *figures]
