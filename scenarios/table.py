"""What came of runs, on a terminal: for those of a trajectory the violation table of the VFI paper."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from scenarios.analysis.trace import labels
from scenarios.by_hand_table import print_hand
from scenarios.hands_on_table import print_hands_on
from scenarios.plain_table import plain_table

PIPED_WIDTH = 120
"""Columns of the table where nobody sits at a terminal: nothing is cut off in a file."""


SHOWN = 3
"""Changes of state that are printed below the table for each run."""


def console_for_tables() -> Console:
    """The terminal; nothing is cut off where nobody sits at one."""
    console = Console()
    if not console.is_terminal:
        console.width = PIPED_WIDTH
    return console


def print_results(results: Sequence[dict[str, Any]], files: Sequence[Path] = ()) -> None:
    """Print what came of runs, a table for each kind of scene, and the files that were written."""
    console = console_for_tables()
    led = [r for r in results if "plant" in r]
    by_hand = [r for r in results if r not in led and "hand_work_J" in r]
    if followed := [r for r in results if r not in led and r not in by_hand]:
        _print_margins(followed, console, ", ".join(dict.fromkeys(r["solver"] for r in followed)))
    if by_hand:
        _print_margins(by_hand, console, f"by hand, {by_hand[0]['enforcement']}")
        print_hand(by_hand, console)
    if led:
        print_hands_on(led, console, SHOWN)
    for file in files:
        console.print(f"  {file}", highlight=False)


def _print_margins(results: Sequence[dict[str, Any]], console: Console, how: str) -> None:
    """One row a run: the smallest margin of every constraint, the violated ones marked, and what it took."""
    names = list(dict.fromkeys(n for r in results for key in ("min_margin_m", "min_margin_rad") for n in r[key]))
    first = results[0]
    title = f"smallest margins in mm: {how}, T = {first['period_s'] * 1e3:g} ms, guard {first['guard']}"
    caption = (
        "x: violated; infeas., guard: cycles; row: largest shortfall of an answer before verification, per s; "
        "error: largest |vec8(x - x_d)|; acc.: rms of the joints' acceleration over the last 2 s; "
        "time: median of a cycle, us"
    )
    table = plain_table(
        title=title,
        caption=caption,
    )
    table.add_column("scene", no_wrap=True)
    for name in names:
        metric = any(name in r["min_margin_m"] for r in results)
        table.add_column(name if metric else f"{name} in deg", justify="right", no_wrap=True)
    for column in ("infeas.", "row", "guard", "error", "acc.", "time"):
        table.add_column(column, justify="right", no_wrap=True)
    for r, label in zip(results, labels(results), strict=True):
        cells = [_margin(r, name) for name in names]
        table.add_row(
            label,
            *cells,
            str(r["infeasible_cycles"]),
            f"{r['row_shortfall']:.0e}",
            str(r["guard_interventions"]),
            f"{r['task_error']['max']:.1e}",
            f"{r['acceleration_rms_last_2s']:.3f}",
            f"{r['cycle_us']['median']:.0f}",
        )
    console.print(table)
    for r, label in zip(results, labels(results), strict=True):
        for event in r["events"][:SHOWN]:
            if event["state"] != "RUN":
                console.print(f"  {label} at {event['t']:.3f} s {event['state']}: {event['reason']}", markup=False)


def _margin(result: dict[str, Any], name: str) -> str:
    if name in result["min_margin_m"]:
        value = result["min_margin_m"][name] * 1e3
    elif name in result["min_margin_rad"]:
        value = result["min_margin_rad"][name] * 57.29577951308232
    else:
        return "-"
    text = f"{value:.2f}"
    return f"[bold red]{text} x[/]" if name in result["violated"] else text
