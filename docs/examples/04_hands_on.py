"""A hand leads a tool through a port towards a forbidden ball, with the target admittance and nothing else.

Run it with ``python docs/examples/04_hands_on.py``.
"""

import numpy as np

from admittance import TABLE_1, Admittance, Region, SpringHand, State
from primitives import Point
from primitives import dual_quaternion as dq
from scenarios.anatomy import Ellipsoid
from scenarios.robots import robots

robot = robots["lwr4plus"].build()
start = np.radians([20.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0])  # rad; the tool points down
arm = robot.kinematics(start)
tip, shaft = arm.translation("tip"), arm.rotation("tip")[:, 2]
port = tip - 0.13 * shaft  # m; where the tool passes the wall of the body

# A ball of 20 mm below the tip, as spheres around points that cover it; the tip is kept out of them.
middle = dq.from_rotation_translation(np.array([1.0, 0.0, 0.0, 0.0]), tip + 0.05 * shaft)  # m
cloud = Ellipsoid(np.array([0.02, 0.02, 0.02]), pose=middle).cloud(0.0035)  # m, d_c
forbidden = Region("ball", cloud, Point.at([0.0, 0.0, 0.0], frame="tip"), pose=cloud.pose)

admittance = Admittance(
    robot, port=port, start=start, parameters=TABLE_1, regions=[forbidden], integrator="robust", period=0.004
)

# The hand pulls the handle 80 mm down within 2 s, with at most 15 N: without the ball the tip would go through it.
top = admittance.handle
hand = SpringHand([0.0, 2.0], np.array([top, top + 0.08 * shaft]), stiffness=300.0, damping=20.0, most=15.0)

handle, velocity = top, np.zeros(3)
clearance, error, states = [], [], []
for k in range(1, 751):
    t = k * admittance.period
    motion = admittance.step(t, hand.wrench(t, handle, velocity))
    handle, velocity = motion.handle, motion.handle_velocity
    clearance.append(motion.clearance)  # m
    error.append(np.linalg.norm(motion.x_c))  # m
    states.append(motion.state)

# The ring keeps the last 512 cycles with everything; `columns` says where it stands.
last = admittance.ring[(admittance.cycles - 1) % len(admittance.ring)]
force = np.linalg.norm(last[admittance.columns["repulsion"]][:3])
ledger = admittance.ledger

print(f"all cycles in RUN: {all(s is State.RUN for s in states)}")
print(f"smallest clearance {min(clearance) * 1e3:.2f} mm, at the end {clearance[-1] * 1e3:.2f} mm")
print(f"largest port error {max(error) * 1e6:.2f} um")
print(f"repulsion at the end {force:.2f} N, work of the hand {ledger['hand']:.4f} J, excess {ledger['excess']:.1e} J")
