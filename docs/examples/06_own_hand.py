"""A hand of one's own: it pulls towards a place, gives up where the handle hardly moves, and tries again elsewhere.

A hand is asked once a cycle for the wrench that it puts on the handle, given where the handle is and how fast.

Run it with ``python docs/examples/06_own_hand.py``.
"""

import numpy as np

from admittance import Admittance, Hand, Region, State
from primitives import Point
from primitives import dual_quaternion as dq
from scenarios.anatomy import Ellipsoid
from scenarios.robots import robots


class Probing:
    """Pulls the handle to one target after the other, with at most `most` newtons.

    A target is given up after `patience` seconds in which the handle was slower than 1 mm/s: it feels like a wall.
    """

    def __init__(self, targets: np.ndarray, most: float = 10.0, patience: float = 0.5):
        self.targets, self.most, self.patience = targets, most, patience
        self.reset()

    def reset(self) -> None:
        """Back to the first target."""
        self.at, self.moved = 0, 0.0

    def wrench(self, t: float, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """(6,) [force; torque] on the handle, N and Nm, world axes."""
        if np.linalg.norm(velocity) > 0.001:
            self.moved = t
        if t - self.moved > self.patience:
            self.at, self.moved = min(self.at + 1, len(self.targets) - 1), t
        force = 300.0 * (self.targets[self.at] - position) - 20.0 * velocity
        size = np.linalg.norm(force)
        return np.concatenate([force * min(1.0, self.most / size) if size > 0.0 else force, np.zeros(3)])


robot = robots["lwr4plus"].build()
start = np.radians([20.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0])  # rad
arm = robot.kinematics(start)
tip, shaft = arm.translation("tip"), arm.rotation("tip")[:, 2]
middle = dq.from_rotation_translation(np.array([1.0, 0.0, 0.0, 0.0]), tip + 0.05 * shaft)  # m
cloud = Ellipsoid(np.array([0.02, 0.02, 0.02]), pose=middle).cloud(0.0035)
ball = Region("ball", cloud, Point.at([0.0, 0.0, 0.0], frame="tip"), pose=cloud.pose)
admittance = Admittance(robot, port=tip - 0.13 * shaft, start=start, regions=[ball], integrator="robust")

top = admittance.handle
hand: Hand = Probing(np.array([top + 0.06 * shaft, top]))  # m; into the ball, then back to the beginning
position, velocity, clearance, states = top, np.zeros(3), [], set()
for k in range(1, 1501):
    t = k * admittance.period
    motion = admittance.step(t, hand.wrench(t, position, velocity))
    position, velocity = motion.handle, motion.handle_velocity
    clearance.append(motion.clearance)
    states.add(motion.state)

print(f"all cycles in RUN: {states == {State.RUN}}, smallest clearance {min(clearance) * 1e3:.2f} mm")
print(f"handle at the end {np.linalg.norm(position - top) * 1e3:.1f} mm from where it began")
