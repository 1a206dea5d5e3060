"""pink as its users write it: a frame task, its limits, and C1..C4 as a Limit of their own in NumPy; quadprog.

A second contender gets the rows of C1..C4 for nothing: what is left is pink itself. A third one has both arms in its
model, follows the parked one, and keeps it still by its velocity limits.
"""

import numpy as np
import pink
import pinocchio as pin
from pink.limits import ConfigurationLimit, Limit, VelocityLimit
from pink.tasks import FrameTask

from primitives import dual_quaternion as dq
from tests.bench import problem
from tests.bench.contender import Contender
from tests.bench.explained import LogarithmOfThePose
from tests.bench.numpy_rows import constraint_rows

TIP, SHAFT, PARKED = "moving/tip", "moving/shaft", "parked/shaft"
STILL = 1e-6  # m/s and rad/s
COST = 0.5  # of the rotation vector and of the translation: what |vec8(x - x_d)| weighs them with


def targets():
    """The reference as Pinocchio's poses."""
    return [pin.SE3(dq.rotation_matrix(x), dq.translation(x)) for x in problem.REFERENCE]


class ActiveConstraints(Limit):
    """C1..C4 as rows G dq <= h."""

    def compute_qp_inequalities(self, configuration, dt):
        shaft, tip = (configuration.get_transform_frame_to_world(frame) for frame in (SHAFT, TIP))
        J_shaft, J_tip = configuration.get_frame_jacobian(SHAFT), configuration.get_frame_jacobian(TIP)
        R, S = shaft.rotation, tip.rotation
        J_shaft, J_tip = np.vstack([R @ J_shaft[:3], R @ J_shaft[3:]]), np.vstack([S @ J_tip[:3], S @ J_tip[3:]])
        parked = self.parked(configuration)
        A, margins = constraint_rows(shaft.translation, R[:, 2], J_shaft, tip.translation, J_tip, *parked)
        return -A, problem.ETA * dt * margins

    def parked(self, configuration):
        return ()


class TwoArmConstraints(ActiveConstraints):
    """C1 with the parked shaft of the model."""

    def parked(self, configuration):
        pose, J = configuration.get_transform_frame_to_world(PARKED), configuration.get_frame_jacobian(PARKED)
        R = pose.rotation
        return pose.translation, R[:, 2], np.vstack([R @ J[:3], R @ J[3:]])


class GivenRows(Limit):
    """Rows that were computed before the cycle."""

    G, h = np.zeros((0, 8)), np.zeros(0)

    def compute_qp_inequalities(self, configuration, dt):
        return self.G, self.h


class Pink(Contender):
    name = "pink, quadprog"
    differs = "the cost is that of the logarithm of the pose, not of vec8(x - x_d)"
    explained_by = LogarithmOfThePose
    rows = ActiveConstraints
    robot = problem.ALONE

    def all_joints(self):
        return self.q

    def speeds(self, model):
        return VelocityLimit(model)

    def __init__(self):
        super().__init__()
        model = self.robot.model
        self.configuration = pink.Configuration(model, model.createData(), self.all_joints())
        gain = problem.GAIN * problem.PERIOD
        self.task = FrameTask(TIP, position_cost=COST, orientation_cost=COST, gain=gain)
        self.constraint = self.rows()
        near = ConfigurationLimit(model, config_limit_gain=problem.LIMIT_ETA * problem.PERIOD)
        self.limits = [near, self.speeds(model), self.constraint]
        self.targets = targets()

    def step(self):
        self.configuration.update(self.all_joints())
        self.task.set_target(self.targets[self.k])
        return pink.solve_ik(
            self.configuration,
            [self.task],
            problem.PERIOD,
            solver="quadprog",
            damping=problem.DAMPING,
            limits=self.limits,
        )


class PinkGivenRows(Pink):
    name = "pink, rows for nothing"
    rows = GivenRows

    def prepare(self):
        A, margins = problem.rows(self.q)
        self.constraint.G, self.constraint.h = -A, problem.ETA * problem.PERIOD * margins


class PinkTwoArms(Pink):
    name = "pink, two arms"
    rows = TwoArmConstraints
    robot = problem.PAIR

    def all_joints(self):
        return problem.both(self.q)

    def speeds(self, model):
        speed = problem.PAIR.limits.velocity.copy()
        speed[problem.PARKED] = STILL
        return VelocityLimit(model, speed)

    def step(self):
        return super().step()[problem.MOVING]


CONTENDERS = (Pink, PinkGivenRows, PinkTwoArms)
