"""The barrier without a port: force, stiffness and motion against differences of the printed formula and against scipy,
the ledger, what is refused, and steps of force that the plain step does not survive and the robust one does."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from admittance.joint_parameters import NEURO8_JOINTS
from admittance.joints import JointAdmittance
from admittance.memory import Real
from admittance.outcome import State
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Line, Plane, Point, Segment
from primitives.errors import InactiveConstraintError, InputError, UnknownNameError
from primitives.kinematics import snapshot
from primitives.table import used_frames
from tests.admittance.cases import Array, column, on_shaft
from tests.admittance.near_pairs import EVERY, near, parallel_start, random_start
from tests.admittance.walls import ARM, PAIR, S5, SHAFT, START, around, margin, potential, printed, reach, slope

M, D = NEURO8_JOINTS.masses(8), NEURO8_JOINTS.dampings(8)
TIP = "moving/tip"


def arm(constraints: ConstraintSet = S5.constraints, **more: object) -> JointAdmittance:
    """The moving arm of S1-S5, held at its tip."""
    options = {"start": START, "group": "moving", "frame": TIP, **more}
    return JointAdmittance(PAIR, NEURO8_JOINTS, constraints=constraints, **options)


def against(a: JointAdmittance, name: str, newtons: float) -> Array:
    """A wrench (6,) at the tip that moves it fastest against a constraint."""
    row = slope(lambda k: margin(a.constraints[name], k), around(PAIR, a.q, ARM, 1e-7), 1e-7)
    f = -(PAIR.kinematics(a.q).jacobian(TIP)[:3, ARM] @ (row / D))
    return np.r_[newtons * f / np.linalg.norm(f), 0.0, 0.0, 0.0]


def said(a: JointAdmittance) -> float:
    """What the books say of the storage, J."""
    book = a.ledger
    signs = {"hand": 1, "dissipated": -1, "numerical": 1, "limited": 1, "barrier": 1}
    return sum(sign * book[name] for name, sign in signs.items())


def test_force_and_stiffness_are_derivatives_of_the_printed_potential():
    """-dV/dq and sum V'' a a^T by differences, all eight joints, at random configurations and every kind of pair."""
    rng, h, pushed = np.random.default_rng(1), 1e-7, np.zeros(8)
    for _ in range(20):
        q = random_start(rng)
        constraints = near(EVERY, q, rng)
        a, k, moved = arm(constraints, start=q), PAIR.kinematics(q), around(PAIR, q, ARM, h)
        F, K, size = np.zeros(8), np.zeros((8, 8)), 0.0
        for c in constraints:
            d_0, m = reach(c, NEURO8_JOINTS), margin(c, k)
            f = -slope(lambda k, c=c, d_0=d_0: printed(margin(c, k), NEURO8_JOINTS.k, d_0), moved, h)
            row, e = slope(lambda k, c=c: margin(c, k), moved, h), 1e-4 * m
            ahead, here, behind = (printed(m + s * e, NEURO8_JOINTS.k, d_0) for s in (1, 0, -1))
            F, size = F + f, size + np.abs(f).max()
            K += (ahead - 2.0 * here + behind) / e**2 * np.outer(row, row)
        np.testing.assert_allclose(a._real[Real.F_RX], F, atol=1e-5 * (1e-3 + size))
        np.testing.assert_allclose(a._real[Real.STIFFNESS], K, atol=1e-4 * (1e-6 + np.abs(K).max()))
        assert a.ledger["potential"] == pytest.approx(potential(constraints, k, NEURO8_JOINTS), rel=1e-9, abs=1e-18)
        pushed = np.maximum(pushed, np.abs(F))
        metric = a.propose(0.004, np.zeros(6)).metric
        np.testing.assert_allclose(metric, np.diag(M + 0.004 * D) + 0.004**2 * a._real[Real.STIFFNESS], rtol=1e-12)
    # The roll about the shaft moves no constraint but those of the tip's own line.
    assert pushed.min() > 0.0


@pytest.mark.parametrize("tilt", [0.1, 1e-2, 1e-3, 3e-4])
def test_force_of_lines_that_are_nearly_parallel(tilt):
    """Outside of the pair's declared band (1e-4) the gradient grows like 1/tilt; a step must be that much smaller."""
    rng = np.random.default_rng(3)
    for _ in range(4):
        q = parallel_start(tilt, rng)
        c = near(ConstraintSet([EVERY["C1"]]), q, rng)
        h, m = 1e-5 * tilt, margin(c["C1"], PAIR.kinematics(q))
        row = slope(lambda k, c=c: margin(c["C1"], k), around(PAIR, q, ARM, h), h)
        e, d_0 = 1e-4 * m, NEURO8_JOINTS.d_0
        ahead, behind = (printed(m + s * e, NEURO8_JOINTS.k, d_0) for s in (1, -1))
        expected = -(ahead - behind) / (2.0 * e) * row
        found = arm(c, start=q)._real[Real.F_RX]
        np.testing.assert_allclose(found, expected, atol=1e-4 * (1e-9 + np.abs(expected).max()))


