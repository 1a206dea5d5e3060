"""Runs as curves over time."""

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from primitives.checks import Array
from scenarios.analysis.figures import thin
from scenarios.analysis.picture import Dash, Line
from scenarios.analysis.trace import Trace

POINTS = 900
"""Points of a curve; its smallest and largest values are kept."""
TIME = "time [s]"


class View(Protocol):
    """A run that is drawn."""

    @property
    def label(self) -> str:
        """Of its curves."""

    @property
    def colour(self) -> str:
        """Of its curves."""

    @property
    def dash(self) -> Dash:
        """Of its curves."""

    @property
    def trace(self) -> Trace:
        """What was recorded."""


V = TypeVar("V", bound=View)


def curves(views: Sequence[V], values: Callable[[V], Array]) -> tuple[Line, ...]:
    """A curve for each run of what a function says of it, (k,), one value a cycle."""
    lines = []
    for view in views:
        y, t = values(view), view.trace.t
        keep = thin(y, POINTS)
        lines.append(Line(view.label, t[keep], y[keep], view.colour, view.dash))
    return tuple(lines)
