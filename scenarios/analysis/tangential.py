"""How much of the motion along a boundary is left beside it.

A boundary that only holds against leaves the motion along it alone: under a hand's force f the tool would settle at
v* = P D_0^-1 f, with D_0 the damping that it has at its speed far from any region, and P what the reaction of a
frictionless wall leaves of a velocity. Tangential freedom is the way along the boundary over the way at v*, near it: 1
where nothing is lost, less where damping grows near the region or the tool catches between the spheres of a cloud.
It compares with the same force at the same place, so neither the curve of the wall nor where the hand wants to go
enters. Both velocities are averaged over `WINDOW` first: inertia and tremor are not the boundary's doing.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from primitives.checks import Array
from primitives.robot import Robot
from scenarios.analysis.free_motion import free_trace
from scenarios.analysis.tool_poses import kept_away
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, placed_cloud
from scenarios.hands_on.scene import HandsOnScene

WINDOW = 0.2
"""Seconds over which velocities are averaged: several time constants of the admittance, two periods of tremor."""


class Contact(NamedTuple):
    """Where the tool is near a region.

    Attributes
    ----------
    near : (k,) whether a region is within d_0. point : (k, 3) of the tool, nearest to it, world, metres.
    normal : (k, 3) unit vectors from the region to that point, world.
    """

    near: NDArray[np.bool_]
    point: Array
    normal: Array


def contacts(scene: HandsOnScene, robot: Robot, parts: Mapping[str, Part], q: Array) -> Contact:
    """Where the tool at joints (k, n) is within d_0 of a region, the nearest of each."""
    near, point, normal = np.zeros(len(q), dtype=bool), np.zeros((len(q), 3)), np.zeros((len(q), 3))
    nearest = np.full(len(q), np.inf)
    for region in scene.regions:
        cloud, safe = placed_cloud(region, parts), region.safe_distance
        points, reach = cloud.world_points, scene.parameters.d_0 + safe + cloud.radius
        for k, (start, end) in enumerate(zip(*kept_away(region, robot, q), strict=True)):
            found, places, distances = cloud.near(start, end, reach)
            i = int(np.argmin(distances)) if len(found) else -1
            if i >= 0 and distances[i] > 0.0 and distances[i] - cloud.radius - safe < nearest[k]:
                nearest[k], near[k] = distances[i] - cloud.radius - safe, True
                length = float(np.linalg.norm(end - start))
                point[k] = start + (places[i] / length if length > 0.0 else 0.0) * (end - start)
                normal[k] = (point[k] - points[found[i]]) / distances[i]
    return Contact(near, point, normal)


def along_boundary(v: Array, a: Array, damping: Array) -> Array:
    """P v: what of free velocities (k, 4) a frictionless wall leaves, whose clearance grows at a^T v, a (k, 4).

    A velocity into the wall is stopped by a reaction mu a against the damping (k, 4): P v = v - D^-1 a mu, a^T P v = 0.
    """
    response = a / damping
    size = np.sum(a * response, axis=1)
    share = np.divide(np.sum(a * v, axis=1), size, out=np.zeros_like(size), where=size > 0.0)
    out: Array = v - response * share[:, None]
    return out


def tangential_freedom(trace: Trace, scene: HandsOnScene, parts: Mapping[str, Part]) -> float | None:
    """Way along the boundary over the way that a frictionless one would leave, near it; None where it is never near."""
    free, p = free_trace(trace, scene), scene.parameters
    contact = contacts(scene, scene.build_robot(), parts, trace["q"][:-1])
    away = contact.point - np.array(scene.port)
    a = np.column_stack([np.sum(contact.normal * free.axes, axis=1), np.cross(away, contact.normal)])
    turn = np.linalg.norm(free.after[:, 1:], axis=1)
    speed = np.column_stack([np.abs(free.after[:, 0]), turn, turn, turn])
    damping = np.array(p.D_c) + np.array(p.Q) * np.exp(-np.array(p.M) * speed)

    def ways(v: Array) -> Array:
        """Metres that the tool's nearest point goes along the boundary in each window at free velocities (k, 4)."""
        v = along_boundary(v, a, damping)
        points = v[:, :1] * free.axes + np.cross(v[:, 1:], away)
        out: Array = np.linalg.norm(points[: count * window].reshape(count, window, 3).sum(axis=1), axis=1)
        return out * period

    period = float(trace.header["period_s"])
    window = max(1, round(WINDOW / period))
    count = len(free.hand) // window
    chosen = contact.near[: count * window].reshape(count, window).all(axis=1)
    unhindered = float(ways(free.hand / damping)[chosen].sum())
    return float(ways(free.after)[chosen].sum()) / unhindered if unhindered > 0.0 else None
