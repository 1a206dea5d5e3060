"""Joint limits as bounds: the formula, outside the range, and braking in simulation."""

from itertools import product

import numpy as np
import pytest

from primitives.robot import Robot
from tests.primitives.qps import cases
from tests.vfi.arms import SEVEN, Array, closed_loop, seven
from vfi.controller import Controller
from vfi.limits import approach_speed, fill_bounds
from vfi.outcome import State
from vfi.tasks import VelocityTask

PERIODS = (1e-4, 1e-3, 4e-3, 2e-2)


def bounds(q: Array, limits: Array, last: Array, eta: float, period: float, accelerate: int = 1):
    low, high = np.full(len(q), np.nan), np.full(len(q), np.nan)
    yielded = fill_bounds(q, np.arange(len(q)), limits, last, eta, period, accelerate, low, high)
    return low, high, yielded


def test_formula_within_velocity_limits():
    """[I; -I] v <= eta [q_max - q; q - q_min], clipped to the velocity limits, for joints inside and outside."""
    rng = np.random.default_rng(1)
    for _ in range(cases(2000, 100)):
        n = int(rng.integers(1, 9))
        lower = rng.uniform(-3.0, 0.0, n)
        upper = lower + rng.exponential(1.0, n) + 1e-3
        speed = np.where(rng.random(n) < 0.2, np.inf, rng.exponential(1.0, n) + 1e-3)
        lower[rng.random(n) < 0.2], upper[rng.random(n) < 0.2] = -np.inf, np.inf
        q, eta = rng.uniform(-4.0, 4.0, n), float(rng.uniform(0.1, 50.0))
        limits = np.array([lower, upper, speed, np.full(n, np.inf)])
        low, high, yielded = bounds(q, limits, rng.normal(size=n), eta, 1e-3)
        np.testing.assert_array_equal(low, np.clip(-eta * (q - lower), -speed, speed))
        np.testing.assert_array_equal(high, np.clip(eta * (upper - q), -speed, speed))
        assert yielded == 0 and np.all(low <= high)


def test_only_the_decided_joints_are_looked_at():
    q, limits = np.array([9.0, 0.25, 9.0, -0.5]), np.array([[-1.0, -1.0], [1.0, 1.0], [2.0, 2.0], [np.inf, np.inf]])
    low, high = np.zeros(2), np.zeros(2)
    fill_bounds(q, np.array([3, 1]), limits, np.zeros(2), 2.0, 0.01, 1, low, high)
    np.testing.assert_allclose(low, [-1.0, -2.0])
    np.testing.assert_allclose(high, [2.0, 1.5])


def test_low_never_exceeds_high():
    """Wherever the joints are, and however fast they were commanded before."""
    rng = np.random.default_rng(2)
    for _ in range(cases(20_000, 500)):
        lower = rng.uniform(-1.0, 1.0, 3)
        upper = lower + 10.0 ** rng.uniform(-4.0, 1.0, 3)
        limits = np.array([lower, upper, 10.0 ** rng.uniform(-2.0, 1.0, 3), 10.0 ** rng.uniform(-3.0, 3.0, 3)])
        period = float(rng.choice(PERIODS))
        low, high, _ = bounds(
            rng.uniform(-3.0, 3.0, 3),
            limits,
            rng.normal(size=3),
            float(rng.uniform(0.01, 1.0)) / period,
            period,
            int(rng.integers(2)),
        )
        assert np.all(low <= high) and np.isfinite([low, high]).all()
        assert np.all(np.abs([low, high]) <= limits[2])


GRID = [
    (period, a, speed, share)
    for period, a, speed, share in product(PERIODS, (0.05, 0.5, 5.0, 100.0), (0.05, 0.5, 3.0), (0.01, 0.3, 1.0))
]


@pytest.mark.parametrize("way", ["upper limit", "lower limit", "to and fro"])
def test_braking_keeps_limits_and_acceleration(way):
    """A joint driven at a limit, in steps of T: never beyond it, never faster braked than a, nothing has to yield.

    The whole grid of periods, accelerations, speeds and gains (from 1 % to all of 1/T) runs as one vector of joints.
    """
    cycles = cases(3000, 120)
    rng = np.random.default_rng(3)
    wish = {"upper limit": 1.0, "lower limit": -1.0}.get(way, 0.0)
    for period in PERIODS:
        chosen = [(a, speed, share) for p, a, speed, share in GRID if p == period]
        for share in (0.01, 0.3, 1.0):
            a, speed = np.array([(a, v) for a, v, s in chosen if s == share]).T
            n, eta = len(a), share / period
            reach = np.minimum(cycles * period * speed / 4.0, a * (cycles * period) ** 2 / 16.0)
            limits = np.array([-reach, reach, speed, a])
            q, last = np.zeros(n), np.zeros(n)
            for k in range(cycles):
                low, high, yielded = bounds(q, limits, last, eta, period)
                assert yielded == 0
                if way == "to and fro" and k % 50 == 0:
                    wish = rng.choice([-1.0, 1.0], n)
                v = np.where(wish > 0.0, high, low)
                assert np.all(np.abs(v - last) <= a * period * (1.0 + 1e-6))
                q, last = q + period * v, v
                assert np.all(np.abs(q) <= reach * (1.0 + 1e-12))
            if way != "to and fro" and cycles * share > 100:
                assert np.all(np.abs(q) > 0.9 * reach), "a joint is not kept away from its limit"


