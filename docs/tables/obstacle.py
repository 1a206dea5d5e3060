"""What a moving obstacle takes of the safe distance: a plane comes nearer, the point wants to stay where it is."""

import numpy as np

from docs.tables.point import jacobian, millimetres, point
from primitives import Constraint, ConstraintSet, Entity, Plane, Point
from primitives import dual_quaternion as dq
from vfi import Controller, Measurement, VelocityTask

NAME = "obstacle"
PERIOD, SAFE = 0.004, 0.005
"""s; m."""
CASES = ((0.5, 0.001), (0.5, 0.005), (5.0, 0.005), (50.0, 0.005))
"""eta in 1/s, speed of the obstacle in m/s."""
HEAD = (
    "$\\eta$, 1/s",
    "obstacle $v_o$, mm/s",
    "$v_o/\\eta$, mm",
    "velocity told: smallest margin, mm",
    "told that it stands still, mm",
    "and seen 0.2 mm too far away, mm",
)
ERROR = 0.0002
"""By how much the last column's measured distance is too large, m."""


def _smallest(eta: float, speed: float, told: float, error: float) -> float:
    """Smallest true margin, metres."""
    robot = point()
    J = jacobian(robot)
    wall = Plane.through(point=[0.0, 0.0, 0.0], normal=[0.0, 0.0, 1.0], entity="obstacle")
    keep = Constraint("obstacle", Point.at([0.0, 0.0, 0.0], frame="frame3"), wall, "outside", SAFE)
    controller = Controller(robot, ConstraintSet([keep]), VelocityTask(), period=PERIOD, eta=eta, limit_eta=1.0)
    q, qdot, smallest = J.T @ [0.0, 0.0, SAFE + 0.001], np.zeros(3), np.inf
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    for k in range(round(10.0 / eta / PERIOD) + round(0.002 / speed / PERIOD)):
        height = k * PERIOD * speed
        smallest = min(smallest, (J @ q)[2] - height - SAFE)
        seen = dq.from_rotation_translation(upright, np.array([0.0, 0.0, height - error]))
        moving = Entity(seen, np.array([0.0, 0.0, told, 0.0, 0.0, 0.0]))
        command = controller.step(Measurement(k * PERIOD, q, qdot, entities={"obstacle": moving}), np.zeros(3))
        qdot = command.qdot
        q = q + PERIOD * qdot
    return smallest


def rows() -> list[tuple[str, ...]]:
    """One row for each pair of gain and speed."""
    return [
        (
            f"{eta:g}",
            f"{speed * 1e3:g}",
            f"{speed / eta * 1e3:g}",
            *(millimetres(_smallest(eta, speed, *case)) for case in ((speed, 0.0), (0.0, 0.0), (0.0, ERROR))),
        )
        for eta, speed in CASES
    ]
