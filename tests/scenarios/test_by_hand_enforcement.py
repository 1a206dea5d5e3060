"""S1-S5 by hand under every enforcement: the same violations, passive, exact in the books; and pushed with a step."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.tables.hand_led import SCENE, lead, towards
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import evaluate
from primitives.kinematics import snapshot, world_first
from scenarios.analysis.between import margins_between
from scenarios.analysis.trace import Trace
from scenarios.by_hand.enforcement import enforce
from scenarios.by_hand.hand import Guide
from scenarios.by_hand.metrics import summary
from scenarios.by_hand.run import build, run_by_hand
from scenarios.enforcement import METHODS, chosen
from scenarios.jobs import Choices
from scenarios.joined import SHARE, kept_farther
from scenarios.scene_file import dump_scene, load_any, load_scene
from scenarios.session import prepare

VIOLATED = {
    "S1-hand": ["C1", "C2", "C3", "C4"],
    "S2-hand": ["C2", "C3", "C4"],
    "S3-hand": ["C3", "C4"],
    "S4-hand": ["C4"],
    "S5-hand": [],
}
PUSHED = ("admittance", "both")


@cache
def traced(scene: str, enforcement: str, guard: str | None = None, period: float = 0.008, **more: str) -> Trace:
    return run_by_hand(load_scene(scene), period=period, enforcement=enforcement, guard=guard, **more)


def growth(trace: Trace) -> np.ndarray:
    """By how much the storage grows beyond what the books say, each cycle."""
    names, signs = ("hand", "dissipated", "numerical", "limited_work", "barrier"), (1, -1, 1, 1, 1)
    said = sum(sign * trace[name] for name, sign in zip(names, signs, strict=True))
    return np.diff(trace["storage"] - said)


def check(scene: str, trace: Trace) -> None:
    """The matrix, between cycles too, no energy from nowhere, and exact books."""
    found, declared = summary(trace), load_scene(scene).constraints
    assert found["violated"] == VIOLATED[scene] and found["stopped_cycles"] == found["degraded_cycles"] == 0
    smallest = margins_between(trace, load_scene(scene).build_robot(), declared).min(axis=0)
    for name, margin in zip(declared.names, smallest, strict=True):
        assert (margin < -1e-3) if name in VIOLATED[scene] else (margin > 1e-4), "nothing is only just kept or violated"
    assert trace["excess"].max() <= 1e-9 and np.abs(growth(trace)).max() <= 1e-12


@pytest.mark.parametrize("enforcement", PUSHED)
@pytest.mark.parametrize("scene", sorted(VIOLATED))
def test_the_matrix_is_that_of_s1_to_s5(scene, enforcement):
    check(scene, traced(scene, enforcement))


@pytest.mark.parametrize("enforcement", PUSHED)
@pytest.mark.parametrize("guard", ["off", "watch", "act"])
def test_neither_guard_nor_period_changes_the_matrix(enforcement, guard):
    check("S5-hand", traced("S5-hand", enforcement, guard, 0.004))
    check("S3-hand", traced("S3-hand", enforcement, guard))


@pytest.mark.parametrize("enforcement", PUSHED)
def test_the_matrix_is_the_same_on_the_lwr4plus(enforcement):
    for scene in ("S3-hand", "S5-hand"):
        trace = run_by_hand(load_any(scene, "lwr4plus"), enforcement=enforcement)
        assert summary(trace)["violated"] == VIOLATED[scene]
        assert trace["excess"].max() <= 1e-9 and np.abs(growth(trace)).max() <= 1e-12


@pytest.mark.parametrize(("enforcement", "guard"), [("admittance", "off"), ("admittance", "act"), ("both", "act")])
def test_the_trace_says_what_was_carried_out(enforcement, guard):
    """Velocities, declared margins, potential and the hand's work, from q alone."""
    trace, scene = traced("S5-hand", enforcement, guard), load_scene("S5-hand")
    robot, q, work = scene.build_robot(), trace["q"], 0.0
    np.testing.assert_allclose(np.diff(q[:, :8], axis=0) / 0.008, trace["qdot"][:-1], atol=1e-12)
    for k in range(0, len(q), 100):
        np.testing.assert_allclose(trace["margin"][k], evaluate(robot, scene.constraints, q[k]).margin, atol=1e-12)
    frames = world_first(("moving/tip",))
    flat = robot.flat(frames)
    for k in range(len(q)):
        jacobian = snapshot(flat, frames, q[k]).jacobian("moving/tip")[:, :8]
        work += 0.008 * trace["hand_wrench"][k] @ jacobian @ trace["qdot"][k]
    assert trace["hand"][-1] == pytest.approx(work, abs=1e-10)
    m, p = trace["margin"][1:], scene.admittance
    psi = (1.0 - np.minimum(m / p.d_0, 1.0)) ** 2
    expected = np.sum(0.5 * p.k * np.log(1.0 / (1.0 - psi)) ** 2, axis=1)
    np.testing.assert_allclose(trace["potential"][:-1], expected, rtol=1e-9, atol=1e-18)
    assert trace.header["enforcement"] == enforcement and trace.header["guard"] == guard
    assert trace.header["enforced"] == ["C1", "C2", "C3", "C4"]


