"""Pictures as figures of plotly: plain data for its JavaScript."""

from typing import Any

import numpy as np

from primitives.checks import Array
from scenarios.analysis.picture import Chart, Line, Panel, Picture, Space

FONT = {"family": "system-ui, -apple-system, 'Segoe UI', 'Liberation Sans', sans-serif", "size": 13, "color": "#333333"}
GRID, EDGE, SHADE = "#E9E9E9", "#9A9A9A", "rgba(213, 94, 0, 0.09)"
DASHES = {"solid": "solid", "dash": "12px,7px", "dot": "dot", "dashdot": "dashdot"}
SYMBOLS = {"dots": "circle", "diamonds": "diamond"}
LEGEND, TITLE, FOOT = 34, 26, 52
"""Pixels for the legend above, a panel's title, and the axis below it."""
EYE, CENTRE = {"x": 1.1, "y": -1.2, "z": 0.85}, {"x": 0.0, "y": 0.0, "z": -0.12}
"""From where a figure in space is seen, and what is in the middle of the view, in lengths of its longest side."""
DIGITS = 5


def plain(values: Array) -> list[float]:
    """Numbers to `DIGITS` digits: finer than a screen shows."""
    return [float(f"{v:.{DIGITS}g}") for v in values]


def figure(picture: Picture) -> dict[str, Any]:
    """{"data": [...], "layout": {...}} of a picture."""
    return _space(picture) if isinstance(picture, Space) else _chart(picture)


def _line(line: Line, axes: dict[str, str], first: bool) -> dict[str, Any]:
    look: dict[str, Any] = {"color": line.colour}
    if line.marks:
        small = line.marks == "dots"
        marker = look | {"symbol": SYMBOLS[line.marks], "size": 4 if small else 11, "opacity": 0.45 if small else 1.0}
        drawn: dict[str, Any] = {"mode": "markers", "marker": marker}
    else:
        drawn = {"mode": "lines", "line": look | {"dash": DASHES[line.dash], "width": line.width}}
    return {
        "type": "scatter",
        "name": line.label,
        "legendgroup": line.label,
        "showlegend": first,
        "x": plain(line.x),
        "y": plain(line.y),
        "hovertemplate": f"%{{y:.4g}} at %{{x:.4g}}<extra>{line.label}</extra>",
        **drawn,
        **axes,
    }


