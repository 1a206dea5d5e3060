"""The controller: readings.md's numbers for the LWR4+, its ledger, limits, faults, and clouds that change."""

import dataclasses

import numpy as np
import pytest

from admittance.controller import Admittance
from admittance.hand import SpringHand
from admittance.outcome import State
from admittance.parameters import NEURO8, TABLE_1
from primitives import dual_quaternion as dq
from primitives.elements import Point, Segment
from primitives.errors import InputError, UnknownNameError
from tests.admittance.cases import (
    Q0,
    Array,
    below_tip,
    bowl,
    column,
    covered,
    lwr4plus,
    neuro,
    on_shaft,
    paper,
    paper_port,
    plane_below_tip,
    tip_region,
    tool_region,
)


def guided(a: Admittance, seconds: float, reach: float, pace: float, seed: int = 1, most: float = 30.0) -> None:
    """A spring hand leads the handle along random waypoints within a reach (m), a new one every `pace` seconds."""
    rng, count = np.random.default_rng(seed), int(seconds / pace)
    way = np.vstack([a.handle, a.handle + reach * rng.uniform(-1.0, 1.0, (count, 3))])
    hand = SpringHand(np.arange(count + 1) * pace, way, damping=60.0, most=most)
    velocity = np.zeros(3)
    for k in range(1, round(seconds / a.period) + 1):
        t = k * a.period
        motion = a.step(t, hand.wrench(t, a.handle, velocity))
        velocity = motion.handle_velocity


def speeds(a: Admittance) -> tuple[float, float]:
    v = column(a, "v")
    return float(np.abs(v[:, 0]).max()), float(np.linalg.norm(v[:, 1:4], axis=1).max())


