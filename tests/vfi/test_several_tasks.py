"""Several pose tasks as one: against a stacked program made by Pinocchio and solved by others; what is refused."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from qpsolvers import solve_qp
from scipy.optimize import linprog

from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.evaluate import evaluate
from tests.primitives.qps import cases
from tests.vfi.arms import START, Array, pair, paper_constraints
from vfi.backends.lp import BETA_OVER_ETA
from vfi.controller import Controller
from vfi.messages import Measurement
from vfi.outcome import State
from vfi.tasks import PoseTask, VelocityTask

PAIR = pair()
STILL = np.zeros(16)
T, ETA, LIMIT_ETA, DAMPING = 0.004, 2.0, 5.0, 1e-2
TASKS = (
    PoseTask("moving/tip", gain=30.0, damping=DAMPING, weight=(1, 2, 1, 1, 3, 1, 1, 1)),
    PoseTask("parked/tip", gain=10.0, damping=DAMPING, weight=(1, 1, 1, 4, 1, 1, 0.5, 1)),
)


def product(a: Array, b: Array) -> Array:
    return np.r_[a[0] * b[0] - a[1:] @ b[1:], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])]


def pose_of(frame: str, q: Array) -> tuple[Array, Array]:
    """vec8 (8,) of a frame and its Jacobian (8, 16), by Pinocchio: r' = w r / 2, d = t r / 2 by the product rule."""
    model, data = PAIR.model, PAIR.model.createData()
    index = model.getFrameId(frame)
    J = pin.computeFrameJacobian(model, data, PAIR.configuration(q), index, pin.LOCAL_WORLD_ALIGNED)
    pin.updateFramePlacement(model, data, index)
    turned = pin.Quaternion(data.oMf[index].rotation)
    r, t = np.array([turned.w, turned.x, turned.y, turned.z]), np.r_[0.0, data.oMf[index].translation]
    out = np.empty((8, 16))
    for j in range(16):
        rate = 0.5 * product(np.r_[0.0, J[3:, j]], r)
        out[:, j] = np.r_[rate, 0.5 * (product(np.r_[0.0, J[:3, j]], r) + product(t, rate))]
    return np.r_[r, 0.5 * product(t, r)], out


def stacked(q: Array, reference: Array, tasks: tuple[PoseTask, ...] = TASKS) -> tuple[Array, Array]:
    """Task matrix (8k, 16) and target (8k,) of all tasks, those with the sign of x_d that is nearer to x."""
    rows, targets = [], []
    for task, wanted in zip(tasks, reference.reshape(-1, 8), strict=True):
        x, J = pose_of(str(task.frame), q)
        weight = np.array(task.weight)
        rows.append(weight[:, None] * J)
        nearer = min((x - wanted, x + wanted), key=np.linalg.norm)
        targets.append(weight * task.gain * nearer)
    return np.vstack(rows), np.concatenate(targets)


def bounds(q: Array) -> tuple[Array, Array]:
    limits = PAIR.limits
    low = np.maximum(-limits.velocity, LIMIT_ETA * (limits.lower - q))
    return low, np.minimum(limits.velocity, LIMIT_ETA * (limits.upper - q))


def situation(seed: int) -> tuple[Array, Array]:
    """A configuration near the start, and references some millimetres and degrees off."""
    rng = np.random.default_rng(seed)
    q = START + rng.normal(scale=[0.0005, 0.0005, 0.005, 0.005, 0.0005, 0.1, 0.1, 0.1] * 2)
    wanted = []
    for task in TASKS:
        moved, _ = pose_of(str(task.frame), q + rng.normal(scale=0.004, size=16))
        wanted.append(rng.choice([-1.0, 1.0]) * moved)
    return q, np.concatenate(wanted)


def step(constraints: ConstraintSet, q: Array, reference: Array, **options: Any) -> tuple[Controller, Array]:
    c = Controller(PAIR, constraints, TASKS, period=T, eta=ETA, limit_eta=LIMIT_ETA, guard="off", **options)
    command = c.step(Measurement(0.0, q, STILL), reference)
    assert command.state <= State.DEGRADED, command.reason
    return c, np.array(command.qdot)


@pytest.mark.parametrize("solver", ["quadprog", "daqp"])
@pytest.mark.parametrize("seed", range(cases(40, 5)))
def test_is_the_stacked_program_by_another_solver(seed, solver):
    pytest.importorskip(solver)
    q, reference = situation(seed)
    constraints = paper_constraints()
    _, v = step(constraints, q, reference)
    J, target = stacked(q, reference)
    found = evaluate(PAIR, constraints, q)
    demand = np.minimum(-ETA * found.margin, 0.05)
    low, high = bounds(q)
    options = {"dual_tol": 1e-11, "primal_tol": 1e-11} if solver == "daqp" else {}
    H, g = J.T @ J + DAMPING * np.eye(16), J.T @ target
    other = solve_qp(H, g, -found.jacobian, -demand, lb=low, ub=high, solver=solver, **options)
    np.testing.assert_allclose(v, other, atol=1e-8)
    assert np.abs(v[:8]).max() > 1e-4 and np.abs(v[8:]).max() > 1e-4


