"""What the admittance takes and refuses of a constraint set, its states, its ledger and its other forms with one."""

from dataclasses import replace

import numpy as np
import pytest

from admittance.outcome import State
from admittance.parameters import NEURO8
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Line, Plane, Point, Segment
from primitives.errors import InactiveConstraintError, InputError, UnknownNameError
from tests.admittance.cases import column, covered, on_shaft, tip_region
from tests.admittance.walls import PAIR, S5, SHAFT, START, aimed, lean, pair

END = Point.at([0.0, 0.0, 0.0], frame=SHAFT)
FLOOR = Constraint("floor", END, Plane.through([0, 0, -0.06], [0, 0, 1]), "outside", 0.0)


def with_floor(height: float, **more: object) -> ConstraintSet:
    return ConstraintSet([replace(FLOOR, second=Plane.through([0, 0, height], [0, 0, 1]), **more)])


@pytest.mark.parametrize(
    ("constraint", "words"),
    [
        (Constraint("v", END, Cloud.named("vessels"), "outside", 0.002), r'give regions=\[Region\("v", cloud'),
        (Constraint("v", END, Cloud.named("v"), "outside", 0.002, enforced=False), "takes as a region"),
        (Constraint("heart", END, Point.at([0, 0, 0], entity="heart"), "outside", 0.002), 'moves with entity "heart"'),
        (Constraint("hand", Point.at([0, 0, 0], entity="hand"), FLOOR.second, "outside", 0.0), 'entity "hand"'),
        (Constraint("no", END, Line.through([0, 0, 0], [0, 0, 1]), "inside", 0.0), "leaves no room"),
    ],
)
def test_what_the_barrier_cannot_enforce_is_refused(constraint, words):
    with pytest.raises(InputError, match=words):
        pair(ConstraintSet([constraint]))


@pytest.mark.parametrize("frame", ["parked/shaft", "world"])
def test_a_constraint_that_the_group_does_not_move_is_refused_unless_it_is_watched(frame):
    still = Constraint("still", Point.at([0, 0, 0], frame=frame), FLOOR.second, "outside", 0.0)
    with pytest.raises(InactiveConstraintError, match="none of the decided joints moves its elements"):
        pair(ConstraintSet([still]))
    assert pair(ConstraintSet([replace(still, enforced=False)])).step(0.004, np.zeros(6)).state == State.RUN


def test_names_frames_and_kinds_are_checked():
    region = tip_region(covered(on_shaft(PAIR, START, SHAFT, -0.02)[None], 0.001), SHAFT)
    with pytest.raises(InputError, match="different names"):
        pair(ConstraintSet([replace(FLOOR, name="r")]), regions=[region])
    with pytest.raises(UnknownNameError, match="blade"):
        pair(ConstraintSet([replace(FLOOR, first=Point.at([0, 0, 0], frame="blade"))]))
    with pytest.raises(InputError, match="expected a ConstraintSet"):
        pair([FLOOR])
    with pytest.raises(InputError, match="d_0_angle"):
        replace(NEURO8, d_0_angle=0.0)


def test_a_start_without_margin_is_refused_and_names_all():
    down = Line.through([0, 0, 0], [0, 0, -1])
    tilted = Constraint("cone", Line.z_axis(SHAFT), down, "inside", 0.05, "line_line_angle")
    with pytest.raises(InputError, match=r'"floor" is -5 mm, of "cone" is -0\.06\d* rad, expected more than zero'):
        pair(with_floor(-0.04) + tilted)
    assert pair(with_floor(-0.04, enforced=False)).step(0.004, np.zeros(6)).margin[0] == pytest.approx(-0.005)


def test_elements_that_touch_have_no_margin():
    """At d = 0 a keep-outside pair has no gradient: no direction to push in, so no start."""
    touching = Segment.between(on_shaft(PAIR, START, SHAFT, 0.02), [0.1, 0.1, 0.1])
    tool = Segment.between([0, 0, -0.1], [0, 0, 0], frame=SHAFT)
    with pytest.raises(InputError, match='the margin of constraint "touch" is'):
        pair(ConstraintSet([Constraint("touch", tool, touching, "outside", 0.0)]))


