"""S1-S5 by hand: the violation matrix of S1-S5, passive, and exact in the books; the hand itself."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from admittance.joint_parameters import NEURO8_JOINTS, JointParameters
from primitives import dual_quaternion as dq
from primitives.errors import FileError, InputError, UnknownNameError
from scenarios.analysis.trace import Trace
from scenarios.by_hand.hand import Guide, GuidingHand, offset, turn
from scenarios.by_hand.metrics import summary
from scenarios.by_hand.run import build, run_by_hand
from scenarios.enforcement import chosen
from scenarios.scene_file import dump_scene, load_any, load_scene

VIOLATED = {
    "S1-hand": ["C1", "C2", "C3", "C4"],
    "S2-hand": ["C2", "C3", "C4"],
    "S3-hand": ["C3", "C4"],
    "S4-hand": ["C4"],
    "S5-hand": [],
}
SCENES = sorted(VIOLATED)
PERIODS = (0.004, 0.008)
M, D = NEURO8_JOINTS.masses(8), NEURO8_JOINTS.dampings(8)


@cache
def traced(scene: str, period: float = 0.008, enforcement: str = "vfi", guard: str = "act", seed: int = 0) -> Trace:
    return run_by_hand(load_scene(scene), period=period, enforcement=enforcement, guard=guard, seed=seed)


def brief(name: str = "S5-hand", duration: float = 1.0):
    return load_scene(name).with_changes(duration=duration)


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("scene", SCENES)
def test_violation_matrix_is_that_of_s1_to_s5(scene, period):
    found = summary(traced(scene, period))
    assert found["violated"] == VIOLATED[scene]
    assert found["infeasible_cycles"] == found["stopped_cycles"] == 0
    assert found["cycles"] == round(15.0 / period)
    margins = found["min_margin_m"]
    assert all(abs(margins[name]) > 5e-5 for name in margins), "nothing is only just kept or violated"


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("scene", SCENES)
def test_it_is_passive_and_its_books_are_exact(scene, period):
    """The storage grows by what the books say to 1e-12 J a step, and over no interval by more than the hand's work."""
    trace = traced(scene, period)
    assert trace["excess"].max() <= 1e-9
    said = trace["hand"] - trace["dissipated"] + trace["numerical"] + trace["limited_work"]
    assert np.abs(np.diff(trace["storage"] - said, prepend=0.0)).max() <= 1e-12
    v = trace["qdot"]
    np.testing.assert_allclose(trace["storage"], 0.5 * np.sum(M * v**2, axis=1), atol=1e-15)
    np.testing.assert_allclose(np.cumsum(period * np.sum(D * v**2, axis=1)), trace["dissipated"], atol=1e-12)
    rows = np.diff(trace["limited_work"], prepend=0.0)
    assert rows.max() <= 1e-12, "rows that allow standing still only take energy out"
    # What the controller says of the rows, port by port, is what the admittance found in its books.
    np.testing.assert_allclose(trace["ports"].sum(axis=1), trace["limited_work"], atol=1e-10)
    if scene != "S1-hand":
        assert trace["limited_work"][-1] < -1e-3


@pytest.mark.parametrize("scene", SCENES)
def test_the_matrix_is_the_same_on_the_lwr4plus(scene):
    trace = run_by_hand(load_any(scene, "lwr4plus"))
    found = summary(trace)
    assert (found["violated"], found["infeasible_cycles"], found["stopped_cycles"]) == (VIOLATED[scene], 0, 0)
    assert all(abs(margin) > 5e-5 for margin in found["min_margin_m"].values())
    assert trace["excess"].max() <= 1e-9
    said = trace["hand"] - trace["dissipated"] + trace["numerical"] + trace["limited_work"]
    assert np.abs(np.diff(trace["storage"] - said, prepend=0.0)).max() <= 1e-12


def test_the_trace_is_what_the_arm_did():
    """Poses, errors, velocities and the hand's work, from q alone."""
    trace, scene = traced("S5-hand"), load_scene("S5-hand")
    robot, q, work = scene.build_robot(), trace["q"], 0.0
    np.testing.assert_allclose(np.diff(q[:, :8], axis=0) / 0.008, trace["qdot"][:-1], atol=1e-12)
    assert np.array_equal(q[:, 8:], np.tile(scene.start[8:], (len(q), 1))), "the parked arm stands still"
    reference = scene.reference.sample(robot.kinematics(scene.start).pose("moving/tip")[:4], 0.008, len(q))
    for k in range(len(q)):
        now = robot.kinematics(q[k])
        work += 0.008 * trace["hand_wrench"][k] @ now.jacobian("moving/tip")[:, :8] @ trace["qdot"][k]
        if k % 100 == 0:
            R, R_d = now.rotation("moving/tip"), dq.rotation_matrix(reference[k])
            away = now.translation("moving/tip") - dq.translation(reference[k])
            assert trace["position_error"][k] == pytest.approx(np.linalg.norm(away), abs=1e-12)
            angle = Rotation.from_matrix(R_d @ R.T).magnitude()
            assert trace["orientation_error"][k] == pytest.approx(angle, abs=1e-9)
    assert trace["hand"][-1] == pytest.approx(work, abs=1e-10) and work > 0.01


