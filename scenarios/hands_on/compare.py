"""One scene under several enforcements, on several arms, for several seeds: what each did under the same conditions."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from primitives.errors import InputError
from scenarios.analysis.comparison_folder import trace_file
from scenarios.enforcement import chosen
from scenarios.hands_on.job import HandsOnJob, hands_on_job
from scenarios.hands_on.scene import HandsOnScene
from scenarios.jobs import Choices
from scenarios.scene_file import load_any

TREMOR = 0.5
"""N rms of the hand's tremor where several seeds are compared and the hand has none: else all runs would be alike."""


def prepare_comparison(
    name: str,
    enforcements: Sequence[str],
    robots: Sequence[str | None],
    seeds: int,
    choices: Choices,
    guards: Sequence[str] = ("watch",),
) -> list[HandsOnJob]:
    """A job for each arm, enforcement, guard and seed; everything is checked before the first one runs.

    Every cell of an arm has the same scene, anatomy, hand and seeds. With `choices.out` every run leaves its trace.
    Errors are those of `hands_on_job`.

    Raises
    ------
    InputError : the scene follows a trajectory, no seeds, or a cell that is named twice.
    UnknownNameError : no such guard.
    """
    if seeds < 1:
        raise InputError(f"seeds: expected at least 1, got {seeds}")
    for what, named in (("enforcement", enforcements), ("robot", robots), ("guard", guards)):
        if len(set(named)) != len(named) or not named:
            raise InputError(f"{what}: expected different names, got {', '.join(map(str, named)) or 'none'}")
    jobs: list[HandsOnJob] = []
    for robot in robots:
        scene = load_any(name, robot)
        if not isinstance(scene, HandsOnScene):
            raise InputError(f'scene "{scene.name}" follows a trajectory; compare takes scenes that a hand leads')
        if seeds > 1 and scene.hand.tremor == 0.0:
            scene = scene.with_changes(hand=replace(scene.hand, tremor=TREMOR))
        first: HandsOnJob | None = None
        for enforcement in enforcements:
            job = hands_on_job(
                scene, replace(choices, robot=robot, enforcement=enforcement, guard=None, out=None), first
            )
            first = first or job
            for guard in guards:
                guarded = job.of(chosen(job.scene, guard=guard), None)
                guarded.check()
                jobs += [_seeded(guarded, guarded.scene.seed + i, choices.out) for i in range(seeds)]
    return jobs


def _seeded(job: HandsOnJob, seed: int, out: Path | None) -> HandsOnJob:
    scene = job.scene.with_changes(seed=seed)
    names = {"scene": scene.name, "robot": scene.robot, "seed": seed, "plant": scene.plant}
    names |= {"enforcement": scene.in_force.method, "guard": scene.in_force.guard}
    return job.of(scene, None if out is None else out / trace_file(names))


def run_comparison(
    jobs: Sequence[HandsOnJob], progress: Callable[[str, float], None] | None = None
) -> list[dict[str, Any]]:
    """The figures of every run, in the order of the jobs; progress is told the run's label and the share of all."""
    results = []
    for i, job in enumerate(jobs):
        if progress is not None:
            progress(job.label, i / len(jobs))
        results.append(job.summary(job.run(None)))
    return results
