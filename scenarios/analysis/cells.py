"""The runs of a comparison, gathered: what each arm, enforcement and guard did, and which was better at what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scenarios.analysis.measures import MEASURES, Measure
from scenarios.analysis.statistics import Interval, median_interval, paired_interval

Result = Mapping[str, Any]
WORST = {"clearance_m.between_samples": min, "port_error_m.max": max, "passivity_excess_J": max}
"""Figures of which the worst run counts, not the median."""
GUARDED = {"off": "guard off", "watch": "guard watches", "act": "guard acts"}
"""What the guard does, in words."""
TRIFLE = 1e-9
"""Differences below this, in the measure's SI unit, are rounding: no merit."""


@dataclass(frozen=True)
class Cell:
    """The runs of one arm under one enforcement and guard, in the order of their seeds.

    Attributes
    ----------
    name : what tells the cell from others of its arm: the enforcement, and the guard where there are several.
    better : keys of the measures at which every other cell of the arm did worse; see `gather`.
    """

    robot: str
    enforcement: str
    guard: str
    runs: tuple[Result, ...]
    name: str
    better: frozenset[str] = frozenset()

    @property
    def bounded(self) -> bool:
        """Whether anything keeps the tool out: without an enforcement, a guard that acts does."""
        return self.enforcement != "none" or self.guard == "act"

    @property
    def slipped(self) -> int:
        """Runs that slipped off the region."""
        return sum(bool(r["slipped"]) for r in self.runs)

    @property
    def entered(self) -> int:
        """Runs that entered it."""
        return sum(r["penetration_depth_m"] > 0.0 for r in self.runs)

    def values(self, measure: Measure) -> list[float]:
        """One value a run; empty where some run has none."""
        found = [measure.of(r) for r in self.runs]
        known = [v for v in found if v is not None]
        return known if len(known) == len(found) else []

    def interval(self, measure: Measure) -> Interval | None:
        """Median and interval over the runs."""
        values = self.values(measure)
        return median_interval(values) if values else None

    def worst(self, measure: Measure) -> float | None:
        """The worst run's value, of the measures in `WORST`."""
        values = self.values(measure)
        return WORST[measure.key](values) if values and measure.key in WORST else None

    def competes(self, measure: Measure) -> bool:
        """Whether it has a boundary, values, and where they are of effort, no run that slipped off."""
        return self.bounded and not (measure.effort and self.slipped) and bool(self.values(measure))


def difference(measure: Measure, first: Cell, second: Cell) -> Interval | None:
    """First less second, run by run with the same seed; None where they cannot be compared."""
    seeds = [[r["seed"] for r in cell.runs] for cell in (first, second)]
    if seeds[0] != seeds[1] or not (first.competes(measure) and second.competes(measure)):
        return None
    return paired_interval(first.values(measure), second.values(measure))


def _beats(measure: Measure, first: Cell, second: Cell) -> bool:
    found = difference(measure, first, second)
    if found is None or not found.excludes_zero or abs(found.median) < TRIFLE:
        return False
    return (found.median < 0.0) == (measure.better == "low")


def gather(results: Sequence[Result]) -> list[Cell]:
    """One cell for each arm, enforcement and guard, in the order of the runs.

    A cell is better at a measure where each other cell of its arm that can be compared did worse with the same seeds:
    the 95 % interval of the median of the paired differences excludes zero, for every one of them.
    """
    groups: dict[tuple[str, str, str], list[Result]] = {}
    for r in results:
        groups.setdefault((r["robot"], r["enforcement"], r["guard"]), []).append(r)
    alone = len({guard for _, _, guard in groups}) == 1
    plain = []
    for (robot, enforcement, guard), runs in groups.items():
        name = enforcement if alone else f"{enforcement}, {GUARDED[guard]}"
        plain.append(Cell(robot, enforcement, guard, tuple(sorted(runs, key=lambda r: int(r["seed"]))), name))
    return [replace(cell, better=_merits(cell, plain)) for cell in plain]


def _merits(cell: Cell, cells: Sequence[Cell]) -> frozenset[str]:
    out = set()
    for measure in MEASURES:
        others = [c for c in cells if c is not cell and c.robot == cell.robot and c.competes(measure)]
        if measure.better and others and all(_beats(measure, cell, other) for other in others):
            out.add(measure.key)
    return frozenset(out)
