"""Slack where rows contradict each other: smallest by linear programs, in the order of the safety classes."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog

from primitives.active_set import work_rows
from primitives.constraint import SAFETY_CLASSES, Constraint, ConstraintSet
from primitives.elements import Plane, Point
from primitives.evaluate import Entity
from tests.primitives.qps import cases, least_violation
from tests.vfi.arms import START, Array, pair, pose, seven
from vfi.controller import Controller
from vfi.memory import Real
from vfi.messages import Measurement, Rows
from vfi.outcome import Slot, State
from vfi.qp import SolverStatus
from vfi.relaxation import ROOM, relax
from vfi.tasks import VelocityTask

PATIENT, ROBOT, TASK = range(3)
CLOSE = 2e-6
"""m/s; the slack found may exceed the smallest possible one by this, of rows of unit size and speeds of about 1."""


class Case(NamedTuple):
    A: Array
    demand: Array
    low: Array
    high: Array
    classes: np.ndarray


def relaxed(case: Case, raised: Array | None = None) -> tuple[int, Array]:
    """Status and slacks of the rows, from clean scratch; raised : what re-solving has added to the demands."""
    r, n = case.A.shape
    wide = n + 1
    b, slack = case.demand + (0.0 if raised is None else raised), np.zeros(r)
    status = relax(
        case.A,
        case.demand,
        case.low,
        case.high,
        case.classes,
        b,
        slack,
        np.zeros((wide, wide)),
        np.zeros(wide),
        np.zeros((r, wide)),
        np.zeros(r),
        np.zeros(wide),
        np.zeros(wide),
        np.zeros(wide),
        np.zeros(r + 2 * wide),
        np.zeros(wide + 2, dtype=np.int64),
        np.zeros(r + 2 * wide, dtype=np.int64),
        np.zeros(r),
        np.zeros((work_rows(wide), wide)),
    )
    if status == SolverStatus.OPTIMAL and raised is None:
        np.testing.assert_allclose(b, case.demand - slack, atol=1e-15)
    return status, slack


def case(A: Any, demand: Any, classes: Any = None, speed: float = 1.0) -> Case:
    A, demand = np.array(A, dtype=float), np.array(demand, dtype=float)
    n = A.shape[1]
    classes = np.zeros(len(A), dtype=np.int64) if classes is None else np.array(classes, dtype=np.int64)
    return Case(A, demand, np.full(n, -speed), np.full(n, speed), classes)


def test_no_row_is_sacrificed_for_a_guess_of_re_solving():
    """Raised by 0.8 m/s, a row that standing still keeps may not have one that is 3e-6 m/s short lose 0.8 m/s."""
    c = case([[1.0], [-1.0]], [3e-6, -0.1])
    status, slack = relaxed(c, np.array([0.0, 0.9]))
    assert status == SolverStatus.OPTIMAL
    assert 0.0 < slack[0] <= 3e-6 and slack[1] == 0.0
    bound = c._replace(low=np.array([-1.0]), high=np.array([-0.5]))  # a joint that has to come back
    assert relaxed(bound, np.array([0.0, 0.9]))[1][0] == pytest.approx(0.8 + 3e-6, abs=CLOSE)


def least_by_lp(c: Case, fixed: Array, stage: int) -> float | None:
    """Smallest largest slack of the class, the slacks of earlier classes given, later ones free; None: impossible."""
    n = c.A.shape[1]
    yields = c.demand > 0.0
    kept = ~(yields & (c.classes > stage)) & (c.demand > -np.inf)
    own = (yields & (c.classes == stage)).astype(float)
    found = linprog(
        np.r_[np.zeros(n), 1.0],
        A_ub=np.c_[-c.A, -own][kept],
        b_ub=-(c.demand - fixed)[kept],
        bounds=[*zip(c.low, c.high, strict=True), (0.0, None)],
        method="highs",
    )
    assert found.status in (0, 2), found.message
    return float(found.fun) if found.status == 0 else None


def one_alone(c: Case, slack: Array, i: int) -> float:
    """Smallest slack of row i when all others keep theirs."""
    r, n = c.A.shape
    own = (np.arange(r) == i).astype(float)
    held = c.demand > -np.inf
    b = np.where(own == 1.0, c.demand, c.demand - slack)
    found = linprog(
        np.r_[np.zeros(n), 1.0],
        A_ub=np.c_[-c.A, -own][held],
        b_ub=-b[held],
        bounds=[*zip(c.low, c.high, strict=True), (0.0, None)],
        method="highs",
    )
    assert found.status == 0
    return float(found.fun)


def random_case(rng: np.random.Generator) -> Case:
    n, r = int(rng.integers(1, 9)), int(rng.integers(2, 16))
    A = rng.normal(size=(r, n))
    A /= np.linalg.norm(A, axis=1, keepdims=True)
    for i in range(1, r):
        if rng.random() < 0.3:
            A[i] = -A[int(rng.integers(i))]
    demand = rng.normal(size=r) * 0.5 - 0.2
    demand[rng.random(r) < 0.1] = -np.inf
    return Case(A, demand, -rng.uniform(0.2, 2.0, n), rng.uniform(0.2, 2.0, n), rng.integers(0, 3, r))


def test_slacks_are_the_smallest_possible_class_by_class():
    """The largest slack of each class is that of a linear program; given those, no single row could yield less."""
    rng = np.random.default_rng(1)
    slackened = 0
    for _ in range(cases(400, 40)):
        c = random_case(rng)
        status, slack = relaxed(c)
        assert status == SolverStatus.OPTIMAL, "standing still needs no more than the demands that are > 0"
        assert np.all(slack >= 0.0) and not slack[c.demand <= 0.0].any()
        for stage in range(len(SAFETY_CLASSES)):
            own = (c.classes == stage) & (c.demand > 0.0)
            if own.any():
                before = np.where(c.classes < stage, slack, 0.0)
                least = least_by_lp(c, before, stage)
                assert least is not None
                assert slack[own].max() == pytest.approx(least, abs=CLOSE)
        for i in np.flatnonzero(slack):
            slackened += 1
            if c.classes[i] == c.classes[slack > 0.0].max():
                assert one_alone(c, slack, i) > slack[i] - CLOSE
    assert slackened > cases(300, 20)


def test_what_is_left_is_feasible():
    """To a tenth of what the kernel tolerates and to a thousandth of what verification sees."""
    rng = np.random.default_rng(2)
    for _ in range(cases(200, 20)):
        c = random_case(rng)
        _, slack = relaxed(c)
        n, held = c.A.shape[1], c.demand > -np.inf
        N = np.vstack([c.A[held], np.eye(n), -np.eye(n)])
        assert least_violation(N, np.concatenate([(c.demand - slack)[held], c.low, -c.high])) < 1e-9


def test_rows_without_conflict_yield_nothing():
    rng = np.random.default_rng(3)
    for _ in range(cases(100, 10)):
        c = random_case(rng)
        v = rng.uniform(c.low, c.high)
        met = c._replace(demand=np.where(c.demand > -np.inf, c.A @ v - 1e-3, -np.inf))
        status, slack = relaxed(met)
        assert status == SolverStatus.OPTIMAL
        assert not slack.any()


def test_two_that_push_each_other_share():
    _, slack = relaxed(case([[1.0], [-1.0]], [0.3, 0.1]))
    np.testing.assert_allclose(slack, [0.2, 0.2], atol=CLOSE)


def test_row_in_no_conflict_keeps_its_demand():
    """A third row, on a joint of its own, must not profit from what the other two have to give up."""
    _, slack = relaxed(case([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [0.3, 0.1, 0.2]))
    np.testing.assert_allclose(slack[:2], [0.2, 0.2], atol=CLOSE)
    assert slack[2] == 0.0


def test_smaller_conflict_beside_a_larger_one_yields_by_its_own_size():
    A = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]
    _, slack = relaxed(case(A, [0.3, 0.1, 0.05, 0.05]))
    np.testing.assert_allclose(slack, [0.2, 0.2, 0.05, 0.05], atol=CLOSE)


def test_demand_beyond_the_speed_limit_yields_to_it():
    _, slack = relaxed(case([[1.0, 1.0]], [5.0], speed=2.0))
    np.testing.assert_allclose(slack, [1.0], atol=CLOSE)


@pytest.mark.parametrize("order", [(PATIENT, TASK), (PATIENT, ROBOT), (ROBOT, TASK)])
@pytest.mark.parametrize("first", [0, 1])
def test_task_yields_before_robot_before_patient(order, first):
    classes = order if first == 0 else order[::-1]
    _, slack = relaxed(case([[1.0], [-1.0]], [0.3, 0.1], classes))
    np.testing.assert_allclose(slack[first], 0.0, atol=1e-15)
    np.testing.assert_allclose(slack[1 - first], 0.4, atol=CLOSE)


def test_all_three_classes_at_once():
    """Patient asks +0.3, robot and task pull the other way: each keeps what the one before leaves it."""
    A, demand = [[1.0], [-1.0], [-1.0]], [0.3, 0.1, 0.2]
    _, slack = relaxed(case(A, demand, (PATIENT, ROBOT, TASK)))
    np.testing.assert_allclose(slack, [0.0, 0.4, 0.5], atol=CLOSE)
    _, slack = relaxed(case(A, demand, (TASK, PATIENT, ROBOT)))
    np.testing.assert_allclose(slack, [0.5, 0.0, 0.0], atol=CLOSE)


def test_row_that_standing_still_keeps_never_yields():
    """Demand 0 or less: hard, whatever its class; the other one has to yield all of its demand."""
    for demand in (0.0, -1e-9, -0.2):
        _, slack = relaxed(case([[-1.0], [1.0]], [demand, 0.4], (TASK, PATIENT)))
        assert slack[0] == 0.0
        np.testing.assert_allclose(slack[1], 0.4 + demand, atol=CLOSE)


def test_impossible_where_nothing_may_yield():
    c = case([[1.0]], [-0.1])._replace(low=np.array([-1.0]), high=np.array([-0.5]))
    status, _ = relaxed(c._replace(demand=np.array([-0.1])))
    assert status == SolverStatus.OPTIMAL, "no row with a demand > 0: nothing to do, and nothing is checked"
    both = case([[1.0], [1.0]], [-0.1, 0.3])._replace(low=np.array([-1.0]), high=np.array([-0.5]))
    status, _ = relaxed(both)
    assert status == SolverStatus.INFEASIBLE


def test_room_is_far_below_what_verification_sees():
    assert ROOM < 1e-7


# In a controller ------------------------------------------------------------------------------------------------------


def between_planes(classes: tuple[str, str] = ("patient", "patient"), **options: Any) -> Controller:
    """The moving arm's tip between two planes that come as entities "above" and "below"."""
    tip = Point.at([0.0, 0.0, 0.0], frame="moving/tip")
    constraints = [
        Constraint(name, tip, Plane.through([0, 0, 0], [0, 0, sign], entity=name), "outside", 0.0, safety_class=c)
        for name, sign, c in (("above", -1.0, classes[0]), ("below", 1.0, classes[1]))
    ]
    options = {"period": 1e-3, "eta": 1.0, "group": "moving", **options}
    return Controller(pair(), ConstraintSet(constraints), VelocityTask(), **options)