def test_a_barrier_that_was_stepped_across_holds_and_says_which():
    """The plain integrator can step across, as it can with a cloud; then it stands still, and goes on saying so."""
    port = on_shaft(PAIR, START, SHAFT, 0.045)
    a = pair(integrator="semi-implicit", ring=1000)
    assert lean(a, port, "C3", 30.0, 2.0) <= 0.0
    wrench = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    m = a.step(0.004 * (a.cycles + 1), wrench)
    assert m.state == State.HOLD and m.margin[2] <= 0.0 and not m.v.any()
    assert m.reason.startswith('the margin of constraint "C3" is -0.') and "start again" in m.reason
    assert column(a, "where")[-1] == -1.0
    q, work = a.q, a.ledger["hand"]
    for _ in range(5):
        m = a.step(0.004 * (a.cycles + 1), -wrench)
        assert m.state == State.HOLD and not m.qdot.any()
    np.testing.assert_array_equal(a.q, q)
    assert a.ledger["hand"] == work


@pytest.mark.parametrize("integrator", ["semi-implicit", "euler", "robust"])
def test_ledger_is_an_identity_with_constraints(integrator):
    a, rng = pair(integrator=integrator, ring=1300), np.random.default_rng(1)
    push = aimed(a, on_shaft(PAIR, START, SHAFT, 0.045), "C3", 2.0)
    for k in range(1, 801):
        noise = np.r_[rng.normal(size=3), rng.normal(size=3) * 0.05]
        assert a.step(0.004 * k, 0.2 * noise + push * (k // 200 % 2)).state == State.RUN
    sums = (
        column(a, "hand") - column(a, "dissipated") + column(a, "numerical") + column(a, "limited_work")
        + column(a, "barrier") + column(a, "clouds")
    )  # fmt: skip
    assert column(a, "potential").max() > 1e-4
    np.testing.assert_allclose(np.diff(column(a, "storage") - sums), 0.0, atol=1e-12)


def test_accept_of_what_was_proposed_is_step_with_constraints():
    options = {"implicit_stiffness": True, "linear_below": 0.05 * NEURO8.d_0, "sight": 0.005}
    whole, halves = (pair(ring=400, **options) for _ in range(2))
    wrench = aimed(whole, on_shaft(PAIR, START, SHAFT, 0.045), "C3", 2.0)
    for k in range(1, 301):
        one, proposal = whole.step(0.004 * k, wrench), halves.propose(0.004 * k, wrench)
        assert proposal.rows.shape == (0, 6), "rows are those of cloud points"
        two = halves.accept(proposal.v_ref)
        np.testing.assert_array_equal(one.q, two.q)
        np.testing.assert_array_equal(one.margin, two.margin)
    assert column(whole, "potential").max() > 1e-4


@pytest.mark.parametrize(
    ("form", "integrator"),
    [("full", "rk4"), ("reduced", "robust"), ("reduced", "semi-implicit"), ("full", "semi-implicit")],
)
def test_all_forms_feel_the_same_barrier(form, integrator):
    """A hand of 3 N, 0.8 s at 1 ms: close to what Runge-Kutta gives; without the barrier the end would be elsewhere."""
    wrench = aimed(pair(), on_shaft(PAIR, START, SHAFT, 0.045), "C3", 3.0)
    ends = []
    for how, chosen in (
        (("reduced", "rk4"), S5.constraints),
        ((form, integrator), S5.constraints),
        (("reduced", "rk4"), S5.constraints.enforcing(())),
    ):
        a = pair(chosen, form=how[0], integrator=how[1], period=0.001, ring=4)
        for k in range(1, 801):
            m = a.step(0.001 * k, wrench)
        ends.append(m.q)
    error, effect = np.abs(ends[1] - ends[0]).max(), np.abs(ends[2] - ends[0]).max()
    assert effect > 1e-3 and error < 0.03 * effect


def test_many_constraints_are_each_their_own():
    """44 of them: the margins are those of the four, eleven times, and the force that of all."""
    many = ConstraintSet([replace(c, name=f"{c.name}-{i}") for i in range(11) for c in S5.constraints])
    few, all_of_them = pair(ring=4), pair(many, ring=4)
    one = all_of_them.step(0.004, np.zeros(6)).margin.reshape(11, 4)
    np.testing.assert_array_equal(one, np.tile(one[0], (11, 1)))
    few, all_of_them = pair(ring=4), pair(many, ring=4)
    assert all_of_them.ledger["potential"] == pytest.approx(11.0 * few.ledger["potential"], rel=1e-12)
