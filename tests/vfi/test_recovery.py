"""Recovery, step by step: what is written down, what is raised, what may be conceded, and the order of it all."""

from typing import Any

import numpy as np
import pytest

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.evaluate import Entity
from tests.primitives.qps import cases
from tests.vfi.arms import START, Array, Oracle, closed_loop, pair, paper_constraints, pose
from vfi.controller import Controller
from vfi.memory import Real, Whole
from vfi.messages import Measurement
from vfi.outcome import Reason, Slot, State
from vfi.recovery import HALVINGS, RESOLVES, concede, conclude, raise_demands, violation, worst_row
from vfi.tasks import VelocityTask

PAIR = pair()
TIP = Point.at([0.0, 0.0, 0.0], frame="moving/tip")


@pytest.fixture
def c() -> Controller:
    """Four constraints and one row of the user, after a plain cycle at the start."""
    out = Controller(PAIR, paper_constraints(), VelocityTask(), period=0.01, eta=2.0, group="moving", user_rows=1)
    assert out.step(Measurement(0.0, START, np.zeros(16)), np.zeros(8)).state == State.RUN
    return out


def real(c: Controller, block: Real) -> Array:
    """As many rows of a block as this cycle has."""
    return c._memory.real[block][: c._memory.float_layout[block, 1]]


GRAVE = [
    # (state, reason) first, then; what stands in the end
    ((State.DEGRADED, Reason.HALVED), (State.DEGRADED, Reason.ACCELERATION), Reason.HALVED),
    ((State.DEGRADED, Reason.ACCELERATION), (State.DEGRADED, Reason.SLACK), Reason.SLACK),
    ((State.DEGRADED, Reason.SLACK), (State.DEGRADED, Reason.HALVED), Reason.SLACK),
    ((State.DEGRADED, Reason.RECOVERING), (State.DEGRADED, Reason.HALVED), Reason.HALVED),
    ((State.DEGRADED, Reason.OUT_OF_RANGE), (State.DEGRADED, Reason.SECOND_SOLVER), Reason.SECOND_SOLVER),
    ((State.DEGRADED, Reason.SLACK), (State.HOLD, Reason.NOT_KEPT), Reason.NOT_KEPT),
    ((State.HOLD, Reason.NOT_KEPT), (State.DEGRADED, Reason.SLACK), Reason.NOT_KEPT),
    ((State.HOLD, Reason.INFEASIBLE), (State.FAULT, Reason.NO_ROW), Reason.NO_ROW),
    ((State.FAULT, Reason.NO_ROW), (State.HOLD, Reason.INFEASIBLE), Reason.NO_ROW),
]


@pytest.mark.parametrize(("first", "then", "stands"), GRAVE)
def test_the_graver_of_two_outcomes_stands(c, first, then, stands):
    for where, (state, reason) in enumerate((first, then), 3):
        assert conclude(*c._arguments, state, reason, where) == state
    assert c._outcome[Slot.REASON] == stands
    assert c._outcome[Slot.STATE] == max(first[0], then[0])
    assert c._outcome[Slot.WHERE] == (3 if stands == first[1] else 4)


@pytest.mark.parametrize("state", [State.DEGRADED, State.HOLD, State.FAULT])
def test_only_hold_and_fault_command_zero(c, state):
    real(c, Real.V)[:], real(c, Real.MULTIPLIER)[:] = 0.3, 0.7
    conclude(*c._arguments, state, Reason.HALVED, -1)
    assert real(c, Real.V).any() == real(c, Real.MULTIPLIER).any() == (state == State.DEGRADED)


def raised(c: Controller, b: Any, v: Any, defect: Any, last: Any, attempt: int) -> Array:
    """b after raising, for rows A = the first unit vectors, all of them of keep-outside."""
    real(c, Real.SIDE)[:] = 1.0
    real(c, Real.A)[:] = np.eye(8)[:5]
    real(c, Real.B)[:], real(c, Real.DEFECT)[:], real(c, Real.LAST_DEFECT)[:] = b, defect, last
    full = np.zeros(8)
    full[: len(v)] = v
    raise_demands(*c._arguments, full, attempt)
    np.testing.assert_array_equal(real(c, Real.LAST_DEFECT), defect)
    return real(c, Real.B).copy()


def test_only_rows_that_failed_are_raised(c):
    """Above their value at v where that is more than was asked, else above what was asked."""
    b = raised(
        c, [-0.1, -0.1, -0.1, -np.inf, 0.2], [0.3, -0.1, 0.3, 0.4, 0.2], [2e-6, 0.01, 0.5e-6, 0.02, -np.inf], 0.0, 1
    )
    np.testing.assert_allclose(b, [0.3 + 2e-6, -0.09, -0.1, 0.42, 0.2], rtol=1e-12)


