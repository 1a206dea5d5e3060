"""Every back end on programs recorded from the project's own scenes; the tables stand in docs/solvers.md."""

import pytest

from primitives.errors import SolverError
from scenarios.run import run
from scenarios.scene_file import load_scene
from tests.scenarios.recorded import judge, record
from vfi.backends import solvers

QP_SOLVERS = [name for name in solvers.names() if not solvers[name].tracks_pose_only]
EXACT = ("active-set", "daqp", "quadprog", "piqp", "proxqp")


@pytest.fixture(scope="module")
def programs():
    return record(1000)


def verdicts(name, programs):
    try:
        return judge(name, programs)
    except SolverError as error:
        pytest.skip(str(error))


@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("name", QP_SOLVERS)
def test_back_end_agrees_with_the_kernel_and_keeps_every_row(name, programs):
    for kind, v in verdicts(name, programs).items():
        assert v.count == 500
        assert v.violation <= 2e-9, kind
        assert abs(v.cost) <= 2e-5, kind
        if name in EXACT:
            assert v.failures == 0, kind
        if kind == "easy":
            assert v.failures == 0
            assert v.distance <= 2e-4


@pytest.mark.campaign
@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("name", QP_SOLVERS)
def test_ten_thousand_programs(name):
    for kind, v in verdicts(name, record(10_000)).items():
        assert v.violation <= 2e-9, kind
        assert v.failures == 0 or (name == "osqp" and kind == "nearly degenerate")


def test_solver_that_is_not_installed_is_said(monkeypatch):
    import qpsolvers

    monkeypatch.setattr(qpsolvers, "available_solvers", ["proxqp"])
    with pytest.raises(SolverError, match=r'"daqp" is not installed; install it with: pip install daqp'):
        run(load_scene("S5"), solver="daqp")


class Liar:
    """A back end that says "found" whatever it answers."""

    def __init__(self, qp, answer):
        self.qp, self.answer = qp, answer

    def solve(self, v, multiplier):
        from vfi.qp import SolverStatus

        v[:] = self.answer
        return SolverStatus.OPTIMAL


@pytest.mark.parametrize("answer", [0.5, -0.04, float("nan"), float("inf"), 1e6])
def test_wrong_answers_are_never_commanded(answer):
    from vfi.backends import Solver

    name = f"liar {answer}"
    solvers.register(Solver(name, "says found and lies", lambda qp: Liar(qp, answer)))
    try:
        trace = run(load_scene("S5").with_changes(duration=4.0), solver=name, period=0.008)
    finally:
        solvers._things.pop(name)
    assert trace["intervened"].any() or trace["solver"].any() or trace["state"].any()
    for constraint in trace.header["constraints"]:
        assert trace.margin(constraint).min() >= -1e-5
    limits = [0.05, 0.05, 0.5, 0.5, 0.05, 2.0, 2.0, 2.0]
    assert (abs(trace["qdot"]) <= [1e-5 + limit for limit in limits]).all()