def test_record_holds_both_tasks_and_all_joints():
    q, reference = situation(1)
    c, v = step(paper_constraints(""), q, reference)
    record = c.ring[0]
    np.testing.assert_array_equal(record[c.columns["qdot"]], v)
    np.testing.assert_array_equal(record[c.columns["reference"]], reference)
    for k, task in enumerate(TASKS):
        x, _ = pose_of(str(task.frame), q)
        kept = record[c.columns["pose"]][8 * k : 8 * k + 8]
        assert min(np.abs(kept - x).max(), np.abs(kept + x).max()) < 1e-14
    assert c.joints == PAIR.joints


def test_of_arms_that_share_nothing_is_that_of_each_alone():
    q, reference = situation(2)
    constraints = ConstraintSet()
    _, together = step(constraints, q, reference)
    for k, arm in enumerate(("moving", "parked")):
        alone = Controller(PAIR, constraints, TASKS[k], period=T, group=arm, limit_eta=LIMIT_ETA, guard="off")
        command = alone.step(Measurement(0.0, q, STILL), reference[8 * k : 8 * k + 8])
        np.testing.assert_allclose(together[8 * k : 8 * k + 8], command.qdot, atol=1e-12)


@pytest.mark.parametrize("seed", range(cases(20, 3)))
def test_lp_stacks_them_too(seed):
    """The 1-norm of both tasks' residuals together, by SciPy on Pinocchio's matrices."""
    q, reference = situation(seed)
    _, v = step(paper_constraints(""), q, reference, solver="lp")
    J, target = stacked(q, reference)
    low, high = bounds(q)
    I, O = np.eye, np.zeros
    A = np.block(
        [
            [J, -I(16), O((16, 16))],
            [-J, -I(16), O((16, 16))],
            [I(16), O((16, 16)), -I(16)],
            [-I(16), O((16, 16)), -I(16)],
            [O((1, 32)), np.ones((1, 16))],
        ]
    )
    b = np.r_[-target, target, O(32), BETA_OVER_ETA * np.abs(target).sum()]
    limits = [*zip(low, high, strict=True), *[(0.0, None)] * 32]
    best = linprog(np.r_[O(16), np.ones(16), O(16)], A_ub=A, b_ub=b, bounds=limits, method="highs")
    assert np.abs(J @ v + target).sum() == pytest.approx(best.fun, rel=1e-7, abs=1e-9)
    assert np.abs(v).sum() <= BETA_OVER_ETA * np.abs(target).sum() + 1e-9


REFUSED = [
    ([TASKS[0], TASKS[0]], {}, "expected pose tasks of different frames, got moving/tip, moving/tip"),
    ([PoseTask(), PoseTask("moving/tip")], {}, "different frames"),
    ([TASKS[0], PoseTask("parked/tip", damping=0.5)], {}, "of one damping, got 0.01, 0.5"),
    ([TASKS[0], VelocityTask()], {}, "expected a PoseTask, several of them"),
    ([], {}, "expected a PoseTask, several of them"),
    ("moving/tip", {}, "expected a PoseTask, several of them"),
    (TASKS, {"group": "moving"}, 'no joint of the group "moving" moves the frame "parked/tip"'),
    (PoseTask("world"), {}, 'moves the frame "world"'),
    (VelocityTask(), {"solver": "lp"}, 'solver "lp" needs a PoseTask or several, got VelocityTask'),
    ([TASKS[0], VelocityTask()], {"solver": "lp"}, "expected a PoseTask, several of them"),
    ([TASKS[0], PoseTask("parked/tpi", damping=DAMPING)], {}, "parked/tip"),
]


@pytest.mark.parametrize(("task", "options", "words"), REFUSED)
def test_refused(task, options, words):
    with pytest.raises(InputError, match=words):
        Controller(PAIR, ConstraintSet(), task, period=T, **options)


def test_reference_of_another_form_is_named():
    q, reference = situation(3)
    c = Controller(PAIR, ConstraintSet(), TASKS, period=T, latch=None)
    command = c.step(Measurement(0.0, q, STILL), reference[:8])
    assert command.state == State.FAULT and not command.qdot.any()
    assert "of moving/tip and parked/tip, one after the other" in command.reason and "shape (16)" in command.reason
    bad = reference.copy()
    bad[8:12] *= 1.01
    command = c.step(Measurement(T, q, STILL), bad)
    assert command.state == State.FAULT and "reference of task 2 of 2: expected a unit dual" in command.reason
    assert c.step(Measurement(2 * T, q, STILL), reference).state == State.RUN
