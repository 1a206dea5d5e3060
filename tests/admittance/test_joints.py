"""The joint admittance: against an integrator of scipy, in its ledger, within limits, and given bad input."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from admittance.joint_parameters import NEURO8_JOINTS, JointParameters
from admittance.joints import JointAdmittance
from admittance.outcome import State
from primitives.errors import InputError, UnknownNameError
from tests.admittance.cases import NEURO_Q0, Array, neuro8

ROBOT = neuro8()
M, D = NEURO8_JOINTS.masses(8), NEURO8_JOINTS.dampings(8)


def arm(**more: object) -> JointAdmittance:
    return JointAdmittance(ROBOT, NEURO8_JOINTS, **{"start": NEURO_Q0, **more})


def jacobian(q: Array, frame: str = "tip") -> Array:
    """As Pinocchio has it, world axes at the frame's origin."""
    data = ROBOT.model.createData()
    which = ROBOT.model.getFrameId(frame)
    return pin.computeFrameJacobian(ROBOT.model, data, q, which, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)


def smooth(t: float) -> Array:
    return np.array([np.sin(3.0 * t), np.cos(2.0 * t), -0.5, 0.05 * np.sin(t), 0.02, 0.05 * np.cos(4.0 * t)])


def growth(a: JointAdmittance, before: dict[str, float]) -> float:
    """By how much the storage grew beyond what the books say, J."""
    now = a.ledger
    said = sum(
        sign * (now[k] - before[k]) for k, sign in (("hand", 1), ("dissipated", -1), ("numerical", 1), ("limited", 1))
    )
    return now["storage"] - before["storage"] - said


@pytest.mark.parametrize("frame", ["tip", "shaft"])
def test_it_is_the_target_dynamics_to_first_order(frame):
    """Half the period, half the distance from what scipy integrates to 1e-10, and in the limit the same."""

    def rates(t: float, state: Array) -> Array:
        q, v = np.split(state, 2)
        return np.r_[v, (jacobian(q, frame).T @ smooth(t) - D * v) / M]

    end = 1.0
    exact = solve_ivp(rates, (0.0, end), np.r_[NEURO_Q0, np.zeros(8)], rtol=1e-10, atol=1e-12).y[:8, -1]
    ends, apart = [], []
    for period in (0.004, 0.002, 0.001):
        a = arm(frame=frame, period=period)
        for k in range(round(end / period)):
            motion = a.step(k * period, smooth(k * period))
        ends.append(motion.q)
        apart.append(np.abs(motion.q - exact).max())
        assert motion.state == State.RUN
    moved = np.abs(exact - NEURO_Q0).max()
    assert moved > 0.03 and apart[2] < 0.01 * moved
    # Without the first-order part of their distances, little is left.
    assert np.abs(2.0 * ends[2] - ends[1] - exact).max() < 0.02 * apart[2]
    assert apart[0] / apart[1] == pytest.approx(2.0, abs=0.1)
    assert apart[1] / apart[2] == pytest.approx(2.0, abs=0.1)


def test_a_slide_under_a_constant_force_is_a_geometric_series():
    """Joint 5 slides along the shaft: v_k = F / D (1 - (M / (M + T D))^k)."""
    a = arm()
    force = 2.0 * ROBOT.kinematics(NEURO_Q0).rotation("shaft")[:, 2]
    start = NEURO_Q0[4]
    speeds = []
    for k in range(1, 51):
        torque = a.propose(0.004 * k, [*force, 0.0, 0.0, 0.0])
        along = np.zeros(8)
        along[4] = torque.v_ref[4]
        speeds.append(a.accept(along).qdot[4])
    powers = (M[4] / (M[4] + 0.004 * D[4])) ** np.arange(1, 51)
    np.testing.assert_allclose(speeds, 2.0 / D[4] * (1.0 - powers), rtol=1e-9)
    assert a.q[4] == pytest.approx(start + 0.004 * np.sum(speeds), abs=1e-12)


def test_it_comes_to_rest_when_the_hand_lets_go():
    """Each joint by itself, by M / (M + T D) a cycle: within 200 ms to a hundredth."""
    a, rng = arm(), np.random.default_rng(1)
    for k in range(100):
        last = a.step(0.004 * k, np.r_[2.0 * rng.normal(size=3), 0.05 * rng.normal(size=3)])
    for k in range(100, 150):
        motion = a.step(0.004 * k, np.zeros(6))
    assert np.abs(last.qdot).max() > 0.01 and motion.state == State.RUN
    # Velocities are differences of positions.
    np.testing.assert_allclose(motion.qdot, last.qdot * (M / (M + 0.004 * D)) ** 50, rtol=1e-12, atol=1e-14)
    assert np.all(np.abs(motion.qdot) <= 0.01 * np.abs(last.qdot))


