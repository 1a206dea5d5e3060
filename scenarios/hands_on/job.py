"""One run of a hands-on scene, as a job of a session."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from primitives.elements import Cloud
from primitives.errors import InputError
from primitives.point_cloud import Gaps
from scenarios.analysis.trace import Trace
from scenarios.hands_on.enforcement import enforce
from scenarios.hands_on.parts import FILES, AnatomySource, Part, build_parts
from scenarios.hands_on.plant import build_plant
from scenarios.hands_on.run import run_hands_on
from scenarios.hands_on.scene import HandsOnScene
from scenarios.jobs import Choices, Progress
from scenarios.robots import robots


@dataclass(frozen=True)
class HandsOnJob:
    """A run of a hands-on scene."""

    scene: HandsOnScene
    plant: str
    enforcement: str
    seed: int
    file: Path | None
    guard: str | None = None
    metric: str = "free"
    """Both: see `scenarios.hands_on.enforcement.enforce`."""

    @property
    def label(self) -> str:
        """See `Job`."""
        return f"{self.scene.name} {self.scene.robot} {self.plant} {self.enforcement}"

    @cached_property
    def parts(self) -> Mapping[str, Part]:
        """The anatomy, built once."""
        return build_parts(self.scene.anatomy, np.array(self.scene.port))

    def again(self, seed: int, file: Path | None) -> Self:
        """See `Job`; the anatomy is not built again."""
        other = replace(self, seed=seed, file=file)
        other.__dict__["parts"] = self.parts
        return other

    def check(self) -> None:
        """Build everything that the run will need; raises where something does not fit."""
        robot = self.scene.build_robot()
        enforce(self.enforcement, self.scene, robot, self.parts, guard=self.guard, metric=self.metric)
        clouds = {name: part.cloud for name, part in self.parts.items()}
        build_plant(self.plant, self.scene, robot, clouds, self.seed)

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        return run_hands_on(
            self.scene,
            plant=self.plant,
            enforcement=self.enforcement,
            guard=self.guard,
            metric=self.metric,
            seed=self.seed,
            out=self.file,
            progress=progress,
            parts=self.parts,
        )

    def summary(self, trace: Trace) -> dict[str, Any]:
        """See `Job`."""
        from scenarios.analysis.hands_on_metrics import summary as hands_on_summary

        return hands_on_summary(trace, self.scene, self.parts)

    def draw(self, trace: Trace, folder: Path) -> list[Path]:
        """See `Job`: figures 7 to 11 of the admittance paper."""
        from scenarios.analysis.hands_on_figures import draw_hands_on

        return draw_hands_on(trace, self.scene, self.parts, folder)


def hands_on_job(scene: HandsOnScene, choices: Choices, like: HandsOnJob | None = None) -> HandsOnJob:
    """The job of a scene as the command line changes it, checked; raises what is wrong with it.

    like : a job of the same scene and anatomy, whose parts are taken over instead of being built again.
    """
    if choices.robot not in (None, scene.robot):
        robots[choices.robot or ""]
        raise InputError(
            f'scene "{scene.name}" has no variant for robot "{choices.robot}"; it is for "{scene.robot}". '
            "Write one: a copy of its file with start, port and anatomy that suit the arm"
        )
    changes = {name: getattr(choices, name) for name in ("period", "integrator", "form")}
    scene = scene.with_changes(**{name: value for name, value in changes.items() if value is not None})
    if choices.organ or choices.vessels:
        anatomy = _from_files(scene, choices)
        for name in (c.second.name for c in scene.constraints if isinstance(c.second, Cloud)):
            if name not in anatomy.parts:
                way = f"give --{name} too" if name in ("organ", "vessels") else "files have an organ and vessels only"
                raise InputError(f'scene "{scene.name}" is about its part "{name}", not among the files; {way}')
        scene = scene.with_changes(anatomy=anatomy, hand=scene.hand_on_files or scene.hand)
    enforcement = choices.enforcement or "admittance"
    chosen = (enforcement, "admittance"), (choices.guard, None), (choices.metric, "free")
    suffix = "".join(f"-{value}" for value, default in chosen if value != default)
    stem = f"{scene.name}-{scene.robot}-{choices.plant}{suffix}"
    file = choices.out / f"{stem}.mcap" if choices.out is not None else None
    job = HandsOnJob(scene, choices.plant, enforcement, choices.seed, file, choices.guard, choices.metric)
    if like is not None:
        job.__dict__["parts"] = like.parts
    job.check()
    return job


def _from_files(scene: HandsOnScene, choices: Choices) -> AnatomySource:
    anatomy = scene.anatomy
    if anatomy is None:
        raise InputError(f'scene "{scene.name}" has no anatomy that files could replace')
    organ, vessels = (str(path.absolute()) if path else "" for path in (choices.organ, choices.vessels))
    gaps: Gaps = "fill" if choices.fill_gaps else anatomy.gaps
    thickest = max(anatomy.cover.values())
    cover = {name: anatomy.cover.get(name, thickest) for name in ("organ", "vessels")}
    return replace(anatomy, kind=FILES, cover=cover, unit=choices.unit, organ=organ, vessels=vessels, gaps=gaps)
