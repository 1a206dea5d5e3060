"""A point that moves along three axes: what the tables of `choosing.md` are measured with."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from primitives import Constraint, ConstraintSet, DHRow, Robot
from primitives.checks import Array
from vfi import Controller, Measurement, State, VelocityTask

_QUARTER = np.pi / 2.0


class Run(NamedTuple):
    """What a run of K cycles gave.

    Attributes
    ----------
    margin : (K,) true margins in metres. command : (K, 3) m/s. degraded : cycles in another state than RUN.
    """

    margin: Array
    command: Array
    degraded: int


def point(acceleration: float = np.inf) -> Robot:
    """Three sliding joints whose axes are world x, y and z; the frame "tip" is at q, in metres."""
    rows = [
        DHRow("prismatic", 0.0, 0.0, _QUARTER, 0.0),  # along z
        DHRow("prismatic", _QUARTER, 0.0, _QUARTER, 0.0),  # along x
        DHRow("prismatic", _QUARTER, 0.0, 0.0, 0.0),  # along y
    ]
    robot = Robot.from_dh(rows, convention="modified", name="point")
    return robot.with_limits(acceleration=np.full(3, acceleration))


def jacobian(robot: Robot) -> Array:
    """(3, 3) velocity of the tip over the joints' velocities; a rotation."""
    return np.array(robot.kinematics(np.zeros(3)).jacobian(robot.tip)[:3])


def drive(
    constraint: Constraint,
    start: Array,
    wanted: Callable[[Array], Array],
    *,
    eta: float,
    period: float,
    seconds: float,
    delay: int = 0,
    lag: float = 0.0,
    acceleration: float = np.inf,
    guard: str = "act",
) -> Run:
    """Let the point go where it wants to, under one constraint.

    Parameters
    ----------
    start : (3,) world, metres. wanted : from the measured position (3,) to the velocity that is wanted, m/s.
    delay : cycles by which the measured position is old.
    lag : time constant of the joints, which follow their commands as a first-order lag, seconds.
    acceleration : limit of each joint, m/s^2. eta, period, guard : see `Controller`.
    """
    robot = point(acceleration)
    J = jacobian(robot)
    controller = Controller(
        robot, ConstraintSet([constraint]), VelocityTask(), period=period, eta=eta, limit_eta=1.0, guard=guard
    )
    q, qdot = J.T @ start, np.zeros(3)
    past, margin, commands, degraded = [q] * (delay + 1), [], [], 0
    for k in range(round(seconds / period)):
        seen = past[-1 - delay]
        command = controller.step(Measurement(k * period, seen, qdot), J.T @ wanted(J @ seen))
        degraded += command.state is not State.RUN
        share = 1.0 if lag == 0.0 else 1.0 - np.exp(-period / lag)
        # The exact solution of lag dv/dt = command - v over a period.
        mean = command.qdot + (qdot - command.qdot) * (share * lag / period if lag else 0.0)
        qdot = qdot + share * (command.qdot - qdot)
        q = q + period * mean
        past.append(q)
        commands.append(J @ command.qdot)
        margin.append(_margin(constraint, J @ q))
    return Run(np.array(margin), np.array(commands), degraded)


def _margin(constraint: Constraint, at: Array) -> float:
    """The margin as it is, from the position (3,): of a plane and of a line, whose geometry is in the world."""
    geometry = constraint.second.geometry
    away = at - geometry[:3]
    along = away @ geometry[3:6]
    if constraint.second.kind == "plane":
        return float(along - constraint.safe_distance)
    return float(constraint.safe_distance - np.linalg.norm(away - along * geometry[3:6]))


def millimetres(value: float, digits: int = 3) -> str:
    """Metres as millimetres, without a minus sign before zero."""
    return f"{round(value * 1e3, digits) + 0.0:.{digits}f}"
