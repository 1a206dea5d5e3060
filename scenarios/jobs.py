"""What one run of a session is, and what the command line says beside the scenes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

from scenarios.analysis.trace import Trace
from scenarios.enforcement import S, chosen

Progress = Callable[[float], None] | None


@dataclass(frozen=True)
class Choices:
    """What the command line says beside the scenes; None where the scene decides.

    Attributes
    ----------
    coordination : of scenes with several arms, see `scenarios.coordination`; names with commas: each in turn.
    solver : of scenes that follow a trajectory.
    enforcement, guard, metric : see `scenarios.enforcement.Enforcement`. plant, seed : see `Scene`.
    period : T, seconds. robot : another robot than the scene's. out : folder of traces.
    hand : a file with another hand than the scene's, see `scenarios.hand_file`.
    integrator, form : of hands-on scenes. organ, vessels, unit : files in the place of their anatomy.
        fill_gaps : of files of points, instead of refusing them.
    """

    solver: str = "active-set"
    coordination: str | None = None
    period: float | None = None
    guard: str | None = None
    seed: int | None = None
    robot: str | None = None
    out: Path | None = None
    hand: Path | None = None
    plant: str | None = None
    enforcement: str | None = None
    metric: str | None = None
    integrator: str | None = None
    form: str | None = None
    organ: Path | None = None
    vessels: Path | None = None
    unit: str = "m"
    fill_gaps: bool = False

    def applied_to(self, scene: S) -> S:
        """The scene with the enforcement, the plant, the seed and the period that are chosen; raises InputError."""
        how = {name: getattr(self, name) for name in ("enforcement", "guard", "metric", "plant", "seed", "period")}
        return chosen(scene, **how)


class Job(Protocol):
    """One run that has been checked."""

    @property
    def scene(self) -> Any:
        """What is run."""

    @property
    def label(self) -> str:
        """What the run is called while it goes on."""

    @property
    def file(self) -> Path | None:
        """Where its trace goes."""

    def again(self, seed: int, file: Path | None) -> Self:
        """The same run with another seed, to another file."""

    def run(self, progress: Progress) -> Trace:
        """Do it."""

    def summary(self, trace: Trace) -> dict[str, Any]:
        """Its figures of merit."""

    def draw(self, trace: Trace, folder: Path) -> list[Path]:
        """Draw the figures that it has of its own; the files written."""