def test_unconstrained_it_goes_where_the_trajectory_goes():
    """Within half a millimetre and a degree at the scenes' speeds, with a tremor of 0.2 N: not sluggish."""
    for period in PERIODS:
        found = summary(traced("S1-hand", period))
        assert found["position_error_m"]["max"] < 5e-4 and found["orientation_error_rad"]["max"] < np.radians(1.0)
        assert found["max_force_N"] < 1.0 and found["max_torque_Nm"] < 0.1


def test_the_hand_feels_what_is_kept():
    free, kept = summary(traced("S1-hand")), summary(traced("S5-hand"))
    assert kept["max_force_N"] > 5.0 * free["max_force_N"]
    assert kept["hand_work_J"] > free["hand_work_J"] > 0.0 > kept["constraint_work_J"]
    assert kept["max_force_N"] < load_scene("S5-hand").hand.most, "not for want of strength"


def test_with_nobody_to_keep_them_all_are_violated():
    trace = traced("S5-hand", enforcement="none")
    assert summary(trace)["violated"] == VIOLATED["S1-hand"] and trace.header["enforced"] == []
    assert np.array_equal(trace["q"], traced("S1-hand")["q"])
    assert np.abs(trace["limited_work"]).max() < 1e-15


@pytest.mark.parametrize(
    "seed", [1, 2, pytest.param(3, marks=pytest.mark.slow), pytest.param(4, marks=pytest.mark.slow)]
)
def test_the_matrix_does_not_hang_on_the_tremor(seed):
    for scene in SCENES:
        found = summary(traced(scene, seed=seed))
        assert found["violated"] == VIOLATED[scene] and found["passivity_excess_J"] <= 1e-9


def test_same_seed_same_run_to_the_bit():
    def timeless(seed: int) -> bytes:
        trace = run_by_hand(brief(), seed=seed)
        return b"".join(trace[name].tobytes() for name in trace.columns if name != "cycle_us")

    assert timeless(3) == timeless(3) != timeless(4)


def test_guard_watches_or_acts_on_what_the_rows_do_not_see():
    """Curved margins fall short of their rows by little; the guard counts that, and acting gives what was asked for."""
    off, watch, act = (traced("S4-hand", guard=guard) for guard in ("off", "watch", "act"))
    counts = [summary(trace)["guard_interventions"] for trace in (off, watch, act)]
    assert counts[0] == 0 < min(counts[1:])
    assert np.array_equal(off["q"], watch["q"]) and not np.array_equal(off["q"], act["q"])
    for trace in (off, watch, act):
        assert summary(trace)["violated"] == VIOLATED["S4-hand"] and trace["excess"].max() <= 1e-9


def test_a_weak_hand_does_not_get_there():
    scene = brief("S1-hand", 3.0)
    weak = scene.with_changes(hand=replace(scene.hand, most=0.05, tremor=0.0))
    assert summary(run_by_hand(weak))["position_error_m"]["max"] > 2e-3


def test_trace_on_disk_holds_the_scene_it_was_made_from(tmp_path):
    path = tmp_path / "S5-hand.mcap"
    trace = run_by_hand(brief(), out=path)
    loaded = Trace.load(path)
    assert loaded.header["kind"] == "by-hand" and np.array_equal(loaded.records, trace.records)
    again = tmp_path / "again.yaml"
    again.write_text(loaded.header["resolved_scene"])
    assert load_scene(again) == brief()


# The hand


def pose(rotation: Rotation, at) -> np.ndarray:
    x, y, z, w = rotation.as_quat()
    return dq.from_rotation_translation(np.array([w, x, y, z]), np.array(at, dtype=float))


def test_turn_is_the_rotation_vector():
    rng = np.random.default_rng(1)
    for size in (0.0, 1e-9, 1e-3, 1.0, 3.1):
        a, axis = Rotation.random(random_state=rng.integers(1 << 30)), rng.normal(size=3)
        vector = size * axis / np.linalg.norm(axis)
        x, y = pose(a, [0, 0, 0]), pose(Rotation.from_rotvec(vector) * a, [1, 2, 3])
        for sign in (1.0, -1.0):
            np.testing.assert_allclose(turn(x, sign * y), vector, atol=1e-12)
        np.testing.assert_allclose(offset(x, y), [1, 2, 3], atol=1e-15)


