"""Colours and dashes of the cells of a comparison."""

from collections.abc import Mapping, Sequence

from scenarios.analysis.cells import Cell
from scenarios.analysis.picture import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, Dash

Look = tuple[str, Dash]
LOOKS: Mapping[str, Look] = {
    "none": (GREY, "dot"),
    "admittance": (BLUE, "solid"),
    "vfi": (VERMILION, "solid"),
    "both": (GREEN, "dash"),
}
"""Of each enforcement; of runs that lie on each other the dashed one lets the other show."""
OTHERS = (VERMILION, BLUE, GREEN, ORANGE, PURPLE, SKY, BLACK)
"""Colours of solvers, or ways to coordinate, one after the other; the enforcement then decides on the dashes alone."""
GUARDED: Dash = "dashdot"
"""Of runs whose guard acts where others' do not."""


def looks(cells: Sequence[Cell]) -> list[Look]:
    """Colour and dashes of each cell of an arm."""
    others = [(cell.variant.get("solver"), cell.variant.get("coordination")) for cell in cells]
    distinct, guards = list(dict.fromkeys(others)), {cell.guard for cell in cells}
    out = []
    for cell, other in zip(cells, others, strict=True):
        colour, dash = LOOKS[cell.enforcement]
        if len(distinct) > 1:
            colour = OTHERS[distinct.index(other) % len(OTHERS)]
        out.append((colour, GUARDED if cell.guard == "act" and len(guards) > 1 else dash))
    return out
