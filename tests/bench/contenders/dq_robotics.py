"""DQ Robotics as its users write it: its arm, its distance Jacobians, W and w stacked, its QP controller, quadprog.

A second contender has the parked arm too: its shaft's line from its measured joints, and the line's own motion in C1.
"""

import numpy as np
from dqrobotics import DQ, E_, cross, i_, j_, k_, rotation, translation, vec8
from dqrobotics.robot_control import ControlObjective, DQ_ClassicQPController
from dqrobotics.robot_modeling import DQ_Kinematics, DQ_SerialManipulatorMDH
from dqrobotics.solvers import DQ_QuadprogSolver
from dqrobotics.utils import DQ_Geometry

from scenarios.robots.neuro8 import DH_TABLE, TIP_OFFSET
from scenarios.robots.neuro8_pair import BASES
from tests.bench import problem
from tests.bench.contender import Contender
from tests.bench.explained import SquaredDistances

SHAFT = 5  # index of the shaft's link


def _pure(v):
    return v[0] * i_ + v[1] * j_ + v[2] * k_


def _line(point, direction):
    return _pure(direction) + E_ * cross(_pure(point), _pure(direction))


def _z_axis(x):
    r = rotation(x)
    l = r * k_ * r.conj()
    return l + E_ * cross(translation(x), l)


def arm(at):
    """An arm on its base (3,), with its tool."""
    table = [[r.theta, r.d, r.a, r.alpha, float(r.kind == "prismatic")] for r in DH_TABLE]
    robot = DQ_SerialManipulatorMDH(np.array(table).T)
    base = 1 + E_ * 0.5 * _pure(at)
    robot.set_base_frame(base)
    robot.set_reference_frame(base)
    half = np.sqrt(0.5)
    robot.set_effector((1 + E_ * 0.5 * TIP_OFFSET * i_) * (half + half * j_))
    return robot


class DQRobotics(Contender):
    name = "DQ Robotics, quadprog"
    differs = "C1..C3 bound the rate of the squared distance, whose Jacobian it has"
    explained_by = SquaredDistances

    def __init__(self):
        super().__init__()
        self.robot = arm(BASES["moving"])
        self.solver = DQ_QuadprogSolver()  # the controller does not keep it alive
        self.control = DQ_ClassicQPController(self.robot, self.solver)
        self.control.set_control_objective(ControlObjective.Pose)
        self.control.set_gain(problem.GAIN)
        self.control.set_damping(problem.DAMPING)
        self.reference = [vec8(DQ(x)) for x in problem.REFERENCE]
        self.parked, self.still = _line(problem.PARKED_POINT, problem.PARKED_DIRECTION), DQ([0.0])
        self.entry, self.axis = _pure(problem.ENTRY), _line(problem.AXIS_POINT, problem.AXIS)
        self.floor = _pure(problem.NORMAL) + E_ * float(problem.NORMAL @ problem.FLOOR)

    def parked_line(self):
        """The parked shaft and its rate of change."""
        return self.parked, self.still

    def step(self):
        q, robot, eta = self.q, self.robot, problem.ETA
        x_shaft, x_tip = robot.fkm(q, SHAFT), robot.fkm(q)
        J_shaft = np.zeros((8, 8))
        J_shaft[:, : SHAFT + 1] = robot.pose_jacobian(q, SHAFT)
        J_tip = robot.pose_jacobian(q)
        t_shaft, t_tip = translation(x_shaft), translation(x_tip)
        line = _z_axis(x_shaft)
        parked, motion = self.parked_line()
        J_line = DQ_Kinematics.line_jacobian(J_shaft, x_shaft, k_)
        J_end = DQ_Kinematics.translation_jacobian(J_shaft, x_shaft)
        J_t = DQ_Kinematics.translation_jacobian(J_tip, x_tip)

        W1 = -DQ_Kinematics.line_to_line_distance_jacobian(J_line, line, parked)
        w1 = eta * (DQ_Geometry.line_to_line_squared_distance(line, parked) - problem.APART**2)
        w1 += DQ_Kinematics.line_to_line_residual(line, parked, motion)
        W2 = DQ_Kinematics.line_to_point_distance_jacobian(J_line, line, self.entry)
        w2 = eta * (problem.OPENING**2 - DQ_Geometry.point_to_line_squared_distance(self.entry, line))
        W3 = DQ_Kinematics.point_to_line_distance_jacobian(J_end, t_shaft, self.axis)
        w3 = eta * (problem.RADIUS**2 - DQ_Geometry.point_to_line_squared_distance(t_shaft, self.axis))
        W4 = -DQ_Kinematics.point_to_plane_distance_jacobian(J_t, t_tip, self.floor)
        w4 = eta * DQ_Geometry.point_to_plane_distance(t_tip, self.floor)

        high = np.minimum(problem.SPEED, problem.LIMIT_ETA * (problem.UPPER - q))
        low = np.minimum(problem.SPEED, problem.LIMIT_ETA * (q - problem.LOWER))
        W = np.vstack([W1, W2, W3, W4, np.eye(8), -np.eye(8)])
        w = np.hstack([w1, w2, w3, w4, high, low])
        self.control.set_inequality_constraint(W, w)
        return self.control.compute_setpoint_control_signal(q, self.reference[self.k])


class DQRoboticsTwoArms(DQRobotics):
    name = "DQ Robotics, two arms"

    def __init__(self):
        super().__init__()
        self.other, self.q_other = arm(BASES["parked"]), problem.STILL
        self.qdot_other = np.zeros(8)

    def parked_line(self):
        x = self.other.fkm(self.q_other, SHAFT)
        J = np.zeros((8, 8))
        J[:, : SHAFT + 1] = self.other.pose_jacobian(self.q_other, SHAFT)
        J_line = DQ_Kinematics.line_jacobian(J, x, k_)
        return _z_axis(x), DQ(J_line @ self.qdot_other)


CONTENDERS = (DQRobotics, DQRoboticsTwoArms)