def port_error(a: Admittance) -> Array:
    return np.linalg.norm(column(a, "x_c"), axis=1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_port_error_in_guided_motion(seed):
    """<= 5e-6 m, rms <= 1e-6 m with semi-implicit, <= 1e-8 m with Runge-Kutta, at most 0.06 m/s and 0.25 rad/s."""
    for integrator, largest, rms in (("semi-implicit", 5e-6, 1e-6), ("rk4", 1e-8, 1e-8), ("robust", 5e-6, 1e-6)):
        a = paper(integrator=integrator, ring=2600)
        guided(a, 10.0, 0.055, 1.4, seed)
        fastest = speeds(a)
        assert 0.01 < fastest[0] <= 0.06 and 0.1 < fastest[1] <= 0.25, "the motion is what the numbers are for"
        x = port_error(a)
        assert x.max() <= largest and np.sqrt((x**2).mean()) <= rms


def test_port_error_in_fast_slips():
    a = paper(ring=2600)
    guided(a, 10.0, 0.14, 0.5)
    assert speeds(a)[1] > 0.8
    assert port_error(a).max() <= 3e-4


@pytest.mark.parametrize("form", ["full", "printed"])
def test_full_forms_follow_the_reduced_one(form):
    """The same hand, both forms: the free velocities agree to the first order of T."""
    reduced, full = paper(ring=1300), paper(ring=1300, form=form)
    for a in (reduced, full):
        for k in range(1, 1001):
            t = 0.004 * k
            a.step(t, [2.0 * np.sin(3.0 * t), np.cos(2.0 * t), np.sin(t), 0.0, 0.0, 0.2 * np.sin(t)])
    np.testing.assert_allclose(column(full, "v"), column(reduced, "v"), atol=3e-3)
    assert port_error(full).max() <= 5e-5


def test_passive_in_guided_motion_in_a_bowl():
    """V_f grows by no more than the hand's work, over any interval, to 1e-4 J, with v+ and with the chord."""
    robot = lwr4plus()
    center = on_shaft(robot, Q0, "tip", 0.0)
    for region in (tip_region, tool_region):
        a = paper(regions=[region(covered(bowl(center, 0.030, 0.003), 0.0035))], ring=2600)
        guided(a, 10.0, 0.10, 1.0)
        assert column(a, "potential").max() > 1e-3, "it was pushed against the bowl"
        assert column(a, "excess")[-1] <= 1e-4 and column(a, "excess_chord")[-1] <= 1e-4
        assert column(a, "clearance").min() > 0.0


@pytest.mark.parametrize("integrator", ["semi-implicit", "euler", "robust"])
@pytest.mark.parametrize("make", [paper, neuro])
def test_ledger_is_an_identity(make, integrator):
    """Storage grows by exactly what the books say, each cycle, to 1e-12 J; also where limits act."""
    a = make(integrator=integrator, ring=1300)
    rng = np.random.default_rng(1)
    for k in range(1, 801):
        a.step(0.004 * k, np.r_[rng.normal(size=3) * 12.0 * (k // 100 % 2), rng.normal(size=3) * 0.5])
    sums = (
        column(a, "hand") - column(a, "dissipated") + column(a, "numerical") + column(a, "limited_work")
        + column(a, "barrier") + column(a, "clouds")
    )  # fmt: skip
    np.testing.assert_allclose(np.diff(column(a, "storage") - sums), 0.0, atol=1e-12)
    assert np.all(np.diff(column(a, "dissipated")) >= 0.0) and np.all(np.diff(column(a, "limited_work")) <= 1e-15)
    if integrator == "robust" or (make is neuro and integrator == "semi-implicit"):
        assert np.all(np.diff(column(a, "numerical")) <= 1e-15), "an implicit step takes energy out"


def test_excess_is_the_largest_growth_over_any_interval():
    a = paper(integrator="euler", regions=[tip_region(plane_below_tip(lwr4plus(), 0.02))], ring=1300)
    guided(a, 4.0, 0.10, 0.5)
    S = column(a, "storage") - column(a, "hand")
    assert column(a, "excess")[-1] == pytest.approx(max((S[i:] - S[i]).max() for i in range(len(S))), abs=2e-5)


def test_accept_of_what_was_proposed_is_step():
    for make in (paper, neuro):
        whole, halves = make(ring=400), make(ring=400)
        for k in range(1, 301):
            wrench = [np.sin(0.02 * k), 0.3, -0.2, 0.0, 0.0, 0.01]
            one, proposal = whole.step(0.004 * k, wrench), halves.propose(0.004 * k, wrench)
            two = halves.accept(proposal.v_ref)
            np.testing.assert_array_equal(one.q, two.q)
            np.testing.assert_allclose(two.qdot, proposal.basis @ two.v + proposal.offset, atol=1e-12)
        np.testing.assert_allclose(whole.ring[:300, 2:], halves.ring[:300, 2:], atol=1e-15)


def test_a_projection_in_the_metric_of_the_proposal_is_passive():
    """readings.md, what joins the papers: any v+ nearest to v_ref under a_i v >= b_i, b_i <= 0, hands no energy in."""
    a = paper(parameters=dataclasses.replace(TABLE_1, implicit_damping=True), ring=800)
    rng = np.random.default_rng(3)
    for k in range(1, 601):
        p = a.propose(0.004 * k, [6.0 * np.sin(0.03 * k), 4.0, -5.0, 0.0, 0.0, 0.2])
        row, b = rng.normal(size=5), -rng.exponential(1e-3)
        v = p.v_ref
        if row @ v < b:
            push = np.linalg.solve(p.metric, row)
            v = v + push * (b - row @ v) / (row @ push)
        a.accept(v)
    assert column(a, "limited_work")[-1] < -1e-3, "the rows did act"
    assert column(a, "excess")[-1] <= 1e-9


def test_joint_velocity_limits_are_kept_and_named():
    robot = lwr4plus().with_limits(velocity=np.full(7, 0.05))
    a = Admittance(robot, port=paper_port(robot), start=Q0, ring=600)
    for k in range(1, 500):
        m = a.step(0.004 * k, [20.0, 10.0, 0.0, 0.0, 0.0, 1.0])
    assert np.abs(column(a, "qdot")).max() <= 0.05 + 1e-12
    assert m.state == State.DEGRADED and "velocity limits" in m.reason
    assert port_error(a).max() <= 5e-6 and column(a, "excess")[-1] <= 1e-12


def test_joint_position_limits_are_kept_and_named():
    robot = lwr4plus()
    room = np.full(7, 0.05)
    robot = robot.with_limits(lower=Q0 - room, upper=Q0 + room)
    a = Admittance(robot, port=paper_port(robot), start=Q0, ring=2000)
    reasons = set()
    for k in range(1, 1500):
        reasons.add(a.step(0.004 * k, [8.0, 6.0, -5.0, 0.0, 0.0, 1.0]).reason)
    q = column(a, "q")
    assert np.all(np.abs(q - Q0) <= 0.05 + 1e-12) and np.abs(q - Q0).max() > 0.045
    assert any("position limits" in r for r in reasons)
    assert port_error(a).max() <= 5e-6 and column(a, "excess")[-1] <= 1e-12


def test_a_singularity_is_not_entered_and_can_be_left():
    """The tool is drawn along its axis until J_t's condition reaches its limit; it holds, and pushing back works."""
    a = paper(condition_limit=14.0, ring=4000)
    n = a.robot.kinematics(Q0).rotation("tip")[:, 2]
    for k in range(1, 1500):
        m = a.step(0.004 * k, np.r_[6.0 * n, 0, 0, 0] if k < 1200 else np.r_[-6.0 * n, 0, 0, 0])
        assert m.state < State.HOLD
    condition = column(a, "singular")[:, 2]
    assert condition.max() > 13.5, "it was brought to the limit"
    assert condition.max() <= 14.0 * 1.001
    assert condition[-1] < 13.0, "and away from it"
    assert np.any(column(a, "limited").astype(int) & 4)


@pytest.mark.parametrize(
    ("wrench", "words"),
    [
        (np.full(6, np.nan), "not finite"),
        ([0, 0, np.inf, 0, 0, 0], "not finite"),
        ([1000.0, 0, 0, 0, 0, 0], "larger than a hand"),
        ([0, 0, 0, 0, 101.0, 0], "larger than a hand"),
        ([0, 0, 0], "shape"),
        ("push", "shape"),
        (None, "shape"),
        ([1e200, 0, 0, 0, 0, 0], "larger than a hand"),
    ],
)
def test_bad_wrenches_stop_for_a_cycle_and_harm_nothing(wrench, words):
    a = paper(ring=400)
    for k in range(1, 101):
        a.step(0.004 * k, [5.0, 0, 0, 0, 0, 0])
    q = a.q
    m = a.step(0.404, wrench)
    assert m.state == State.FAULT and words in m.reason
    assert not m.qdot.any() and not m.v.any()
    np.testing.assert_array_equal(a.q, q)
    after = a.step(0.408, [5.0, 0, 0, 0, 0, 0])
    assert after.state == State.RUN and np.isfinite(after.q).all() and after.v.any()
    assert not np.isnan(a.ring[: a.cycles]).any()
    assert column(a, "excess")[-1] <= 1e-12


@pytest.mark.parametrize("t", [0.4, 0.0, -1.0, np.nan, np.inf, "now", None, True])
def test_times_that_do_not_grow_stand_still(t):
    a = paper(ring=400)
    for k in range(1, 101):
        a.step(0.004 * k, [5.0, 0, 0, 0, 0, 0])
    m = a.step(t, [5.0, 0, 0, 0, 0, 0])
    assert m.state == State.FAULT and m.reason and not m.qdot.any()
    assert a.step(0.404, np.zeros(6)).state == State.RUN


def test_step_never_raises_nor_commands_what_is_not_finite():
    rng, a = np.random.default_rng(5), paper(regions=[tool_region(plane_below_tip(lwr4plus(), 0.015))])
    bad = [np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, 199.0]
    for k in range(1, 3001):
        wrench = rng.normal(size=6) * 10.0 ** rng.uniform(-3, 2.2)
        if rng.random() < 0.2:
            wrench[rng.integers(6)] = bad[rng.integers(len(bad))]
        m = a.step(0.004 * k, wrench)
        assert np.isfinite([*m.q, *m.qdot, *m.v, *m.x_c, m.clearance]).all()


def test_accept_without_a_proposal_or_of_nonsense_stands_still():
    a = paper()
    assert a.accept(np.zeros(5)).state == State.FAULT
    for nonsense in (np.full(5, np.nan), np.zeros(4), "fast"):
        a.propose(0.004 * (a.cycles + 1), np.zeros(6))
        m = a.accept(nonsense)
        assert m.state == State.FAULT and not m.qdot.any()


def test_accept_of_no_velocity_holds_and_says_so():
    a = paper()
    a.propose(0.004, np.array([0.0, 0.0, -5.0, 0.0, 0.0, 0.0]))
    m = a.accept(None)
    assert m.state == State.HOLD and not m.qdot.any() and "no velocity keeps all" in m.reason
    assert a.step(0.008, np.zeros(6)).state == State.RUN


def test_a_start_inside_is_refused_with_index_and_depth():
    robot = lwr4plus()
    points = np.vstack([np.full((1, 3), 0.3), on_shaft(robot, Q0, "tip", -0.0025)])
    with pytest.raises(InputError, match=r'1 mm inside the sphere of point 1 of region "r"'):
        paper(regions=[tip_region(covered(points, 0.0035))])


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"start": Q0 * 9.0}, "out of range at"),
        ({"port": [0.0, 0.0, 0.3]}, "passes the port at"),
        ({"start": np.zeros(6)}, "start"),
        ({"form": "fast"}, "unknown form"),
        ({"integrator": "heun"}, "unknown integrator"),
        ({"form": "printed", "integrator": "rk4"}, "rk4"),
        ({"form": "full", "integrator": "robust"}, "robust"),
        ({"shaft": "blade"}, "unknown frame"),
        ({"period": 0.0}, "period"),
        ({"limit_gain": 300.0}, "limit_gain T <= 1"),
        ({"condition_limit": 5.0}, "condition"),
        ({"sight": -1.0}, "sight"),
        ({"ring": 0}, "ring"),
        ({"sensor": Point.at([0, 0, 0], entity="hand")}, "sensor"),
    ],
)
def test_bad_declarations_are_refused(more, words):
    robot = lwr4plus()
    with pytest.raises(InputError, match=words):
        Admittance(robot, **{"port": paper_port(robot), "start": Q0, **more})


