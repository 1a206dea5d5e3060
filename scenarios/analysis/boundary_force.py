"""What the boundary puts on the hand: the force that keeps the tool out, whoever exerts it, and where it is first felt.

The target admittance is M dv/dt + D v = f + f_b, with f the hand's force in free coordinates and f_b that of potentials
and rows together. All but f_b is in the trace, so f_b is what is left, and is defined alike for every enforcement.
"""

import numpy as np

from primitives.checks import Array
from scenarios.analysis.free_motion import free_trace
from scenarios.analysis.trace import Trace
from scenarios.hands_on.enforcement import damps_implicitly
from scenarios.hands_on.scene import HandsOnScene

FELT = 1.0
"""N at the shaft's end from which on the boundary counts as felt."""
ROUNDING = 1e-9
"""N below which a force is what rounding left of terms that cancel; it counts as zero."""


def boundary_force(trace: Trace, scene: HandsOnScene) -> Array:
    """(k, 3) force of the boundary in each cycle as one at the end of the shaft, world axes, N.

    The force along the shaft, and the torque about the port as the force at the shaft's end that has it. Exact for the
    semi-implicit integrator; others, which take D v elsewhere in a cycle, err by what D v changes in one. Zero in the
    first cycle, before which there is none, and where limits held the motion back, whose part cannot be told.
    """
    period, masses = float(trace.header["period_s"]), np.array(scene.parameters.inertia)
    free = free_trace(trace, scene)
    implicit = damps_implicitly(trace.header["enforcement"], scene)
    damped = free.damping * (free.after if implicit else free.before)
    left = masses * (free.after - free.before) / period + damped - free.hand
    away = free.ends - np.array(scene.port)
    aside = np.cross(left[:, 1:], away) / np.sum(away**2, axis=1)[:, None]
    out = np.zeros((len(left) + 1, 3))
    out[1:] = np.where(trace["limited"][1:, None] == 0.0, left[:, :1] * free.axes + aside, 0.0)
    out[np.linalg.norm(out, axis=1) < ROUNDING] = 0.0
    return out


def felt_clearance(force: Array, clearance: Array) -> float | None:
    """Clearance, metres, that the tool had when the boundary's force first exceeded `FELT`; None where it never did.

    force (k,), N, in each cycle; clearance (k,), metres, at the end of each.
    """
    felt = np.flatnonzero(force[1:] > FELT)
    return float(clearance[felt[0]]) if len(felt) and np.isfinite(clearance[felt[0]]) else None
