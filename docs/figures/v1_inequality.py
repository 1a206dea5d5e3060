"""Paper V, Figure 1: how fast a margin may shrink at every place around a restricted zone, and over the distance."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from docs.figures.drawing import BOUNDARY, FORBIDDEN, Curves
from primitives.pairs.point_point import point_point
from vfi.inequality import demanded_rate

NAME = "v1-inequality"
ETA = 0.5
"""Gain of paper V's scenes, 1/s."""
RECOVERY = 0.05
"""Fastest way out of a violation that a row asks for, m/s; that of `vfi.Controller`."""
SAFE = 0.014
"""Safe distance from the middle of the zone, metres."""
HALF, STEP = 0.036, 0.006
"""What is drawn: a square of twice HALF, an arrow every STEP, metres."""
_SECONDS = 0.7
"""An arrow is what its speed goes in that time."""


def curves() -> Curves:
    """Places, and the velocity (m, 2) across the boundary that the inequality just allows there; its rate over margins.

    A rate below zero is the fastest approach that is allowed, one above zero the slowest retreat that is asked for.
    """
    side = np.arange(-HALF, HALF + 1e-9, STEP)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    apart = np.hypot(x, y) > 1e-9
    places = np.column_stack([x, y])[apart]
    velocity, gradient = [], np.zeros(12)
    middle = np.zeros(8)
    for px, py in places:
        distance, _ = point_point(np.array([px, py, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), middle, gradient)
        velocity.append(demanded_rate(distance - SAFE, ETA, RECOVERY) * gradient[:2])
    margin = np.linspace(-SAFE, HALF - SAFE, 101)
    rate = np.array([demanded_rate(m, ETA, RECOVERY) for m in margin])
    return {"places": places, "velocity": np.array(velocity), "margin": margin, "rate": rate}


def draw(curves: Curves) -> Figure:
    """The plane on the left, the rate over the margin on the right."""
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    plane, graph = figure.subplots(1, 2)
    plane.add_patch(Circle((0.0, 0.0), SAFE * 1e3, facecolor=FORBIDDEN, edgecolor=BOUNDARY, linewidth=1.5))
    places, velocity = curves["places"] * 1e3, curves["velocity"] * 1e3
    approach = np.sum(places * velocity, axis=1) < 0.0
    for chosen, colour, label in (
        (approach, "#C1272D", "fastest approach allowed"),
        (~approach, "#009E73", "slowest retreat asked for, inside"),
    ):
        plane.quiver(
            *places[chosen].T,
            *(velocity[chosen] * _SECONDS).T,
            color=colour,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            width=0.005,
            label=f"{label} (way in {_SECONDS:g} s)",
        )
    plane.plot(*places.T, "o", color="black", markersize=2)
    plane.set_aspect("equal")
    room = (HALF + 0.5 * STEP) * 1e3
    plane.set_xlim(-room, room)
    plane.set_ylim(-room, room)
    plane.set_xlabel("x [mm]")
    plane.set_ylabel("y [mm]")
    plane.set_title("restricted zone; along its boundary any velocity is allowed", loc="left", fontsize=9)
    plane.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), frameon=False, fontsize=9)
    margin, rate = curves["margin"] * 1e3, curves["rate"] * 1e3
    low, high = 1.4 * rate.min(), 1.6 * rate.max()
    graph.fill_between(margin, rate, high, color="#009E73", alpha=0.15, linewidth=0, label="allowed")
    graph.fill_between(margin, low, rate, color="#C1272D", alpha=0.15, linewidth=0, label="forbidden")
    graph.plot(margin, rate, color="black", linewidth=1.8, label=rf"$-\eta$ margin, $\eta$ = {ETA:g} 1/s")
    graph.axhline(0.0, color="#777777", linewidth=0.8)
    graph.axvline(0.0, color=BOUNDARY, linewidth=1.5)
    graph.text(0.5 * margin[0], 0.92 * low, "restricted zone", color=BOUNDARY, ha="center")
    graph.set_xlim(margin[0], margin[-1])
    graph.set_ylim(low, high)
    graph.set_xlabel("margin, distance - safe distance [mm]")
    graph.set_ylabel("rate of the margin [mm/s]")
    graph.legend(frameon=False, loc="upper right", fontsize=9)
    return figure
