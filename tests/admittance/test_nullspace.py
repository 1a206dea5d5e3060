"""Identities of the free motions on both robots, random arms, and near singularities; their rates by differences."""

import numpy as np
import pytest

from admittance.nullspace import (
    LARGEST_CONDITION,
    FreeMotion,
    first_null_basis,
    free_inverse,
    free_motion,
    range_inverse,
)
from admittance.rates import free_rate, free_velocity_rate, jacobian_rate
from primitives.errors import InputError
from primitives.robot import Robot
from tests.admittance.cases import NEURO_Q0, Q0, lwr4plus, neuro8, on_shaft
from tests.primitives.arms import random_rows

ARMS = {
    "lwr4plus": (lwr4plus(), "tip"),
    "neuro8": (neuro8(), "frame6"),
    "six": (Robot.from_dh(random_rows(6, 3)), "frame6"),
    "nine": (Robot.from_dh(random_rows(9, 4)), "frame9"),
}


def worst(f: FreeMotion, J: np.ndarray) -> float:
    """Largest error of S^-1 S = I, A Z^T = 0, Z J^T = [Z_x; 0] and the properties (i) to (iii)."""
    d, m = J.shape[1], J.shape[1] - 2
    return max(
        np.abs(f.S_inverse @ f.S - np.eye(d)).max(),
        np.abs(f.A @ f.Z.T).max(),
        np.abs(f.Z @ J.T - np.vstack([f.Z_x, np.zeros((d - 6, 6))])).max(),
        np.abs(f.A @ f.A_plus - np.eye(2)).max(),
        np.abs(f.Z_plus.T @ f.A_plus).max(),
        np.abs(f.Z @ f.Z_plus - np.eye(m)).max(),
        np.abs(f.G @ f.G.T - np.eye(d - 6)).max(initial=0.0),
    )


@pytest.mark.parametrize("name", ARMS)
def test_identities_at_random_configurations(name):
    robot, frame = ARMS[name]
    rng, tested = np.random.default_rng(1), 0
    for _ in range(200):
        k = robot.kinematics(rng.uniform(robot.limits.lower, robot.limits.upper))
        port = k.translation(frame) - rng.uniform(-0.05, 0.4) * k.rotation(frame)[:, 2] + 1e-3 * rng.normal(size=3)
        J = k.jacobian(frame)
        if np.linalg.cond(J) < LARGEST_CONDITION:
            tested += 1
            assert worst(free_motion(k, frame, port, weights=rng.uniform(0.3, 3.0, robot.n)), J) < 1e-10
    assert tested > 180


@pytest.mark.parametrize("exponent", range(1, 9))
def test_identities_hold_up_to_the_singularity_and_then_it_is_refused(exponent):
    """The elbow of the LWR4+ straightens: J_t's condition grows like 1/angle."""
    robot, q = lwr4plus(), np.radians([20.0, 50.0, 10.0, 0.0, 30.0, 60.0, 0.0])
    q[3] = -(10.0**-exponent)
    k = robot.kinematics(q)
    J, condition = k.jacobian("tip"), np.linalg.cond(k.jacobian("tip"))
    if condition > LARGEST_CONDITION:
        with pytest.raises(InputError, match=r"condition .*SI units"):
            free_motion(k, "tip", on_shaft(robot, q, "tip", 0.2))
        return
    f = free_motion(k, "tip", on_shaft(robot, q, "tip", 0.2))
    assert worst(f, J) < 1e-10
    assert f.condition == pytest.approx(condition, rel=1e-6)


def test_exactly_singular_is_refused_and_gives_no_nan():
    robot = lwr4plus()
    with pytest.raises(InputError, match="condition"):
        free_motion(robot.kinematics(np.zeros(7)), "tip", [0.0, 0.0, 0.5])


def test_the_wrist_of_the_neurosurgical_arm_is_its_redundancy():
    robot = neuro8()
    rng = np.random.default_rng(2)
    for _ in range(20):
        q = rng.uniform(robot.limits.lower, robot.limits.upper)
        f = free_motion(robot.kinematics(q), "frame6", on_shaft(robot, q, "frame6", 0.05))
        np.testing.assert_array_equal(f.G, np.eye(8)[6:])
        assert f.condition < 4.1


