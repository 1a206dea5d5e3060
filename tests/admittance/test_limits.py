"""Limits of the free velocity: kept exactly, nothing but energy taken out, and the projection is the nearest one."""

import numpy as np
import pytest
from qpsolvers import solve_qp

from admittance.limits import fill_limits, fit_offset, limit_velocity
from admittance.outcome import Limited
from primitives.active_set import work_rows


def random_case(rng: np.random.Generator, stuck: float = 0.2, d: int = 7):
    m = d - 2
    Z, B = rng.normal(size=(m, d)), rng.normal(size=(m, m))
    X = 0.2 * B @ B.T + np.eye(m)
    low = np.array([-rng.exponential(1.0, d) * (rng.random(d) >= stuck), np.zeros(d)])
    high = np.array([rng.exponential(1.0, d) * (rng.random(d) >= stuck), np.zeros(d)])
    speed = rng.exponential(1.0, d) + 0.05
    low[1], high[1] = np.maximum(low[0], -speed), np.minimum(high[0], speed)
    offset = 0.3 * rng.normal(size=d)
    return Z, X, low, high, offset


def limited(v, Z, X, low, high, offset, singular=None, singular_low=-np.inf):
    m, d = Z.shape
    rows, out = 2 * d + 1, v.copy()
    singular = np.zeros(m) if singular is None else singular
    unbounded = np.concatenate([np.full(m, -np.inf), np.full(m, np.inf)])
    counts = np.zeros(m + 2, dtype=np.int64), np.zeros(rows + 2 * m, dtype=np.int64)
    floats = np.zeros((rows, m)), np.zeros(rows), np.zeros(m), np.zeros(m), unbounded, np.zeros(rows + 2 * m)
    last = np.zeros(rows), np.zeros((work_rows(m), m))
    done = limit_velocity(out, Z, offset, low, high, singular, singular_low, X, *floats, *counts, *last)
    return out, done


def test_bounds_are_kept_and_energy_only_leaves():
    rng = np.random.default_rng(1)
    for _ in range(400):
        Z, X, low, high, offset = random_case(rng)
        factor = fit_offset(offset, low, high)
        assert 0.0 <= factor <= 1.0
        v = rng.normal(size=5) * rng.exponential(2.0)
        singular, singular_low = rng.normal(size=5), -rng.exponential(0.3)
        out, done = limited(v, Z, X, low, high, offset, singular, singular_low)
        qdot = Z.T @ out + offset
        assert np.all(qdot <= high[1] + 1e-12) and np.all(qdot >= low[1] - 1e-12)
        assert singular @ out >= singular_low - 1e-12
        assert out @ X @ (out - v) <= 1e-12, "the limits put no energy in"
        assert np.isfinite(out).all()
        if done == Limited.NONE:
            np.testing.assert_allclose(out, v, rtol=1e-8)


@pytest.mark.parametrize("stuck", [0.0, 0.2, 0.5])
def test_the_projection_is_the_nearest_velocity_by_another_solver(stuck):
    """In every case, with jammed joints and in badly conditioned metrics too."""
    rng, limited_ones = np.random.default_rng(2), 0
    for _ in range(400):
        Z, _, low, high, _ = random_case(rng, stuck)
        B = rng.normal(size=(5, 5))
        X = B @ B.T + 0.01 * np.eye(5)
        low[1], high[1] = -1e6, 1e6
        v = rng.normal(size=5)
        out, done = limited(v, Z, X, low, high, np.zeros(7))
        if not done & Limited.POSITION:
            continue
        limited_ones += 1
        rows, right = np.vstack([Z.T, -Z.T]), np.concatenate([high[0], -low[0]])
        expected = solve_qp(X, -X @ v, rows, right, solver="daqp", primal_tol=1e-12, dual_tol=1e-12)
        np.testing.assert_allclose(out, expected, atol=1e-8)
    assert limited_ones > 300


def test_scaling_alone_keeps_the_direction():
    rng = np.random.default_rng(3)
    Z, X = rng.normal(size=(5, 7)), np.eye(5)
    low, high = np.array([np.full(7, -1e3), np.full(7, -0.1)]), np.array([np.full(7, 1e3), np.full(7, 0.1)])
    v = rng.normal(size=5)
    out, done = limited(v, Z, X, low, high, np.zeros(7))
    assert done == Limited.VELOCITY
    np.testing.assert_allclose(out / np.linalg.norm(out), v / np.linalg.norm(v), atol=1e-12)
    assert np.abs(Z.T @ out).max() == pytest.approx(0.1, rel=1e-12)


def test_room_of_joints_inside_and_outside_their_range():
    limits = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])
    low, high = np.empty((2, 3)), np.empty((2, 3))
    fill_limits(np.array([0.9, -1.2, 1.5]), np.arange(3), limits, 5.0, low, high)
    np.testing.assert_allclose(low, [[-9.5, 0.0, -12.5], [-2.0, 0.0, -2.0]])
    np.testing.assert_allclose(high, [[0.5, 11.0, 0.0], [0.5, 2.0, 0.0]])
