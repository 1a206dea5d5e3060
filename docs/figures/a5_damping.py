"""Paper A, Figure 5: the two variable terms of the damping, over speed and over repulsion, with Table 1."""

import numpy as np
from matplotlib.figure import Figure

from admittance import TABLE_1
from admittance.damping import fill_damping
from docs.figures.drawing import Curves
from primitives.checks import Array

NAME = "a5-damping"
SPEED, TURN = 0.3, 0.3
"""Largest speed along the tool, m/s, and about the port, rad/s."""
FORCE, TORQUE = 30.0, 8.0
"""Largest repulsion along the tool, N, and about the port, Nm."""
_SAMPLES = 121


def _term(v: Array, F_rx: Array, **gains: tuple[float, ...]) -> Array:
    """Diagonal (4,) of the damping that some of Table 1's gains give, without the others."""
    table = np.array([gains.get(name, (0.0, 0.0, 0.0, 0.0)) for name in ("D_c", "Q", "M", "G", "C")])
    out = np.zeros(4)
    fill_damping(table, 0.0, v, F_rx, out)
    return out


def _along(value: float) -> Array:
    return np.array([value, 0.0, 0.0, 0.0])


def _about(value: float) -> Array:
    return np.array([0.0, value, 0.0, 0.0])


def curves() -> Curves:
    """D_v (44) over speed and D_r (45) over repulsion, along the tool and about the port."""
    p, rest = TABLE_1, np.zeros(4)
    out: Curves = {
        "speed": np.linspace(0.0, SPEED, _SAMPLES),
        "turn": np.linspace(0.0, TURN, _SAMPLES),
        "force": np.linspace(0.0, FORCE, _SAMPLES),
        "torque": np.linspace(0.0, TORQUE, _SAMPLES),
    }
    out["D_v_along"] = np.array([_term(_along(s), rest, Q=p.Q, M=p.M)[0] for s in out["speed"]])
    out["D_v_about"] = np.array([_term(_about(s), rest, Q=p.Q, M=p.M)[1] for s in out["turn"]])
    out["D_r_along"] = np.array([_term(rest, _along(z), G=p.G, C=p.C)[0] for z in out["force"]])
    out["D_r_about"] = np.array([_term(rest, _about(z), G=p.G, C=p.C)[1] for z in out["torque"]])
    return out


def draw(curves: Curves) -> Figure:
    """Speed on the left, repulsion on the right; along the tool above, about the port below."""
    figure = Figure(figsize=(8.6, 5.6), layout="constrained")
    panels = figure.subplots(2, 2)
    for row, column, x, y, label, colour in (
        (0, 0, "speed", "D_v_along", "speed along the tool [m/s]", "#0072B2"),
        (0, 1, "force", "D_r_along", "repulsion along the tool [N]", "#D55E00"),
        (1, 0, "turn", "D_v_about", "angular speed about the port [rad/s]", "#0072B2"),
        (1, 1, "torque", "D_r_about", "torque of the repulsion about the port [Nm]", "#D55E00"),
    ):
        axes = panels[row, column]
        axes.plot(curves[x], curves[y], color=colour, linewidth=2.0)
        axes.set_xlim(0.0, curves[x][-1])
        axes.set_ylim(0.0, 1.08 * curves[y].max())
        axes.set_xlabel(label)
    panels[0, 0].set_ylabel("damping along the tool [N s/m]")
    panels[1, 0].set_ylabel("damping about the port [Nm s/rad]")
    panels[0, 0].set_title("a) $D_v$: high at rest", loc="left", fontsize=10)
    panels[0, 1].set_title("b) $D_r$: high near the region", loc="left", fontsize=10)
    return figure
