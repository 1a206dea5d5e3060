"""What came of hands-on runs, on a terminal."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from scenarios.analysis.cells import WORST, Cell
from scenarios.analysis.measures import MEASURES, Measure
from scenarios.plain_table import plain_table

COLUMNS = ("port", "guided", "clearance", "between", "excess", "work", "contact", "force", "time")


def print_hands_on(results: Sequence[dict[str, Any]], console: Console, shown: int) -> None:
    """Print one row a run, and the first changes of state below."""
    first = results[0]
    table = plain_table(
        title=f"hands-on: {first['enforcement']}, {first['integrator']}, T = {first['period_s'] * 1e3:g} ms",
        caption=(
            "port: largest distance of the shaft from the port, mm; guided: that of the reference in guided motion, "
            "um; clearance: smallest, at and between cycles, mm, x where the region was entered; excess: of passivity, "
            "J; work: of the hand, J; contact: share of cycles with repulsion, s where the tool slipped off; force: "
            "largest of the hand, N; time: median of a cycle, us"
        ),
    )
    table.add_column("scene", no_wrap=True)
    for column in COLUMNS:
        table.add_column(column, justify="right", no_wrap=True)
    for r in results:
        table.add_row(_label(r), *_cells(r))
    console.print(table)
    for r in results:
        for event in [e for e in r["events"] if e["state"] != "RUN"][:shown]:
            console.print(f"  {_label(r)} at {event['t']:.3f} s {event['state']}: {event['reason']}", markup=False)


TERMINAL = {
    "felt_clearance_m": "felt",
    "hand_work_J": "work",
    "mean_force_N": "force",
    "max_force_N": "peak",
    "jerk_m_s3.rms": "jerk",
    "tangential_freedom": "along",
}
"""Measures whose medians the comparison shows on a terminal, and their columns; the report has them all."""


def print_comparison(scene: str, cells: Sequence[Cell], files: Sequence[Path], console: Console) -> None:
    """Print one row for each arm, enforcement and guard, and the files that were written."""
    runs = len(cells[0].runs)
    table = plain_table(
        title=f"{scene}: {runs} run{'s' if runs > 1 else ''} each",
        caption=(
            "clearance: smallest of all runs, also between cycles, mm; in, off: runs that entered the region, and that "
            "slipped off it; port: largest distance of the shaft from the port, um; excess: largest of passivity, J. "
            "Medians: felt: clearance from which on the boundary is felt, mm; work, force, peak: of the hand, J, N, N; "
            "jerk: rms, m/s^3; along: tangential freedom, %. *: better than every other "
            "enforcement with a boundary, see docs/metrics.md; (): not compared, as runs slipped."
        ),
    )
    for column in ("robot", "enforcement"):
        table.add_column(column, no_wrap=True)
    for column in ("clearance", "in", "off", "port", "excess", *TERMINAL.values()):
        table.add_column(column, justify="right", no_wrap=True)
    by_key = {m.key: m for m in MEASURES}
    for cell in cells:
        worst = {key: cell.worst(by_key[key]) for key in WORST}
        table.add_row(
            cell.robot,
            cell.name,
            _clearance(worst["clearance_m.between_samples"]),
            str(cell.entered),
            str(cell.slipped),
            _marked(cell, by_key["port_error_m.max"], f"{1e6 * (worst['port_error_m.max'] or 0.0):.3g}"),
            _marked(cell, by_key["passivity_excess_J"], f"{worst['passivity_excess_J'] or 0.0:.1e}"),
            *(_median(cell, by_key[key]) for key in TERMINAL),
        )
    console.print(table)
    for file in files:
        console.print(f"  {file}", highlight=False)


def _median(cell: Cell, measure: Measure) -> str:
    found = cell.interval(measure)
    return "-" if found is None else _marked(cell, measure, f"{measure.scale * found.median:.3g}")


def _marked(cell: Cell, measure: Measure, text: str) -> str:
    if measure.effort and cell.slipped:
        return f"({text})"
    return f"{text} *" if measure.key in cell.better else text


def _label(r: dict[str, Any]) -> str:
    method = "" if r["enforcement"] == "admittance" else f" {r['enforcement']}"
    return f"{r['scene']} {r['robot']} {r['plant']}{method}"


def _cells(r: dict[str, Any]) -> list[str]:
    return [
        f"{r['port_error_m']['max'] * 1e3:.3g}",
        f"{r['guided_reference_port_error_m'] * 1e6:.3g}",
        *(_clearance(r["clearance_m"][where]) for where in ("at_samples", "between_samples")),
        f"{r['passivity_excess_J']:.1e}",
        f"{r['hand_work_J']:.3f}",
        f"{r['contact_fraction']:.0%}{' s' if r['slipped'] else ''}",
        f"{r['max_force_N']:.1f}",
        f"{r['cycle_us']['median']:.0f}",
    ]


def _clearance(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value * 1e3:.3f}" if value > 0.0 else f"[bold red]{value * 1e3:.3f} x[/]"
