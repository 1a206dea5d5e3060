"""Figures 3, 4 and 5 of the VFI paper, from any set of traces, as PNG and SVG."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from primitives.checks import Array
from primitives.errors import InputError
from scenarios.analysis.metrics import positions
from scenarios.analysis.trace import Trace, labels

# The colours of M. Okabe and K. Ito, told apart with any colour vision.
COLOURS = ("#000000", "#E69F00", "#56B4E9", "#009E73", "#D55E00", "#0072B2", "#CC79A7", "#F0E442")
STYLES = ("-", "--", "-.", (0, (5, 1)), "-")
SLIMMEST = 0.4
"""Least extent of an axis in space, as a share of the longest one."""
POINTS = 2000
"""Points that a line is thinned to; its smallest and largest values are kept."""


def thin(values: Array, most: int = POINTS) -> np.ndarray:
    """Indices of at most about that many samples, those of the extremes of each stretch among them."""
    if len(values) <= most:
        return np.arange(len(values))
    edges = np.linspace(0, len(values), most // 2 + 1).astype(int)
    picks = [a + f(values[a:b]) for a, b in pairwise(edges) if b > a for f in (np.argmin, np.argmax)]
    return np.unique([0, *picks, len(values) - 1])


def _named(traces: Sequence[Trace]) -> list[tuple[Trace, str]]:
    return list(zip(traces, labels([trace.header for trace in traces]), strict=True))


def _look(i: int) -> dict[str, Any]:
    """Colour, dashes and width of curve i; the earlier ones are wider, so that they show under the later ones."""
    width = max(2.6 - 0.4 * i, 1.0)
    return {"color": COLOURS[i % len(COLOURS)], "linestyle": STYLES[i % len(STYLES)], "linewidth": width}


def _curve(axes: Axes, i: int, trace: Trace, label: str, values: Array) -> None:
    keep = thin(values)
    axes.plot(trace.t[keep], values[keep], label=label, **_look(i))


def _legend(figure: Figure, axes: Axes, traces: Sequence[Trace]) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(len(traces) + 1, 7), frameon=False)


def margins(traces: Sequence[Trace]) -> Figure:
    """Figure 3: the margin of every constraint over time, one panel each; below the line it is violated."""
    units = {name: unit for trace in traces for name, unit in trace.header["constraints"].items()}
    rows, named = (len(units) + 1) // 2, _named(traces)
    figure = Figure(figsize=(9.0, 2.7 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, 2, squeeze=False, sharex=True).ravel()
    for axes, (name, unit) in zip(panels, units.items(), strict=False):
        scale, shown = (1e3, "mm") if unit == "m" else (np.degrees(1.0), "deg")
        for i, (trace, label) in enumerate(named):
            if name in trace.header["constraints"]:
                _curve(axes, i, trace, label, scale * trace.margin(name))
        axes.axhline(0.0, color="#777777", linewidth=0.8)
        low = min(axes.get_ylim()[0], 0.0)
        axes.axhspan(low, 0.0, color="#D55E00", alpha=0.08, linewidth=0)
        axes.set_ylim(bottom=low)
        axes.set_title(f"{name} (violated in the shaded part)", fontsize=9, loc="left")
        axes.set_ylabel(f"margin [{shown}]")
    for axes in panels[len(units) :]:
        axes.set_axis_off()
    for axes in panels[max(len(units) - 2, 0) : len(units)]:
        axes.set_xlabel("time [s]")
        axes.tick_params(labelbottom=True)
    _legend(figure, panels[0], traces)
    return figure


def velocity_and_error(traces: Sequence[Trace]) -> Figure:
    """Figure 4: the norm of the joint velocities (rad/s and m/s together, as in the paper) and of the pose error."""
    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for i, (trace, label) in enumerate(_named(traces)):
        _curve(top, i, trace, label, np.linalg.norm(trace["qdot"], axis=1))
        _curve(bottom, i, trace, label, np.linalg.norm(trace["error"], axis=1))
    top.set_ylabel("|q̇|₂  [rad/s, m/s]")
    bottom.set_ylabel("|vec₈(x − x_d)|₂")
    bottom.set_xlabel("time [s]")
    _legend(figure, top, traces)
    return figure


def tip_paths(traces: Sequence[Trace]) -> Figure:
    """Figure 5: the path of the tool tip of every run, and of the reference, in millimetres; of several tips each."""
    figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    wanted = _positions(traces[0]["reference"])
    paths = [wanted]
    axes.plot(*wanted.T, color="#999999", linestyle="-", linewidth=5.0, alpha=0.5, label="reference")
    for i, (trace, label) in enumerate(_named(traces)):
        path = _positions(trace["pose"])
        paths.append(path)
        axes.plot(*path.T, label=label, **_look(i))
        ends = path[[*np.flatnonzero(np.isnan(path[:, 0])) - 1, -1]]
        axes.scatter(*ends.T, color=COLOURS[i % len(COLOURS)], s=14)
    low, high = np.nanmin(np.vstack(paths), axis=0), np.nanmax(np.vstack(paths), axis=0)
    room = np.maximum(high - low, SLIMMEST * np.max(high - low)) / 2.0
    for name, centre, half in zip("xyz", (low + high) / 2.0, room, strict=True):
        getattr(axes, f"set_{name}lim")(centre - 1.05 * half, centre + 1.05 * half)
        getattr(axes, f"set_{name}label")(f"{name} [mm]", labelpad=8)
        getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(5))
    axes.set_box_aspect(tuple(room), zoom=0.88)
    axes.view_init(elev=18, azim=-50)
    _legend(figure, axes, traces)
    return figure


def _positions(poses: Array) -> Array:
    """Positions (k, 3) of poses (cycles, 8 tips), millimetres, one tip after the other with NaN between them."""
    keep = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), POINTS)).astype(int))
    tips = [1e3 * positions(poses[keep, at : at + 8]) for at in range(0, poses.shape[1], 8)]
    return np.vstack([tips[0], *(part for tip in tips[1:] for part in (np.full((1, 3), np.nan), tip))])


def draw_all(traces: Sequence[Trace], folder: Path) -> list[Path]:
    """Draw the three figures of these runs together; returns the files, PNG and SVG of each.

    Raises
    ------
    InputError : no traces.
    """
    if not traces:
        raise InputError("nothing to draw: expected at least one trace")
    kinds = (("figure3-margins", margins), ("figure4-error", velocity_and_error), ("figure5-tip", tip_paths))
    return [path for name, draw in kinds for path in save(draw(traces), folder, name)]


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG and SVG; returns both paths."""
    FigureCanvasAgg(figure)
    written = []
    for suffix, options in ((".png", {"dpi": 150}), (".svg", {"metadata": {"Date": None}})):
        path = folder / f"{name}{suffix}"
        figure.savefig(path, **options)
        written.append(path)
    return written
