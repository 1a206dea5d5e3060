"""The check that every command passes, against Pinocchio, SciPy and plain formulas; NaN is refused everywhere."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from primitives.compiled import JIT_DISABLED
from primitives.constraint import Constraint, ConstraintSet
from primitives.evaluate import evaluate
from primitives.pair import Pair
from primitives.registry import pairs
from primitives.robot import Robot
from primitives.vectors import OK
from primitives.verification import (
    TOLERANCE_ANGULAR,
    TOLERANCE_LINEAR,
    all_finite,
    bound_excess,
    move_frames,
    row_defects,
    sampled_defects,
    worst_defect,
)
from tests.primitives.arms import ARMS, element, random_q
from tests.primitives.pair_cases import CASES

Array = NDArray[np.float64]
MANY = 60 if JIT_DISABLED else 1000
NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("bad", [NAN, INF, -INF])
@pytest.mark.parametrize("place", [0, 3, 6])
def test_all_finite(bad, place):
    values = np.arange(7.0)
    assert all_finite(values) == 1
    values[place] = bad
    assert all_finite(values) == 0
    assert all_finite(np.empty(0)) == 1


def test_bounds_in_tolerances():
    low, high, tolerance = np.array([-1.0, -2.0]), np.array([1.0, 2.0]), np.array([1e-6, 1e-5])
    assert bound_excess(np.array([1.0, -2.0]), low, high, tolerance) == 0.0
    assert bound_excess(np.array([1.0 + 3e-6, 0.0]), low, high, tolerance) == pytest.approx(3.0)
    assert bound_excess(np.array([0.0, -2.0 - 3e-6]), low, high, tolerance) == pytest.approx(0.3)
    assert bound_excess(np.array([1.0 + 3e-6, 2.0 + 4e-5]), low, high, tolerance) == pytest.approx(4.0)
    infinite = np.full(2, np.inf)
    assert bound_excess(np.array([1e9, -1e9]), -infinite, infinite, tolerance) == 0.0


@pytest.mark.parametrize("which", ["v", "low", "high"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_nan_in_a_velocity_or_a_bound_is_refused(which, place):
    values = {"v": np.zeros(3), "low": -np.ones(3), "high": np.ones(3)}
    values[which][place] = NAN
    assert bound_excess(values["v"], values["low"], values["high"], np.full(3, 1e-6)) == INF


def test_defect_of_rows():
    rng = np.random.default_rng(1)
    for _ in range(MANY):
        m, n = int(rng.integers(0, 9)), int(rng.integers(1, 9))
        A, demand, slack, v = rng.normal(size=(m, n)), rng.normal(size=m), rng.exponential(size=m), rng.normal(size=n)
        demand[rng.random(m) < 0.3] = -np.inf
        defect = np.full(m, NAN)
        row_defects(A, demand, slack, v, defect)
        np.testing.assert_allclose(defect, demand - slack - A @ v, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("which", ["A", "demand", "slack", "v"])
def test_nan_in_a_row_is_refused(which):
    values = {"A": np.ones((2, 3)), "demand": -np.ones(2), "slack": np.zeros(2), "v": np.zeros(3)}
    tolerance = np.full(2, 1e-6)
    defect = np.empty(2)
    row_defects(*values.values(), defect)
    assert worst_defect(defect, tolerance) == 0.0
    values[which].flat[1] = NAN
    row_defects(*values.values(), defect)
    assert worst_defect(defect, tolerance) == INF


def sampled(margin: float, predicted: float, rate: float, slack: float = 0.0, defect: float = -1.0) -> float:
    out = np.array([defect])
    sampled_defects(np.array([margin]), np.array([predicted]), np.array([rate]), np.array([slack]), 0.01, out)
    return float(out[0])


def test_predicted_margin_is_asked_to_be_the_allowed_share_of_the_measured_one():
    """(1 - eta T) margin with eta = 10 and T = 0.01: 0.9 of it. The defect is per second."""
    assert sampled(0.02, 0.018, -0.2) == pytest.approx(0.0, abs=1e-15)
    assert sampled(0.02, 0.017, -0.2) == pytest.approx(0.1)
    assert sampled(0.02, 0.019, -0.2) == pytest.approx(-0.1)
    assert sampled(0.02, 0.017, -0.2, slack=0.04) == pytest.approx(0.06)
    assert sampled(-0.02, -0.0195, 0.05) == pytest.approx(0.0, abs=1e-15)
    assert sampled(-0.02, -0.02, 0.05) == pytest.approx(0.05)


def test_the_worse_of_both_questions_counts():
    assert sampled(0.02, 0.019, -0.2, defect=0.3) == 0.3
    assert sampled(0.02, 0.017, -0.2, defect=0.05) == pytest.approx(0.1)


def test_rows_without_a_rate_are_not_sampled():
    assert sampled(0.02, -5.0, -INF, defect=-INF) == -INF
    assert sampled(0.02, NAN, -INF, defect=-INF) == -INF


@pytest.mark.parametrize("values", [(0.02, NAN, -0.2), (NAN, 0.02, -0.2), (0.02, 0.02, NAN), (0.02, 0.02, -0.2, NAN)])
@pytest.mark.parametrize("before", [-1.0, 0.0, 1.0, NAN])
def test_nan_in_a_margin_is_refused(values, before):
    defect = sampled(*values, *((0.0,) if len(values) == 3 else ()), defect=before)
    assert worst_defect(np.array([-1.0, defect, -1.0]), np.full(3, 1e-6)) == INF


def test_a_defect_that_is_nan_stays_so():
    assert np.isnan(sampled(0.02, 0.5, -0.2, defect=NAN))


def test_worst_defect_in_tolerances():
    tolerance = np.array([TOLERANCE_LINEAR, TOLERANCE_ANGULAR, TOLERANCE_LINEAR])
    assert worst_defect(np.array([-1.0, -INF, -3.0]), tolerance) == 0.0
    assert worst_defect(np.array([0.5e-6, 2e-5, 1e-6]), tolerance) == pytest.approx(2.0)
    assert worst_defect(np.array([INF, 0.0, 0.0]), tolerance) == INF
    assert worst_defect(np.empty(0), np.empty(0)) == 0.0


def test_frames_move_as_scipy_says():
    """After one period of their twists, from 1e-12 rad to several turns; frames of the robot are left alone."""
    rng = np.random.default_rng(2)
    for k in range(MANY):
        pose, twist, out = np.zeros((4, 12)), np.zeros((4, 6)), np.full((4, 12), 7.0)
        R = Rotation.random(4, rng=rng)
        pose[:, :9], pose[:, 9:] = R.as_matrix().reshape(4, 9), rng.normal(size=(4, 3))
        period = float(rng.choice([1e-4, 1e-3, 2e-2]))
        size = 10.0 ** rng.uniform(-12.0, 1.0, (4, 1)) if k else np.zeros((4, 1))
        axis = rng.normal(size=(4, 3))
        twist[:, 3:] = size * axis / np.linalg.norm(axis, axis=1, keepdims=True) / period
        twist[:, :3] = rng.normal(size=(4, 3))
        move_frames(pose, twist, 2, period, out)
        turned = (Rotation.from_rotvec(period * twist[:, 3:]) * R).as_matrix()
        np.testing.assert_array_equal(out[:2], 7.0)
        np.testing.assert_allclose(out[2:, :9].reshape(2, 3, 3), turned[2:], atol=3e-15)
        np.testing.assert_allclose(out[2:, 9:], pose[2:, 9:] + period * twist[2:, :3], rtol=1e-15, atol=1e-15)
        np.testing.assert_allclose(np.linalg.det(out[2:, :9].reshape(2, 3, 3)), 1.0, atol=1e-14)


def by_pinocchio(robot: Robot, constraint: Constraint, q: Array) -> float:
    """Margin of one constraint by Pinocchio's kinematics and the formulas of the pairs' tests."""
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, robot.configuration(q))
    world = []
    for e in (constraint.first, constraint.second):
        g = e.geometry.copy()
        if e.frame != "world":
            M = data.oMf[model.getFrameId(e.frame)]
            g[:3], g[3:6] = M.rotation @ g[:3] + M.translation, M.rotation @ g[3:6]
        world.append(g[None])
    distance = CASES[constraint.definition.name].distance(*world)[0]
    if CASES[constraint.definition.name].absolute:
        distance = abs(distance)
    return float((1 if constraint.keep == "outside" else -1) * (distance - constraint.safe_distance))


@pytest.mark.parametrize("pair", [pairs[name] for name in pairs.names()], ids=lambda pair: pair.name)
def test_sampled_defect_by_pinocchio_at_the_next_sample(pair: Pair):
    """margin at q + T v, computed anew, against what the compiled evaluation gives to `sampled_defects`."""
    rng, robot = np.random.default_rng(3), ARMS["seven"].robot
    checked = 0
    while checked < MANY // 10:
        q, v = random_q(robot, rng), rng.uniform(-2.0, 2.0, 7)
        period, eta = float(rng.choice([1e-3, 8e-3])), float(rng.uniform(0.5, 50.0))
        geometry = rng.uniform(-0.3, 0.3, (2, 8))
        geometry[:, 3:6] /= np.linalg.norm(geometry[:, 3:6], axis=1, keepdims=True)
        geometry[:, 6], geometry[:, 7] = 0.2, 0.0
        side = str(rng.choice(["outside", "inside"]))
        c = Constraint(
            "c",
            element(pair.first, geometry[0], frame="frame7"),
            element(pair.second, geometry[1]),
            side,
            0.1,
            pair.name,
        )
        now, after = (evaluate(robot, ConstraintSet([c]), x) for x in (q, q + period * v))
        if now.status[0] != OK or after.status[0] != OK:
            continue
        checked += 1
        rate = -eta * now.margin
        defect = np.full(1, -INF)
        sampled_defects(now.margin, after.margin, rate, np.zeros(1), period, defect)
        expected = ((1.0 - eta * period) * by_pinocchio(robot, c, q) - by_pinocchio(robot, c, q + period * v)) / period
        # Both margins carry a rounding of 1e-15 m or so, which the division by T makes 1e-12 m/s.
        assert defect[0] == pytest.approx(expected, abs=1e-10)


def test_tolerances_are_those_that_the_safety_page_states():
    assert TOLERANCE_LINEAR == 1e-6 and TOLERANCE_ANGULAR == 1e-5
