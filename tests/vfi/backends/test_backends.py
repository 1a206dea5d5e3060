"""Every registered solver against the kernel, and solvers that lie, fail or raise."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from primitives.constraint import ConstraintSet
from primitives.errors import InputError, SolverError, UnknownNameError
from tests.primitives.qps import Problem, cases, objective, random_problem
from tests.primitives.qps import solved as by_kernel
from tests.vfi.arms import START, Array, Oracle, closed_loop, pair, paper_constraints, paper_reference
from vfi.backends import Solver, solvers
from vfi.controller import Controller
from vfi.messages import Measurement
from vfi.outcome import Reason, State
from vfi.qp import QP, SolverStatus
from vfi.recovery import RESOLVES
from vfi.tasks import PoseTask, VelocityTask

PAIR = pair()
REFERENCE = paper_reference(PAIR)
STILL = np.zeros(16)
T = 0.008


def quadratic() -> list[str]:
    """Registered solvers of the quadratic program that are installed."""
    out = []
    for name in solvers.names():
        entry = solvers[name]
        if entry.bind is None or entry.tracks_pose_only:
            continue
        try:
            entry.bind(as_qp(random_problem(np.random.default_rng(0), 3, 2, frozenset())))
        except Exception:
            continue
        out.append(name)
    return out


def as_qp(p: Problem) -> QP:
    return QP(*p[:6], np.eye(len(p.g)), np.zeros(len(p.g)))


def test_kernel_and_lp_are_there():
    assert {"active-set", "lp"} <= set(solvers.names())
    assert solvers["active-set"].bind is None and solvers["lp"].tracks_pose_only
    with pytest.raises(UnknownNameError, match='Did you mean "lp"'):
        solvers["lpp"]


def test_more_than_the_kernel_was_tried():
    assert {"daqp", "quadprog"} <= set(quadratic())


@pytest.mark.filterwarnings("ignore:OSQP exited")
@pytest.mark.parametrize("name", quadratic())
def test_agrees_with_the_kernel(name):
    """The same minimum on programs like those of a controller; where there is none, none is claimed."""
    rng = np.random.default_rng(1)
    found = refused = 0
    for k in range(cases(150, 25)):
        kinds = frozenset({"infeasible"}) if k % 5 == 4 else frozenset()
        p = random_problem(rng, int(rng.integers(2, 9)), int(rng.integers(1, 30)), kinds)
        p = p._replace(H=p.H + 1e-3 * np.eye(len(p.g)))
        bind = solvers[name].bind
        assert bind is not None
        v, multiplier = np.zeros(len(p.g)), np.zeros(len(p.b) + 2 * len(p.g))
        status, kernel = bind(as_qp(p)).solve(v, multiplier), by_kernel(p)
        if kernel.status != SolverStatus.OPTIMAL:
            refused += 1
            assert status != SolverStatus.OPTIMAL
        elif status == SolverStatus.OPTIMAL:
            found += 1
            assert abs(objective(p, v) - objective(p, kernel.x)) < 1e-5 * (1.0 + abs(objective(p, kernel.x)))
            assert multiplier.min() >= 0.0
            if np.count_nonzero(kernel.multiplier):
                size = kernel.multiplier.max()
                np.testing.assert_allclose(multiplier, kernel.multiplier, atol=1e-3 * (1.0 + size))
    assert refused > cases(10, 1) and found > cases(100, 10)


@pytest.mark.parametrize("where", ["H", "g", "A", "b", "low", "high"])
@pytest.mark.parametrize("name", quadratic())
def test_nan_in_a_program_is_no_optimum(name, where):
    """Nor a row or bound less: the answer is none, or an error, which the controller takes for none."""
    qp = as_qp(random_problem(np.random.default_rng(2), 4, 5, frozenset({"free gradient"})))
    qp.b[:] = -1.0
    getattr(qp, where).flat[1] = np.nan
    bind, v = solvers[name].bind, np.zeros(4)
    assert bind is not None
    try:
        status = bind(qp).solve(v, np.zeros(13))
    except SolverError:
        return
    assert status != SolverStatus.OPTIMAL


# Solvers that are not to be trusted -----------------------------------------------------------------------------------

Answer = Callable[[QP, Array, Array], Any]


class Untrustworthy:
    def __init__(self, qp: QP, answer: Answer):
        self.qp, self.answer, self.asked = qp, answer, 0

    def solve(self, v: Array, multiplier: Array) -> Any:
        self.asked += 1
        return self.answer(self.qp, v, multiplier)


@pytest.fixture
def bad_solver() -> Iterator[Callable[[Answer], str]]:
    """Registers a solver with some answer under a name of its own, until the test is over."""
    names: list[str] = []

    def make(answer: Answer) -> str:
        names.append(f"untrustworthy {len(names)}")
        solvers.register(Solver(names[-1], "", lambda qp: Untrustworthy(qp, answer)))
        return names[-1]

    yield make
    for name in names:
        del solvers._things[name]


def nan(qp: QP, v: Array, multiplier: Array) -> Any:
    v[:] = np.nan
    return SolverStatus.OPTIMAL


def infinite(qp: QP, v: Array, multiplier: Array) -> Any:
    v[0] = np.inf
    return SolverStatus.OPTIMAL


def raising(qp: QP, v: Array, multiplier: Array) -> Any:
    raise RuntimeError("out of order")


def exiting(qp: QP, v: Array, multiplier: Array) -> Any:
    v[:] = np.ones(3)
    return SolverStatus.OPTIMAL


def speechless(qp: QP, v: Array, multiplier: Array) -> Any:
    return None


def unknown_status(qp: QP, v: Array, multiplier: Array) -> Any:
    return 42


def not_converged(qp: QP, v: Array, multiplier: Array) -> Any:
    v[:] = 7.0
    return SolverStatus.NOT_CONVERGED


def infeasible(qp: QP, v: Array, multiplier: Array) -> Any:
    return SolverStatus.INFEASIBLE


FAILING = (nan, infinite, raising, exiting, speechless, unknown_status, not_converged, infeasible)


@pytest.mark.parametrize("guard", ["act", "watch", "off"])
@pytest.mark.parametrize("answer", FAILING)
def test_solver_that_finds_nothing_is_replaced_by_the_kernel(bad_solver, answer, guard, monkeypatch):
    """With any guard the command is the kernel's without cuts, which a back end has none of, and it is said."""
    monkeypatch.setattr("vfi.lowering.RESOLVES", 0)
    options = {"period": T, "group": "moving", "guard": guard}
    bad = Controller(PAIR, paper_constraints(), VelocityTask(), solver=bad_solver(answer), **options)
    kernel = Controller(PAIR, paper_constraints(), VelocityTask(), **options)
    wish = 0.8 * PAIR.limits.velocity[:8]
    for k in range(20):
        measurement = Measurement(float(k), START, STILL)
        command, expected = bad.step(measurement, wish), kernel.step(measurement, wish)
        np.testing.assert_allclose(command.qdot, expected.qdot, atol=1e-9)
        assert command.state == State.DEGRADED and "active-set kernel" in command.reason
        assert bad.ring[k, bad.columns["reason"]][0] == Reason.SECOND_SOLVER
        assert bad.ring[k, bad.columns["infeasible"]][0] == (answer is infeasible)


