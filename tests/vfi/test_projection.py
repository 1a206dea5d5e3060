"""The passive projection: optimal by an independent solver, exact in its ledger, and passive where nothing moves."""

import numpy as np
import pytest
import qpsolvers

from primitives.checks import Array
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from tests.primitives.qps import cases
from tests.vfi.arms import seven
from vfi.controller import Controller
from vfi.messages import Command, FreeReference, Measurement, Rows
from vfi.outcome import State, Work
from vfi.tasks import ProjectionTask

T, SEVEN, MOST = 0.004, seven(), 40
Q = np.full(7, 0.3)


def controller(guard: str = "off", m: int = 5) -> Controller:
    return Controller(SEVEN, ConstraintSet(), ProjectionTask(m), period=T, user_rows=MOST, guard=guard)


class Step:
    """A step of a target admittance with m free coordinates and seven joints: random, standing still is allowed."""

    def __init__(self, rng: np.random.Generator, m: int = 5, k: int = 12, recovering: bool = False):
        self.M = np.diag(rng.uniform(0.3, 8.0, m))
        self.D = np.diag(rng.uniform(1.0, 200.0, m))
        self.v, self.f = rng.normal(size=m), 30.0 * rng.normal(size=m)
        self.X = self.M + T * self.D
        self.v_ref = np.linalg.solve(self.X, self.M @ self.v + T * self.f)
        self.rows = rng.normal(size=(k, 7)) * rng.choice([0.05, 1.0], size=(k, 1))
        self.demand = -rng.exponential(0.05, k)
        if recovering:
            self.demand[0] = 0.01
        self.basis, self.offset = rng.normal(size=(7, m)), 1e-4 * rng.normal(size=7)

    def solve(self, c: Controller, t: float = 0.0) -> Command:
        reference = FreeReference(self.v_ref, self.X, self.basis, self.offset)
        return c.step(
            Measurement(t, Q, np.zeros(7)), reference, Rows(self.rows, np.zeros(len(self.demand)), 1.0, -self.demand)
        )

    def inequalities(self) -> tuple[Array, Array]:
        """A v >= b of rows, lower and upper bounds, in the free coordinates."""
        speed, room = SEVEN.limits.velocity, 5.0
        low = np.maximum(-speed, -room * (Q - SEVEN.limits.lower))
        high = np.minimum(speed, room * (SEVEN.limits.upper - Q))
        rows = np.vstack([self.rows @ self.basis, self.basis, -self.basis])
        demand = self.demand - self.rows @ self.offset
        return rows, np.concatenate([demand, low - self.offset, self.offset - high])


def steps(seed: int, count: int, **sizes: bool) -> list[Step]:
    rng = np.random.default_rng(seed)
    return [Step(rng, k=int(rng.integers(0, 39)) + int(sizes.get("recovering", False)), **sizes) for _ in range(count)]


def multipliers(c: Controller, command: Command, k: int) -> Array:
    """Of the k rows, lower and upper bounds."""
    all_of_them = command.record[c.columns["multiplier"]]
    return np.concatenate([all_of_them[:k], all_of_them[MOST:]])


def work(c: Controller, command: Command) -> Array:
    return command.record[c.columns["work"]]


def test_it_is_the_nearest_velocity_in_its_metric():
    """As DAQP finds it; rows, bounds and stationarity hold."""
    active = 0
    for s in steps(1, cases(300, 20)):
        c = controller()
        found = s.solve(c)
        A, b = s.inequalities()
        assert found.state == State.RUN, found.reason
        v, forces = found.free, multipliers(c, found, len(s.demand))
        np.testing.assert_allclose(found.qdot, s.basis @ v + s.offset, atol=1e-12)
        assert (A @ v - b).min() >= -1e-9
        twin = qpsolvers.solve_qp(s.X, -s.X @ s.v_ref, -A, -b, solver="daqp", primal_tol=1e-11, dual_tol=1e-12)
        np.testing.assert_allclose(v, twin, atol=1e-7)
        np.testing.assert_allclose(s.X @ (v - s.v_ref), A.T @ forces, atol=1e-8)
        active += int((forces > 0.0).sum())
    assert active > cases(300, 20), "a projection that nothing acts on proves nothing"