def test_braking_starts_as_late_as_it_can():
    """2 % faster than allowed, braking as hard as it may, a joint is soon beyond the bound eta (q_max - q)."""
    for period, a, eta in product((1e-3, 1e-2), (0.5, 5.0), (2.0, 20.0)):
        touch = a * (1.0 / eta - 0.5 * period)
        for room in touch / eta * np.array([1.5, 4.0, 50.0]):
            allowed = approach_speed(room, eta, a, period)
            assert allowed < eta * room
            for factor, keeps in ((1.0, True), (1.02, False)):
                v, left, kept = factor * allowed, room, True
                while v > 0.5 * a * period:
                    kept = kept and v <= eta * left * (1.0 + 1e-9)
                    left -= period * v
                    v -= a * period
                assert kept == keeps, (period, a, eta, room, factor)


def test_speed_of_approach_is_continuous_and_grows_with_the_room():
    for period, a, eta in product(PERIODS, (0.1, 10.0), (0.5, 50.0)):
        rooms = np.concatenate([[0.0], np.geomspace(1e-9, 1e3, 400)])
        speeds = np.array([approach_speed(room, eta, a, period) for room in rooms])
        assert speeds[0] == 0.0 and np.all(np.diff(speeds) > 0.0)
        assert np.all(np.diff(speeds) <= eta * np.diff(rooms) * (1.0 + 1e-9) + 1e-12)


def test_acceleration_yields_to_a_limit_that_would_be_crossed_and_says_so():
    limits = np.array([[-1.0], [1.0], [2.0], [1.0]])
    low, high, yielded = bounds(np.array([0.999]), limits, np.array([2.0]), 5.0, 0.01)
    assert yielded == 1
    np.testing.assert_allclose([low[0], high[0]], [0.005, 0.005], rtol=1e-12)
    low, high, yielded = bounds(np.array([0.999]), limits, np.array([2.0]), 5.0, 0.01, accelerate=0)
    assert yielded == 0 and low[0] < -1.9


def limited(**limits: object) -> Robot:
    return seven().with_limits(**limits)


@pytest.mark.parametrize("period", [1e-3, 8e-3])
def test_in_closed_loop(period):
    """A velocity task that pushes all joints at their limits, with limits of acceleration."""
    a = np.array([1.0, 2.0, 5.0, 10.0, 1.0, 20.0, 3.0])
    robot = limited(acceleration=a)
    from primitives.constraint import ConstraintSet

    controller = Controller(robot, ConstraintSet(), VelocityTask(), period=period)
    push = np.array([row.velocity for row in SEVEN]) * np.array([1, -1, 1, -1, 1, 1, -1.0])
    run = closed_loop(controller, np.zeros(7), lambda t: push, cases(round(6.0 / period), 100))
    assert {c.state for c in run.commands} == {State.RUN}
    steps = np.diff(np.vstack([np.zeros(7), run.qdot]), axis=0)
    assert np.all(np.abs(steps) <= a * period * (1.0 + 1e-6))
    assert np.all(run.q >= robot.limits.lower - 1e-12) and np.all(run.q <= robot.limits.upper + 1e-12)
    if len(run.commands) > 500:
        assert np.all(np.abs(run.q[-1]) > 0.9 * robot.limits.upper)


@pytest.mark.parametrize("period", [1e-3, 2e-2])
def test_start_outside_comes_back(period):
    """Exponentially at limit_eta, no faster than the velocity limit, and then stays inside."""
    from primitives.constraint import ConstraintSet

    robot = seven()
    q = np.zeros(7)
    q[[0, 3]] = robot.limits.upper[0] + 0.5, robot.limits.lower[3] - 2.0
    controller = Controller(robot, ConstraintSet(), VelocityTask(), period=period, limit_eta=5.0)
    run = closed_loop(controller, q, lambda t: np.sign(q), cases(round(3.0 / period), 150))
    over = np.maximum(run.q - robot.limits.upper, robot.limits.lower - run.q).max(axis=1)
    assert np.all(np.diff(over)[over[:-1] > 0.0] < 0.0)
    expected = np.maximum(over[0] * (1.0 - 5.0 * period) ** np.arange(len(over)), 0.0)
    slowed = 2.0 - robot.limits.velocity[3] * period * np.arange(len(over))
    assert np.all(over <= np.maximum(expected, np.maximum(slowed, 0.45)) + 1e-9)
    if len(over) > 100 / period / 50:
        assert over[-1] < 1e-3
    outside = over[:-1]
    for command, by in zip(run.commands, outside, strict=True):
        assert command.state is (State.DEGRADED if by > 1e-5 else State.RUN)
        assert ("outside its range" in command.reason) == (by > 1e-5)
