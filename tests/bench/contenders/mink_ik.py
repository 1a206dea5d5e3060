"""mink as its users write it: a frame task, its limits, and C1..C4 as a Limit of their own in NumPy; quadprog.

A second contender gets the rows of C1..C4 for nothing: what is left is mink itself. A third one has both arms in its
model, follows the parked one, and keeps it still by its velocity limits.
"""

import mink
import mujoco
import numpy as np

from primitives import dual_quaternion as dq
from scenarios.robots import urdf_path
from scenarios.robots.neuro8_pair import BASES
from tests.bench import problem
from tests.bench.contender import Contender
from tests.bench.explained import LogarithmOfThePose
from tests.bench.numpy_rows import constraint_rows

TIP, SHAFT, PARKED = "moving/tip", "moving/shaft", "parked/shaft"
COST, STILL = 0.5, 1e-6  # as for pink


def placed(arms):
    """MuJoCo's model of these arms on their bases."""
    world = mujoco.MjSpec()
    for name in arms:
        arm = mujoco.MjSpec.from_file(str(urdf_path("neuro8")))
        world.worldbody.add_frame(pos=BASES[name]).attach_body(arm.worldbody.first_body(), f"{name}/", "")
    return world.compile()


class ActiveConstraints(mink.Limit):
    """C1..C4 as rows G dq <= h."""

    def compute_qp_inequalities(self, configuration, dt):
        shaft, tip = (configuration.get_transform_frame_to_world(frame, "body") for frame in (SHAFT, TIP))
        J_shaft, J_tip = (configuration.get_frame_jacobian(frame, "body") for frame in (SHAFT, TIP))
        R, S = shaft.rotation().as_matrix(), tip.rotation().as_matrix()
        J_shaft, J_tip = np.vstack([R @ J_shaft[:3], R @ J_shaft[3:]]), np.vstack([S @ J_tip[:3], S @ J_tip[3:]])
        parked = self.parked(configuration)
        A, margins = constraint_rows(shaft.translation(), R[:, 2], J_shaft, tip.translation(), J_tip, *parked)
        return mink.Constraint(-A, problem.ETA * dt * margins)

    def parked(self, configuration):
        return ()


class TwoArmConstraints(ActiveConstraints):
    """C1 with the parked shaft of the model."""

    def parked(self, configuration):
        pose = configuration.get_transform_frame_to_world(PARKED, "body")
        J, R = configuration.get_frame_jacobian(PARKED, "body"), pose.rotation().as_matrix()
        return pose.translation(), R[:, 2], np.vstack([R @ J[:3], R @ J[3:]])


class GivenRows(mink.Limit):
    """Rows that were computed before the cycle."""

    G, h = np.zeros((0, 8)), np.zeros(0)

    def compute_qp_inequalities(self, configuration, dt):
        return mink.Constraint(self.G, self.h)


class Mink(Contender):
    name = "mink, quadprog"
    differs = "the cost is that of the logarithm of the pose, not of vec8(x - x_d)"
    explained_by = LogarithmOfThePose
    rows = ActiveConstraints
    arms = ("moving",)

    def all_joints(self):
        return self.q

    def __init__(self):
        super().__init__()
        model = placed(self.arms)
        self.configuration = mink.Configuration(model, self.all_joints())
        gain = problem.GAIN * problem.PERIOD
        self.task = mink.FrameTask(TIP, "body", position_cost=COST, orientation_cost=COST, gain=gain)
        self.constraint = self.rows()
        near = mink.ConfigurationLimit(model, gain=problem.LIMIT_ETA * problem.PERIOD)
        speeds = {
            f"{arm}/joint{i}": speed if arm == "moving" else STILL
            for arm in self.arms
            for i, speed in enumerate(problem.SPEED, 1)
        }
        self.limits = [near, mink.VelocityLimit(model, speeds), self.constraint]
        self.targets = [mink.SE3(np.r_[x[:4], dq.translation(x)]) for x in problem.REFERENCE]

    def step(self):
        self.configuration.update(self.all_joints())
        self.task.set_target(self.targets[self.k])
        return mink.solve_ik(
            self.configuration,
            [self.task],
            problem.PERIOD,
            solver="quadprog",
            damping=problem.DAMPING,
            limits=self.limits,
        )


class MinkGivenRows(Mink):
    name = "mink, rows for nothing"
    rows = GivenRows

    def prepare(self):
        A, margins = problem.rows(self.q)
        self.constraint.G, self.constraint.h = -A, problem.ETA * problem.PERIOD * margins


class MinkTwoArms(Mink):
    name = "mink, two arms"
    rows = TwoArmConstraints
    arms = ("moving", "parked")

    def all_joints(self):
        return problem.both(self.q)

    def step(self):
        return super().step()[problem.MOVING]


CONTENDERS = (Mink, MinkGivenRows, MinkTwoArms)