def test_what_the_rows_did_is_in_their_ports():
    """Of both: what the admittance books as limited is what the controller's ports say; of potentials alone nothing."""
    both, alone = traced("S5-hand", "both"), traced("S5-hand", "admittance")
    np.testing.assert_allclose(both["ports"].sum(axis=1), both["limited_work"], atol=1e-10)
    assert both["limited_work"][-1] < -1e-3 and np.diff(both["limited_work"]).max() <= 1e-12
    assert not alone["ports"].any() and np.abs(alone["limited_work"]).max() < 1e-15


def test_a_guard_that_finds_nothing_changes_nothing():
    """Led at this pace the potentials keep what they are for: the guard beside them never has to ask for more."""
    off, watch, act = (traced("S5-hand", "admittance", guard) for guard in ("off", "watch", "act"))
    for trace in (watch, act):
        assert not trace["intervened"].any()
        np.testing.assert_allclose(trace["q"], off["q"], atol=1e-12)


def test_the_rows_of_both_keep_more_than_is_due():
    p = SCENE.admittance
    farther = kept_farther(SCENE.constraints, p.d_0, p.d_0_angle)
    for c, kept in zip(SCENE.constraints, farther, strict=True):
        sign = 1.0 if c.keep == "outside" else -1.0
        assert kept.safe_distance - c.safe_distance == pytest.approx(sign * SHARE * p.d_0)
    assert traced("S5-hand", "both")["margin"].min() > SHARE * p.d_0


@pytest.mark.parametrize("name", ["C1", "C2"])
def test_a_step_of_force_is_withstood_by_all_but_the_plain_potentials(name):
    """20 N at 8 ms, samples and between: the plain step crosses and stops; the robust one, rows and both do not."""
    hand, how = Guide(most=20.0), {"period": 0.008, "seconds": 1.0}
    plain = lead(towards(name), hand, enforcement="admittance", **how)
    assert plain.margin.min() < -2e-5 and plain.stopped
    for enforcement, integrator in (("admittance", "robust"), ("vfi", "semi-implicit"), ("both", "semi-implicit")):
        found = lead(towards(name), hand, enforcement=enforcement, integrator=integrator, **how)
        assert found.margin.min() > 5e-5 and found.excess <= 1e-9 and not found.stopped


