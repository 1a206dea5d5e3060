"""What tells two runs apart, on a terminal."""

from typing import Any

from rich.console import Console

from scenarios.analysis.difference import Difference
from scenarios.plain_table import plain_table

MOST = 20
"""Lines of the resolved scenes and of events that are printed; --json has all."""


def print_difference(found: Difference, a: str, b: str, console: Console) -> None:
    """Print it part by part; parts without a difference are left out."""
    if found.equal:
        console.print("equal to the bit, apart from the times of cycles", markup=False)
        return
    console.print(f"A {a}\nB {b}", markup=False, highlight=False)
    _pairs(console, "what was run", found.header)
    if found.scene:
        console.print("\nresolved scene", markup=False)
        _lines(console, found.scene)
    if found.cycles[0] != found.cycles[1]:
        console.print(f"\ncycles: {found.cycles[0]} and {found.cycles[1]}; the first {min(found.cycles)} are compared")
    for which, names in zip("AB", found.columns, strict=True):
        if names:
            console.print(f"\nonly {which} has: {', '.join(names)}", markup=False)
    if found.first:
        first = found.first
        console.print(
            f"\nfirst command that differs: cycle {first['cycle']} ({first['t']:.4g} s), {first['quantity']} of "
            f"{first['joint']} by {first['by']:.3g}",
            markup=False,
        )
    if found.differing:
        _apart(console, found)
    if found.events is not None:
        console.print("\nchanges of state", markup=False)
        for which, events in zip("AB", found.events, strict=True):
            _lines(console, [f"{which} {e['t']:.3f} s {e['state']} {e['reason']}" for e in events] or [f"{which} none"])
    if found.without_metrics:
        console.print(f"\nno figures of merit: {found.without_metrics}", markup=False)
    _pairs(console, "figures of merit", found.metrics)


def _lines(console: Console, lines: list[str]) -> None:
    for line in lines[:MOST]:
        console.print(f"  {line}", markup=False, highlight=False)
    if len(lines) > MOST:
        console.print(f"  and {len(lines) - MOST} more; see --json", markup=False)


def _apart(console: Console, found: Difference) -> None:
    table = plain_table(title="\nB - A, rad, m and s", caption=f"not equal to the bit: {', '.join(found.differing)}")
    for column in ("quantity", "largest", "in cycle", "rms"):
        table.add_column(column, justify="left" if column == "quantity" else "right", no_wrap=True)
    for name, size in found.apart.items():
        table.add_row(name, f"{size['max']:.3g}", str(size["at_cycle"]), f"{size['rms']:.3g}")
    console.print(table)


def _pairs(console: Console, title: str, pairs: Any) -> None:
    if not pairs:
        return
    table = plain_table(title=f"\n{title}", caption="")
    for column in ("", "A", "B"):
        table.add_column(column, overflow="fold")
    for key, (x, y) in pairs.items():
        table.add_row(key, _text(x), _text(y))
    console.print(table)


def _text(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
