"""The runs of all seeds, a dot each, with medians and their intervals."""

from collections.abc import Sequence

import numpy as np

from scenarios.analysis.cells import Cell
from scenarios.analysis.look import Look, looks
from scenarios.analysis.measures import Measure
from scenarios.analysis.picture import Chart, Line, Panel
from scenarios.analysis.statistics import LEVEL

SHOWN = (
    "clearance_m.between_samples",
    "felt_clearance_m",
    "hand_work_J",
    "mean_force_N",
    "jerk_m_s3.rms",
    "tangential_freedom",
    "position_error_m.rms",
    "acceleration_rms",
)
"""Keys of the measures that are drawn, of those that a kind of scene has."""
ABOVE = 0.22
"""How far above its cell's line the dots of the runs stand, in lines."""


def spread(cells: Sequence[Cell]) -> Chart:
    """One panel a measure, one line a cell of one arm."""
    shown = [m for m in cells[0].measures if m.key in SHOWN and any(c.interval(m) for c in cells)]
    panels = [_panel(measure, cells, looks(cells)) for measure in shown]
    caption = (
        f"Dots: one run each. Diamonds: medians; bars: {LEVEL:.0%} bootstrap intervals of the median. Cells may "
        "overlap here and still differ seed by seed: the marks rest on paired differences, which take out what a seed "
        "does to all."
    )
    return Chart("spread", "Every seed", caption, tuple(panels), columns=2, panel_height=150, shared_x=False)


def _panel(measure: Measure, cells: Sequence[Cell], styles: Sequence[Look]) -> Panel:
    lines: list[Line] = []
    for row, (cell, (colour, _)) in enumerate(zip(reversed(cells), reversed(styles), strict=True)):
        found = cell.interval(measure)
        if found is None:
            continue
        values = measure.scale * np.array(cell.values(measure))
        lines.append(Line("", values, np.full(len(values), row + ABOVE), colour, marks="dots"))
        if found.low is not None and found.high is not None:
            ends = measure.scale * np.array([found.low, found.high])
            lines.append(Line("", ends, np.full(2, float(row)), colour, width=2.5))
        lines.append(
            Line("", np.array([measure.scale * found.median]), np.array([float(row)]), colour, marks="diamonds")
        )
    names = {float(row): cell.name for row, cell in enumerate(reversed(cells))}
    title = f"{measure.label[0].upper()}{measure.label[1:]}"
    return Panel(title, f"[{measure.unit}]", "", tuple(lines), y_range=(-0.5, len(cells) - 0.3), rows=names)