def _chart(chart: Chart) -> dict[str, Any]:
    count = len(chart.panels)
    columns, rows = chart.columns, -(-count // chart.columns)
    height = rows * (chart.panel_height + TITLE + FOOT) + LEGEND
    data: list[dict[str, Any]] = []
    layout = _layout(height)
    layout |= {"shapes": [], "annotations": []}
    named: set[str] = set()
    for i, panel in enumerate(chart.panels):
        number = "" if i == 0 else str(i + 1)
        axes = {"xaxis": f"x{number}", "yaxis": f"y{number}"}
        row, column = divmod(i, columns)
        gap = 0.13 if columns > 1 else 0.0
        width = (1.0 - gap * (columns - 1)) / columns
        left = column * (width + gap)
        plot = rows * (chart.panel_height + TITLE + FOOT) - FOOT
        top = 1.0 - (row * (chart.panel_height + TITLE + FOOT) + TITLE) / plot
        bottom = max(0.0, top - chart.panel_height / plot)
        layout[f"xaxis{number}"] = _axis(panel.x_label, [left, left + width], panel.x_range, f"y{number}")
        layout[f"yaxis{number}"] = _axis(panel.y_label, [bottom, top], panel.y_range, f"x{number}")
        if chart.shared_x and i:
            layout[f"xaxis{number}"]["matches"] = "x"
        if panel.rows:
            names = {"tickvals": list(panel.rows), "ticktext": list(panel.rows.values()), "zeroline": False}
            layout[f"yaxis{number}"] |= names
        layout["annotations"].append(_title(panel.title, left, top))
        _add_marks(layout, panel, number)
        for line in panel.lines:
            data.append(_line(line, axes, bool(line.label) and line.label not in named))
            named.add(line.label)
    return {"data": data, "layout": layout}


def _layout(height: int) -> dict[str, Any]:
    return {
        "height": height,
        "font": FONT,
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "margin": {"l": 76, "r": 16, "t": LEGEND, "b": FOOT},
        "legend": {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "yref": "paper", "font": {"size": 13}},
        "hovermode": "closest",
        "dragmode": "zoom",
    }


def _axis(label: str, domain: list[float], limits: tuple[float, float] | None, anchor: str) -> dict[str, Any]:
    return {
        "title": {"text": label, "standoff": 8, "font": {"size": 12.5}},
        "domain": domain,
        "anchor": anchor,
        "gridcolor": GRID,
        "linecolor": EDGE,
        "zerolinecolor": EDGE,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": EDGE,
        "automargin": True,
        **({"range": list(limits)} if limits else {}),
    }


def _title(text: str, left: float, top: float) -> dict[str, Any]:
    place = {"x": left, "y": top, "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    return {"text": f"<b>{text}</b>", "showarrow": False, "yshift": 3, "font": {"size": 13}, **place}


def _add_marks(layout: dict[str, Any], panel: Panel, number: str) -> None:
    across = {"xref": f"x{number} domain", "yref": f"y{number}", "x0": 0, "x1": 1, "layer": "below"}
    if panel.shaded is not None:
        low = panel.y_range[0] if panel.y_range else min(float(line.y.min()) for line in panel.lines)
        layout["shapes"].append(
            {"type": "rect", **across, "y0": low, "y1": panel.shaded, "fillcolor": SHADE, "line": {"width": 0}}
        )
    for level in panel.levels:
        line = {"color": EDGE, "width": 1, "dash": "dash"}
        layout["shapes"].append({"type": "line", **across, "y0": level.y, "y1": level.y, "line": line})
        layout["annotations"].append(
            {
                "text": level.label,
                "showarrow": False,
                "xref": f"x{number} domain",
                "yref": f"y{number}",
                "x": 0.5,
                "y": level.y,
                "xanchor": "center",
                "yanchor": "bottom",
                "font": {"size": 11, "color": "#666666"},
            }
        )


def _space(space: Space) -> dict[str, Any]:
    data: list[dict[str, Any]] = []
    for dots in space.clouds:
        marker = {"size": dots.size, "color": dots.colour, "opacity": dots.opacity, "line": {"width": 0}}
        data.append(_points(dots.label, dots.points) | {"mode": "markers", "marker": marker, "hoverinfo": "name"})
    named: set[str] = set()
    for label, points, colour, dash in space.paths:
        line, first = {"color": colour, "width": 5, "dash": dash}, label not in named
        one = {"mode": "lines", "line": line, "legendgroup": label, "showlegend": first}
        data.append(_points(label, points) | one)
        named.add(label)
    layout = _layout(640)
    middle, half = space.box()
    axes = {
        f"{name}axis": {
            "title": {"text": space.axis_label.replace("x", name, 1)},
            "gridcolor": GRID,
            "backgroundcolor": "white",
            "showspikes": False,
            "range": plain(np.array([centre - h, centre + h])),
        }
        for name, centre, h in zip("xyz", middle, half, strict=True)
    }
    sides = dict(zip("xyz", plain(half / np.max(half)), strict=True))
    layout["scene"] = {**axes, "aspectmode": "manual", "aspectratio": sides, "camera": {"eye": EYE, "center": CENTRE}}
    layout["margin"] = {"l": 0, "r": 0, "t": LEGEND, "b": 0}
    return {"data": data, "layout": layout}


def _points(label: str, points: Array) -> dict[str, Any]:
    x, y, z = (plain(c) for c in np.asarray(points).T)
    return {"type": "scatter3d", "name": label, "x": x, "y": y, "z": z}
