"""Margins on the way from one cycle to the next, where no controller looks."""

from typing import Any

import numpy as np

from primitives.checks import Array
from primitives.constraint import ConstraintSet
from primitives.evaluate import evaluate_margins
from primitives.kinematics import forward_kinematics
from primitives.robot import Robot
from primitives.table import tabulate, used_frames
from scenarios.analysis.trace import Trace
from scenarios.scene import Scene

PARTS = 4
"""Parts of a period: the margins are taken at the three places between them too."""


def margins_at(robot: Robot, constraints: ConstraintSet, positions: Array) -> Array:
    """Margins (k, m) of constraints without clouds and entities at configurations (k, n), metres and radians."""
    frames = used_frames(constraints)
    flat, table = robot.flat(frames), tabulate(constraints, frames, ())
    joint_pose, pose = np.empty((robot.n, 12)), np.empty((len(frames), 12))
    distance, status = np.empty(len(constraints)), np.empty(len(constraints), dtype=np.int64)
    out: Array = np.empty((len(positions), len(constraints)))
    for q, margin in zip(np.ascontiguousarray(positions), out, strict=True):
        forward_kinematics(
            flat.parent, flat.prismatic, flat.placement, flat.frame_joint, flat.frame_placement, q, joint_pose, pose
        )
        evaluate_margins(*table[:5], pose, distance, margin, status)
    return out


def margins_between(trace: Trace, robot: Robot, constraints: ConstraintSet) -> Array:
    """Smallest margin (cycles, m) of each period of an ideal plant, whose joints move by q̇ s until the next cycle."""
    q, qdot = trace["q"], np.zeros_like(trace["q"])
    qdot[:, [trace.header["joints"].index(joint) for joint in trace.header["decided"]]] = trace["qdot"]
    steps = float(trace.header["period_s"]) * np.arange(PARTS) / PARTS
    positions = (q[:, None] + steps[:, None] * qdot[:, None]).reshape(-1, robot.n)
    smallest: Array = margins_at(robot, constraints, positions).reshape(len(q), PARTS, -1).min(axis=1)
    return smallest


def clearance_between(trace: Trace, scene: Scene) -> dict[str, Any]:
    """What a summary says of the margins between cycles; nothing where a constraint has a cloud or a moving entity."""
    if any(c.is_cloud or c.first.entity or c.second.entity for c in scene.constraints):
        return {}
    smallest = margins_between(trace, scene.build_robot(), scene.constraints).min(axis=0)
    named = [(c.name, c.definition.unit, value) for c, value in zip(scene.constraints, smallest.tolist(), strict=True)]
    return {f"min_margin_between_{u}": {n: value for n, unit, value in named if unit == u} for u in ("m", "rad")}
