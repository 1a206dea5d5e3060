"""Every line of the tables in docs/conventions.md for people who come from DQ Robotics and from Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest
from dqrobotics import DQ, E_, cross, k_
from dqrobotics.robot_modeling import DQ_Kinematics
from dqrobotics.utils import DQ_Geometry

from primitives import Constraint, ConstraintSet, Entity, Line, Plane, Point, Robot, conversions
from primitives import dual_jacobians as dj
from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.evaluate import evaluate
from tests.primitives.arms import ARMS, random_rows

TIP = "frame6"
POINT, NORMAL = np.array([0.3, -0.2, 0.5]), np.array([2.0, -3.0, 6.0]) / 7.0
STEP = 1e-6


@pytest.fixture
def arm():
    return ARMS["six"]


@pytest.fixture
def q():
    return np.array([0.4, -0.7, 0.9, 0.3, -1.1, 0.6])


def pure(vector: Array) -> DQ:
    return DQ([0.0, *vector])


def plucker(point: Array, direction: Array) -> DQ:
    return pure(direction) + E_ * pure(np.cross(point, direction))


def close(got, expected, tolerance=1e-12):
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=tolerance)


def one(first, second, keep="outside", safe=0.0, pair=""):
    return ConstraintSet([Constraint("c", first, second, keep, safe, pair=pair)])


# DQ Robotics


def test_pose_is_vec8_of_fkm(arm, q):
    x = arm.twin.fkm(q)
    close(arm.robot.kinematics(q).pose(TIP) * np.sign(x.vec8() @ arm.robot.kinematics(q).pose(TIP)), x.vec8())
    close(conversions.from_dq(x), x.vec8())
    assert conversions.to_dq(x.vec8()) == x
    close(dq.translation(x.vec8()), x.translation().vec3())


def test_a_dq_goes_wherever_eight_numbers_do():
    close(Line(plucker(POINT, NORMAL)).dual_quaternion, Line.through(POINT, NORMAL).dual_quaternion)
    close(
        Plane(pure(NORMAL) + E_ * float(POINT @ NORMAL)).dual_quaternion, Plane.through(POINT, NORMAL).dual_quaternion
    )
    close(Point(pure(POINT)).dual_quaternion, Point.at(POINT).dual_quaternion)


def test_jacobians_of_dq_robotics_have_twins(arm, q):
    x, J_x, J = arm.twin.fkm(q), arm.twin.pose_jacobian(q), arm.robot.kinematics(q).jacobian(TIP)
    K = DQ_Kinematics
    close(dj.pose_jacobian(x.vec8(), J), J_x)
    J_t = K.translation_jacobian(J_x, x)
    assert J_t.shape == (4, 6)
    close(J_t[0], np.zeros(6))
    close(J[:3], J_t[1:])
    close(dj.rotation_jacobian(x.vec8(), J), K.rotation_jacobian(J_x))
    close(dj.line_jacobian(x.vec8(), J), K.line_jacobian(J_x, x, k_))
    close(dj.plane_jacobian(x.vec8(), J), K.plane_jacobian(J_x, x, k_))


def test_twist_of_dq_robotics_is_taken_at_the_origin_of_the_reference_frame(arm, q):
    """dx/dt = (1/2) xi x with xi = w + eps (v + p x w): angular first, linear part at the world's origin."""
    qdot = np.array([0.3, -0.2, 0.5, 0.1, -0.4, 0.2])
    kinematics, x = arm.robot.kinematics(q), arm.twin.fkm(q)
    v, w = np.split(kinematics.jacobian(TIP) @ qdot, 2)
    xi = 2.0 * DQ(arm.twin.pose_jacobian(q) @ qdot) * x.conj()
    close(xi.vec6()[:3], w)
    close(xi.vec6()[3:], v + np.cross(kinematics.translation(TIP), w))


def test_dh_table_has_other_columns(arm):
    """A column (theta, d, a, alpha, type) there, a row (kind, alpha, a, theta, d) here."""
    twin = arm.twin
    columns = np.array([twin.get_thetas(), twin.get_ds(), twin.get_as(), twin.get_alphas(), twin.get_types()])
    rows = random_rows(6, 6)
    close(columns, np.array([[r.theta, r.d, r.a, r.alpha, 0.0] for r in rows]).T)
    close(
        Robot.from_dh(rows, convention="standard").kinematics(np.zeros(6)).translation(TIP),
        twin.fkm(np.zeros(6)).translation().vec3(),
    )