def squeeze(c: Controller, gap: float, closing: float, t: float = 0.0) -> Any:
    """Planes `gap` above and below the tip, each coming nearer at `closing` m/s."""
    z = c.robot.kinematics(START).translation("moving/tip")
    entities = {
        name: Entity(pose(z + np.array([0.0, 0.0, sign * gap])), [0, 0, -sign * closing, 0, 0, 0])
        for name, sign in (("above", 1.0), ("below", -1.0))
    }
    return c.step(Measurement(t, START, np.zeros(16), entities=entities), np.zeros(8))


@pytest.mark.parametrize("guard", ["off", "watch", "act"])
def test_squeezed_arm_shares_what_cannot_be_kept_and_says_so(guard):
    c = between_planes(guard=guard)
    command = squeeze(c, 0.001, 0.02)
    assert command.state == State.DEGRADED
    assert "above by 0.019 m/s" in command.reason and "below by 0.019 m/s" in command.reason
    np.testing.assert_allclose(command.qdot, 0.0, atol=1e-6)
    assert c.ring[0, c.columns["infeasible"]][0] == 1.0
    np.testing.assert_allclose(c.ring[0, c.columns["slack"]], 0.019, atol=CLOSE)


def test_squeezed_arm_protects_the_patient_first():
    c = between_planes(("task", "patient"))
    command = squeeze(c, 0.001, 0.02)
    assert command.state == State.DEGRADED and "below" not in command.reason
    speed = c.robot.kinematics(START).jacobian("moving/tip")[2, :8] @ command.qdot
    assert speed == pytest.approx(0.019, abs=1e-5)
    assert "above by 0.038 m/s" in command.reason