@pytest.mark.parametrize("name", ["lwr4plus", "nine"])
def test_G_is_continuous_along_a_motion_and_its_rate_is_the_one_stated(name):
    robot, frame = ARMS[name]
    q, h = (Q0 if name == "lwr4plus" else np.linspace(-0.6, 0.8, 9)), 5e-4
    direction = np.cos(np.arange(robot.n))
    k = robot.kinematics(q)
    last = first = free_motion(k, frame, on_shaft(robot, q, frame, 0.2))
    for step in range(1, 401):
        k = robot.kinematics(q + step * h * direction)
        now = free_motion(k, frame, k.translation(frame) - 0.2 * k.rotation(frame)[:, 2], last=last)
        assert np.abs(now.G - last.G).max() < 20.0 * h
        last = now
    assert np.abs(last.G @ k.jacobian(frame).T).max() < 1e-12
    assert np.abs(last.G - first.G).max() > 1e-2, "the null space did turn"


@pytest.mark.parametrize("name", ARMS)
def test_rates_are_derivatives(name):
    """dJ/dt, dZ/dt and d(Z^+T)/dt qdot against central differences along a motion, G transported from the middle."""
    robot, frame = ARMS[name]
    rng, h = np.random.default_rng(5), 1e-5
    W = rng.uniform(0.5, 2.0, robot.n)
    tested = 0
    for _ in range(20):
        q, qdot = rng.uniform(0.6 * robot.limits.lower, 0.6 * robot.limits.upper), rng.normal(size=robot.n)
        if name == "neuro8":
            q = NEURO_Q0 + 0.05 * rng.normal(size=8)
        k = robot.kinematics(q)
        J, pose = np.ascontiguousarray(k.jacobian(frame)), k.poses[k.place(frame)]
        if np.linalg.cond(J) > 100.0:
            continue
        tested += 1
        port = on_shaft(robot, q, frame, 0.2)
        f = free_motion(k, frame, port, weights=W)
        ahead, behind = (
            (
                robot.kinematics(q + s * h * qdot),
                free_motion(robot.kinematics(q + s * h * qdot), frame, port, weights=W, last=f),
            )
            for s in (1, -1)
        )
        d, m = robot.n, robot.n - 2
        J_rate, P, P_rate, Z_rate = np.empty((6, d)), np.empty((6, d)), np.empty((6, d)), np.zeros((m, d))
        gram, factor, scratch = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6))
        jacobian_rate(J, qdot, J_rate)
        scale = np.abs(J_rate).max()
        np.testing.assert_allclose(
            J_rate, (ahead[0].jacobian(frame) - behind[0].jacobian(frame)) / (2 * h), atol=1e-7 * scale
        )
        range_inverse(J, gram, factor, scratch, P)
        free_rate(J, J_rate, factor, P, f.Z_x, f.G, pose, J @ qdot, P_rate, Z_rate)
        scale = max(1.0, np.abs(Z_rate).max())
        np.testing.assert_allclose(Z_rate, (ahead[1].Z - behind[1].Z) / (2 * h), atol=2e-6 * scale)
        work, Z_factor, Z_plus_T, out = np.zeros((m, m)), np.zeros((m, m)), np.zeros((m, d)), np.zeros(m)
        free_inverse(f.Z, W, work, Z_factor, Z_plus_T)
        free_velocity_rate(f.Z, Z_rate, W, Z_factor, qdot, Z_plus_T @ qdot, out)
        expected = (ahead[1].Z_plus.T - behind[1].Z_plus.T) @ qdot / (2 * h)
        np.testing.assert_allclose(out, expected, atol=2e-6 * max(1.0, np.abs(out).max()))
    assert tested >= 5


def test_the_first_basis_spans_the_null_space_by_another_method():
    robot, frame = ARMS["nine"]
    J = np.ascontiguousarray(robot.kinematics(np.linspace(-0.6, 0.8, 9)).jacobian(frame))
    P, G = np.empty((6, 9)), np.empty((3, 9))
    range_inverse(J, np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6)), P)
    first_null_basis(J, P, G)
    null = np.linalg.svd(J)[2][6:]
    np.testing.assert_allclose(G.T @ G, null.T @ null, atol=1e-12)


@pytest.mark.parametrize("weights", [np.zeros(7), -np.ones(7), np.full(7, np.nan), np.ones(6)])
def test_bad_weights_are_refused(weights):
    robot = lwr4plus()
    with pytest.raises(InputError, match="weights"):
        free_motion(robot.kinematics(Q0), "tip", [0, 0, 0], weights=weights)
