"""One run of a hands-on scene, as a job of a session."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from primitives.elements import Cloud
from primitives.errors import InputError
from primitives.point_cloud import Gaps
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import FILES, AnatomySource, Part, build_parts
from scenarios.enforcement import chosen
from scenarios.hands_on.enforcement import enforce
from scenarios.hands_on.plant import plant_of
from scenarios.hands_on.run import run_hands_on
from scenarios.hands_on.scene import HandsOnScene
from scenarios.jobs import Choices, Progress
from scenarios.robots import robots


@dataclass(frozen=True)
class HandsOnJob:
    """A run of a hands-on scene."""

    scene: HandsOnScene
    file: Path | None

    @property
    def label(self) -> str:
        """See `Job`."""
        return f"{self.scene.name} {self.scene.robot} {self.scene.plant} {self.scene.in_force.method}"

    @cached_property
    def parts(self) -> Mapping[str, Part]:
        """The anatomy, built once."""
        return build_parts(self.scene.anatomy, self.scene.port)

    def of(self, scene: HandsOnScene, file: Path | None) -> "HandsOnJob":
        """A run of a scene in the same anatomy, which is not built again."""
        other = HandsOnJob(scene, file)
        other.__dict__["parts"] = self.parts
        return other

    def again(self, seed: int, file: Path | None) -> "HandsOnJob":
        """See `Job`."""
        return self.of(self.scene.with_changes(seed=seed), file)

    def check(self) -> None:
        """Build everything that the run will need; raises where something does not fit."""
        robot = self.scene.build_robot()
        enforce(self.scene, robot, self.parts)
        plant_of(self.scene, robot, {name: part.cloud for name, part in self.parts.items()})

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        return run_hands_on(self.scene, out=self.file, progress=progress, parts=self.parts)

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
    scene = chosen(choices.applied_to(scene), integrator=choices.integrator, form=choices.form)
    if choices.organ or choices.vessels:
        anatomy = _from_files(scene, choices)
        for name in (c.second.name for c in scene.constraints if isinstance(c.second, Cloud)):
            if name not in anatomy.parts:
                way = f"give --{name} too" if name in ("organ", "vessels") else "files have an organ and vessels only"
                raise InputError(f'scene "{scene.name}" is about its part "{name}", not among the files; {way}')
        scene = scene.with_changes(anatomy=anatomy, hand=scene.hand_on_files or scene.hand)
    named = (choices.enforcement, "admittance"), (choices.guard, None), (choices.metric, "free")
    suffix = "".join(f"-{value}" for value, usual in named if value not in (None, usual))
    stem = f"{scene.name}-{scene.robot}-{scene.plant}{suffix}"
    file = choices.out / f"{stem}.mcap" if choices.out is not None else None
    job = HandsOnJob(scene, file) if like is None else like.of(scene, file)
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