def test_defect_that_shrinks_by_a_factor_is_summed_up(c):
    """0.01, then 0.002: a fifth each time, in all 0.002 / (1 - 1/5) more. Not after the first attempt, not when the
    factor is above a half."""
    last = [0.01, 0.01, 0.0, -1.0, 0.01]
    b = raised(c, 0.0, [], [0.002, 0.006, 0.002, 0.002, 0.02], last, 2)
    np.testing.assert_allclose(b, [0.0025, 0.006, 0.002, 0.002, 0.02], rtol=1e-12)
    b = raised(c, 0.0, [], [0.002, 0.006, 0.002, 0.002, 0.02], last, 1)
    np.testing.assert_allclose(b, [0.002, 0.006, 0.002, 0.002, 0.02], rtol=1e-12)


def conceded(c: Controller, demand: Any, defect: Any, slack: Any = 0.0, v: Any = 0.0) -> tuple[int, Array]:
    real(c, Real.DEMAND)[:], real(c, Real.DEFECT)[:], real(c, Real.SLACK)[:] = demand, defect, slack
    real(c, Real.V)[:], real(c, Real.LOW)[:], real(c, Real.HIGH)[:] = v, -1.0, 1.0
    return int(concede(*c._arguments)), real(c, Real.SLACK).copy()