def test_regions_must_be_on_the_shaft_and_differ_in_name():
    robot, cloud = lwr4plus(), below_tip(lwr4plus(), 0.02)
    with pytest.raises(InputError, match="shaft frame"):
        paper(regions=[tip_region(cloud, "flange")])
    with pytest.raises(InputError, match="different names"):
        Admittance(robot, port=paper_port(robot), start=Q0, regions=[tip_region(cloud), tool_region(cloud)])


def test_group_must_move_the_shaft():
    robot = lwr4plus().with_group("some", lwr4plus().joints[:5])
    with pytest.raises(InputError, match="lacks joints"):
        Admittance(robot, port=paper_port(robot), start=Q0, group="some")


def test_clouds_can_be_moved_replaced_and_swallow_the_tool():
    robot = lwr4plus()
    n = robot.kinematics(Q0).rotation("tip")[:, 2]
    a = paper(regions=[tip_region(below_tip(robot, 0.008))], ring=400)
    for k in range(1, 51):
        m = a.step(0.004 * k, np.zeros(6))
    assert m.state == State.RUN and column(a, "potential")[-1] > 0.0
    before = a.ledger
    a.move("r", dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), -0.008 * n - 0.0005 * n))
    m = a.step(0.204, np.zeros(6))
    assert m.state == State.HOLD and "inside the sphere of point 0" in m.reason and not m.qdot.any()
    a.move("r", dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), 0.002 * n))
    assert a.step(0.208, np.zeros(6)).state == State.RUN
    a.replace("r", plane_below_tip(robot, 0.05))
    m = a.step(0.212, np.zeros(6))
    assert m.state == State.RUN and m.clearance == pytest.approx(0.05, abs=0.02)
    after = a.ledger
    assert after["clouds"] != before["clouds"] and after["excess"] <= 1e-5
    with pytest.raises(UnknownNameError, match="region"):
        a.move("s", [1, 0, 0, 0, 0, 0, 0, 0])
    with pytest.raises(InputError):
        a.move("r", np.ones(8))


