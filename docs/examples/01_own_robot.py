"""A robot of one's own and one constraint: the tip may go anywhere but below a table.

Run it with ``python docs/examples/01_own_robot.py``.
"""

from pathlib import Path

import numpy as np

from primitives import Constraint, ConstraintSet, Plane, Point, Robot
from vfi import Controller, Measurement, VelocityTask

# Six lines to a first constraint: a robot, a point on it, a plane, what to keep, and a controller.
robot = Robot.from_urdf(Path(__file__).parent / "six_axis.urdf", tip="tool_tip")
tip = Point.at([0.0, 0.0, 0.0], frame="tool_tip")  # m, in the tool's frame
table = Plane.through(point=[0.0, 0.0, 0.10], normal=[0.0, 0.0, 1.0])  # m, in the world
above = Constraint("above table", tip, table, keep="outside", safe_distance=0.01)  # m
period = 0.004  # s
controller = Controller(robot, ConstraintSet([above]), VelocityTask(), period=period, eta=5.0)  # eta in 1/s

q = np.array([0.0, 0.3, 0.9, 0.8, 0.0, 0.2])  # rad
qdot = np.zeros(robot.n)  # rad/s
wanted = np.array([0.1, 0.3, 0.2, 0.0, 0.0, 0.0])  # rad/s; would drive the tip through the table

margins = []
for k in range(1000):
    command = controller.step(Measurement(k * period, q, qdot), wanted)
    qdot = command.qdot
    q = q + period * qdot
    margins.append(command.margins["above table"])

height = robot.kinematics(q).translation("tool_tip")[2]
print(f"margin: first {margins[0] * 1e3:.1f} mm, smallest {min(margins) * 1e3:.3f} mm")
print(f"tip height at the end: {height * 1e3:.1f} mm, table and safe distance: 110.0 mm")
print(f"multiplier of the row at the end: {command.multipliers['above table']:.3f}")