def test_rows_that_may_yield_yield_what_they_fall_short_of(c):
    """Two with a demand > 0: as much as standing still would cost them, and no row more than that."""
    ok, slack = conceded(c, [0.02, -0.1, 0.03, -np.inf, 0.0], [0.01, -0.1, 0.03, -np.inf, 0.5e-6])
    assert ok == 1
    np.testing.assert_allclose(slack, [0.01, 0.0, 0.03, 0.0, 0.0])
    assert not (real(c, Real.DEFECT) > 1e-6).any()
    ok, slack = conceded(c, 0.02, [0.01, 0.0, 0.0, 0.0, 0.0], [0.01, 0.01, 0.0, 0.0, 0.0])
    assert ok == 1
    np.testing.assert_allclose(slack, [0.02, 0.01, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("demand", "defect", "slack", "v"),
    [
        ([0.02, 0.0, -1, -1, -1], [0.01, 2e-6, -1, -1, -1], 0.0, 0.0),  # a row that standing still keeps
        ([0.02, -0.01, -1, -1, -1], [0.01, 0.005, -1, -1, -1], 0.0, 0.0),
        ([0.02, -1, -1, -1, -1], [0.021, -1, -1, -1, -1], 0.0, 0.0),  # more than standing still costs
        ([0.02, -1, -1, -1, -1], [0.015, -1, -1, -1, -1], 0.01, 0.0),
        ([0.02, -1, -1, -1, -1], [0.01, -1, -1, -1, -1], 0.0, 1.1),  # beyond a joint limit
        ([0.02, -1, -1, -1, -1], [0.01, np.nan, -1, -1, -1], 0.0, 0.0),
        ([0.02, -1, -1, -1, -1], [0.01, -1, -1, -1, -1], 0.0, np.nan),
        ([np.nan, -1, -1, -1, -1], [np.nan, -1, -1, -1, -1], 0.0, 0.0),
    ],
)
def test_nothing_else_is_conceded(c, demand, defect, slack, v):
    ok, after = conceded(c, demand, defect, slack, v)
    assert ok == 0
    np.testing.assert_array_equal(after, slack)


def test_worst_row_is_so_in_tolerances(c):
    real(c, Real.ROW_TOLERANCE)[1] = 1e-5
    for defect, place in (
        ([2e-6, 1e-5, 0, 0, 0], 0),
        ([2e-6, 3e-5, 0, 0, 0], 1),
        ([0, 0, 0, 0, 5e-6], 4),
        ([1e-6, 1e-5, -1, -np.inf, 0], -1),
        ([2e-6, np.nan, 0, 0, 0], 1),
    ):
        real(c, Real.DEFECT)[:] = defect
        assert worst_row(*c._arguments) == place


def test_verification_looks_at_the_same_configuration_as_pinocchio(c):
    """Predicted margins at q + T v, for velocities of the decided arm and measured ones of the other."""
    rng = np.random.default_rng(1)
    oracle = Oracle(PAIR, paper_constraints())
    for k in range(cases(200, 20)):
        q = rng.uniform(PAIR.limits.lower, PAIR.limits.upper)
        qdot, v = rng.uniform(-0.05, 0.05, 16), rng.uniform(-1.0, 1.0, 8)
        c.step(Measurement(1.0 + k, q, qdot), np.zeros(8))
        real(c, Real.V)[:] = v
        violation(*c._arguments)
        moved = q + 0.01 * np.r_[v, qdot[8:]]
        # Infinite lines are 1/angle away from where they nearly meet; the shafts' angle is never that small here.
        expected = oracle.margins(moved)[0].astype(float)
        np.testing.assert_allclose(real(c, Real.MARGIN_NEXT), expected, atol=1e-11)


# The order of things -------------------------------------------------------------------------------------------------


def bowl(period: float, **options: Any) -> Controller:
    """The tip inside a narrow cylinder about its own place, which it is driven through at an angle."""
    tip = PAIR.kinematics(START).translation("moving/tip")
    wall = Constraint("wall", TIP, Line.through(tip + np.array([0.0, 0.004, 0.0]), [0, 0, 1]), "inside", 0.005)
    return Controller(PAIR, ConstraintSet([wall]), VelocityTask(), period=period, eta=20.0, group="moving", **options)


def test_one_more_solution_suffices_for_a_smooth_wall():
    """Along the wall at 20 mm/s: the first answer drifts outward, the next one is accepted; nothing is halved."""
    run_c = bowl(0.004, ring=400)
    push = np.zeros(8)
    push[0], push[1] = 0.02, 0.02
    run = closed_loop(run_c, START, lambda t: push, cases(300, 200))
    count = len(run.commands)
    resolves = run_c.ring[:count, run_c.columns["resolves"]][:, 0]
    assert {command.state for command in run.commands} == {State.RUN}
    assert resolves.max() >= 1 and resolves.max() <= RESOLVES
    assert not run_c.ring[:count, run_c.columns["halvings"]].any()
    assert Oracle(PAIR, run_c.constraints).margins(run.q).min() > -1e-6 / 20.0


def test_halving_and_standing_still_come_last():
    """A wall that lies: its kernel says OK, but its gradient points the wrong way, so no answer passes."""
    from primitives.compiled import compiled
    from primitives.intrinsics import PAIR_SIGNATURE
    from primitives.pair import Pair
    from primitives.registry import pairs

    @compiled(PAIR_SIGNATURE)
    def lying(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
        gradient[:] = 0.0
        distance = 0.0
        for i in range(3):
            gradient[i] = -b[3 + i]
            distance += (a[i] - b[i]) * b[3 + i]
        return distance, 0

    if "lying" not in pairs.names():
        pairs.register(Pair("lying", "point", "plane", "m", lying))
    try:
        tip = PAIR.kinematics(START).translation("moving/tip")
        liar = Constraint("liar", TIP, Plane.through(tip - np.array([0, 0, 1e-4]), [0, 0, 1]), "outside", 0.0, "lying")
        down = -0.05 * np.sign(PAIR.kinematics(START).jacobian("moving/tip")[2, :8])
        c = Controller(PAIR, ConstraintSet([liar]), VelocityTask(), period=0.01, eta=0.5, group="moving")
        command = c.step(Measurement(0.0, START, np.zeros(16)), down)
        row = c.ring[0]
        assert 1 <= row[c.columns["resolves"]][0] <= RESOLVES and row[c.columns["intervened"]][0] == 1.0
        assert command.state in (State.DEGRADED, State.HOLD)
        if command.state == State.HOLD:
            assert not command.qdot.any() and '"liar" would not be kept' in command.reason
            assert row[c.columns["halvings"]][0] == HALVINGS
        else:
            assert 0 < row[c.columns["halvings"]][0] <= HALVINGS and "scaled down" in command.reason
            fall = PAIR.kinematics(START).jacobian("moving/tip")[2, :8] @ command.qdot
            assert fall >= -0.5 * 1e-4 - 1e-6
    finally:
        del pairs._things["lying"]


def test_recovery_never_stands_still():
    """Violated, and the predicted margin curves away: whatever is found is commanded, if it is better than nothing."""
    tip = PAIR.kinematics(START).translation("moving/tip")
    far = Constraint("far", TIP, Point.at(tip + np.array([0.0, 0.0, 0.012])), "inside", 0.01)
    c = Controller(
        PAIR, ConstraintSet([far]), VelocityTask(), period=0.02, eta=50.0, group="moving", recovery_linear=0.2
    )
    run = closed_loop(c, START, lambda t: np.array([0.05, -0.05, 0.5, 0.5, 0.0, 2.0, 2.0, -2.0]), cases(100, 40))
    assert not any(command.state >= State.HOLD for command in run.commands)
    margins = run.margins[:, 0]
    assert margins[0] == pytest.approx(-0.002, abs=1e-9) and margins[-1] > -1e-5


def test_what_is_given_up_is_named():
    """An obstacle that is faster than the arm: slack up to what standing still would cost, and its name."""
    wall = Constraint("obstacle", TIP, Plane.through([0, 0, 0], [0, 0, 1], entity="e"), "outside", 0.0)
    c = Controller(PAIR, ConstraintSet([wall]), VelocityTask(), period=0.01, eta=1.0, group="moving")
    z = PAIR.kinematics(START).translation("moving/tip")
    entity = Entity(pose(z - np.array([0, 0, 0.001])), [0, 0, 5.0, 0, 0, 0])
    command = c.step(Measurement(0.0, START, np.zeros(16), entities={"e": entity}), np.zeros(8))
    assert command.state == State.DEGRADED and "obstacle by" in command.reason and command.reason.endswith("m/s")
    J = PAIR.kinematics(START).jacobian("moving/tip")[2, :8]
    fastest = float(np.abs(J) @ PAIR.limits.velocity[:8])
    assert J @ command.qdot == pytest.approx(fastest, rel=0.2)
    assert c._memory.whole[Whole.OUTCOME][Slot.INFEASIBLE] == 1
