"""One scene under several enforcements, on several arms, for several seeds: what each did under the same conditions."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import median
from typing import Any

from primitives.errors import InputError
from scenarios.hands_on.job import HandsOnJob, hands_on_job
from scenarios.hands_on.scene import HandsOnScene
from scenarios.jobs import Choices
from scenarios.scene_file import load_any

TREMOR = 0.5
"""N rms of the hand's tremor where several seeds are compared and the hand has none: else all runs would be alike."""


def prepare_comparison(
    name: str, enforcements: Sequence[str], robots: Sequence[str | None], seeds: int, choices: Choices
) -> list[HandsOnJob]:
    """A job for each arm, enforcement and seed; everything is checked before the first one runs.

    Every cell of an arm has the same scene, anatomy, hand and seeds. Errors are those of `hands_on_job`.

    Raises
    ------
    InputError : the scene follows a trajectory, no seeds, or a cell that is named twice.
    """
    if seeds < 1:
        raise InputError(f"seeds: expected at least 1, got {seeds}")
    for what, named in (("enforcement", enforcements), ("robot", robots)):
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
            job = hands_on_job(scene, replace(choices, robot=robot, enforcement=enforcement, out=None), first)
            first = first or job
            jobs += [job.with_seed(choices.seed + i) for i in range(seeds)]
    return jobs


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


def cells(results: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row for each arm and enforcement, in the order of the runs: the worst over the seeds, or the median.

    Keys: robot, enforcement, runs; clearance_m, port_error_m and passivity_excess_J, the worst of all runs; entered and
    slipped, how many runs did; hand_work_J, mean_force_N, max_force_N, travel_m and contact_fraction, medians.
    """
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for r in results:
        groups.setdefault((r["robot"], r["enforcement"]), []).append(r)
    rows = []
    for (robot, enforcement), runs in groups.items():
        nearest = [r["clearance_m"]["between_samples"] for r in runs]
        rows.append(
            {
                "robot": robot,
                "enforcement": enforcement,
                "runs": len(runs),
                "clearance_m": min(nearest),
                "entered": sum(c < 0.0 for c in nearest),
                "port_error_m": max(r["port_error_m"]["max"] for r in runs),
                "passivity_excess_J": max(r["passivity_excess_J"] for r in runs),
                "slipped": sum(r["slipped"] for r in runs),
                **{
                    key: median(r[key] for r in runs)
                    for key in ("hand_work_J", "mean_force_N", "max_force_N", "travel_m", "contact_fraction")
                },
            }
        )
    return rows
