"""One scene under several enforcements, on several arms, for several seeds: what each did under the same conditions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from primitives.checks import known
from primitives.errors import InputError
from scenarios.analysis import kinds
from scenarios.analysis.comparison_folder import trace_file
from scenarios.by_hand.job import by_hand_job
from scenarios.enforcement import METHODS
from scenarios.hand_file import with_hand
from scenarios.hands_on.job import HandsOnJob, hands_on_job
from scenarios.hands_on.scene import HandsOnScene
from scenarios.jobs import Choices, Job
from scenarios.scene import Scene
from scenarios.scene_file import load_any
from scenarios.scenes import scene_names
from scenarios.session import TrajectoryJob, fit, trajectory_job

ALONG = ("none", "vfi")
"""Methods of scenes that follow a trajectory by themselves."""
TREMOR, TREMOR_ALONG = 0.5, 0.2
"""N rms of the hand's tremor where several seeds are compared and the hand has none: else all runs would be alike. In
hands-on scenes, and along a trajectory."""


@dataclass(frozen=True)
class Plan:
    """What differs from run to run; every combination is a cell, with a run a seed.

    Attributes
    ----------
    enforcements, guards, robots : names; no enforcements for all that there are, None for the scene's robot.
    solvers, coordinations : of scenes that follow a trajectory, and of several arms; empty for the scene's.
    seeds : so many.
    """

    enforcements: Sequence[str] = ()
    guards: Sequence[str] = ("watch",)
    robots: Sequence[str | None] = (None,)
    solvers: Sequence[str] = ()
    coordinations: Sequence[str] = ()
    seeds: int = 1

    def __post_init__(self) -> None:
        if self.seeds < 1:
            raise InputError(f"seeds: expected at least 1, got {self.seeds}")
        for what, names in (
            ("enforcement", self.enforcements),
            ("robot", self.robots),
            ("guard", self.guards),
            ("solver", self.solvers),
            ("coordination", self.coordinations),
        ):
            if len(set(names)) != len(names):
                raise InputError(f"{what}: expected different names, got {', '.join(map(str, names))}")


def prepare_comparison(name: str, plan: Plan, choices: Choices) -> list[Job]:
    """A job for each arm, variant and seed; everything is checked before the first one runs.

    Every cell of an arm has the same scene, anatomy, hand and seeds. With `choices.out` every run leaves its trace.
    Errors are those of the jobs.

    Raises
    ------
    InputError : a choice that this kind of scene does not have. UnknownNameError : no such name.
    """
    jobs: list[Job] = []
    for robot in plan.robots:
        scene = load_any(name, robot)
        kind = _kind(scene)
        enforcements = _check(plan, scene, kind)
        if choices.hand is not None:
            scene = with_hand(scene, choices.hand)
        if plan.seeds > 1:
            scene = _trembling(scene)
        first: Job | None = None
        for coordination, solver, enforcement, guard in product(
            plan.coordinations or (None,), plan.solvers or (choices.solver,), enforcements, plan.guards
        ):
            variant: dict[str, Any] = {
                "enforcement": enforcement,
                "guard": guard,
                "solver": solver,
                "coordination": coordination,
            }
            job = _job(scene, replace(choices, robot=robot, out=None, **variant), first)
            first = first or job
            jobs += [_again(job, kind, job.scene.seed + i, choices.out) for i in range(plan.seeds)]
    return jobs


def _again(job: Job, kind: str, seed: int, out: Path | None) -> Job:
    """The same run with another seed, with a file of its own in a folder."""
    if out is None:
        return job.again(seed, None)
    scene = job.scene
    names = {"kind": kind, "scene": scene.name, "robot": scene.robot, "plant": scene.plant, "seed": seed}
    names |= {"enforcement": scene.in_force.method, "guard": scene.in_force.guard}
    if isinstance(job, TrajectoryJob):
        names |= {"solver": job.solver, "coordination": job.scene.coordination if job.scene.arms else None}
    return job.again(seed, out / trace_file(names))


def _kind(scene: Scene | HandsOnScene) -> str:
    if isinstance(scene, HandsOnScene):
        return kinds.HANDS_ON
    return kinds.TRAJECTORY if scene.hand is None else kinds.BY_HAND


def _job(scene: Scene | HandsOnScene, choices: Choices, like: Job | None) -> Job:
    """The job of a cell, checked; like: one of the same scene, whose anatomy is taken over."""
    if isinstance(scene, HandsOnScene):
        return hands_on_job(scene, choices, like if isinstance(like, HandsOnJob) else None)
    fitting = fit(scene, choices.robot)
    return trajectory_job(fitting, choices) if scene.hand is None else by_hand_job(fitting, choices)


def _trembling(scene: Scene | HandsOnScene) -> Scene | HandsOnScene:
    """The scene with a hand that trembles."""
    if isinstance(scene, HandsOnScene):
        return scene if scene.hand.tremor else scene.with_changes(hand=replace(scene.hand, tremor=TREMOR))
    if scene.hand is None or scene.hand.tremor:
        return scene
    return scene.with_changes(hand=replace(scene.hand, tremor=TREMOR_ALONG))


def run_comparison(jobs: Sequence[Job], progress: Callable[[str, float], None] | None = None) -> list[dict[str, Any]]:
    """The figures of every run, in the order of the jobs; progress is told the run's label and the share of all."""
    results = []
    for i, job in enumerate(jobs):
        if progress is not None:
            progress(job.label, i / len(jobs))
        results.append(job.summary(job.run(None)))
    return results


def _check(plan: Plan, scene: Scene | HandsOnScene, kind: str) -> Sequence[str]:
    """Refuse what this kind of scene does not have; the enforcements to compare."""
    if plan.solvers and kind != kinds.TRAJECTORY:
        raise InputError(
            f'--solver: it is for scenes that follow a trajectory by themselves, and "{scene.name}" is none'
        )
    if plan.coordinations and not (isinstance(scene, Scene) and scene.arms):
        raise InputError(f'--coordination: it is for scenes with several arms, and "{scene.name}" is none')
    if plan.seeds > 1 and kind == kinds.TRAJECTORY:
        raise InputError(
            f'--seeds: nothing in "{scene.name}" is random, each run repeats to the bit; leave it out, or compare a '
            "scene that a hand leads"
        )
    names = ALONG if kind == kinds.TRAJECTORY else METHODS
    for name in plan.enforcements:
        if known("enforcement", name, METHODS) not in names:
            by_hand = f"{scene.name}-hand"
            way = f"take {by_hand}" if by_hand in scene_names() else "give it the keys hand and admittance"
            raise InputError(
                f'enforcement "{name}": "{scene.name}" has {", ".join(names)}; an admittance yields to a hand, so a '
                f"hand has to lead the tool: {way}"
            )
    return plan.enforcements or names