def test_distances_there_are_squares_and_jacobians_those_of_squares(arm, q):
    x, J_x = arm.twin.fkm(q), arm.twin.pose_jacobian(q)
    t, J_t = x.translation(), DQ_Kinematics.translation_jacobian(J_x, x)
    tip, shaft = Point.at(np.zeros(3), frame=TIP), Line.z_axis(TIP)
    l_z = x.P() * k_ * x.P().conj()
    l_z = l_z + E_ * cross(t, l_z)
    J_l, line, p = DQ_Kinematics.line_jacobian(J_x, x, k_), plucker(POINT, NORMAL), pure(POINT)
    for pair, square, jacobian in (
        (
            one(tip, Point.at(POINT)),
            DQ_Geometry.point_to_point_squared_distance(t, p),
            DQ_Kinematics.point_to_point_distance_jacobian(J_t, t, p),
        ),
        (
            one(tip, Line.through(POINT, NORMAL)),
            DQ_Geometry.point_to_line_squared_distance(t, line),
            DQ_Kinematics.point_to_line_distance_jacobian(J_t, t, line),
        ),
        (
            one(shaft, Point.at(POINT)),
            DQ_Geometry.point_to_line_squared_distance(p, l_z),
            DQ_Kinematics.line_to_point_distance_jacobian(J_l, l_z, p),
        ),
        (
            one(shaft, Line.through(POINT, NORMAL)),
            DQ_Geometry.line_to_line_squared_distance(l_z, line),
            DQ_Kinematics.line_to_line_distance_jacobian(J_l, l_z, line),
        ),
    ):
        found = evaluate(arm.robot, pair, q)
        close(found.distance[0] ** 2, square)
        close(2.0 * found.distance[0] * found.jacobian, np.atleast_2d(jacobian), 1e-11)


def test_distance_to_a_plane_is_signed_in_both(arm, q):
    """Its docstring in DQ Robotics says "squared"; it is not."""
    x, J_x = arm.twin.fkm(q), arm.twin.pose_jacobian(q)
    t, J_t = x.translation(), DQ_Kinematics.translation_jacobian(J_x, x)
    plane = pure(NORMAL) + E_ * float(POINT @ NORMAL)
    found = evaluate(arm.robot, one(Point.at(np.zeros(3), frame=TIP), Plane.through(POINT, NORMAL)), q)
    close(found.distance[0], DQ_Geometry.point_to_plane_distance(t, plane))
    close(found.distance[0], NORMAL @ (t.vec3() - POINT))
    close(found.jacobian, np.atleast_2d(DQ_Kinematics.point_to_plane_distance_jacobian(J_t, t, plane)))


def test_angle_there_is_an_angle_and_its_jacobian_that_of_a_function_of_it(arm, q):
    x, J_x = arm.twin.fkm(q), arm.twin.pose_jacobian(q)
    l_z = x.P() * k_ * x.P().conj()
    line = plucker(POINT, NORMAL)
    pair = one(Line.z_axis(TIP), Line.through(POINT, NORMAL), pair="line_line_angle")
    found = evaluate(arm.robot, pair, q)
    close(found.distance[0], DQ_Geometry.line_to_line_angle(l_z + E_ * cross(x.translation(), l_z), line), 1e-9)
    J_l = DQ_Kinematics.line_jacobian(J_x, x, k_)
    theirs = DQ_Kinematics.line_to_line_angle_jacobian(J_l, l_z + E_ * cross(x.translation(), l_z), line)
    close(2.0 * np.sin(found.distance[0]) * found.jacobian, np.atleast_2d(theirs), 1e-11)


def test_residual_there_is_that_of_the_square(arm, q):
    velocity = np.array([0.01, -0.02, 0.03])
    moving = Point.at(np.zeros(3), entity="ball")
    found = evaluate(
        arm.robot,
        one(Line.z_axis(TIP), moving),
        q,
        entities={"ball": Entity(dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), POINT), [*velocity, 0, 0, 0])},
    )
    x = arm.twin.fkm(q)
    l_z = x.P() * k_ * x.P().conj()
    l_z = l_z + E_ * cross(x.translation(), l_z)
    theirs = DQ_Kinematics.line_to_point_residual(l_z, pure(POINT), pure(velocity))
    close(2.0 * found.distance[0] * found.residual[0], theirs)


