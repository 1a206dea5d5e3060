"""The passive projection: optimal by an independent solver, exact in its ledger, and passive where nothing moves."""

import numpy as np
import pytest
import qpsolvers

from primitives.checks import Array
from tests.primitives.qps import cases
from vfi.projection import Projected, Projection
from vfi.qp import SolverStatus

T = 0.004


class Step:
    """A step of a target admittance with m free coordinates and d joints: random, with standing still allowed."""

    def __init__(self, rng: np.random.Generator, m: int = 5, d: int = 7, k: int = 12, recovering: bool = False):
        self.M = np.diag(rng.uniform(0.3, 8.0, m))
        self.D = np.diag(rng.uniform(1.0, 200.0, m))
        self.v, self.f = rng.normal(size=m), 30.0 * rng.normal(size=m)
        self.X = self.M + T * self.D
        self.v_ref = np.linalg.solve(self.X, self.M @ self.v + T * self.f)
        self.rows = rng.normal(size=(k, m)) * rng.choice([0.05, 1.0], size=(k, 1))
        self.demand = -rng.exponential(0.05, k)
        if recovering:
            self.demand[0] = 0.01
        self.basis, self.offset = rng.normal(size=(d, m)), 1e-4 * rng.normal(size=d)
        self.low, self.high = -rng.uniform(0.05, 2.0, d), rng.uniform(0.05, 2.0, d)

    def solve(self, projection: Projection) -> Projected:
        return projection.solve(
            self.v_ref, self.X, self.rows, self.demand, self.basis, self.offset, self.low, self.high
        )

    def inequalities(self) -> tuple[Array, Array]:
        """A v >= b of rows, lower and upper bounds."""
        return (
            np.vstack([self.rows, self.basis, -self.basis]),
            np.concatenate([self.demand, self.low - self.offset, self.offset - self.high]),
        )


def steps(seed: int, count: int, **sizes: bool) -> list[Step]:
    rng = np.random.default_rng(seed)
    return [Step(rng, k=int(rng.integers(0, 40)) + int(sizes.get("recovering", False)), **sizes) for _ in range(count)]


def test_it_is_the_nearest_velocity_in_its_metric():
    """As DAQP finds it; rows, bounds and stationarity hold."""
    projection = Projection(5, 7)
    active = 0
    for s in steps(1, cases(300, 20)):
        found = s.solve(projection)
        A, b = s.inequalities()
        assert found.status == SolverStatus.OPTIMAL
        assert (A @ found.v - b).min() >= -1e-9
        twin = qpsolvers.solve_qp(s.X, -s.X @ s.v_ref, -A, -b, solver="daqp", primal_tol=1e-11, dual_tol=1e-12)
        np.testing.assert_allclose(found.v, twin, atol=1e-7)
        forces = A.T @ np.concatenate([found.multipliers, *found.joints])
        np.testing.assert_allclose(s.X @ (found.v - s.v_ref), forces, atol=1e-9)
        active += int((found.multipliers > 0.0).sum() + (found.joints > 0.0).sum())
    assert active > cases(300, 20), "a projection that nothing acts on proves nothing"


@pytest.mark.parametrize("recovering", [False, True])
def test_ledger_is_an_identity(recovering):
    """dE = hand - damping - numerical + constraints, to 1e-12 J; with b <= 0 the constraints take energy out."""
    projection = Projection(5, 7)
    for s in steps(2, cases(300, 20), recovering=recovering):
        found = s.solve(projection)
        if found.status != SolverStatus.OPTIMAL:
            assert recovering
            continue
        v, w = found.v, s.v
        change = 0.5 * v @ s.M @ v - 0.5 * w @ s.M @ w
        ledger = T * s.f @ v - T * v @ s.D @ v - 0.5 * (v - w) @ s.M @ (v - w) + found.constraint_work
        scale = max(1.0, abs(change), T * abs(s.f @ v))
        assert abs(change - ledger) <= 1e-12 * scale
        if not recovering:
            assert found.constraint_work <= 1e-14
            assert change <= T * s.f @ v + 1e-12 * scale, "no more than what the hand puts in"


def test_another_metric_puts_energy_in():
    """The same rows in the joints' metric: the numbers that make the passive one worth its name."""
    projection, worst = Projection(5, 7), -np.inf
    for s in steps(3, cases(300, 20)):
        metric = s.basis.T @ s.basis + 1e-9 * np.eye(5)
        found = projection.solve(s.v_ref, metric, s.rows, s.demand, s.basis, s.offset, s.low, s.high)
        v, w = found.v, s.v
        worst = max(worst, 0.5 * v @ s.M @ v - 0.5 * w @ s.M @ w - T * s.f @ v)
    assert worst > 1e-2


def test_more_rows_than_ever_before_and_none():
    rng = np.random.default_rng(4)
    projection = Projection(5, 7)
    for k in (0, 3, 0, 500, 2):
        s = Step(rng, k=k)
        found = s.solve(projection)
        assert found.status == SolverStatus.OPTIMAL and found.multipliers.shape == (k,)
        np.testing.assert_array_equal(found.v, s.solve(Projection(5, 7)).v)


def test_contradiction_stands_still_and_says_so():
    s = Step(np.random.default_rng(5), k=2)
    s.rows[1], s.demand[:] = -s.rows[0], 1.0
    found = s.solve(Projection(5, 7))
    assert found.status == SolverStatus.INFEASIBLE
    assert not found.v.any() and not found.multipliers.any() and found.constraint_work == 0.0


@pytest.mark.parametrize("what", ["v_ref", "X", "rows", "demand", "basis", "offset", "low"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_not_finite_give_no_velocity(what, value):
    s = Step(np.random.default_rng(6), k=3)
    getattr(s, what).flat[0] = value
    found = s.solve(Projection(5, 7))
    assert np.isfinite(found.v).all() and np.isfinite(found.constraint_work)
    if found.status != SolverStatus.OPTIMAL:
        assert not found.v.any()
    else:
        assert what in ("demand", "offset", "low") and value == np.inf, "a bound at infinity may be one that is free"


def test_what_is_returned_is_not_overwritten():
    rng = np.random.default_rng(7)
    projection = Projection(5, 7)
    first = Step(rng).solve(projection)
    kept = first.v.copy(), first.multipliers.copy()
    Step(rng).solve(projection)
    np.testing.assert_array_equal(first.v, kept[0])
    np.testing.assert_array_equal(first.multipliers, kept[1])
