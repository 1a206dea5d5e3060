"""What is drawn of hands-on runs on one arm, as data: the runs of one seed, over time and in space."""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from primitives.checks import Array
from scenarios.analysis.boundary_force import FELT
from scenarios.analysis.curves import POINTS, TIME, curves
from scenarios.analysis.hands_on_view import RunView
from scenarios.analysis.ledger_chart import ledger
from scenarios.analysis.picture import Chart, Dots, Level, Line, Panel, Picture, Space
from scenarios.anatomy.parts import Part
from scenarios.hands_on.scene import HandsOnScene

CLOUD_POINTS = 3000
SIGHT = 1.6
"""How far clearance is drawn, in ranges d_0: beyond, nothing acts."""


def pictures(views: Sequence[RunView], scene: HandsOnScene, parts: Mapping[str, Part]) -> list[Picture]:
    """Every figure of the runs on one arm, one run a cell, in the order of the report."""
    return [
        in_space(views, scene, parts),
        margins(views, scene),
        forces(views),
        force_against_clearance(views, scene),
        ledger(views),
        way(views, scene),
    ]


def margins(views: Sequence[RunView], scene: HandsOnScene) -> Chart:
    """Clearance and port error over time."""
    d_0 = 1e3 * scene.parameters.d_0
    lowest = min(1e3 * float(v.clearance.min()) for v in views)
    kept = Panel(
        "Clearance between the tool and the forbidden region",
        TIME,
        "clearance [mm]",
        curves(views, lambda v: 1e3 * np.minimum(v.clearance, 2.0 * SIGHT * scene.parameters.d_0)),
        (Level(d_0, "range of the potentials, d₀"),),
        0.0,
        y_range=(min(1.15 * lowest, -0.08 * d_0), SIGHT * d_0),
    )
    port = Panel(
        "Distance of the port from the shaft", TIME, "port error [µm]", curves(views, lambda v: 1e6 * v.port_error)
    )
    caption = (
        "Above: how far the tool's surface is from the spheres of the forbidden region; shaded: inside. "
        f"Drawn up to {SIGHT:g} d₀, farther off nothing acts. Below: how far the port is from the line of the shaft."
    )
    return Chart("margins", "Margins against time", caption, (kept, port))


def forces(views: Sequence[RunView]) -> Chart:
    """Force of the hand and of the boundary over time."""
    panels = (
        Panel("Force of the hand on the handle", TIME, "hand [N]", curves(views, lambda v: v.hand)),
        Panel(
            "Force of the boundary, at the end of the shaft",
            TIME,
            "boundary [N]",
            curves(views, lambda v: v.boundary),
            (Level(FELT, f"felt from {FELT:g} N"),),
        ),
    )
    caption = (
        "Above: what the hand exerts. Below: what potentials and rows exert together to keep the tool out, as a force "
        "at the end of the shaft: what of the motion neither the hand, nor inertia, nor damping accounts for."
    )
    return Chart("forces", "Forces against time", caption, panels)


def force_against_clearance(views: Sequence[RunView], scene: HandsOnScene) -> Chart:
    """Force of the boundary over the clearance that the tool had."""
    d_0 = 1e3 * scene.parameters.d_0
    lines = []
    for view in views:
        # The force of a cycle belongs to where the cycle began.
        x, y = 1e3 * view.clearance[:-1], view.boundary[1:]
        near = np.flatnonzero(x < 1.2 * d_0)
        keep = near[:: max(1, len(near) // POINTS)]
        lines.append(Line(view.label, x[keep], y[keep], view.colour, marks="dots"))
    shown = [line for line in lines if len(line.x)]
    lowest = min((float(line.x.min()) for line in shown), default=0.0)
    panel = Panel(
        "One dot a moment near the region",
        "clearance [mm]",
        "boundary force [N]",
        tuple(shown),
        (Level(FELT, f"felt from {FELT:g} N"),),
        x_range=(min(1.1 * lowest, -0.06 * d_0), 1.2 * d_0),
    )
    caption = (
        "How the boundary makes itself felt: a potential pushes harder the nearer the tool comes, rows alone act only "
        "at the boundary, with whatever force it takes. Left of zero the tool is inside."
    )
    return Chart("force-clearance", "Force against clearance", caption, (panel,), panel_height=340)


def way(views: Sequence[RunView], scene: HandsOnScene) -> Chart:
    """Where the end of the shaft was."""
    port = np.array(scene.port)
    panels = []
    for i, name in enumerate("xyz"):
        lines = curves(views, partial(_coordinate, port=port, i=i))
        panels.append(Panel(f"{name}, from the port", TIME, f"{name} [mm]", lines))
    caption = "Traces of the end of the shaft, world axes, from the port. Where curves part, a boundary holds one back."
    return Chart("way", "Where the tool went", caption, tuple(panels), panel_height=190)


def _coordinate(view: RunView, *, port: Array, i: int) -> Array:
    return np.array(1e3 * (view.ends[:, i] - port[i]))


def in_space(views: Sequence[RunView], scene: HandsOnScene, parts: Mapping[str, Part]) -> Space:
    """Paths of the end of the shaft over the clouds."""
    port, clouds = np.array(scene.port), []
    for name, part in parts.items():
        points = 1e3 * (part.cloud.world_points - port)
        points = points[:: max(1, len(points) // CLOUD_POINTS)]
        forbidden = name in scene.forbidden_parts
        label = f"{name} (forbidden)" if forbidden else name
        clouds.append(Dots(label, points, "#C77F6B" if forbidden else "#9DB89A", 3.0, 0.3))
    paths = tuple((v.label, 1e3 * (v.ends[:: max(1, len(v.ends) // POINTS)] - port), v.colour, v.dash) for v in views)
    whole = any(region.first.kind == "segment" for region in scene.regions)
    caption = (
        "Paths of the end of the shaft over the points of the anatomy. Every point stands for a sphere around it that "
        f"must not be entered{' by the whole shaft, which comes down from the port' if whole else ''}."
    )
    return Space("space", "The tool over the cloud", caption, "x from the port [mm]", tuple(clouds), paths)
