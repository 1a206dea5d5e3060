"""Pictures as figures of matplotlib, for PNG and SVG."""

from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from scenarios.analysis.picture import Chart, Panel, Picture, Space

PIXELS = 110.0
"""Pixels of a page that make an inch."""
WIDTH = 1040.0 / PIXELS
MOST_COLUMNS = 6
HANDLE, LETTER = 0.75, 0.072
"""Inches that the line of a legend's entry takes with the space around it, and a letter."""
DASHES = {"solid": "-", "dash": (0, (6, 4)), "dot": ":", "dashdot": "-."}
MARKERS = {"dots": ("o", 3.0, 0.45), "diamonds": ("D", 7.0, 1.0)}


def figure(picture: Picture) -> Figure:
    """The figure of a picture, with its title above."""
    return _space(picture) if isinstance(picture, Space) else _chart(picture)


def _chart(chart: Chart) -> Figure:
    rows = -(-len(chart.panels) // chart.columns)
    made = Figure(figsize=(WIDTH, rows * (chart.panel_height + 78) / PIXELS + 0.5), layout="constrained")
    axes = made.subplots(rows, chart.columns, squeeze=False, sharex=chart.shared_x).ravel()
    for place, panel in zip(axes, chart.panels, strict=False):
        _panel(place, panel)
    for place in axes[len(chart.panels) :]:
        place.set_axis_off()
    _legend(made, axes)
    return made


def _panel(axes: Axes, panel: Panel) -> None:
    for line in panel.lines:
        look: dict[str, Any] = {"linestyle": DASHES[line.dash], "linewidth": line.width}
        if line.marks:
            marker, size, opacity = MARKERS[line.marks]
            look = {"linestyle": "", "marker": marker, "markersize": size, "alpha": opacity, "markeredgewidth": 0}
        axes.plot(line.x, line.y, color=line.colour, label=line.label, **look)
    if panel.x_range:
        axes.set_xlim(*panel.x_range)
    if panel.y_range:
        axes.set_ylim(*panel.y_range)
    if panel.shaded is not None:
        low = axes.get_ylim()[0]
        axes.axhspan(low, panel.shaded, color="#D55E00", alpha=0.09, linewidth=0)
        axes.set_ylim(bottom=low)
    for level in panel.levels:
        axes.axhline(level.y, color="#9A9A9A", linewidth=0.9, linestyle="--")
        axes.annotate(
            level.label, (0.5, level.y), xycoords=axes.get_yaxis_transform(), ha="center", va="bottom", fontsize=8
        )
    if panel.rows:
        axes.set_yticks(list(panel.rows), labels=list(panel.rows.values()))
    axes.set_title(panel.title, fontsize=10, loc="left")
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.tick_params(labelbottom=True)
    axes.grid(color="#E9E9E9")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _legend(made: Figure, axes: Iterable[Axes]) -> None:
    """One entry a label, above the panels."""
    found: dict[str, Any] = {}
    for place in axes:
        for handle, label in zip(*place.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if found:
        columns = _columns(list(found))
        made.legend(found.values(), found.keys(), loc="outside upper left", ncols=columns, frameon=False)


def _columns(labels: Sequence[str]) -> int:
    """How many entries of a legend stand side by side in the width of a figure; columns are filled downwards."""
    widths = [HANDLE + LETTER * len(label) for label in labels]
    for columns in range(min(MOST_COLUMNS, len(labels)), 1, -1):
        rows = -(-len(labels) // columns)
        if sum(max(widths[i : i + rows]) for i in range(0, len(widths), rows)) < WIDTH:
            return columns
    return 1


def _space(space: Space) -> Figure:
    made = Figure(figsize=(WIDTH, 7.2), layout="constrained")
    axes = made.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    for dots in space.clouds:
        size, opacity = dots.size**2, dots.opacity
        axes.scatter(*dots.points.T, s=size, color=dots.colour, alpha=opacity, linewidths=0, label=dots.label)
    named: set[str] = set()
    for label, points, colour, dash in space.paths:
        shown = "_" if label in named else label
        axes.plot(*points.T, color=colour, linestyle=DASHES[dash], linewidth=1.8, label=shown)
        named.add(label)
    middle, half = space.box()
    for name, centre, h in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(centre - h, centre + h)
        getattr(axes, f"set_{name}label")(space.axis_label.replace("x", name, 1), labelpad=10)
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(5, prune="both"))
    axes.set_box_aspect(tuple(half), zoom=0.8)
    axes.view_init(elev=32, azim=-50)
    columns = _columns([*(dots.label for dots in space.clouds), *named])
    made.legend(loc="outside upper left", ncols=columns, frameon=False, markerscale=2.0)
    return made
