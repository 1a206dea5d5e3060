"""Margins on the way from one cycle to the next, where no controller looks."""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud
from primitives.evaluate import evaluate_margins
from primitives.kinematics import forward_kinematics
from primitives.point_cloud import PointCloud
from primitives.robot import Robot
from primitives.table import tabulate, used_frames
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part
from scenarios.plants import PLANTS
from scenarios.scene import Scene

PARTS = 4
"""Parts of a period: the margins are taken at the three places between them too."""


def margins_at(
    robot: Robot, constraints: ConstraintSet, positions: Array, clouds: Mapping[str, PointCloud] | None = None
) -> Array:
    """Margins (k, m) of constraints without entities at configurations (k, n), metres and radians.

    clouds : {name: cloud} of the constraints' clouds.
    """
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
        for i, constraint in enumerate(constraints):
            if constraint.is_cloud:
                margin[i] = _cloud_margin(constraint, pose, frames, clouds or {})
    return out


def _cloud_margin(c: Constraint, pose: Array, frames: tuple[str, ...], clouds: Mapping[str, PointCloud]) -> float:
    """Margin of a part of the tool from the spheres of a cloud, metres, where the frames are at pose (k, 12)."""
    tool, other = c.first, cast(Cloud, c.second)
    cloud, at, on = clouds[other.name], pose[frames.index(tool.frame)], pose[frames.index(other.frame)]
    carrier = dq.from_matrix(np.ascontiguousarray(on[:9].reshape(3, 3)), on[9:])
    moved = cloud.moved(dq.product(dq.product(carrier, np.array(other.dual_quaternion)), np.array(cloud.pose)))
    rotation, geometry = at[:9].reshape(3, 3), tool.geometry
    start = at[9:] + rotation @ geometry[:3]
    return moved.segment_distance(start, start + geometry[6] * (rotation @ geometry[3:6])) - c.safe_distance


def margins_between(
    trace: Trace, robot: Robot, constraints: ConstraintSet, clouds: Mapping[str, PointCloud] | None = None
) -> Array:
    """Smallest margin (cycles, m) of each period, whose joints are taken to move evenly until the next cycle.

    On the ideal plant they do, by the velocity that was commanded; on another one to where they were measured next.
    """
    q = trace["q"]
    if trace.header["plant"] == PLANTS[0]:
        moved = np.zeros_like(q)
        decided = [trace.header["joints"].index(joint) for joint in trace.header["decided"]]
        moved[:, decided] = float(trace.header["period_s"]) * trace["qdot"]
    else:
        moved = np.diff(q, axis=0, append=q[-1:])
    shares = np.arange(PARTS) / PARTS
    positions = (q[:, None] + shares[:, None] * moved[:, None]).reshape(-1, robot.n)
    smallest: Array = margins_at(robot, constraints, positions, clouds).reshape(len(q), PARTS, -1).min(axis=1)
    return smallest


def clearance_between(trace: Trace, scene: Scene, parts: Mapping[str, Part]) -> dict[str, Any]:
    """What a summary says of the margins between cycles; nothing where a constraint has a moving entity.

    parts : the scene's anatomy.
    """
    if any(c.first.entity or c.second.entity for c in scene.constraints):
        return {}
    clouds = {name: part.cloud for name, part in parts.items()}
    smallest = margins_between(trace, scene.build_robot(), scene.constraints, clouds).min(axis=0)
    named = [(c.name, c.definition.unit, value) for c, value in zip(scene.constraints, smallest.tolist(), strict=True)]
    return {f"min_margin_between_{u}": {n: value for n, unit, value in named if unit == u} for u in ("m", "rad")}
