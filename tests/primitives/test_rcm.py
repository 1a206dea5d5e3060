"""x_c, A_x and A against differences, Pinocchio's Jacobian and plain geometry."""

import numpy as np
import pinocchio as pin
import pytest

from primitives.errors import InputError, UnknownNameError
from primitives.rcm import constraint_jacobian, constraint_jacobian_rate, port_error, rcm
from tests.primitives.arms import ARMS, random_q

NAMES = list(ARMS)


def cases(name: str, count: int = 20):
    robot, rng = ARMS[name].robot, np.random.default_rng(NAMES.index(name))
    for _ in range(count):
        yield robot, random_q(robot, rng), rng.uniform(-1.0, 1.0, 3), rng


@pytest.mark.parametrize("name", NAMES)
def test_norm_is_the_distance_of_the_port_from_the_shafts_line(name):
    for robot, q, port, _ in cases(name):
        k = robot.kinematics(q)
        n, t = k.rotation(robot.tip)[:, 2], k.translation(robot.tip)
        assert np.linalg.norm(rcm(k, robot.tip, port).x_c) == pytest.approx(
            np.linalg.norm(np.cross(n, port - t)), abs=1e-14
        )


@pytest.mark.parametrize("name", NAMES)
def test_A_is_the_derivative_of_x_c(name):
    h = 1e-6
    for robot, q, port, rng in cases(name):
        direction = rng.normal(size=robot.n)
        ahead, behind = (rcm(robot.kinematics(q + s * h * direction), robot.tip, port).x_c for s in (1, -1))
        A = rcm(robot.kinematics(q), robot.tip, port).A
        np.testing.assert_allclose(A @ direction, (ahead - behind) / (2 * h), atol=2e-8)


@pytest.mark.parametrize("name", NAMES)
def test_A_from_pinocchio(name):
    for robot, q, port, _ in cases(name):
        data, frame = robot.model.createData(), robot.model.getFrameId(robot.tip)
        reference = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        J = pin.computeFrameJacobian(robot.model, data, robot.configuration(q), frame, reference)
        pose = data.oMf[frame]
        B, arm = pose.rotation[:, :2], pin.skew(pose.translation - port)
        np.testing.assert_allclose(rcm(robot.kinematics(q), robot.tip, port).A, B.T @ (J[:3] + arm @ J[3:]), atol=1e-12)


def test_A_x_has_rank_two_everywhere_also_with_the_tip_at_the_port():
    """Its first three columns are B_c^T, so that both singular values are at least one."""
    rng = np.random.default_rng(3)
    for scale in (0.0, 1e-12, 1e-3, 1.0, 1e3):
        R, t = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
        pose, A_x = np.concatenate([R.ravel(), t]), np.empty((2, 6))
        constraint_jacobian(pose, t - scale * R[:, 2], A_x)
        assert np.linalg.svd(A_x)[1].min() >= 1.0 - 1e-12


def test_rate_of_A_x_is_its_derivative_along_a_twist():
    rng, h = np.random.default_rng(4), 1e-6
    for _ in range(50):
        pose = pin.SE3.Random()
        twist, port = rng.normal(size=6), rng.normal(size=3)

        def at(s: float, pose=pose, twist=twist, port=port):
            R = pin.exp3(s * twist[3:]) @ pose.rotation
            out = np.empty((2, 6))
            constraint_jacobian(np.concatenate([R.ravel(), pose.translation + s * twist[:3]]), port, out)
            return out

        rate = np.empty((2, 6))
        constraint_jacobian_rate(np.concatenate([pose.rotation.ravel(), pose.translation]), twist, port, rate)
        np.testing.assert_allclose(rate, (at(h) - at(-h)) / (2 * h), atol=1e-8)


def test_on_the_shaft_x_c_vanishes_wherever_the_port_lies_on_it():
    robot = ARMS["seven"].robot
    k = robot.kinematics(np.full(7, 0.3))
    for back in (-1.0, 0.0, 1e-9, 0.2, 5.0):
        port = k.translation(robot.tip) - back * k.rotation(robot.tip)[:, 2]
        assert np.abs(rcm(k, robot.tip, port).x_c).max() < 1e-14
    x_c = np.full(2, np.nan)
    port_error(k.poses[k.place(robot.tip)], port, x_c)
    assert np.isfinite(x_c).all()


@pytest.mark.parametrize("port", [[0.0, 0.0], [0.0, np.nan, 0.0], "port", None])
def test_bad_ports_are_refused(port):
    robot = ARMS["seven"].robot
    with pytest.raises(InputError, match="port"):
        rcm(robot.kinematics(np.zeros(7)), robot.tip, port)


def test_unknown_frames_are_refused():
    robot = ARMS["seven"].robot
    with pytest.raises(UnknownNameError, match="frame"):
        rcm(robot.kinematics(np.zeros(7)), "shaft", [0, 0, 0])
