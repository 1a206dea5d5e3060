"""One run by hand, as a job of a session."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, build_parts
from scenarios.by_hand.enforcement import INTEGRATOR
from scenarios.by_hand.run import build, run_by_hand
from scenarios.jobs import Choices, Progress
from scenarios.scene import Scene


@dataclass(frozen=True)
class ByHandJob:
    """A run of a scene by hand."""

    scene: Scene
    integrator: str
    file: Path | None

    @property
    def label(self) -> str:
        """See `Job`."""
        return f"{self.scene.name} {self.scene.in_force.method}"

    @cached_property
    def parts(self) -> Mapping[str, Part]:
        """The anatomy, built once."""
        return build_parts(self.scene.anatomy)

    def again(self, seed: int, file: Path | None) -> Self:
        """See `Job`."""
        other = replace(self, scene=self.scene.with_changes(seed=seed), file=file)
        other.__dict__["parts"] = self.parts
        return other

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        return run_by_hand(self.scene, integrator=self.integrator, out=self.file, progress=progress, parts=self.parts)

    def summary(self, trace: Trace) -> dict[str, Any]:
        """See `Job`."""
        from scenarios.analysis.kept import kept_summary
        from scenarios.by_hand.metrics import summary

        return summary(trace) | kept_summary(trace, self.scene, self.parts)

    def draw(self, trace: Trace, folder: Path) -> list[Path]:
        """Nothing alone: the figures of the VFI paper show several runs together."""
        return []


def by_hand_job(scene: Scene, choices: Choices) -> ByHandJob:
    """The job of a scene as the command line changes it, checked; raises what is wrong with it."""
    scene = choices.applied_to(scene)
    suffix = f"-{choices.enforcement}" if choices.enforcement not in (None, "vfi") else ""
    file = choices.out / f"{scene.name}{suffix}.mcap" if choices.out is not None else None
    job = ByHandJob(scene, choices.integrator or INTEGRATOR, file)
    build(scene, job.parts, job.integrator)
    return job
