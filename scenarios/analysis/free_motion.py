"""What the trace says in the admittance's free coordinates: speed along the shaft, and turn about the port."""

from typing import NamedTuple

import numpy as np

from primitives.checks import Array
from scenarios.analysis.trace import Trace
from scenarios.hands_on.scene import HandsOnScene


class FreeTrace(NamedTuple):
    """Every cycle but the first: the reference's shaft where the cycle begins, and what moved it.

    Attributes
    ----------
    ends, axes : (k, 3) end and direction of the shaft, world, metres.
    hand : (k, 4) the hand's force along the shaft, N, and torque about the port, Nm.
    before, after : (k, 4) velocity before and after the cycle, m/s and rad/s. damping : (k, 4) of the cycle.
    """

    ends: Array
    axes: Array
    hand: Array
    before: Array
    after: Array
    damping: Array


def free_trace(trace: Trace, scene: HandsOnScene) -> FreeTrace:
    """Take a trace into free coordinates; k is one less than its cycles."""
    axes, handles = trace["handle"][:-1, [2, 5, 8]], trace["handle"][:-1, 9:]
    force, torque = trace["wrench"][1:, :3], trace["wrench"][1:, 3:]
    along = np.sum(axes * force, axis=1)
    about = np.cross(handles - np.array(scene.port), force) + torque
    v = trace["v"][:, :4]
    ends = handles + scene.parameters.shaft_length * axes
    return FreeTrace(ends, axes, np.column_stack([along, about]), v[:-1], v[1:], trace["damping"][1:, :4])
