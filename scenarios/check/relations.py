"""Constraints that contradict each other, that others imply, or that cannot act within the joint limits."""

from collections.abc import Callable, Sequence

from primitives.constraint import Constraint
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.search import CLOSE, Search

CHECK = "relations"


def check_relations(search: Search, progress: Callable[[str, float], None]) -> Part:
    """What the search of the joint box says of the constraints; progress is told a label and a share."""
    items = list(search.space.constraints)
    findings = []
    progress("constraints that contradict", 0.0)
    against = contradiction(search, range(len(items)))
    if against:
        findings.append(_contradiction(search, [items[i] for i in against], against))
    rows = []
    for i, c in enumerate(items):
        progress(f"where {c.name} acts", (i + 1) / (len(items) + 1))
        unit = c.definition.unit
        lowest = search.smallest(i).value
        row = {"name": c.name, "unit": unit, "smallest_margin": lowest, "acts": bool(lowest < -CLOSE)}
        others = [k for k, other in enumerate(items) if k != i and other.enforced]
        if not row["acts"]:
            findings.append(_idle(c, lowest))
        elif others and not against:
            kept = search.smallest(i, others).value
            row |= {"smallest_margin_beside_others": kept, "redundant": bool(kept >= -CLOSE)}
            if row["redundant"]:
                findings.append(_redundant(search, c, kept, others))
        rows.append(row)
    return Part(CHECK, rows, findings, search.method)


def contradiction(search: Search, which: Sequence[int]) -> list[int]:
    """Constraints that no configuration found keeps together, none of which can be left out; empty for none."""
    left = list(which)
    if not left or bool((search.margins[:, left] >= 0.0).all(axis=1).any()) or search.roomiest(left).value >= -CLOSE:
        return []
    for i in list(left):
        fewer = [k for k in left if k != i]
        kept = bool((search.margins[:, fewer] >= 0.0).all(axis=1).any()) if fewer else True
        if not kept and search.roomiest(fewer).value < -CLOSE:
            left = fewer
    return left


def _contradiction(search: Search, items: Sequence[Constraint], which: Sequence[int]) -> Finding:
    value = search.roomiest(which).value
    names = ", ".join(c.name for c in items)
    kept = "it" if len(items) == 1 else "them all"
    what = f"no configuration was found that keeps {kept}; the best one violates by {amount(-value, _unit(items))}"
    severity = Severity.ERROR if all(c.enforced for c in items) else Severity.NOTE
    advice = "check their places and the side that each keeps; the search does not prove it"
    return Finding(severity, CHECK, names, what, advice, {"largest_smallest_margin": value})


def _unit(items: Sequence[Constraint]) -> str:
    return items[0].definition.unit


def _idle(c: Constraint, lowest: float) -> Finding:
    unit = c.definition.unit
    what = f"cannot act: its smallest margin found within the joint limits is {amount(lowest, unit)}"
    advice = "leave it out, or check its place and its safe distance; the search does not prove it"
    return Finding(Severity.WARNING, CHECK, c.name, what, advice, {f"smallest_margin_{unit}": lowest})


def _redundant(search: Search, c: Constraint, kept: float, others: Sequence[int]) -> Finding:
    unit = c.definition.unit
    names = ", ".join(list(search.space.constraints)[k].name for k in others)
    what = f"holds wherever {names} hold: its smallest margin found there is {amount(kept, unit)}"
    advice = "it may be left out, or kept for its margin in the log; the search does not prove it"
    return Finding(Severity.NOTE, CHECK, c.name, what, advice, {f"smallest_margin_{unit}": kept})