def test_the_guard_watches_a_step_or_acts_on_it():
    """It counts what crosses, and acting keeps the tool on this side; energy it may put in, as its rows end at zero."""
    hand, how = Guide(most=20.0), {"enforcement": "admittance", "period": 0.008, "seconds": 1.0}
    off, watch, act = (lead(towards("C1"), hand, guard=guard, **how) for guard in ("off", "watch", "act"))
    # The arm's speed limits bind as well, and the guard that watches leaves them where they are.
    assert np.abs(np.diff(off.q[:, :8], axis=0) / 0.008 / SCENE.build_robot().limits.velocity[:8]).max() > 0.999
    np.testing.assert_allclose(watch.q, off.q, atol=1e-12)
    assert off.margin.min() < -2e-5 and act.margin.min() > -1e-8


def test_the_wrist_does_not_fold_by_the_potentials():
    """Pushed at C4 it turns by what the hand's force alone turns it; a hand that holds the direction keeps it."""
    loose, held = Guide(most=20.0, turning_stiffness=0.0, turning_damping=0.0), Guide(most=20.0)
    turned = {}
    for e in METHODS:
        for hand in (loose, held):
            q = lead(towards("C4"), hand, enforcement=e, period=0.004, seconds=1.5).q
            turned[e, hand is held] = np.degrees(np.abs(q - q[0])[:, 6:8].max())
    for e in METHODS[1:]:
        assert turned[e, True] < 4.0 and abs(turned[e, False] - turned["none", False]) < 5.0


def test_integrators_are_those_of_potentials_alone():
    plain, robust = (traced("S5-hand", "admittance", integrator=name) for name in ("semi-implicit", "robust"))
    assert (plain.header["solver"], robust.header["solver"]) == ("semi-implicit", "robust")
    np.testing.assert_allclose(robust["q"], plain["q"], atol=1e-4)
    for enforcement, guard in (("vfi", None), ("both", None), ("admittance", "watch")):
        with pytest.raises(InputError, match="its steps are those of the semi-implicit integrator, got robust"):
            build(chosen(SCENE, enforcement=enforcement, guard=guard), {}, "robust")
    with pytest.raises(UnknownNameError, match="Known: robust, semi-implicit"):
        build(chosen(SCENE, enforcement="admittance"), {}, "rk4")


def test_the_potential_is_the_files(tmp_path):
    file = tmp_path / "mine.yaml"
    keys = "admittance: {inertia: 1, damping: 50, k: 0.002, d_0: 5 mm, d_0_angle: 3 deg}\n"
    file.write_text(dump_scene(load_scene("S5")) + "hand: {}\n" + keys)
    scene = load_scene(file)
    p = scene.admittance
    assert (p.k, p.d_0, p.d_0_angle) == (0.002, 0.005, pytest.approx(np.radians(3.0)))
    again = tmp_path / "again.yaml"
    again.write_text(dump_scene(scene))
    assert load_scene(again) == scene
    pushed = chosen(scene, enforcement="admittance")
    strong, weak = (enforce(pushed, replace(p, k=k), {})[0] for k in (0.002, 0.001))
    assert (
        strong.ledger["potential"] == pytest.approx(2.0 * weak.ledger["potential"]) and weak.ledger["potential"] > 0.0
    )


def test_jobs_of_the_command_line_run_them_all(tmp_path):
    results = {}
    for enforcement in PUSHED:
        (job,) = prepare(["S5-hand"], Choices(enforcement=enforcement, period=0.008, out=tmp_path))
        assert job.file == tmp_path / f"S5-hand-{enforcement}.mcap"
        results[enforcement] = job.summary(job.run(None))
    assert {e: (r["enforcement"], r["guard"], r["violated"]) for e, r in results.items()} == {
        "admittance": ("admittance", "off", []),
        "both": ("both", "act", []),
    }
    with pytest.raises(InputError, match="robust"):
        prepare(["S5-hand"], Choices(enforcement="both", integrator="robust"))
    with pytest.raises(UnknownNameError, match='Did you mean "admittance"'):
        prepare(["S5-hand"], Choices(enforcement="admitance"))
