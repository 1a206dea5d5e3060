"""The scene two-arms in three ways, and with nothing enforced: clearance, how it shrinks, and which arm yields."""

from functools import cache

import numpy as np
from matplotlib.figure import Figure

from docs.figures.drawing import BOUNDARY, FORBIDDEN, GREY, Curves
from primitives.checks import Array
from scenarios.analysis.metrics import positions
from scenarios.analysis.trace import Trace
from scenarios.run import run
from scenarios.scene import COORDINATIONS
from scenarios.scene_file import load_scene

NAME = "two-arms"
BETWEEN = ("shafts", "wrists", "wrist-shaft", "shaft-wrist")
"""The constraints between the two arms."""
EVERY = 5
"""Cycles from one sample of a curve over the whole run to the next."""
CLOSE = (5.8, 6.2)
"""Seconds that are looked at cycle by cycle: both arms still wait in the middle."""
_COLOURS = {"central": "#0072B2", "static": "#009E73", "velocity": "#CC79A7"}


@cache
def trace(coordination: str) -> Trace:
    """A run of the scene; "none" is the one with nothing enforced."""
    scene = load_scene("two-arms")
    if coordination == "none":
        return run(scene.with_changes(constraints=scene.constraints.enforcing(())))
    return run(scene.with_changes(coordination=coordination))


def clearance(found: Trace) -> Array:
    """Smallest margin (cycles,) of those between the arms, metres."""
    return np.min([found.margin(name) for name in BETWEEN], axis=0)


def curves() -> Curves:
    """Clearances, metres; their rates while the arms approach, m/s; distances of the tips from the references, m."""
    t = trace("none").t
    near = (t >= CLOSE[0]) & (t < CLOSE[1])
    out: Curves = {"t": t[::EVERY], "t_close": t[near], "clearance_none": clearance(trace("none"))[::EVERY]}
    for name in COORDINATIONS:
        found = trace(name)
        out[f"clearance_{name}"] = clearance(found)[::EVERY]
        out[f"rate_{name}"] = (np.diff(clearance(found), append=np.nan) / found.header["period_s"])[near]
        for k, frame in enumerate(found.header["tasks"]):
            pose, wanted = (positions(found[what][::EVERY, 8 * k : 8 * k + 8]) for what in ("pose", "reference"))
            out[f"off_{name}_{frame.split('/')[0]}"] = np.linalg.norm(pose - wanted, axis=1)
    return out


def draw(curves: Curves) -> Figure:
    """Clearance above; below on the left its rate, on the right the distances of the two tips."""
    figure = Figure(figsize=(8.6, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 2)
    above, left, right = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    above.plot(curves["t"], 1e3 * curves["clearance_none"], color=GREY, linestyle=":", label="nothing enforced")
    for name in COORDINATIONS:
        look = {"color": _COLOURS[name], "label": name, "linewidth": 1.6}
        above.plot(curves["t"], 1e3 * curves[f"clearance_{name}"], **look)
        left.plot(curves["t_close"], 1e3 * curves[f"rate_{name}"], **look)
        for arm, dashes in (("moving", "-"), ("parked", "--")):
            off = 1e3 * curves[f"off_{name}_{arm}"]
            right.plot(curves["t"], off, color=_COLOURS[name], linestyle=dashes, linewidth=1.2)
    above.axhspan(-4.5, 0.0, color=FORBIDDEN, alpha=0.5, linewidth=0)
    above.axhspan(-4.5, -1.0, color=BOUNDARY, alpha=0.35, linewidth=0)
    above.set_ylim(-4.5, 4.0)
    above.set_xlim(0.0, curves["t"][-1])
    above.set_ylabel("margin between the tools [mm]")
    above.set_title("a) clearance; below -1 mm the tools run into each other", loc="left", fontsize=10)
    above.legend(loc="lower right", ncols=4, fontsize=9)
    left.set_ylabel("rate of the clearance [mm/s]")
    left.set_title("b) its rate, cycle by cycle", loc="left", fontsize=10)
    right.set_ylabel("tip to its reference [mm]")
    right.set_title("c) who yields: moving solid, parked dashed", loc="left", fontsize=10)
    for axes in (above, left, right):
        axes.set_xlabel("time [s]")
    return figure
