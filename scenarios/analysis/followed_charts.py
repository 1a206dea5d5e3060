"""What is drawn of runs along a trajectory on one arm, by hand or not, as data: over time and in space."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from primitives.checks import Array
from scenarios.analysis.curves import POINTS, TIME, curves
from scenarios.analysis.followed_view import WINDOW, FollowedView
from scenarios.analysis.ledger_chart import ledger
from scenarios.analysis.measures import DEGREES
from scenarios.analysis.picture import Chart, Dash, Panel, Picture, Space

SHADOW = "#C4C4C4"
"""Of the reference, under the paths of the runs."""


def followed_pictures(views: Sequence[FollowedView], keep: Sequence[str]) -> list[Picture]:
    """Every figure of the runs on one arm, one run a cell, in the order of the report; keep: constraints to keep."""
    drawn: list[Picture] = [margins(views, keep), tracking(views), in_space(views)]
    if "hand_wrench" in views[0].trace.columns:
        drawn += [forces(views), ledger(views)]
    return [*drawn, motion(views)]


def margins(views: Sequence[FollowedView], keep: Sequence[str]) -> Chart:
    """The margin of every declared constraint over time."""
    panels = []
    for name, unit in views[0].trace.header["constraints"].items():
        scale, shown = (1e3, "mm") if unit == "m" else (DEGREES, "deg")
        lines = curves(views, partial(_margin, name=name, scale=scale))
        low, high = min(float(line.y.min()) for line in lines), max(float(line.y.max()) for line in lines)
        room = 0.06 * (max(high, 0.0) - min(low, 0.0))
        title = name if name in keep else f"{name} (watched)"
        limits = (min(low, 0.0) - room, max(high, 0.0) + room)
        panels.append(Panel(title, TIME, f"margin [{shown}]", lines, shaded=0.0, y_range=limits))
    caption = (
        "How far every declared constraint was from being violated, at the beginning of each cycle; shaded: violated. "
        "Those that the scene only watches nobody keeps, under any enforcement."
    )
    return Chart("margins", "Margins against time", caption, tuple(panels), columns=2, panel_height=210)


def _margin(view: FollowedView, *, name: str, scale: float) -> Array:
    return scale * view.trace.margin(name)


def tracking(views: Sequence[FollowedView]) -> Chart:
    """How far every tool was from its reference over time."""
    panels = []
    for i, frame in enumerate(views[0].trace.header["tasks"]):
        off, turned = (
            partial(_of_tool, what="off", i=i, scale=1e3),
            partial(_of_tool, what="turned", i=i, scale=DEGREES),
        )
        panels.append(Panel(f"{frame}: distance from its reference", TIME, "off [mm]", curves(views, off)))
        panels.append(Panel(f"{frame}: turned from its reference", TIME, "turned [deg]", curves(views, turned)))
    caption = (
        "How far the tool was from where it was to be, and turned from how it was to be. What keeps the constraints "
        "holds it back wherever its reference leads beyond one."
    )
    return Chart("tracking", "Tracking error against time", caption, tuple(panels), columns=2, panel_height=210)


def _of_tool(view: FollowedView, *, what: str, i: int, scale: float) -> Array:
    values: tuple[Array, ...] = getattr(view, what)
    return scale * values[i]


def motion(views: Sequence[FollowedView]) -> Chart:
    """How fast the joints moved, and how hard they were accelerated."""
    panels = (
        Panel("Joint velocities, norm", TIME, "|q̇| [rad/s, m/s]", curves(views, lambda v: v.speed)),
        Panel(
            f"Joint accelerations, rms over {WINDOW:g} s",
            TIME,
            "q̈ [rad/s², m/s²]",
            curves(views, lambda v: v.acceleration),
        ),
    )
    caption = (
        "Norms over the joints that are decided, turning and sliding ones together. The acceleration is the difference "
        "of two commands divided by the period; it shows commands that jump."
    )
    return Chart("motion", "Motion of the joints", caption, panels)


def forces(views: Sequence[FollowedView]) -> Chart:
    """Force and torque of the hand over time."""
    panels = (
        Panel("Force of the hand on the tool", TIME, "force [N]", curves(views, _norm(slice(0, 3)))),
        Panel("Torque of the hand on the tool", TIME, "torque [Nm]", curves(views, _norm(slice(3, 6)))),
    )
    caption = (
        "What the hand exerts at the tool's tip. It pulls like a spring towards the reference, so it feels as force "
        "how far the constraints hold the tool back."
    )
    return Chart("forces", "Forces against time", caption, panels)


def _norm(part: slice) -> Callable[[FollowedView], Array]:
    def norm(view: FollowedView) -> Array:
        out: Array = np.linalg.norm(view.trace["hand_wrench"][:, part], axis=1)
        return out

    return norm


def in_space(views: Sequence[FollowedView]) -> Space:
    """Paths of the tools beside those of their references."""
    paths: list[tuple[str, Array, str, Dash]] = []
    for wanted in views[0].wanted:
        paths.append(("reference", _thinned(wanted), SHADOW, "solid"))
    for view in views:
        paths += [(view.label, _thinned(tip), view.colour, view.dash) for tip in view.tips]
    caption = "Paths of the tools' tips, and of where they were to be. Where they part, a constraint holds a tool back."
    return Space("space", "Where the tools went", caption, "x [mm]", (), tuple(paths))


def _thinned(points: Array) -> Array:
    keep = np.unique(np.linspace(0, len(points) - 1, min(len(points), POINTS)).astype(int))
    return np.array(1e3 * points[keep])