# Pinocchio


URDF = """<robot name="one"><link name="a"/><link name="b"/><joint name="turn" type="continuous"><parent link="a"/>
<child link="b"/><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><axis xyz="0 0 1"/><limit velocity="1" effort="1"/>
</joint></robot>"""


def models(arm, q):
    model = arm.robot.model
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    return model, data, model.getFrameId(TIP)


def test_pose_is_an_se3_there(arm, q):
    _, data, at = models(arm, q)
    kinematics = arm.robot.kinematics(q)
    close(kinematics.rotation(TIP), data.oMf[at].rotation)
    close(kinematics.translation(TIP), data.oMf[at].translation)


def test_quaternion_of_pinocchio_ends_with_its_real_part(arm, q):
    _, data, at = models(arm, q)
    x, y, z, w = pin.SE3ToXYZQUAT(data.oMf[at])[3:]
    ours = arm.robot.kinematics(q).pose(TIP)[:4]
    close(abs(ours @ [w, x, y, z]), 1.0)
    assert abs(ours @ [x, y, z, w]) < 0.999


def test_jacobian_is_local_world_aligned(arm, q):
    model, data, at = models(arm, q)
    ours = arm.robot.kinematics(q).jacobian(TIP)
    frames = pin.ReferenceFrame
    close(ours, pin.getFrameJacobian(model, data, at, frames.LOCAL_WORLD_ALIGNED))
    assert np.abs(ours - pin.getFrameJacobian(model, data, at, frames.LOCAL)).max() > 0.1
    world = pin.getFrameJacobian(model, data, at, frames.WORLD)
    assert np.abs(ours - world).max() > 0.1
    # WORLD takes the linear part at the world's origin, LOCAL has the frame's axes.
    t, R = data.oMf[at].translation, data.oMf[at].rotation
    close(ours[:3], world[:3] + np.cross(world[3:].T, t).T)
    close(ours[:3], R @ pin.getFrameJacobian(model, data, at, frames.LOCAL)[:3])


def test_continuous_joint_is_one_angle_here_and_two_numbers_there(tmp_path):
    (tmp_path / "one.urdf").write_text(URDF)
    robot = Robot.from_urdf(tmp_path / "one.urdf", tip="b")
    assert robot.n == 1 and robot.model.nq == 2 and robot.model.nv == 1
    close(robot.configuration([0.7]), [np.cos(0.7), np.sin(0.7)])


def test_difference_of_poses_is_a_difference_of_eight_numbers_here_and_a_logarithm_there(arm, q):
    """To first order both are the motion that leads from one to the other."""
    step = 1e-5 * np.array([1.0, -2.0, 0.5, 1.5, -1.0, 2.0])
    _, data, at = models(arm, q)
    before = data.oMf[at].copy()
    _, data, at = models(arm, q + step)
    local = pin.log6(before.actInv(data.oMf[at])).vector
    R = before.rotation
    J = arm.robot.kinematics(q).jacobian(TIP)
    close(np.concatenate([R @ local[:3], R @ local[3:]]), J @ step, 1e-8)
    x, moved = arm.robot.kinematics(q).pose(TIP), arm.robot.kinematics(q + step).pose(TIP)
    close(moved - x, dj.pose_jacobian(x, J) @ step, 1e-8)


def test_world_is_the_first_frame(arm):
    assert arm.robot.frames[0] == "world"
    assert arm.robot.model.names[0] == "universe"


def test_row_is_that_of_the_margin(arm, q):
    """d for keep-outside, -d for keep-inside."""
    shaft, entry = Line.z_axis(TIP), Point.at(POINT)
    outside, inside = (evaluate(arm.robot, one(shaft, entry, keep, 0.01), q) for keep in ("outside", "inside"))
    close(outside.jacobian, -inside.jacobian)
    close(outside.margin, outside.distance - 0.01)
    close(inside.margin, 0.01 - inside.distance)
    ahead, behind = (evaluate(arm.robot, one(shaft, entry), q + s * np.eye(6)[1] * STEP).distance for s in (1.0, -1.0))
    close((ahead - behind) / (2.0 * STEP), outside.jacobian[:, 1], 1e-8)