def test_ledger_is_an_identity():
    """Storage grows by exactly what the books say, each cycle, to 1e-12 J; also where limits act or none is found."""
    room = np.full(8, 0.02)
    tight = ROBOT.with_limits(lower=NEURO_Q0 - room, upper=NEURO_Q0 + room, velocity=np.full(8, 0.1))
    rng, states = np.random.default_rng(2), set()
    for robot in (ROBOT, tight):
        a = JointAdmittance(robot, NEURO8_JOINTS, start=NEURO_Q0)
        for k in range(600):
            before = a.ledger
            wrench = np.r_[8.0 * rng.normal(size=3), 0.3 * rng.normal(size=3)] * (k // 50 % 2)
            if k % 97 == 5:
                a.propose(0.004 * k, wrench)
                motion = a.accept(None)
            else:
                motion = a.step(0.004 * k, wrench)
            states.add(motion.state)
            now = a.ledger
            assert abs(growth(a, before)) <= 1e-12
            assert now["dissipated"] >= before["dissipated"] and now["numerical"] <= before["numerical"]
            assert now["limited"] <= before["limited"] + 1e-15
            assert now["storage"] == pytest.approx(0.5 * np.sum(M * motion.qdot**2), abs=1e-15)
        assert a.ledger["excess"] <= 1e-12
    assert states == {State.RUN, State.DEGRADED, State.HOLD}


def test_work_of_the_hand_is_that_of_its_wrench():
    """T F^T J v+ with Pinocchio's Jacobian at the beginning of each step."""
    a, work = arm(), 0.0
    for k in range(200):
        q, wrench = a.q, smooth(0.004 * k)
        motion = a.step(0.004 * k, wrench)
        work += 0.004 * wrench @ jacobian(q) @ motion.qdot
    assert a.ledger["hand"] == pytest.approx(work, abs=1e-12) and work > 1e-3
    np.testing.assert_allclose(a.twist, jacobian(a.q) @ motion.qdot, atol=1e-12)


def test_halves_are_the_whole():
    whole, halves = arm(), arm()
    for k in range(200):
        one, proposal = whole.step(0.004 * k, smooth(0.004 * k)), halves.propose(0.004 * k, smooth(0.004 * k))
        np.testing.assert_array_equal(proposal.basis @ proposal.v_ref + proposal.offset, proposal.v_ref)
        two = halves.accept(proposal.v_ref)
        np.testing.assert_array_equal(one.q, two.q)
    assert whole.ledger == halves.ledger
    np.testing.assert_allclose(proposal.metric, np.diag(M + 0.004 * D))


def test_a_projection_in_the_metric_of_the_proposal_is_passive():
    """Any v+ nearest to v_ref under a^T v >= b, b <= 0, hands no energy in; in another metric it may."""
    rng, excess = np.random.default_rng(3), {}
    for name in ("own", "other"):
        a = arm()
        for k in range(600):
            p = a.propose(0.004 * k, 2.0 * smooth(0.02 * k))
            row, b, v = rng.normal(size=8), -rng.exponential(1e-3), p.v_ref
            if row @ v < b:
                push = np.linalg.solve(p.metric if name == "own" else np.eye(8), row)
                v = v + push * (b - row @ v) / (row @ push)
            a.accept(v)
        excess[name] = a.ledger["excess"]
        assert a.ledger["limited"] < -1e-4 or name == "other", "the rows did act"
    assert excess["own"] <= 1e-12 < 1e-6 < excess["other"]


@pytest.mark.parametrize(("room", "fastest", "words"), [(0.01, 0.5, "position limits"), (0.2, 0.02, "velocity limits")])
def test_joint_limits_are_kept_and_named(room, fastest, words):
    robot = ROBOT.with_limits(lower=NEURO_Q0 - room, upper=NEURO_Q0 + room, velocity=np.full(8, fastest))
    a, reasons = JointAdmittance(robot, NEURO8_JOINTS, start=NEURO_Q0), set()
    for k in range(1500):
        motion = a.step(0.004 * k, [3.0, 2.0, -2.0, 0.1, 0.0, 0.1])
        assert np.abs(motion.qdot).max() <= fastest + 1e-12 and np.abs(motion.q - NEURO_Q0).max() <= room + 1e-12
        reasons.add(motion.reason)
    assert np.abs(motion.q - NEURO_Q0).max() > 0.009
    assert any(words in r for r in reasons)


def test_only_the_group_moves():
    robot = ROBOT.with_group("wrist", ["joint7", "joint8"])
    a = JointAdmittance(robot, JointParameters(0.002, 0.05), start=NEURO_Q0, group="wrist")
    for k in range(50):
        motion = a.step(0.004 * k, smooth(0.0))
    assert a.joints == ("joint7", "joint8") and motion.q.shape == (2,)
    assert np.abs(a.q - NEURO_Q0)[6:].min() > 1e-4 and not (a.q - NEURO_Q0)[:6].any()


@pytest.mark.parametrize(
    ("t", "wrench", "words"),
    [
        (2.0, [np.nan, 0, 0, 0, 0, 0], "not finite"),
        (2.0, [0, 0, 0, 0, np.inf, 0], "not finite"),
        (2.0, [201.0, 0, 0, 0, 0, 0], "force_ceiling"),
        (2.0, [1e200, 1e200, 0, 0, 0, 0], "force_ceiling"),
        (2.0, [0, 0, 0, 0, 0, -101.0], "torque_ceiling"),
        (2.0, [1.0, 2.0, 3.0], "shape or kind"),
        (2.0, "push", "shape or kind"),
        (2.0, None, "shape or kind"),
        (1.0, np.zeros(6), "grow"),
        (np.nan, np.zeros(6), "grow"),
        (np.inf, np.zeros(6), "grow"),
        ("now", np.zeros(6), "shape or kind"),
    ],
)
def test_bad_input_stands_still_and_says_why(t, wrench, words):
    for halves in (False, True):
        a = arm()
        assert a.step(1.0, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]).qdot.any()
        before, q = a.ledger, a.q
        motion = (a.propose(t, wrench), a.accept(np.ones(8)))[1] if halves else a.step(t, wrench)
        assert motion.state == State.FAULT and words in motion.reason
        assert not motion.qdot.any() and np.array_equal(a.q, q)
        assert abs(growth(a, before)) <= 1e-15 and a.ledger["storage"] == 0.0 < before["storage"]
        assert a.step(3.0, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]).state == State.RUN, "it goes on"