def test_lines_within_the_band_of_parallel_push_and_stay_finite():
    rng = np.random.default_rng(4)
    for tilt in (0.0, 1e-9, 1e-6, 5e-5):
        q = parallel_start(tilt, rng)
        for integrator in ("semi-implicit", "robust"):
            a = arm(ConstraintSet([S5.constraints["C1"]]), start=q, integrator=integrator)
            for k in range(1, 60):
                m = a.step(0.004 * k, [2.0, -3.0, 1.0, 0.0, 0.0, 0.1])
                assert np.isfinite([*m.q, *m.qdot, *m.margin, *a.ledger.values()]).all()
                assert integrator != "robust" or m.margin[0] > 0.0


def test_it_is_the_target_dynamics_with_the_potential_to_first_order():
    """M dv/dt + D v = J^T F - dV/dq with the printed V, by scipy; half the period, half the distance."""
    wrench, some, end = np.array([0.3, -0.6, -1.0, 0.0, 0.0, 0.0]), S5.constraints.enforcing(["C2", "C3"]), 0.2

    frames, steps = used_frames(S5.constraints), 1e-7 * np.eye(PAIR.n)[:8]
    flat = PAIR.flat(frames)

    def rates(t: float, state: Array) -> Array:
        q, v = START.copy(), state[8:]
        q[ARM] = state[:8]
        moved = [(snapshot(flat, frames, q + e), snapshot(flat, frames, q - e)) for e in steps]
        push = slope(lambda k: potential(some, k, NEURO8_JOINTS), moved, 1e-7)
        return np.r_[v, (snapshot(flat, frames, q).jacobian(TIP)[:, ARM].T @ wrench - push - D * v) / M]

    start = np.r_[START[ARM], np.zeros(8)]
    exact = solve_ivp(rates, (0.0, end), start, rtol=1e-6, atol=1e-8, method="LSODA").y[:8, -1]

    def apart(constraints: ConstraintSet, integrator: str, period: float) -> float:
        a = arm(constraints, integrator=integrator, period=period)
        for k in range(round(end / period)):
            motion = a.step(k * period, wrench)
        assert motion.state == State.RUN
        return float(np.abs(motion.q - exact).max())

    effect = apart(ConstraintSet(), "semi-implicit", 0.001)
    for integrator in ("semi-implicit", "robust"):
        errors = [apart(some, integrator, period) for period in (0.002, 0.001, 0.0005)]
        assert errors[2] < 0.05 * effect, "without the potential it would be elsewhere"
        assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.3)
        assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("period", [0.004, 0.008])
