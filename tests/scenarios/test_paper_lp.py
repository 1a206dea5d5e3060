"""The paper's linear program in the size and with the optimum that S5 gives it."""

import numpy as np
import pytest
from scipy.optimize import linprog

from scenarios.run import build, run
from scenarios.scene_file import load_scene
from tests.scenarios.recorded import _programs
from vfi.backends.lp import BETA_OVER_ETA, PaperLP
from vfi.messages import Measurement
from vfi.outcome import State


@pytest.fixture(scope="module")
def programs():
    return list(_programs(load_scene("S5"), 60))


def independent(qp):
    """min |J v + t|_1 with |v|_1 <= beta/eta |t|_1, by splitting into epigraph variables; not the canonical form."""
    J, t, n, k = qp.task, qp.error, len(qp.g), len(qp.error)
    rows = qp.b > -np.inf
    m = int(rows.sum())
    eye_n, eye_k = np.eye(n), np.eye(k)
    A = np.block(
        [
            [J, -eye_k, np.zeros((k, n))],
            [-J, -eye_k, np.zeros((k, n))],
            [eye_n, np.zeros((n, k)), -eye_n],
            [-eye_n, np.zeros((n, k)), -eye_n],
            [np.zeros((1, n + k)), np.ones((1, n))],
            [-qp.A[rows], np.zeros((m, k + n))],
        ]
    )
    b = np.r_[-t, t, np.zeros(2 * n), BETA_OVER_ETA * np.abs(t).sum(), -qp.b[rows]]
    bounds = [*zip(qp.low, qp.high, strict=True), *[(0, None)] * (k + n)]
    return linprog(np.r_[np.zeros(n), np.ones(k), np.zeros(n)], A_ub=A, b_ub=b, bounds=bounds, method="highs")


def test_size_is_that_of_the_paper(programs):
    matrix, right, cost = PaperLP(programs[0]).matrices()
    assert matrix.shape == (29, 53)
    assert right.shape == (29,) and cost.shape == (53,)
    assert np.array_equal(matrix[9:, 33:], np.eye(20))


def test_optimum_is_that_of_an_independent_program(programs):
    for qp in programs:
        v, multiplier = np.zeros(8), np.zeros(len(qp.b) + 16)
        PaperLP(qp).solve(v, multiplier)
        expected = independent(qp)
        assert expected.status == 0
        assert np.abs(qp.task @ v + qp.error).sum() == pytest.approx(expected.fun, abs=1e-9)
        assert np.abs(v).sum() <= BETA_OVER_ETA * np.abs(qp.error).sum() + 1e-9
        assert np.all(qp.A @ v >= qp.b - 1e-9)
        assert multiplier.min() >= 0.0


def test_kept_basis_gives_the_same_optimum_as_a_cold_start(programs):
    memory = type(programs[0])(*(block.copy() for block in programs[0]))
    warm = PaperLP(memory)
    for qp in programs:
        for mine, theirs in zip(memory, qp, strict=True):
            mine[:] = theirs
        v, cold = np.zeros(8), np.zeros(8)
        warm.solve(v, np.zeros(20))
        PaperLP(qp).solve(cold, np.zeros(20))
        costs = [np.abs(qp.task @ x + qp.error).sum() for x in (v, cold)]
        assert costs[0] == pytest.approx(costs[1], abs=1e-9)


def test_nothing_may_move_where_nothing_is_to_be_tracked_so_a_violation_needs_the_kernel():
    """beta |x~|_1 = 0 forbids the motion that Remark 1 promises; the kernel takes over and says so."""
    scene = load_scene("S5")
    start = np.array(scene.start)
    start[4] = 0.14
    controller = build(scene, solver="lp", guard="act", period=0.008)
    x = controller.robot.kinematics(start).pose("moving/tip")
    command = controller.step(Measurement(0.0, start, np.zeros(16)), x)
    assert controller.ring[0, controller.columns["infeasible"]] == 1
    assert command.state is State.DEGRADED
    assert command.margins["C3"] < -2e-3
    assert np.abs(command.qdot).max() > 1e-4


def test_lp_runs_of_all_scenes_have_no_infeasible_cycle():
    for name in ("S1", "S5", "S3-stiff-wrist"):
        assert not run(load_scene(name), solver="lp", guard="off")["infeasible"].any()
