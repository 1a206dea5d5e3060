"""The violation table of the VFI paper, on a terminal."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table


def print_results(results: Sequence[dict[str, Any]], files: Sequence[Path] = ()) -> None:
    """Print one row a run: the smallest margin of every constraint, the violated ones marked, and what it took."""
    names = list(dict.fromkeys(n for r in results for key in ("min_margin_m", "min_margin_rad") for n in r[key]))
    first = results[0]
    title = f"smallest margins, {first['solver']}, T = {first['period_s'] * 1e3:g} ms, guard {first['guard']}"
    table = Table(title=title, title_justify="left", caption="bold and x: violated", caption_justify="left")
    table.add_column("scene")
    for name in names:
        unit = "mm" if any(name in r["min_margin_m"] for r in results) else "deg"
        table.add_column(f"{name} [{unit}]".replace("[", r"\["), justify="right")
    for column in ("infeasible", "guard acted", "error max", "error rms", "acc. rms", "cycle \\[us]"):
        table.add_column(column, justify="right")
    for r in results:
        cells = [_margin(r, name) for name in names]
        table.add_row(
            r["scene"],
            *cells,
            str(r["infeasible_cycles"]),
            str(r["guard_interventions"]),
            f"{r['task_error']['max']:.2e}",
            f"{r['task_error']['rms']:.2e}",
            f"{r['acceleration_rms_last_2s']:.3g}",
            f"{r['cycle_us']['median']:.0f}",
        )
    console = Console()
    console.print(table)
    for file in files:
        console.print(f"  {file}", highlight=False)


def _margin(result: dict[str, Any], name: str) -> str:
    if name in result["min_margin_m"]:
        value = result["min_margin_m"][name] * 1e3
    elif name in result["min_margin_rad"]:
        value = result["min_margin_rad"][name] * 57.29577951308232
    else:
        return "-"
    text = f"{value:.2f}"
    return f"[bold red]{text} x[/]" if name in result["violated"] else text
