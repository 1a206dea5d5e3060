"""A figure as data: what is drawn, with its units and caption, before any library draws it.

`draw_plotly` makes it a part of a page, `draw_matplotlib` a PNG and an SVG; both draw every line of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from primitives.checks import Array

GREY, BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE, BLACK = (
    "#767676",
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#E69F00",
    "#56B4E9",
    "#CC79A7",
    "#222222",
)
"""The colours of M. Okabe and K. Ito, told apart with any colour vision, and two greys."""
Dash = Literal["solid", "dash", "dot", "dashdot"]
SLIMMEST, ROOM = 0.4, 1.05
"""Least extent of an axis in space as a share of the longest one, and how much longer than what it shows it is."""


@dataclass(frozen=True)
class Line:
    """A curve, or points where `marks` says so; x and y (k,)."""

    label: str
    x: Array
    y: Array
    colour: str
    dash: Dash = "solid"
    marks: Literal["", "dots", "diamonds"] = ""
    width: float = 1.8


@dataclass(frozen=True)
class Level:
    """A horizontal line with its name."""

    y: float
    label: str


@dataclass(frozen=True)
class Panel:
    """One pair of axes.

    Attributes
    ----------
    x_label, y_label : with units. shaded : the part below this y is shaded, or None.
    x_range, y_range : limits; None to fit. rows : {y: name} in the place of the numbers of the y axis.
    """

    title: str
    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    levels: tuple[Level, ...] = ()
    shaded: float | None = None
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    rows: Mapping[float, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Chart:
    """Panels in so many columns, row by row; heights are in pixels of a page of 1040.

    Attributes
    ----------
    name : of its files. title, caption : the caption says what one sees.
    shared_x : whether all panels have the same x axis.
    """

    name: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    columns: int = 1
    panel_height: int = 260
    shared_x: bool = True


@dataclass(frozen=True)
class Dots:
    """Points in space, (k, 3)."""

    label: str
    points: Array
    colour: str
    size: float
    opacity: float


@dataclass(frozen=True)
class Space:
    """Paths among points in space; coordinates as axis_label says, "x" being replaced by the axis' name.

    Paths of one label are of one run.
    """

    name: str
    title: str
    caption: str
    axis_label: str
    clouds: tuple[Dots, ...]
    paths: tuple[tuple[str, Array, str, Dash], ...]

    def box(self) -> tuple[Array, Array]:
        """Middle and half the extent (3,) of the axes; none is shorter than `SLIMMEST` of the longest."""
        everything = np.vstack([*(d.points for d in self.clouds), *(points for _, points, _, _ in self.paths)])
        low, high = everything.min(axis=0), everything.max(axis=0)
        half = 0.5 * np.maximum(high - low, SLIMMEST * np.max(high - low))
        return 0.5 * (low + high), ROOM * half


Picture = Chart | Space
