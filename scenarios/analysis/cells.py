"""The runs of a comparison, gathered: what each arm and variant did, and which was better at what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scenarios.analysis.kinds import BY_HAND, HANDS_ON, TRAJECTORY
from scenarios.analysis.measures import Measure, measures
from scenarios.analysis.statistics import Interval, median_interval, paired_interval

Result = Mapping[str, Any]
VARIANT = {
    TRAJECTORY: ("enforcement", "guard", "solver", "coordination"),
    BY_HAND: ("enforcement", "guard"),
    HANDS_ON: ("enforcement", "guard"),
}
"""What the cells of an arm may differ in, as the summaries of their runs call it, by the kind of scene."""
GUARDED = {"off": "guard off", "watch": "guard watches", "act": "guard acts"}
"""What the guard does, in words."""
TRIFLE = 1e-9
"""Differences below this, in the measure's SI unit, are rounding: no merit."""


@dataclass(frozen=True)
class Cell:
    """The runs of one arm under one variant, in the order of their seeds.

    Attributes
    ----------
    variant : {what: which} of `VARIANT`.
    name : what tells the cell from others of its arm: the parts of the variant that differ among the cells.
    measures : that are shown of it.
    better : keys of the measures at which every other cell of the arm did worse; see `gather`.
    """

    robot: str
    variant: Mapping[str, str]
    runs: tuple[Result, ...]
    name: str
    measures: tuple[Measure, ...]
    better: frozenset[str] = frozenset()

    @property
    def kind(self) -> str:
        """Of its scene, see `scenarios.analysis.kinds`."""
        return str(self.runs[0]["kind"])

    @property
    def enforcement(self) -> str:
        """Who keeps the constraints."""
        return self.variant["enforcement"]

    @property
    def guard(self) -> str:
        """What the guard does."""
        return self.variant["guard"]

    @property
    def bounded(self) -> bool:
        """Whether anything keeps the constraints; in hands-on scenes a guard that acts does, whatever enforces."""
        return self.enforcement != "none" or (self.guard == "act" and self.kind == HANDS_ON)

    @property
    def slipped(self) -> int:
        """Runs that slipped off the region; along a trajectory there is none to slip off."""
        return sum(bool(r.get("slipped", False)) for r in self.runs)

    @property
    def entered(self) -> int:
        """Runs that entered the region, or that violated a constraint which they were to keep."""
        if self.kind == HANDS_ON:
            return sum(r["penetration_depth_m"] > 0.0 for r in self.runs)
        return sum(not set(r["violated"]).isdisjoint(r["to_keep"]) for r in self.runs)

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
        """The worst run's value, of the measures of which it counts."""
        values = self.values(measure)
        return _EXTREME[measure.worst](values) if values and measure.worst else None

    def competes(self, measure: Measure) -> bool:
        """Whether it has a boundary, values, and where they are of effort, no run that slipped off."""
        return self.bounded and not (measure.effort and self.slipped) and bool(self.values(measure))


_EXTREME = {"low": min, "high": max}


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
    """One cell for each arm and variant, in the order of the runs.

    A cell is better at a measure where each other cell of its arm that can be compared did worse with the same seeds:
    the 95 % interval of the median of the paired differences excludes zero, for every one of them.
    """
    groups: dict[tuple[str, ...], list[Result]] = {}
    varied = VARIANT[results[0]["kind"]]
    for r in results:
        groups.setdefault((r["robot"], *(str(r.get(what, "")) for what in varied)), []).append(r)
    differ = [i for i in range(len(varied)) if len({key[i + 1] for key in groups}) > 1]
    plain = []
    for (robot, *variant), runs in groups.items():
        name = ", ".join(GUARDED.get(variant[i], variant[i]) for i in differ) or variant[0]
        parts = dict(zip(varied, variant, strict=True))
        ordered = tuple(sorted(runs, key=lambda r: int(r["seed"])))
        plain.append(Cell(robot, parts, ordered, name, measures(ordered)))
    return [replace(cell, better=_merits(cell, plain)) for cell in plain]


def _merits(cell: Cell, cells: Sequence[Cell]) -> frozenset[str]:
    out = set()
    for measure in cell.measures:
        others = [c for c in cells if c is not cell and c.robot == cell.robot and c.competes(measure)]
        if measure.better and others and all(_beats(measure, cell, other) for other in others):
            out.add(measure.key)
    return frozenset(out)