@pytest.mark.parametrize("recovering", [False, True])
def test_ledger_is_an_identity(recovering):
    """dE = hand - damping - numerical + constraints, to 1e-12 J; with b <= 0 the constraints take energy out."""
    for s in steps(2, cases(300, 20), recovering=recovering):
        c = controller()
        found = s.solve(c)
        if found.state >= State.HOLD:
            assert recovering
            continue
        v, w, parts = found.free, s.v, work(c, found)
        change = 0.5 * v @ s.M @ v - 0.5 * w @ s.M @ w
        ledger = T * s.f @ v - T * v @ s.D @ v - 0.5 * (v - w) @ s.M @ (v - w) + parts.sum()
        scale = max(1.0, abs(change), T * abs(s.f @ v))
        assert abs(change - ledger) <= 1e-12 * scale
        assert abs(parts[Work.GUARD]) <= 1e-9 * scale, "the multipliers account for all of it"
        assert parts[Work.RECOVERING] >= 0.0 >= parts[Work.KEEPING]
        if not recovering:
            small = abs(parts[Work.PORT]) + 1e-14
            assert parts.sum() <= small
            assert change <= T * s.f @ v + small + 1e-12 * scale, "no more than what the hand puts in"


def test_another_metric_puts_energy_in():
    """The same rows in the joints' metric: the numbers that make the passive one worth its name."""
    worst = -np.inf
    for s in steps(3, cases(300, 20)):
        s.X = s.basis.T @ s.basis + 1e-9 * np.eye(5)
        v, w = s.solve(controller()).free, s.v
        worst = max(worst, 0.5 * v @ s.M @ v - 0.5 * w @ s.M @ w - T * s.f @ v)
    assert worst > 1e-2


def test_rows_come_and_go():
    rng, c = np.random.default_rng(4), controller()
    for t, k in enumerate((0, 3, 0, 40, 2)):
        s = Step(rng, k=k)
        np.testing.assert_allclose(s.solve(c, 0.004 * t).free, s.solve(controller()).free, atol=1e-12)


def test_scaling_down_is_passive_too():
    """Where the guard halves the command, the ledger still closes, and the guard's port takes out what is missing."""
    halved = 0
    for s in steps(5, cases(200, 20)):
        c = controller("act")
        found = s.solve(c)
        if found.record[c.columns["halvings"]][0]:
            halved += 1
        v, w = found.free, s.v
        if found.state >= State.HOLD:
            continue
        change = 0.5 * v @ s.M @ v - 0.5 * w @ s.M @ w
        ledger = T * s.f @ v - T * v @ s.D @ v - 0.5 * (v - w) @ s.M @ (v - w) + work(c, found).sum()
        assert abs(change - ledger) <= 1e-12 * max(1.0, abs(change), T * abs(s.f @ v))


def test_contradiction_stands_still_and_says_so():
    s = Step(np.random.default_rng(5), k=2)
    s.rows[1], s.demand[:] = -s.rows[0], [0.2, -0.1]
    c = controller()
    found = s.solve(c)
    assert found.state == State.DEGRADED and "conflict" in found.reason, "the row that may yield does"
    s.demand[:] = -1e3
    s.offset[:] = 100.0
    found = s.solve(c, 0.004)
    assert found.state == State.HOLD and "no velocity within the joint limits" in found.reason
    assert not found.qdot.any() and not found.free.any() and not work(c, found).any()


@pytest.mark.parametrize("what", ["v_ref", "X", "basis", "offset"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_a_fault(what, value):
    s, c = Step(np.random.default_rng(6), k=3), controller()
    getattr(s, what).flat[0] = value
    found = s.solve(c)
    assert found.state == State.FAULT and "finite" in found.reason
    assert not found.qdot.any() and not found.free.any()


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        (np.zeros(5), "expected a FreeReference"),
        (FreeReference(np.zeros(4), np.eye(5), np.zeros((7, 5)), np.zeros(7)), "v_ref"),
        (FreeReference(np.zeros(5), np.eye(4), np.zeros((7, 5)), np.zeros(7)), "metric"),
        (FreeReference(np.zeros(5), np.eye(5), np.zeros((5, 7)), np.zeros(7)), "basis"),
        (FreeReference(np.zeros(5), np.eye(5), np.zeros((7, 5)), np.zeros(3)), "offset"),
    ],
)
def test_a_reference_of_another_form_is_a_fault_that_says_which(reference, words):
    found = controller().step(Measurement(0.0, Q, np.zeros(7)), reference)
    assert found.state == State.FAULT and words in found.reason and not found.qdot.any()


def test_bad_tasks_are_refused():
    for count in (0, 8, 2.5, np.nan):
        with pytest.raises(InputError, match="coordinates of ProjectionTask"):
            controller(m=count)
    with pytest.raises(InputError, match="active-set"):
        Controller(SEVEN, ConstraintSet(), ProjectionTask(5), period=T, solver="daqp")
