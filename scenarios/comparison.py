"""One scene under several enforcements, on several arms, for several seeds: what each did under the same conditions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from primitives.checks import known
from primitives.errors import InputError
from scenarios.analysis import kinds
from scenarios.analysis.comparison_folder import trace_file
from scenarios.by_hand.job import by_hand_job
from scenarios.by_hand.run import ENFORCEMENTS as BY_HAND
from scenarios.hands_on.enforcement import ENFORCEMENTS as HANDS_ON
from scenarios.hands_on.job import HandsOnJob, hands_on_job
from scenarios.hands_on.scene import HandsOnScene
from scenarios.jobs import Choices, Job
from scenarios.run import ENFORCEMENTS as TRAJECTORY
from scenarios.run import build
from scenarios.scene import Scene
from scenarios.scene_file import load_any
from scenarios.scenes import scene_names
from scenarios.session import TrajectoryJob, fit

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
        scene, chosen = load_any(name, robot), replace(choices, robot=robot)
        if isinstance(scene, HandsOnScene):
            _refuse(scene.name, solver=plan.solvers, coordination=plan.coordinations)
            jobs += _hands_on(scene, plan, chosen)
        elif scene.hand is not None:
            _refuse(scene.name, solver=plan.solvers, coordination=plan.coordinations)
            jobs += _by_hand(fit(scene, robot), plan, chosen)
        else:
            jobs += _trajectory(fit(scene, robot), plan, chosen)
    return jobs


def run_comparison(jobs: Sequence[Job], progress: Callable[[str, float], None] | None = None) -> list[dict[str, Any]]:
    """The figures of every run, in the order of the jobs; progress is told the run's label and the share of all."""
    results = []
    for i, job in enumerate(jobs):
        if progress is not None:
            progress(job.label, i / len(jobs))
        results.append(job.summary(job.run(None)))
    return results


def _refuse(scene: str, **given: Sequence[str]) -> None:
    for what, names in given.items():
        if names:
            fit = "scenes that follow a trajectory by themselves" if what == "solver" else "scenes with several arms"
            raise InputError(f'--{what}: it is for {fit}, and "{scene}" is none; see `vfi list`')


def _enforcements(plan: Plan, scene: Scene | HandsOnScene, names: Sequence[str]) -> Sequence[str]:
    """Those of the plan, all of which this kind of scene must have."""
    for name in plan.enforcements:
        if name not in names and name in kinds.EVERY_ENFORCEMENT:
            by_hand = f"{scene.name}-hand"
            way = f"take {by_hand}" if by_hand in scene_names() else "give it the keys hand and admittance"
            raise InputError(
                f'enforcement "{name}": "{scene.name}" has {", ".join(names)}; an admittance yields to a hand, so a '
                f"hand has to lead the tool: {way}"
            )
        known("enforcement", name, names)
    return plan.enforcements or names


def _file(out: Path | None, seed: int, names: Mapping[str, Any]) -> Path | None:
    return None if out is None else out / trace_file({**names, "seed": seed})


def _hands_on(scene: HandsOnScene, plan: Plan, choices: Choices) -> list[HandsOnJob]:
    if plan.seeds > 1 and scene.hand.tremor == 0.0:
        scene = scene.with_changes(hand=replace(scene.hand, tremor=TREMOR))
    jobs: list[HandsOnJob] = []
    for enforcement in _enforcements(plan, scene, HANDS_ON):
        chosen = replace(choices, enforcement=enforcement, guard=None, out=None)
        job = hands_on_job(scene, chosen, jobs[0] if jobs else None)
        for guard in plan.guards:
            guarded = job.with_changes(guard=guard)
            guarded.check()
            names = {"kind": kinds.HANDS_ON, "scene": scene.name, "robot": scene.robot, "plant": job.plant}
            names |= {"enforcement": enforcement, "guard": guard}
            for seed in range(choices.seed, choices.seed + plan.seeds):
                jobs.append(guarded.with_changes(seed=seed, file=_file(choices.out, seed, names)))
    return jobs


def _by_hand(scene: Scene, plan: Plan, choices: Choices) -> list[Job]:
    if plan.seeds > 1 and scene.hand is not None and scene.hand.tremor == 0.0:
        scene = scene.with_changes(hand=replace(scene.hand, tremor=TREMOR_ALONG))
    jobs: list[Job] = []
    for enforcement in _enforcements(plan, scene, BY_HAND):
        for guard in plan.guards:
            job = by_hand_job(scene, replace(choices, enforcement=enforcement, guard=guard, out=None))
            names = {"kind": kinds.BY_HAND, "scene": scene.name, "robot": scene.robot}
            names |= {"enforcement": enforcement, "guard": guard}
            for seed in range(choices.seed, choices.seed + plan.seeds):
                jobs.append(replace(job, seed=seed, file=_file(choices.out, seed, names)))
    return jobs


def _trajectory(scene: Scene, plan: Plan, choices: Choices) -> list[Job]:
    if plan.seeds > 1:
        raise InputError(
            f'--seeds: nothing in "{scene.name}" is random, each run repeats to the bit; leave it out, or compare a '
            "scene that a hand leads"
        )
    if not scene.arms:
        _refuse(scene.name, coordination=plan.coordinations)
    jobs: list[Job] = []
    enforcements = _enforcements(plan, scene, TRAJECTORY)
    for coordination in plan.coordinations or (scene.coordination,):
        coordinated = scene.with_changes(coordination=coordination)
        for solver in plan.solvers or (choices.solver,):
            for enforcement in enforcements:
                for guard in plan.guards:
                    options: dict[str, Any] = {
                        "solver": solver,
                        "period": choices.period,
                        "guard": guard,
                        "enforcement": enforcement,
                    }
                    build(coordinated, **options)
                    names = {"kind": kinds.TRAJECTORY, "scene": scene.name, "robot": scene.robot, **options}
                    names["coordination"] = coordination if scene.arms else None
                    file = _file(choices.out, choices.seed, names)
                    jobs.append(TrajectoryJob(coordinated, {**options, "seed": choices.seed, "out": file}))
    return jobs
