"""What came of hands-on runs, on a terminal."""

from collections.abc import Sequence
from typing import Any

from rich.console import Console

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