@pytest.mark.parametrize(
    ("v", "state", "words"),
    [
        (None, State.HOLD, "no velocity keeps"),
        (np.full(8, np.nan), State.FAULT, "shape or kind"),
        (np.zeros(7), State.FAULT, "shape or kind"),
        ("fast", State.FAULT, "shape or kind"),
        (np.full(8, 1e200), State.HOLD, "not carried out"),
    ],
)
def test_a_velocity_that_is_no_good_is_not_carried_out(v, state, words):
    a = arm()
    a.step(0.0, smooth(0.0))
    q = a.q
    a.propose(0.004, smooth(0.0))
    motion = a.accept(v)
    assert motion.state == state and words in motion.reason and not motion.qdot.any()
    assert np.array_equal(a.q, q) and np.isfinite(list(a.ledger.values())).all()
    assert a.accept(np.zeros(8)).state == State.FAULT, "without a proposal"


def test_construction_says_what_is_wrong():
    for changes, words in (
        ({"period": 0.0}, "period"),
        ({"period": np.nan}, "period"),
        ({"limit_gain": 0.0}, "limit_gain"),
        ({"limit_gain": 500.0}, "limit_gain T <= 1"),
        ({"force_ceiling": -1.0}, "force_ceiling"),
        ({"start": NEURO_Q0[:7]}, "start"),
        ({"start": NEURO_Q0 + 0.2}, "out of range at joint1, joint2"),
    ):
        with pytest.raises(InputError, match=words):
            arm(**changes)
    with pytest.raises(UnknownNameError, match='Did you mean "tip"'):
        arm(frame="tipp")
    with pytest.raises(UnknownNameError, match="joint group"):
        arm(group="moving")
    for inertia in (0.0, -1.0, (1.0, 0.0), (), np.inf):
        with pytest.raises(InputError, match="inertia of JointParameters"):
            JointParameters(inertia, 1.0)
    with pytest.raises(InputError, match=r"damping of JointParameters: expected shape \(8\)"):
        arm(), JointAdmittance(ROBOT, dataclasses.replace(NEURO8_JOINTS, damping=(1.0, 2.0)), start=NEURO_Q0)
