"""The tables of a report, as text that is ready to be shown."""

from collections.abc import Sequence
from typing import NamedTuple

from scenarios.analysis.cells import Cell, difference
from scenarios.analysis.kinds import HANDS_ON
from scenarios.analysis.measures import Measure
from scenarios.analysis.statistics import Interval

NOUGHT = 1e-15
"""What is smaller is rounding."""


class Entry(NamedTuple):
    """One value: in large, what belongs to it in small, and whether it is the better one, out of place, or alarming."""

    text: str
    detail: str = ""
    better: bool = False
    void: bool = False
    alarm: bool = False


class Row(NamedTuple):
    """One line of a table."""

    label: str
    unit: str
    entries: tuple[Entry, ...]


def shown(value: float) -> str:
    """A number to three or four digits, with a true minus."""
    size = abs(value)
    if size < NOUGHT:
        return "0"
    text = f"{value:.1e}" if size < 1e-3 or size >= 1e5 else f"{value:.3g}" if size < 1000.0 else f"{value:.0f}"
    return text.replace("-", "\N{MINUS SIGN}")


def _range(interval: Interval, scale: float) -> str:
    if interval.low is None or interval.high is None:
        return ""
    low, high = shown(scale * interval.low), shown(scale * interval.high)
    return "" if low == high else f"{low} \N{EN DASH} {high}"


def _entry(cell: Cell, measure: Measure) -> Entry:
    found = cell.interval(measure)
    if found is None:
        return Entry("\N{EN DASH}", "never in some run" if measure.key == "felt_clearance_m" else "")
    many, void = len(cell.runs) > 1, measure.effort and cell.slipped > 0
    worst = cell.worst(measure)
    better = measure.key in cell.better
    if worst is not None:
        alarm = measure.alarm is not None and worst < measure.alarm
        detail = f"worst; median {shown(measure.scale * found.median)}" if many else ""
        return Entry(shown(measure.scale * worst), detail, better, void, alarm)
    return Entry(shown(measure.scale * found.median), _range(found, measure.scale), better, void)


def _count(cells: Sequence[Cell], what: str) -> tuple[Entry, ...]:
    numbers = [(getattr(cell, what), len(cell.runs)) for cell in cells]
    return tuple(Entry(f"{n} of {total}", alarm=n > 0) for n, total in numbers)


def _violated(cell: Cell) -> Entry:
    """Which constraints some run violated, those to keep in large."""
    names = list(dict.fromkeys(name for r in cell.runs for name in r["violated"]))
    keep = [name for name in names if name in cell.runs[0]["to_keep"]]
    others = [name for name in names if name not in keep]
    detail = f"watched: {', '.join(others)}" if others else ""
    return Entry(", ".join(keep) or "nothing", detail, alarm=bool(keep))


def _outcome(cells: Sequence[Cell]) -> list[Row]:
    """What went wrong, in so many runs."""
    if cells[0].kind == HANDS_ON:
        return [
            Row("runs that entered the region", "", _count(cells, "entered")),
            Row("runs that slipped off it", "", _count(cells, "slipped")),
        ]
    violated = Row("violated", "", tuple(_violated(cell) for cell in cells))
    many = any(len(cell.runs) > 1 for cell in cells)
    return [violated, Row("runs that violated one to keep", "", _count(cells, "entered"))] if many else [violated]


def rows(cells: Sequence[Cell]) -> list[Row]:
    """The cells of one arm side by side: what went wrong, then every measure that any cell has."""
    out = _outcome(cells)
    for measure in cells[0].measures:
        if any(cell.interval(measure) for cell in cells):
            out.append(Row(measure.label, measure.unit, tuple(_entry(cell, measure) for cell in cells)))
    return out


def differences(cells: Sequence[Cell]) -> tuple[list[str], list[Row]]:
    """Names of the pairs of cells that can be compared, and the median difference of each in every measure."""
    able = [c for c in cells if c.bounded]
    pairs = [(a, b) for i, a in enumerate(able) for b in able[i + 1 :]]
    lines = []
    for measure in cells[0].measures:
        entries = []
        for a, b in pairs:
            found = difference(measure, a, b)
            if found is None:
                entries.append(Entry("\N{EN DASH}", "not compared"))
            else:
                scaled = shown(measure.scale * found.median)
                entries.append(Entry(scaled, _range(found, measure.scale), better=found.excludes_zero))
        lines.append(Row(measure.label, measure.unit, tuple(entries)))
    return [f"{a.name} \N{MINUS SIGN} {b.name}" for a, b in pairs], lines


def merits(cells: Sequence[Cell]) -> list[tuple[str, str]]:
    """For every cell that was better at something: its name, and at what."""
    labels = {m.key: m.label for m in cells[0].measures}
    return [(c.name, "; ".join(labels[k] for k in labels if k in c.better)) for c in cells if c.better]


def notes(cells: Sequence[Cell]) -> list[str]:
    """What has to be said of these cells before their numbers are read."""
    out = []
    for cell in cells:
        if cell.slipped:
            out.append(
                f"{cell.name}: {cell.slipped} of {len(cell.runs)} runs slipped off the region, so its effort figures "
                "(in grey) mean nothing beside the others and are not compared."
            )
    return out