def test_a_moved_cloud_is_the_cloud_of_moved_points():
    robot, rng = lwr4plus(), np.random.default_rng(2)
    tip = on_shaft(robot, Q0, "tip", 0.0)
    pose = dq.from_rotation_translation(np.array([0.6, 0.0, 0.8, 0.0]), np.array([0.1, -0.2, 0.3]))
    R, t = dq.rotation_matrix(pose), dq.translation(pose)
    points = tip + rng.uniform(-0.03, 0.03, (200, 3))
    points = points[np.linalg.norm(points - tip, axis=1) > 0.008]
    here = paper(regions=[tip_region(covered(points, 0.0035))])
    there = paper(regions=[dataclasses.replace(tip_region(covered((points - t) @ R, 0.0035)), pose=pose)])
    for k in range(1, 101):
        one, two = (a.step(0.004 * k, [3.0, 1.0, 0, 0, 0, 0]) for a in (here, there))
        np.testing.assert_allclose(one.q, two.q, atol=1e-12)
        assert one.clearance == pytest.approx(two.clearance, abs=1e-12)


def test_several_regions_add_up():
    robot = lwr4plus()
    tip = on_shaft(robot, Q0, "tip", 0.0)
    rng = np.random.default_rng(8)
    points = tip + rng.uniform(-0.02, 0.02, (120, 3))
    points = points[np.linalg.norm(points - tip, axis=1) > 0.006]
    both = paper(regions=[tip_region(covered(points, 0.0035))], ring=8)
    first = dataclasses.replace(tip_region(covered(points[::2], 0.0035)), name="a")
    second = dataclasses.replace(tip_region(covered(points[1::2], 0.0035)), name="b")
    apart = paper(regions=[first, second], ring=8)
    for a in (both, apart):
        a.step(0.004, np.zeros(6))
    for name in ("repulsion", "free_repulsion", "potential", "clearance"):
        np.testing.assert_allclose(column(apart, name), column(both, name), rtol=1e-10, atol=1e-15)