def test_spring_damper_and_largest_effort():
    a, vector = Rotation.from_rotvec([0.3, 0.1, -0.2]), np.array([0.01, 0.02, 0.0])
    at, wanted = pose(a, [0.1, 0, 0]), pose(Rotation.from_rotvec(vector) * a, [0.101, 0.002, 0])
    hand = GuidingHand(Guide(tremor=0.0), np.array([at, wanted]), 0.01)
    twist = np.array([0.01, 0, 0, 0, 0, 0.5])
    g = hand.guide
    np.testing.assert_allclose(hand.wrench(0.0, at, np.zeros(6)), 0.0, atol=1e-12)
    expected = np.r_[g.stiffness * np.array([0.001, 0.002, 0]), g.turning_stiffness * vector]
    expected -= np.r_[g.damping * twist[:3], g.turning_damping * twist[3:]]
    for t in (0.0099, 0.01, 5.0):
        np.testing.assert_allclose(hand.wrench(t, at, twist), expected, atol=1e-12)
    far = pose(Rotation.from_rotvec([0.0, 2.0, 0.0]) * a, [1.0, 0, 0])
    wrench = GuidingHand(g, far[None], 0.01).wrench(0.0, at, np.zeros(6))
    np.testing.assert_allclose(wrench, [g.most, 0, 0, 0, g.most_torque, 0], atol=1e-9)


def test_tremor_is_a_force_on_top_of_another_each_seed():
    still = pose(Rotation.identity(), [0, 0, 0])[None]
    hands = [Guide(tremor=0.5).hand(still, 0.01, seed) for seed in (1, 1, 2)]
    t = np.arange(0.0, 20.0, 0.007)
    first, again, other = ([h.wrench(x, still[0], np.zeros(6)) for x in t] for h in hands)
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    first = np.array(first)
    assert not first[:, 3:].any() and np.sqrt((first**2).sum(axis=1).mean()) == pytest.approx(0.5, rel=0.1)


# Files and what they refuse


@pytest.mark.parametrize("name", SCENES)
def test_scene_is_the_one_without_a_hand_but_for_the_hand(tmp_path, name):
    scene, plain = load_scene(name), load_scene(name.removesuffix("-hand"))
    by_hand = {"hand": Guide(tremor=0.2), "admittance": NEURO8_JOINTS}
    assert scene == plain.with_changes(name=name, summary=scene.summary, **by_hand)
    file = tmp_path / "again.yaml"
    file.write_text(dump_scene(scene))
    assert load_scene(file) == scene


def test_keys_of_ones_own_and_every_mistake_at_its_line(tmp_path):
    text = dump_scene(load_scene("S5"))
    lines = len(text.splitlines())
    file = tmp_path / "mine.yaml"
    file.write_text(
        text
        + "hand: {most: 5 N, stiffness: 1 N/mm, tremor: 0}\n"
        + "admittance: {inertia: 2, damping: [1, 2, 3, 4, 5, 6, 7, 8]}\n"
    )
    scene = load_scene(file)
    assert scene.hand == Guide(most=5.0) and scene.admittance == JointParameters(2.0, tuple(range(1, 9)))
    file.write_text(text + "hand: {most: 0, stiff: 1}\nadmittance: {inertia: [1, -1], damping: x}\n")
    with pytest.raises(FileError) as caught:
        load_scene(file)
    told = str(caught.value)
    assert told.count(f"mine.yaml:{lines + 1}") == 2 and told.count(f"mine.yaml:{lines + 2}") == 2
    assert 'unknown key "stiff"' in told and "expected a number > 0" in told and "expected numbers > 0" in told
    file.write_text(text + "hand: {}\nadmittance: neuro\n")
    with pytest.raises(FileError, match='Did you mean "neuro8"'):
        load_scene(file)
    file.write_text(text + "hand: {}\n")
    with pytest.raises(FileError, match="hand and admittance go together"):
        load_scene(file)


def test_bad_arguments_say_what_is_wrong():
    scene = brief()
    with pytest.raises(UnknownNameError, match="admittance, both, none, vfi"):
        chosen(scene, enforcement="bot")
    with pytest.raises(UnknownNameError, match='Did you mean "watch"'):
        chosen(scene, guard="watching")
    with pytest.raises(InputError, match="without a hand"):
        build(load_scene("S5"), {})
    with pytest.raises(InputError, match="inertia of JointParameters"):
        build(scene.with_changes(admittance=JointParameters((1.0, 1.0), 1.0)), {})
    with pytest.raises(InputError, match="at most the scene's"):
        build(scene.with_changes(duration=0.001, period=0.01), {})
    for field, value in (("most", 0.0), ("stiffness", -1.0), ("tremor", np.nan), ("most_torque", "x")):
        with pytest.raises(InputError, match=f"{field} of the hand"):
            Guide(**{field: value})
