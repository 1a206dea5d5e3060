"""One run by hand, as a job of a session."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from scenarios.analysis.trace import Trace
from scenarios.by_hand.enforcement import INTEGRATOR
from scenarios.by_hand.run import build, run_by_hand
from scenarios.jobs import Choices, Progress
from scenarios.scene import Scene


@dataclass(frozen=True)
class ByHandJob:
    """A run of a scene by hand: the arguments of `scenarios.by_hand.run.run_by_hand`."""

    scene: Scene
    enforcement: str
    period: float | None
    guard: str | None
    seed: int
    integrator: str
    file: Path | None

    @property
    def label(self) -> str:
        """See `Job`."""
        return f"{self.scene.name} {self.enforcement}"

    def again(self, seed: int, file: Path | None) -> Self:
        """See `Job`."""
        return replace(self, seed=seed, file=file)

    def run(self, progress: Progress) -> Trace:
        """See `Job`."""
        return run_by_hand(
            self.scene,
            enforcement=self.enforcement,
            period=self.period,
            guard=self.guard,
            seed=self.seed,
            integrator=self.integrator,
            out=self.file,
            progress=progress,
        )

    def summary(self, trace: Trace) -> dict[str, Any]:
        """See `Job`."""
        from scenarios.analysis.kept import kept_summary
        from scenarios.by_hand.metrics import summary

        return summary(trace) | kept_summary(trace, self.scene)

    def draw(self, trace: Trace, folder: Path) -> list[Path]:
        """Nothing alone: the figures of the VFI paper show several runs together."""
        return []


def by_hand_job(scene: Scene, choices: Choices) -> ByHandJob:
    """The job of a scene as the command line changes it, checked; raises what is wrong with it."""
    enforcement, guard = choices.enforcement or "vfi", choices.guard
    integrator = choices.integrator or INTEGRATOR
    build(scene, enforcement=enforcement, period=choices.period, guard=guard, seed=choices.seed, integrator=integrator)
    suffix = "" if enforcement == "vfi" else f"-{enforcement}"
    file = choices.out / f"{scene.name}{suffix}.mcap" if choices.out is not None else None
    return ByHandJob(scene, enforcement, choices.period, guard, choices.seed, integrator, file)