def test_not_squeezed_arm_does_not_yield():
    c = between_planes()
    command = squeeze(c, 0.03, 0.02)
    assert command.state == State.RUN and command.reason == ""
    assert not c.ring[0, c.columns["slack"]].any()


def test_nothing_may_yield_so_it_stands_still_and_names_the_conflict():
    """A joint beyond its limit has to come back, and a wall of margin 0, where standing still is allowed, is in the
    way: velocity and joint limits are hard, and so is the wall."""
    robot = seven()
    q = np.zeros(7)
    q[1] = robot.limits.upper[1] + 0.1
    back = robot.kinematics(q).jacobian("frame7")[:3, 1]
    tip = robot.kinematics(q).translation("frame7")
    wall = Constraint("wall", Point.at([0, 0, 0], frame="frame7"), Plane.through(tip, back), "outside", 0.0)
    alone = robot.with_group("second", ["joint2"])
    c = Controller(alone, ConstraintSet([wall]), VelocityTask(), period=1e-3, group="second")
    command = c.step(Measurement(0.0, q, np.zeros(7)), np.zeros(1))
    assert command.state == State.HOLD and not command.qdot.any() and not command.multipliers["wall"]
    assert "wall" in command.reason and "upper limit of joint2" in command.reason
    assert c.ring[0, c.columns["infeasible"]][0] == 1.0


