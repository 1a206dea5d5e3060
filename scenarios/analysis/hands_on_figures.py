"""Figures 7 to 11 of the admittance paper, from the trace of a hands-on run, as PNG and SVG.

7 and 10: traces of the tool, port error, distance from the region, repulsion at the port, the hand. 8: norm of x_c.
9 and 11: damping. 7 to 9 are the paper's for the tip, 10 and 11 for the whole tool; both are drawn alike.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from primitives.checks import Array
from scenarios.analysis.figures import COLOURS, save, thin
from scenarios.analysis.hands_on_metrics import clearance_of, port_offset
from scenarios.analysis.tool_poses import shaft_lines
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part
from scenarios.hands_on.scene import HandsOnScene

SHOWN_TRACES = 40
"""Traces of the tool that are drawn in space."""
ABOVE = 0.15
"""Length of the tool that is drawn above the port, as a share of that below."""
SHOWN_POINTS = 4000
"""Points of a part that are drawn at most."""
FORBIDDEN, ALLOWED = ("#B5332A", "#E08E79"), "#7FA66B"
"""Colours of the parts: the first that is forbidden, the others that are, and those that may be touched."""


def traces_in_space(trace: Trace, scene: HandsOnScene, parts: Mapping[str, Part]) -> Figure:
    """The tool's axis over the run, above the anatomy, millimetres from the port; red parts are forbidden."""
    ends, axes_z = shaft_lines(scene, scene.build_robot(), trace)
    port, length = np.array(scene.port), scene.parameters.shaft_length
    figure = Figure(figsize=(7.5, 7.0), layout="constrained")
    space = figure.add_subplot(projection="3d")
    assert isinstance(space, Axes3D)
    shown = [np.zeros((1, 3))]
    reds = dict(zip(scene.forbidden_parts, (FORBIDDEN[0], *[FORBIDDEN[1]] * len(parts)), strict=False))
    for name, part in parts.items():
        points = (part.cloud.world_points - port) * 1e3
        points = points[:: max(1, len(points) // SHOWN_POINTS)]
        shown.append(points)
        label = f"{name} (forbidden)" if name in reds else name
        space.scatter(*points.T, s=7, color=reds.get(name, ALLOWED), alpha=0.6, linewidths=0, label=label)
    keep = np.unique(np.linspace(0, len(ends) - 1, SHOWN_TRACES).astype(int))
    for share, k in zip(np.linspace(0.0, 1.0, len(keep)), keep, strict=True):
        above = (1.0 + ABOVE) * np.linalg.norm(ends[k] - port)
        line = np.array([ends[k], ends[k] - min(above, length) * axes_z[k]]) - port
        shown.append(line * 1e3)
        space.plot(*(line.T * 1e3), color=(0.1, 0.25 + 0.4 * share, 0.75), linewidth=0.8, alpha=0.7)
    path = (ends[thin(ends[:, 2])] - port) * 1e3
    shown.append(path)
    space.plot(*path.T, color="#E69F00", linewidth=1.8, label="end of the shaft")
    space.scatter([0], [0], [0], color="black", s=16, marker="o", label="port")
    box = np.vstack(shown)
    low, high = box.min(axis=0), box.max(axis=0)
    half = 0.5 * np.maximum(high - low, 0.4 * np.max(high - low))
    for name, centre, h in zip("xyz", 0.5 * (low + high), half, strict=True):
        getattr(space, f"set_{name}lim")(centre - 1.05 * h, centre + 1.05 * h)
        getattr(space, f"set_{name}label")(f"{name} from the port [mm]", labelpad=10)
    space.zaxis.set_tick_params(pad=10)
    space.zaxis.labelpad = 20
    space.set_box_aspect(tuple(half), zoom=0.8)
    space.view_init(elev=16, azim=-60)
    figure.legend(loc="outside upper center", ncols=4, frameon=False, markerscale=2.5)
    return figure


def _curve(axes: Axes, t: Array, values: Array, label: str, colour: str) -> None:
    keep = thin(values)
    axes.plot(t[keep], values[keep], label=label, color=colour, linewidth=1.2)


def _distances(axes: Axes, trace: Trace, scene: HandsOnScene, clearances: Mapping[str, Array]) -> None:
    """The tool's distance from the points of each region, what of it must not be reached, where repulsion begins."""
    if not clearances:
        axes.text(0.5, 0.5, "nothing is forbidden", ha="center", va="center", transform=axes.transAxes)
        return
    farthest, reach = 0.0, 0.0
    for i, (name, at) in enumerate(clearances.items()):
        safe, colour = float(trace.header["regions"][name]["radius"]), COLOURS[i]
        _curve(axes, trace.t, (at + safe) * 1e3, f"to {name}", colour)
        axes.axhline(safe * 1e3, color=colour, linewidth=1.0, linestyle="--", label=f"limit of {name}")
        farthest, reach = max(farthest, float(at.max() + safe)), max(reach, safe + scene.parameters.d_0)
    axes.axhline(reach * 1e3, color="#888888", linewidth=0.8, label="repulsion begins")
    axes.set_ylim(0.0, min(1.05 * max(farthest, reach), 6.0 * reach) * 1e3)


def over_time(trace: Trace, scene: HandsOnScene, parts: Mapping[str, Part]) -> Figure:
    """Port error, distance from the region, repulsion along the tool and torque about the port, hand's wrench."""
    robot = scene.build_robot()
    ends, axes_z = shaft_lines(scene, robot, trace)
    t, port = trace.t, np.array(scene.port)
    figure = Figure(figsize=(9.0, 10.0), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    _curve(panels[0], t, port_offset(port, ends, axes_z) * 1e6, "of the plant", COLOURS[5])
    panels[0].set_ylabel("port to axis [um]")
    clearances = {r.name: clearance_of(r, robot, parts, trace["plant_q"]) for r in scene.regions}
    _distances(panels[1], trace, scene, clearances)
    panels[1].set_ylabel("tool to points [mm]")
    along, torque = trace["free_repulsion"][:, 0], trace["free_repulsion"][:, 1:4]
    _curve(panels[2], t, along, "force along the tool [N]", COLOURS[0])
    for i, label in enumerate(("torque about the port, x [Nm]", "y [Nm]", "z [Nm]")):
        _curve(panels[2], t, torque[:, i], label, COLOURS[i + 4])
    panels[2].set_ylabel("repulsion [N, Nm]")
    for i, name in enumerate("xyz"):
        _curve(panels[3], t, trace["hand_wrench"][:, i], f"force, {name} [N]", COLOURS[i + 4])
    panels[3].set_ylabel("hand [N]")
    panels[3].set_xlabel("time [s]")
    for axes in panels[1:] if scene.regions else panels[2:]:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=8, ncols=5, frameon=False, borderaxespad=0.1)
    return figure


def port_reference(trace: Trace) -> Figure:
    """Figure 8: the norm of the port error that the admittance's own reference has."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    axes = figure.subplots()
    norm = np.linalg.norm(trace["x_c"], axis=1)
    _curve(axes, trace.t, norm * 1e6, "", COLOURS[5])
    axes.set_ylabel("|x_c| [um]")
    axes.set_xlabel("time [s]")
    return figure


def damping(trace: Trace, scene: HandsOnScene) -> Figure:
    """Figures 9 and 11: what of the damping (43) fades with speed and what grows with the repulsion."""
    # A cycle's damping is that of the velocity and the repulsion which the cycle before it led to.
    p, v, t = scene.parameters, trace["v"][:-1], trace.t[1:]
    speeds = np.abs(v[:, 0]), np.linalg.norm(v[:, 1:4], axis=1)
    push = trace["free_repulsion"][:-1]
    pushes = np.abs(push[:, 0]), np.linalg.norm(push[:, 1:4], axis=1)
    figure = Figure(figsize=(9.0, 5.2), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    for axes, i, unit in ((panels[0], 0, "along the tool [N s/m]"), (panels[1], 1, "about the port [Nm s/rad]")):
        _curve(axes, t, p.Q[i] * np.exp(-p.M[i] * speeds[i]), "at low speed, D_v", COLOURS[5])
        _curve(axes, t, p.G[i] * (1.0 - np.exp(-p.C[i] * pushes[i] ** 2)), "near the region, D_r", COLOURS[4])
        axes.set_ylabel(unit)
    panels[0].legend(loc="upper left", fontsize=8, ncols=2, frameon=False)
    panels[1].set_xlabel("time [s]")
    return figure


def draw_hands_on(trace: Trace, scene: HandsOnScene, parts: Mapping[str, Part], folder: Path) -> list[Path]:
    """Draw the paper's figures of a run; returns the files, PNG and SVG of each."""
    whole = any(region.first.kind == "segment" for region in scene.regions)
    main, last = ("figure10", "figure11") if whole else ("figure7", "figure9")
    run = trace.header
    method = "" if run["enforcement"] == "admittance" else f"-{run['enforcement']}"
    stem = f"{run['scene']}-{run['robot']}-{run['plant']}{method}"
    drawn = {
        f"{stem}-{main}-traces": traces_in_space(trace, scene, parts),
        f"{stem}-{main}-time": over_time(trace, scene, parts),
        f"{stem}-figure8-port": port_reference(trace),
        f"{stem}-{last}-damping": damping(trace, scene),
    }
    return [path for name, figure in drawn.items() for path in save(figure, folder, name)]
