"""Paper A, Figure 2: a cut through two vessels, the spheres that cover them, and how far their repulsion reaches."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from admittance import TABLE_1, repulsion
from docs.figures.drawing import BOUNDARY, FORBIDDEN, GREY, RANGE, Curves
from primitives.checks import Array
from primitives.elements import Point
from primitives.point_cloud import PointCloud
from scenarios.anatomy import kidney

NAME = "a2-forbidden-region"
D_C = 0.0035
"""Radius of the spheres, metres: that of the paper's experiments."""
CUT = 0.052
"""Plane of the cut, x of the anatomy's frame, metres: across the artery and the vein in front of it."""
CLEARANCE, TIPS = 0.004, 16
"""How far from the spheres the tool tips lie whose repulsion is drawn, metres, and how many they are."""
PORT, AXIS = (CUT, 0.0, 0.2), (0.0, 0.0, 1.0)
"""Of a tool above the vessels; the force on its tip does not depend on them."""
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 721)
_EACH = 8
"""Of so many samples of an arc one is kept, and its ends."""


def _discs(points: Array, radius: float) -> Array:
    """(m, 3) middles and radii of the discs that the cut makes of spheres, metres, none within another."""
    square = radius**2 - (points[:, 0] - CUT) ** 2
    cut = square > 0.0
    discs = np.column_stack([points[cut, 1:], np.sqrt(square[cut])])
    apart = np.linalg.norm(discs[:, None, :2] - discs[None, :, :2], axis=2)
    within = apart + discs[:, None, 2] <= discs[None, :, 2]
    np.fill_diagonal(within, False)
    kept: Array = discs[~within.any(axis=1)]
    return kept


def _in_space(places: Array) -> Array:
    """Places (m, 2) of the cut as points (m, 3)."""
    return np.column_stack([np.full(len(places), CUT), places])


def _rim(cloud: PointCloud, offset: float) -> Array:
    """(k, 2) where the cut is at an offset from the cloud's spheres, metres; a row of NaN between its arcs."""
    arcs = []
    for y, z, r in _discs(cloud.world_points, D_C + offset):
        arc = np.column_stack([y + r * np.cos(_ANGLES), z + r * np.sin(_ANGLES)])
        shown = cloud.distance(_in_space(arc)) > offset - 1e-9
        if shown.any():
            # The samples beside an arc's ends are kept, so that arcs meet.
            shown |= np.roll(shown, 1) | np.roll(shown, -1)
            starts = np.flatnonzero(np.diff(shown.astype(int), prepend=0)) if not shown.all() else np.array([0])
            for piece, kept in zip(np.split(arc, starts), np.split(shown, starts), strict=True):
                if len(piece) and kept[0]:
                    arcs += [piece[:-1:_EACH], piece[-1:], np.full((1, 2), np.nan)]
    return np.concatenate(arcs)


def _evenly(places: Array, count: int) -> Array:
    """(count, 2) of the places, each as far from those before it as can be."""
    chosen = [places[np.argmin(places[:, 0])]]
    while len(chosen) < count:
        apart = np.min([np.linalg.norm(places - c, axis=1) for c in chosen], axis=0)
        chosen.append(places[np.argmax(apart)])
    return np.array(chosen)


def curves() -> Curves:
    """Discs of the spheres and of their range, both rims, tips at one clearance and the forces on them in the cut."""
    cloud = kidney().vessels.cloud(D_C)
    near = _rim(cloud, CLEARANCE)
    tips = _in_space(_evenly(near[~np.isnan(near[:, 0])], TIPS))
    forces = [
        repulsion(
            cloud.grid,
            Point.at(tip).geometry,
            safe=D_C,
            k=TABLE_1.k,
            d_0=TABLE_1.d_0,
            tip=tip,
            port=PORT,
            axis=AXIS,
        ).F_r[1:3]
        for tip in tips
    ]
    return {
        "spheres": _discs(cloud.world_points, D_C),
        "range": _discs(cloud.world_points, D_C + TABLE_1.d_0),
        "surface": _rim(cloud, 0.0),
        "range_end": _rim(cloud, TABLE_1.d_0),
        "tips": tips[:, 1:],
        "forces": np.array(forces),
    }


def draw(curves: Curves) -> Figure:
    """The cut in millimetres."""
    figure = Figure(figsize=(8.0, 7.4), layout="constrained")
    axes = figure.subplots()
    for y, z, r in curves["range"] * 1e3:
        axes.add_patch(Circle((y, z), r, facecolor=RANGE, linewidth=0))
    for y, z, r in curves["spheres"] * 1e3:
        axes.add_patch(Circle((y, z), r, facecolor=FORBIDDEN, linewidth=0))
    for y, z, r in curves["spheres"] * 1e3:
        axes.add_patch(Circle((y, z), r, fill=False, edgecolor="white", linewidth=0.6))
    axes.plot(*curves["range_end"].T * 1e3, color=GREY, linewidth=1.2)
    axes.plot(*curves["surface"].T * 1e3, color=BOUNDARY, linewidth=2.0)
    tips, forces = curves["tips"] * 1e3, curves["forces"]
    axes.plot(*tips.T, "o", color="#0072B2", markersize=3.5)
    arrows = axes.quiver(*tips.T, *forces.T, color="#0072B2", angles="xy", scale_units="xy", scale=1.0, width=0.004)
    axes.quiverkey(arrows, 0.12, 0.05, 5.0, "force on a tip, 5 N", labelpos="N", coordinates="axes")
    handles = [
        axes.plot([], [], color=BOUNDARY, linewidth=2.0)[0],
        Circle((0, 0), 1, facecolor=FORBIDDEN),
        axes.plot([], [], color=GREY, linewidth=1.2)[0],
        Circle((0, 0), 1, facecolor=RANGE),
    ]
    names = [
        "constrained surface",
        f"spheres around the points ($d_c$ = {D_C * 1e3:g} mm)",
        "end of the range",
        f"region of influence ($d_0$ = {TABLE_1.d_0 * 1e3:g} mm)",
    ]
    figure.legend(handles, names, loc="outside upper center", ncols=2, frameon=False)
    axes.set_aspect("equal")
    low, high = np.nanmin(curves["range_end"], axis=0) * 1e3, np.nanmax(curves["range_end"], axis=0) * 1e3
    axes.set_xlim(low[0] - 2.0, high[0] + 2.0)
    axes.set_ylim(low[1] - 2.0, high[1] + 2.0)
    axes.set_xlabel("y of the anatomy [mm]")
    axes.set_ylabel("z of the anatomy [mm]")
    return figure
