"""What came of a comparison, on a terminal; the report has every measure."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from scenarios.analysis.cells import Cell
from scenarios.analysis.kinds import BY_HAND, HANDS_ON, TRAJECTORY
from scenarios.analysis.measures import DEGREES, EXCESS, Measure
from scenarios.plain_table import plain_table
from scenarios.table import MOST_COLUMNS

LED = "work, force, peak: of the hand, J, N, N; "
COLUMNS = {
    HANDS_ON: {
        "port_error_m.max": "port",
        "passivity_excess_J": "excess",
        "felt_clearance_m": "felt",
        "hand_work_J": "work",
        "mean_force_N": "force",
        "max_force_N": "peak",
        "jerk_m_s3.rms": "jerk",
        "tangential_freedom": "along",
    },
    BY_HAND: {
        "position_error_m.rms": "off",
        "position_error_m.max": "at most",
        "passivity_excess_J": "excess",
        "hand_work_J": "work",
        "mean_force_N": "force",
        "max_force_N": "peak",
        "guard_interventions": "guard",
    },
    TRAJECTORY: {
        "position_error_m.rms": "off",
        "position_error_m.max": "at most",
        "acceleration_rms": "acc.",
        "infeasible_cycles": "infeas.",
        "guard_interventions": "guard",
        "cycle_us.median": "time",
    },
}
"""Measures that are shown of each kind of scene beside the margins, and their columns."""
ALONG = (
    "a margin is the smallest of all runs, also between cycles, mm or deg, x where violated, in () where watched. "
    "Medians: off, at most: rms and largest distance of the tip from its reference, mm; guard: interventions, cycles"
)
CAPTIONS = {
    HANDS_ON: (
        "clearance: smallest of all runs, also between cycles, mm; in, off: runs that entered the region, and that "
        "slipped off it; port: largest distance of the shaft from the port, um; excess: largest of passivity, J. "
        f"Medians: felt: clearance from which on the boundary is felt, mm; {LED}"
        "jerk: rms, m/s^3; along: tangential freedom, %. *: better than every other "
        "enforcement with a boundary, see docs/metrics.md; (): not compared, as runs slipped."
    ),
    BY_HAND: f"{ALONG}; {LED}excess: largest of passivity, J. *: better than every other that keeps constraints.",
    TRAJECTORY: (
        f"{ALONG}; acc.: rms of the joints' acceleration; infeas.: cycles without a solution; time: of a cycle, us."
    ),
}


def print_comparison(scene: str, cells: Sequence[Cell], files: Sequence[Path], console: Console) -> None:
    """Print one row for each arm and variant, or a column where there are many margins, and the files written."""
    runs, kind = len(cells[0].runs), cells[0].kind
    margins, shown = [] if kind == HANDS_ON else _margins(cells), _shown(cells)
    names = ["clearance", "in", "off"] if kind == HANDS_ON else [_heading(key) for key in margins]
    lines = [["robot", "run", *names, *(_column(kind, key) for key in shown)]]
    for cell in cells:
        by_key = {m.key: m for m in cell.measures}
        if kind == HANDS_ON:
            least = _margin(cell, by_key["clearance_m.between_samples"], 3)
            first = [least, str(cell.entered), str(cell.slipped)]
        else:
            first = [_margin(cell, by_key[key], 2) if key in by_key else "-" for key in margins]
        lines.append([cell.robot, cell.name, *first, *(_value(cell, by_key.get(key)) for key in shown)])
    if turned := len(margins) > MOST_COLUMNS:
        lines = [list(line) for line in zip(*lines, strict=True)]
    table = plain_table(title=f"{scene}: {runs} run{'s' if runs > 1 else ''} each", caption=CAPTIONS[kind])
    for i, head in enumerate(lines[0]):
        words = i == 0 or (i == 1 and not turned)
        table.add_column(head, justify="left" if words else "right", no_wrap=not (words or turned))
    for line in lines[1:]:
        table.add_row(*line)
    console.print(table)
    for file in files:
        console.print(f"  {file}", highlight=False)


def _margins(cells: Sequence[Cell]) -> list[str]:
    """Keys of the constraints' margins, of all cells."""
    return list(dict.fromkeys(m.key for c in cells for m in c.measures if m.key.startswith("min_margin")))


def _shown(cells: Sequence[Cell]) -> list[str]:
    """Keys of the other columns: those of the kind, and of several tools how far each is off."""
    keys = [key for cell in cells for key in (m.key for m in cell.measures) if key.startswith("tip_distance_m")]
    wanted = [*dict.fromkeys(keys), *COLUMNS[cells[0].kind]]
    return [key for key in wanted if any(m.key == key for cell in cells for m in cell.measures)]


def _heading(key: str) -> str:
    return key.partition(".")[2]


def _column(kind: str, key: str) -> str:
    if key.startswith("tip_distance_m."):
        frame, _, part = key.removeprefix("tip_distance_m.").rpartition(".")
        return f"{frame} {'off' if part == 'rms' else 'at most'}"
    return COLUMNS[kind][key]


def _margin(cell: Cell, measure: Measure, digits: int) -> str:
    worst = cell.worst(measure)
    if worst is None:
        return "-"
    text = f"{measure.scale * worst:.{digits}f}" if measure.scale != DEGREES else f"{measure.scale * worst:.2f} deg"
    if measure.key.startswith("min_margin") and measure.alarm is None:
        return f"({text})"
    alarming = worst < measure.alarm if measure.alarm else worst <= 0.0
    return f"[bold red]{text} x[/]" if alarming else text


def _value(cell: Cell, measure: Measure | None) -> str:
    """The worst run's value where it is the one that counts, else the median."""
    found = cell.interval(measure) if measure is not None else None
    if measure is None or found is None:
        return "-"
    worst = cell.worst(measure)
    value = measure.scale * (found.median if worst is None else worst)
    text = f"{value:.0f}" if measure.unit == "cycles" else f"{value:.1e}" if measure is EXCESS else f"{value:.3g}"
    if measure.effort and cell.slipped:
        return f"({text})"
    return f"{text} *" if measure.key in cell.better else text
