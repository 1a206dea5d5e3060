"""`Space`: the margins of a constraint set and their Jacobians anywhere in the box of the decided joints.

Lowered once, so that a search can ask for thousands of configurations. The joints that are not decided stay where the
scene starts them.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.evaluate import evaluate_rows
from primitives.kinematics import Kinematics, snapshot, world_first
from primitives.point_cloud import PointCloud
from primitives.rcm import rcm
from primitives.robot import Robot
from primitives.table import tabulate, used_frames
from primitives.vectors import OK

TURN, SLIDE = np.pi, 1.0
"""How far from the start a joint without limits is looked at, rad and m."""
NEAR = 1e-9
"""Metres by which a query reaches past the nearest point of a cloud, so that rounding does not lose it."""


class Port(NamedTuple):
    """Where the shaft must pass: the z axis of a frame runs through a point (3,) of the world, metres."""

    shaft: str
    at: tuple[float, float, float]


class Sight(NamedTuple):
    """The constraints at one configuration of the d decided joints.

    Attributes
    ----------
    margin : (m,) metres or radians. row : (m, d) of the margins. status : (m,) see `primitives.vectors`.
    port : (2,) x_c, metres, or (0,) without a port. port_row : (2, d) of x_c, or (0, d).
    """

    margin: Array
    row: Array
    status: np.ndarray
    port: Array
    port_row: Array


class Space:
    """A constraint set over the box of the decided joints.

    Parameters
    ----------
    robot, constraints : none of the constraints may refer to an entity.
    group : the decided joints. start : (n,) where all joints start, rad and m.
    clouds : {name: cloud} of the constraints' clouds. port : None for none.

    Attributes
    ----------
    low, high : (d,) of the box; the limits, or `TURN` and `SLIDE` about the start where there are none.
    first : (d,) the start.
    """

    def __init__(
        self,
        robot: Robot,
        constraints: ConstraintSet,
        group: str,
        start: Array,
        clouds: Mapping[str, PointCloud] | None = None,
        port: Port | None = None,
    ):
        self.robot, self.constraints, self.port = robot, constraints, port
        self.decided = robot.group(group)
        self.joints = tuple(robot.joints[i] for i in self.decided)
        self._start, self._clouds = start.copy(), clouds or {}
        self._frames = world_first((*used_frames(constraints), *([port.shaft] if port else [])))
        self._flat = robot.flat(self._frames)
        self._table = tabulate(constraints, self._frames, ())
        self._still = np.zeros((len(self._frames), 6)), np.zeros(robot.n)
        self.slides = self._flat.prismatic[self.decided] == 1
        self.first = start[self.decided]
        reach = np.where(self.slides, SLIDE, TURN)
        low, high = robot.limits.lower[self.decided], robot.limits.upper[self.decided]
        self.low = np.where(np.isfinite(low), low, self.first - reach)
        self.high = np.where(np.isfinite(high), high, self.first + reach)

    def all_joints(self, x: Array) -> Array:
        """(n,) of all joints where the decided ones are at x (d,)."""
        q = self._start.copy()
        q[self.decided] = x
        return q

    def kinematics(self, x: Array) -> Kinematics:
        """Frames that the constraints use, where the decided joints are at x (d,)."""
        return snapshot(self._flat, self._frames, self.all_joints(x))

    def at(self, x: Array) -> Sight:
        """Everything at a configuration (d,) of the decided joints."""
        m, kinematics = len(self.constraints), self.kinematics(x)
        distance, margin, residual = np.empty(m), np.empty(m), np.empty(m)
        row, status = np.empty((m, self.robot.n)), np.zeros(m, dtype=np.int64)
        poses, jacobians = kinematics.poses, kinematics.jacobians
        evaluate_rows(*self._table[:5], poses, jacobians, *self._still, distance, margin, row, residual, status)
        for i, constraint in enumerate(self.constraints):
            if constraint.is_cloud:
                margin[i], row[i], status[i] = self._cloud_row(constraint, kinematics)
        return Sight(margin, row[:, self.decided], status, *self.port_at(kinematics))

    def port_at(self, kinematics: Kinematics) -> tuple[Array, Array]:
        """x_c and its rows, as in `Sight`."""
        if self.port is None:
            return np.zeros(0), np.zeros((0, len(self.decided)))
        seen = rcm(kinematics, self.port.shaft, self.port.at)
        return seen.x_c, seen.A[:, self.decided]

    def port_rows(self, constraint: Constraint) -> Array:
        """(2, d) of x_c of a constraint that is an entry port: a shaft that passes near a point of the world."""
        at = constraint.second.geometry[:3]
        seen = rcm(self.kinematics(self.first), constraint.first.frame, (float(at[0]), float(at[1]), float(at[2])))
        rows: Array = seen.A[:, self.decided]
        return rows

    def _cloud_row(self, constraint: Constraint, kinematics: Kinematics) -> tuple[float, Array, int]:
        """Margin of a part of the tool from a cloud, its row (n,) by the nearest point, and the status."""
        tool, other = constraint.first, constraint.second
        cloud = self._clouds[other.name]  # type: ignore[attr-defined]
        carrier = dq.product(kinematics.pose(other.frame), np.array(other.dual_quaternion))
        cloud = cloud.moved(dq.product(carrier, np.array(cloud.pose)))
        rotation, origin = kinematics.rotation(tool.frame), kinematics.translation(tool.frame)
        geometry = tool.geometry
        a = origin + rotation @ geometry[:3]
        along = rotation @ geometry[3:6]
        b = a + geometry[6] * along
        clearance = cloud.segment_distance(a, b)
        index, place, distance = cloud.near(a, b, clearance + cloud.radius + NEAR)
        nearest = int(np.argmin(distance))
        where = np.array(cloud.pose)
        on_tool = a + place[nearest] * along
        on_cloud = dq.rotation_matrix(where) @ cloud.points[index[nearest]] + dq.translation(where)
        away = on_tool - on_cloud
        u = away / max(float(np.linalg.norm(away)), 1e-12)
        row = _point_row(u, kinematics, tool.frame, on_tool) - _point_row(u, kinematics, other.frame, on_cloud)
        return clearance - constraint.safe_distance, row, OK


def _point_row(u: Array, kinematics: Kinematics, frame: str, point: Array) -> Array:
    """(n,) speed along u (3,) of a point (3,) of the world that moves with a frame, per joint velocity."""
    jacobian = kinematics.jacobian(frame)
    arm = point - kinematics.translation(frame)
    out: Array = u @ jacobian[:3] + np.cross(arm, u) @ jacobian[3:]
    return out
