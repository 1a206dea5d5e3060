"""What the figures of a comparison need of one run of a hands-on scene, computed once from its trace."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from primitives.checks import Array
from scenarios.analysis.boundary_force import boundary_force
from scenarios.analysis.cells import Cell
from scenarios.analysis.hands_on_metrics import clearance, port_offset
from scenarios.analysis.look import Look
from scenarios.analysis.picture import Dash
from scenarios.analysis.tool_poses import shaft_lines
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part
from scenarios.hands_on.scene import HandsOnScene


@dataclass(frozen=True)
class RunView:
    """One run of a cell.

    Attributes
    ----------
    label : of its curves. ends, axes : (k, 3) end of the shaft and its direction, metres. clearance, port_error : (k,)
        metres. boundary, hand : (k,) forces, N. colour, dash : of its curves.
    """

    label: str
    trace: Trace
    ends: Array
    axes: Array
    clearance: Array
    port_error: Array
    boundary: Array
    hand: Array
    colour: str
    dash: Dash


def view(cell: Cell, look: Look, trace: Trace, scene: HandsOnScene, parts: Mapping[str, Part]) -> RunView:
    """Compute what is drawn of a run of a cell."""
    robot = scene.build_robot()
    ends, axes = shaft_lines(scene, robot, trace)
    return RunView(
        cell.name,
        trace,
        ends,
        axes,
        clearance(scene, robot, parts, trace["plant_q"]),
        port_offset(np.array(scene.port), ends, axes),
        np.linalg.norm(boundary_force(trace, scene), axis=1),
        np.linalg.norm(trace["hand_wrench"][:, :3], axis=1),
        *look,
    )
