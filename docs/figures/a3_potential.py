"""Paper A, Figure 3: the barrier potential of one cloud point over the tip's distance from it, and its force."""

import numpy as np
from matplotlib.figure import Figure

from admittance import TABLE_1
from admittance.potential import barrier
from docs.figures.drawing import BOUNDARY, GREY, Curves
from scenarios.analysis.figures import COLOURS

NAME = "a3-potential"
D_C = 0.0035
"""Radius of the sphere, metres."""
GAINS = (0.005, 0.01, 0.02, 0.04)
"""k, J."""
NEAREST = 1e-5
"""Smallest clearance that is drawn, metres: at zero the potential is infinite."""


def curves() -> Curves:
    """Distances from the point (m,), and potential (k, m) and force (k, m) of each gain."""
    clearance = np.concatenate([np.geomspace(NEAREST, 0.002, 80), np.linspace(0.0021, 1.25 * TABLE_1.d_0, 120)])
    found = np.array([[barrier(c, k, TABLE_1.d_0, 0.0)[:2] for c in clearance] for k in GAINS])
    return {"distance": D_C + clearance, "potential": found[..., 0], "force": found[..., 1]}


def draw(curves: Curves) -> Figure:
    """Potential above, force below."""
    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    distance = curves["distance"] * 1e3
    for axes, name, top, label in (
        (panels[0], "potential", 0.1, "potential $V$ [J]"),
        (panels[1], "force", 40.0, "repulsive force $-V'$ [N]"),
    ):
        for i, k in enumerate(GAINS):
            axes.plot(distance, curves[name][i], color=COLOURS[(5, 2, 1, 3)[i]], linewidth=1.8, label=f"k = {k:g} J")
        axes.axvspan(0.0, D_C * 1e3, color=BOUNDARY, alpha=0.12, linewidth=0)
        axes.axvline(D_C * 1e3, color=BOUNDARY, linewidth=1.2)
        axes.axvline((D_C + TABLE_1.d_0) * 1e3, color=GREY, linestyle="--", linewidth=1.2)
        axes.set_ylim(0.0, top)
        axes.set_ylabel(label)
    panels[0].text(D_C * 1e3 - 0.15, 0.093, "$d_c$", color=BOUNDARY, ha="right")
    panels[0].text((D_C + TABLE_1.d_0) * 1e3 + 0.15, 0.093, "$d_c + d_0$", color=GREY)
    panels[0].text(0.5 * D_C * 1e3, 0.05, "never reached", color=BOUNDARY, rotation=90, ha="center", va="center")
    panels[0].legend(frameon=False, loc="upper center")
    panels[1].set_xlim(0.0, distance[-1])
    panels[1].set_xlabel("distance of the tip from the point [mm]")
    return figure
