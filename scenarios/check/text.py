"""A report of `vfi check` on a terminal."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from scenarios.check.finding import Part, Severity, amount
from scenarios.check.report import Report
from scenarios.plain_table import plain_table

Row = Mapping[str, Any]
STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "yellow", Severity.NOTE: "cyan"}


def _of(key: str, unit: str = "") -> Callable[[Row], str]:
    """A cell of one number, in the row's unit where none is given."""

    def cell(row: Row) -> str:
        value = row.get(key)
        return "-" if value is None else amount(value, unit or row["unit"])

    return cell


def _rate(key: str) -> Callable[[Row], str]:
    return lambda row: "-" if row.get(key) is None else amount(row[key], f"{row['unit']}/s")


def _word(key: str, yes: str, no: str) -> Callable[[Row], str]:
    return lambda row: "-" if row.get(key) is None else yes if row[key] else no


def _number(key: str) -> Callable[[Row], str]:
    return lambda row: "-" if row.get(key) is None else f"{row[key]:.3g}"


TABLES: dict[str, tuple[str, dict[str, Callable[[Row], str]]]] = {
    "constraints": (
        "constraints at the start",
        {
            "keep": lambda row: row["keep"],
            "safe distance": _of("safe_distance"),
            "margin": _of("margin"),
            "": _word("violated", "[bold red]violated[/]", ""),
            " ": _word("enforced", "enforced", "watched"),
        },
    ),
    "joints": (
        "decided joints at the start",
        {
            "position": _of("position"),
            "lower": _of("lower"),
            "upper": _of("upper"),
            "room": _of("room"),
            "velocity": _rate("velocity"),
        },
    ),
    "gains": ("gains", {"gain": lambda row: row["kind"], "1/s": _number("gain_per_s"), "times T": _number("gain_T")}),
    "relations": (
        "within the joint limits",
        {
            "lowest margin found": _of("smallest_margin"),
            "where the others hold": _of("smallest_margin_beside_others"),
            "": _word("acts", "", "cannot act"),
            " ": _word("redundant", "redundant", ""),
        },
    ),
    "reference": (
        "waypoints without constraints",
        {
            "due": _of("due_s", "s"),
            "position": _of("position_m", "m"),
            "rotation": _of("rotation_rad", "rad"),
            "": _word("reached", "reached", "[yellow]not reached[/]"),
        },
    ),
    "approach": (
        "approach",
        {
            "eta 1/s": _number("eta_per_s"),
            "speed at most": _rate("top_speed"),
            "acts from": _of("acts_from_at_top_speed"),
            "speed of reference": _rate("reference_speed"),
            "acts from ": _of("acts_from"),
            "fades in": _of("time_constant_s", "s"),
            "drift": _of("drift_m", "m"),
        },
    ),
    "port": ("port", {"missed by": _of("off_m", "m")}),
    "hand": (
        "where the hand leads the shaft's end",
        {"due": _of("due_s", "s"), "out of reach by": _of("short_m", "m")},
    ),
    "cue": (
        "potentials",
        {
            "felt from": _of("range_m", "m"),
            "hand": _of("force_N", "N"),
            "balanced at": _of("balanced_m", "m"),
            "way a period": _of("way_per_period_m", "m"),
        },
    ),
    "clouds": (
        "clouds",
        {
            "spheres": _number("points"),
            "radius": _of("radius_m", "m"),
            "largest gap": _of("gap_m", "m"),
            "": _word("covers", "covers", "[bold red]does not cover[/]"),
        },
    ),
}


def print_report(report: Report, console: Console) -> None:
    """Print the findings, the gravest first, then what was measured."""
    print_findings(report, console)
    for part in report.parts:
        if part.name in TABLES and part.rows:
            _print_part(part, console)


def print_findings(report: Report, console: Console) -> None:
    """Print how many findings there are, and each of them, the gravest first."""
    counts = {s: sum(f.severity == s for f in report.findings) for s in Severity}
    said = ", ".join(f"{n} {s.value}{'' if n == 1 else 's'}" for s, n in counts.items())
    console.print(f"[bold]{escape(report.scene)}[/] on {escape(report.robot)}: {said}", highlight=False)
    for f in report.findings:
        mark = f"[{STYLES[f.severity]}]{f.severity.value}[/]"
        place = f" ({Path(f.place).name})" if f.place else ""
        console.print(f"  {mark} {escape(f.where + place)}: {escape(f.what)}; {escape(f.advice)}", highlight=False)


def _print_part(part: Part, console: Console) -> None:
    title, cells = TABLES[part.name]
    table = plain_table(title=title, caption="")
    table.add_column("", no_wrap=True)
    for column in cells:
        table.add_column(column.strip(), justify="right" if column.strip() else "left", no_wrap=True)
    for row in (r for r in part.rows if r.get("decided", True)):
        table.add_row(escape(row["name"]), *(cell(row) for cell in cells.values()))
    console.print()
    console.print(table)
    if part.method:
        console.print(f"[dim]{escape(part.method)}[/]", highlight=False)
