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


MOST_COLUMNS = 6
"""Constraints that stand side by side; more stand one below the other."""
SHOWN = 3
"""Changes of state that are printed below the table for each run."""


_TOOK = ("infeas.", "row", "guard", "error", "acc.", "all", "time")


def console_for_tables() -> Console:
    """The terminal; nothing is cut off where nobody sits at one."""
    console = Console()
    if not console.is_terminal:
        console.width = PIPED_WIDTH
    return console


def print_results(results: Sequence[dict[str, Any]], files: Sequence[Path] = ()) -> None:
    """Print what came of runs, a table for each kind of scene, and the files that were written."""
    console = console_for_tables()
    led = [r for r in results if "integrator" in r]
    by_hand = [r for r in results if r not in led and "hand_work_J" in r]
    if followed := [r for r in results if r not in led and r not in by_hand]:
        how = [", ".join(dict.fromkeys(str(r[key]) for r in followed)) for key in ("solver", "enforcement")]
        _print_margins(followed, console, how[0] if how[1] == "vfi" else f"{how[0]}, enforcement {how[1]}")
    if by_hand:
        _print_margins(by_hand, console, f"by hand, {by_hand[0]['enforcement']}")
        print_hand(by_hand, console)
    if led:
        print_hands_on(led, console, SHOWN)
    for file in files:
        console.print(f"  {file}", highlight=False)


def _print_margins(results: Sequence[dict[str, Any]], console: Console, how: str) -> None:
    """Of each run the smallest margin of every constraint, the violated ones marked, and what it took.

    A row is a run; where there are many constraints a column is.
    """
    names = list(dict.fromkeys(n for r in results for key in ("min_margin_m", "min_margin_rad") for n in r[key]))
    first = results[0]
    title = f"smallest margins in mm: {how}, T = {first['period_s'] * 1e3:g} ms, guard {first['guard']}"
    caption = (
        "x: violated; infeas., guard: cycles; row: largest shortfall of an answer before verification, per s; "
        "error: largest |vec8(x - x_d)|; acc.: rms of the joints' acceleration over the last 2 s, all: over all; "
        "time: median of a cycle, us"
    )
    metric = [any(name in r["min_margin_m"] for r in results) for name in names]
    lines = [["scene", *(name if m else f"{name} in deg" for name, m in zip(names, metric, strict=True)), *_TOOK]]
    frames = list(dict.fromkeys(frame for r in results for frame in r.get("tip_distance_m", ())))
    lines[0] += [f"{frame} in mm" for frame in frames]
    for r, label in zip(results, labels(results), strict=True):
        took = (
            str(r["infeasible_cycles"]),
            f"{r['row_shortfall']:.0e}",
            str(r["guard_interventions"]),
            f"{r['task_error']['max']:.1e}",
            f"{r['acceleration_rms_last_2s']:.3f}",
            f"{r['acceleration_rms']:.2f}",
            f"{r['cycle_us']['median']:.0f}",
        )
        lines.append([label, *(_margin(r, name) for name in names), *took, *(_off(r, frame) for frame in frames)])
    if len(names) > MOST_COLUMNS:
        lines = [list(line) for line in zip(*lines, strict=True)]
    if frames:
        caption += "; .. in mm: rms and largest distance of a frame from where it is wanted"
    table = plain_table(title=title, caption=caption)
    for i, head in enumerate(lines[0]):
        table.add_column(head, justify="right" if i else "left", no_wrap=True)
    for line in lines[1:]:
        table.add_row(*line)
    console.print(table)
    for r, label in zip(results, labels(results), strict=True):
        for event in r["events"][:SHOWN]:
            if event["state"] != "RUN":
                console.print(f"  {label} at {event['t']:.3f} s {event['state']}: {event['reason']}", markup=False)


def _off(result: dict[str, Any], frame: str) -> str:
    found = result.get("tip_distance_m", {}).get(frame)
    return f"{found['rms'] * 1e3:.2f}, {found['max'] * 1e3:.2f}" if found else "-"


def _margin(result: dict[str, Any], name: str) -> str:
    if name in result["min_margin_m"]:
        value = result["min_margin_m"][name] * 1e3
    elif name in result["min_margin_rad"]:
        value = result["min_margin_rad"][name] * 57.29577951308232
    else:
        return "-"
    text = f"{value:.2f}"
    return f"[bold red]{text} x[/]" if name in result["violated"] else text