def careless(qp: QP, v: Array, multiplier: Array) -> Any:
    """The unconstrained minimum, "found"."""
    v[:] = np.linalg.solve(qp.H, -qp.g)
    return SolverStatus.OPTIMAL


def reckless(qp: QP, v: Array, multiplier: Array) -> Any:
    """As fast as can be, in some direction, "found"."""
    v[:] = 1e3
    return SolverStatus.OPTIMAL


@pytest.mark.parametrize("answer", [careless, reckless])
def test_wrong_answers_are_found_out(bad_solver, answer):
    """Rows, limits and predicted margins are kept all the same: by the kernel, after the re-solves have not helped."""
    name = bad_solver(answer)
    c = Controller(PAIR, paper_constraints(), PoseTask(), period=T, group="moving", solver=name, ring=1000)
    run = closed_loop(c, START, lambda t: REFERENCE(4.0 * t), cases(469, 40))
    margins = Oracle(PAIR, paper_constraints()).margins(run.q).astype(float)
    assert margins.min() > -2e-6
    assert np.all(np.abs(run.qdot) <= PAIR.limits.velocity[:8] + 1e-6)
    states = np.array([command.state for command in run.commands])
    assert not np.any(states >= State.HOLD)
    caught = states == State.DEGRADED
    assert caught.any()
    count = len(states)
    assert np.all(c.ring[:count, c.columns["resolves"]][caught, 0] > RESOLVES)
    if answer is reckless:
        assert caught.all()
    else:
        assert not caught.all(), "where no constraint acts its answer is right and taken"


def test_wrong_answers_pass_where_nobody_looks(bad_solver):
    """guard "off" commands what the solver says, "watch" as well but counts it: comparisons need that."""
    name = bad_solver(reckless)
    for guard in ("off", "watch"):
        c = Controller(PAIR, paper_constraints(), PoseTask(), period=T, group="moving", solver=name, guard=guard)
        command = c.step(Measurement(0.0, START, STILL), REFERENCE(0.0))
        np.testing.assert_array_equal(command.qdot, 1e3)
        assert c.ring[0, c.columns["intervened"]][0] == (guard == "watch")


def test_entry_whose_bind_cannot_be_called():
    with pytest.raises(InputError, match="bind must be callable"):
        solvers.register(Solver("broken", "", 3))  # type: ignore[arg-type]
    assert "broken" not in solvers.names()


def test_back_end_without_constraints(bad_solver):
    """No rows at all: wrong answers are still stopped by the joint limits, and the reason is no constraint's."""
    name = bad_solver(reckless)
    c = Controller(PAIR, ConstraintSet(), VelocityTask(), period=T, group="moving", solver=name)
    command = c.step(Measurement(0.0, START, STILL), np.full(8, 0.01))
    np.testing.assert_allclose(command.qdot, 0.01, atol=1e-12)
    assert command.state == State.DEGRADED