@pytest.mark.parametrize(
    "options", [{}, {"implicit_stiffness": False}, {"linear_below": 1.5e-4}, {"integrator": "robust"}]
)
def test_ledger_is_an_identity_with_constraints(options, period):
    """Storage, 1/2 v^T M v + V, grows by what the books say to 1e-12 J a step, and V is the printed one."""
    a, rng = arm(period=period, **options), np.random.default_rng(1)
    push, largest, before = against(a, "C3", 2.0), 0.0, a.ledger["storage"] - said(a)
    for k in range(1, 801):
        noise = np.r_[rng.normal(size=3), rng.normal(size=3) * 0.05]
        motion = a.step(period * k, 0.2 * noise + push * (k // 200 % 2))
        assert motion.state in (State.RUN, State.DEGRADED)
        now = a.ledger["storage"] - said(a)
        assert abs(now - before) <= 1e-12
        before, largest = now, max(largest, a.ledger["potential"])
    kinetic = 0.5 * np.sum(M * a._real[Real.V] ** 2)
    assert a.ledger["storage"] == pytest.approx(kinetic + a.ledger["potential"], abs=1e-15)
    if "linear_below" not in options:
        assert a.ledger["potential"] == pytest.approx(
            potential(S5.constraints, PAIR.kinematics(a.q), NEURO8_JOINTS), rel=1e-9
        )
    assert largest > 1e-4 and a.ledger["excess"] <= 1e-9


def test_a_projection_in_the_metric_of_the_proposal_takes_energy_out():
    """Nearest to v_ref under a^T v >= b, b <= 0, in M + T D + T^2 K: what is booked as limited never grows."""
    a, rng = arm(linear_below=1.5e-4), np.random.default_rng(3)
    wrench, before = against(a, "C2", 3.0), 0.0
    for k in range(600):
        p = a.propose(0.004 * k, wrench)
        row, b, v = rng.normal(size=8), -rng.exponential(1e-3), p.v_ref
        if row @ v < b:
            push = np.linalg.solve(p.metric, row)
            v = v + push * (b - row @ v) / (row @ push)
        a.accept(v)
        assert a.ledger["limited"] <= before + 1e-15
        before = a.ledger["limited"]
    assert before < -1e-4 and a.ledger["excess"] <= 1e-9


def test_halves_are_the_whole():
    whole, halves = arm(), arm()
    wrench = against(whole, "C3", 2.0)
    for k in range(1, 301):
        one, proposal = whole.step(0.004 * k, wrench), halves.propose(0.004 * k, wrench)
        two = halves.accept(proposal.v_ref)
        np.testing.assert_array_equal(one.q, two.q)
        np.testing.assert_array_equal(one.margin, two.margin)
    assert whole.ledger == halves.ledger and whole.ledger["potential"] > 1e-4


@pytest.mark.parametrize("name", ["C1", "C2", "C3", "C4"])
@pytest.mark.parametrize("newtons", [10.0, 20.0, 30.0])
def test_the_robust_step_is_not_pushed_across(name, newtons):
    for period in (0.004, 0.008):
        a = arm(integrator="robust", period=period)
        wrench = against(a, name, newtons)
        for k in range(1, round(1.5 / period)):
            m = a.step(period * k, wrench)
            assert m.margin.min() > 0.0 and m.state <= State.DEGRADED
        assert m.margin.min() < 5e-4, "it was pushed against something"
        assert a.ledger["excess"] <= 1e-9


def test_a_plain_step_across_holds_and_says_which():
    a = arm(period=0.008)
    wrench = against(a, "C2", 10.0)
    for k in range(1, 200):
        m = a.step(0.008 * k, wrench)
        if m.state == State.HOLD:
            break
    assert m.state == State.HOLD and m.margin[1] <= 0.0 and np.isfinite(list(a.ledger.values())).all()
    assert m.reason.startswith('the margin of constraint "C2" is -0.') and "start again" in m.reason
    q, work = a.q, a.ledger["hand"]
    for i, halves in enumerate((False, False, True, True)):
        t = 2.0 + 0.008 * i
        m = (a.propose(t, -wrench), a.accept(np.ones(8)))[1] if halves else a.step(t, -wrench)
        assert m.state == State.HOLD and not m.qdot.any()
    np.testing.assert_array_equal(a.q, q)
    assert a.ledger["hand"] == work


FLOOR = Constraint("floor", Point.at([0, 0, 0], frame=SHAFT), Plane.through([0, 0, -0.06], [0, 0, 1]), "outside", 0.0)


def floor(height: float, **more: object) -> ConstraintSet:
    return ConstraintSet([replace(FLOOR, second=Plane.through([0, 0, height], [0, 0, 1]), **more)])


@pytest.mark.parametrize(
    ("constraint", "words"),
    [
        (Constraint("v", FLOOR.first, Cloud.named("vessels"), "outside", 0.002), "without a port does not push off"),
        (Constraint("heart", FLOOR.first, Point.at([0, 0, 0], entity="heart"), "outside", 0.002), 'entity "heart"'),
        (Constraint("no", FLOOR.first, Line.through([0, 0, 0], [0, 0, 1]), "inside", 0.0), "leaves no room"),
    ],
)
def test_what_the_barrier_cannot_enforce_is_refused(constraint, words):
    with pytest.raises(InputError, match=words):
        arm(ConstraintSet([constraint]))


def test_bad_starts_and_bad_arguments_are_refused_and_named():
    down = Line.through([0, 0, 0], [0, 0, -1])
    tilted = Constraint("cone", Line.z_axis(SHAFT), down, "inside", 0.05, "line_line_angle")
    with pytest.raises(InputError, match=r'"floor" is -5 mm, of "cone" is -0\.06\d* rad, expected more than zero'):
        arm(floor(-0.04) + tilted)
    assert arm(floor(-0.04, enforced=False)).step(0.004, np.zeros(6)).margin[0] == pytest.approx(-0.005)
    touching = Segment.between(on_shaft(PAIR, START, SHAFT, 0.02), [0.1, 0.1, 0.1])
    tool = Segment.between([0, 0, -0.1], [0, 0, 0], frame=SHAFT)
    with pytest.raises(InputError, match='the margin of constraint "touch" is'):
        arm(ConstraintSet([Constraint("touch", tool, touching, "outside", 0.0)]))
    still = Constraint("still", Point.at([0, 0, 0], frame="parked/shaft"), FLOOR.second, "outside", 0.0)
    with pytest.raises(InactiveConstraintError, match="none of the decided joints moves its elements"):
        arm(ConstraintSet([still]))
    with pytest.raises(InputError, match="expected a ConstraintSet"):
        arm([FLOOR])
    with pytest.raises(UnknownNameError, match="Known: robust, semi-implicit"):
        arm(integrator="rk4")
    for name, value in (("k", -1.0), ("k", np.nan), ("d_0", 0.0), ("d_0_angle", np.inf)):
        with pytest.raises(InputError, match=f"{name} of JointParameters"):
            replace(NEURO8_JOINTS, **{name: value})


def test_watched_constraints_are_measured_and_push_nothing():
    a, k = arm(S5.constraints.enforcing(())), PAIR.kinematics(START)
    m = a.step(0.004, np.zeros(6))
    np.testing.assert_allclose(m.margin, [margin(c, k) for c in S5.constraints], atol=1e-12)
    assert a.ledger["potential"] == 0.0 and not m.qdot.any() and not column(a, "free_repulsion").any()
    pushed = arm().step(0.004, np.zeros(6))
    assert pushed.qdot.any(), "C2 and C3 start within range"


def test_without_a_gain_there_is_no_barrier():
    a = JointAdmittance(PAIR, replace(NEURO8_JOINTS, k=0.0), start=START, group="moving", constraints=S5.constraints)
    assert not a.step(0.004, np.zeros(6)).qdot.any() and a.ledger["potential"] == 0.0