def test_the_wrench_is_moved_from_the_sensor_to_the_tip():
    """A force on the handle turns the tool about the port; the same wrench given at the tip does the same."""
    at_handle, at_tip = paper(ring=8), paper(ring=8, sensor=Point.at([0, 0, 0], frame="tip"))
    F = np.array([2.0, -1.0, 0.5])
    arm = at_handle.handle - at_tip.handle
    one = at_handle.step(0.004, np.r_[F, 0.1, 0.2, 0.3])
    two = at_tip.step(0.004, np.r_[F, np.array([0.1, 0.2, 0.3]) + np.cross(arm, F)])
    np.testing.assert_allclose(one.v, two.v, atol=1e-12)
    assert np.linalg.norm(arm) == pytest.approx(0.43)


def test_the_neurosurgical_arm_pushes_into_its_bowl_and_keeps_its_wrist():
    a = neuro(ring=3000)
    center = on_shaft(a.robot, a.q, "frame6", 0.0)
    region = tool_region(covered(bowl(center + 0.006 * np.eye(3)[2], 0.012, 0.0011), 0.001), "frame6", 0.32, 0.00175)
    for integrator in ("semi-implicit", "robust"):
        a = neuro(ring=3000, regions=[region], integrator=integrator)
        guided(a, 8.0, 0.008, 1.0, most=10.0)
        assert column(a, "potential").max() > 1e-5 and column(a, "clearance").min() > 0.0
        assert column(a, "excess")[-1] <= 1e-4 and port_error(a).max() <= 5e-6
        assert np.all(np.abs(column(a, "qdot")) <= a.robot.limits.velocity + 1e-12)
        assert np.ptp(column(a, "q")[:, 6:], axis=0).max() == 0.0
        assert np.all(column(a, "state") < State.HOLD)


@pytest.mark.parametrize("length", [0.30, 0.36, 0.43])
def test_other_tool_lengths_with_unchanged_parameters(length):
    robot = lwr4plus()
    at = dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), np.array([0.0, 0.0, length]))
    robot = robot.with_tool("short", at, on="flange")
    region = dataclasses.replace(
        tool_region(covered(bowl(on_shaft(robot, Q0, "short", 0.0), 0.030, 0.003), 0.0035)),
        element=Segment.between([0, 0, -length], [0, 0, 0], frame="short"),
    )
    parameters = dataclasses.replace(TABLE_1, shaft_length=length)
    port = on_shaft(robot, Q0, "short", 0.12)
    a = Admittance(robot, port=port, start=Q0, shaft="short", regions=[region], parameters=parameters, ring=2600)
    guided(a, 8.0, 0.08, 1.0)
    assert column(a, "clearance").min() > 0.0 and column(a, "excess")[-1] <= 1e-4


def test_same_input_same_commands_to_the_bit():
    first, second = (paper(regions=[tool_region(plane_below_tip(lwr4plus(), 0.01))], ring=300) for _ in range(2))
    for a in (first, second):
        for k in range(1, 201):
            a.step(0.004 * k, [np.sin(0.1 * k), 1.0, -2.0, 0, 0, 0.1])
    np.testing.assert_array_equal(np.delete(first.ring, 1, axis=1), np.delete(second.ring, 1, axis=1))


def test_parameters_of_the_paper_are_those_of_the_table():
    assert (TABLE_1.alpha, TABLE_1.beta, TABLE_1.d_0, TABLE_1.k, TABLE_1.W) == (25.0, 25.0, 0.0115, 0.01, 1.5)
    assert NEURO8.d_0 == 0.003