def test_rows_of_the_user_yield_too_and_are_named():
    c = Controller(pair(), ConstraintSet(), VelocityTask(), period=1e-3, group="moving", user_rows=2)
    e = np.eye(8)[:1]
    rows = Rows(np.vstack([e, -e]), [-0.01, -0.01], eta=2.0)
    command = c.step(Measurement(0.0, START, np.zeros(16)), np.zeros(8), rows)
    assert command.state == State.DEGRADED
    assert "row 0 by 0.02 m/s" in command.reason and "row 1 by 0.02 m/s" in command.reason


def test_conflict_ends_with_its_cause():
    """The cycle after, with the planes apart, is a plain one again: no slack is left over."""
    c = between_planes()
    assert squeeze(c, 0.001, 0.02).state == State.DEGRADED
    assert squeeze(c, 0.03, 0.0, t=1.0).state == State.RUN
    assert not c._memory.real[Real.SLACK].any()
    assert c._outcome[Slot.INFEASIBLE] == 0


def test_planes_that_close_for_long_are_survived():
    """They meet and pass: finite commands to the end, in the middle as long as it goes, never a fault."""
    c = between_planes(eta=5.0)
    robot, q = c.robot, START.copy()
    z = robot.kinematics(q).translation("moving/tip")
    for k in range(cases(1500, 60)):
        t = k * 1e-3
        entities = {
            name: Entity(pose(z + np.array([0.0, 0.0, sign * (0.01 - 0.02 * t)])), [0, 0, -sign * 0.02, 0, 0, 0])
            for name, sign in (("above", 1.0), ("below", -1.0))
        }
        command = c.step(Measurement(t, q, np.zeros(16), entities=entities), np.zeros(8))
        assert np.isfinite(command.qdot).all() and command.state in (State.RUN, State.DEGRADED)
        q[:8] += 1e-3 * command.qdot
    assert abs(robot.kinematics(q).translation("moving/tip")[2] - z[2]) < 1e-4
