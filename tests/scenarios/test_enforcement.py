"""One scene, several enforcements: what the plain admittance lets through, and what the projected one does not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from primitives.errors import UnknownNameError
from scenarios.analysis.hands_on_metrics import summary
from scenarios.anatomy.parts import build_parts
from scenarios.enforcement import METHODS, chosen
from scenarios.hands_on.enforcement import ROUNDING, enforce
from scenarios.hands_on.push import Push
from scenarios.hands_on.run import run_hands_on
from scenarios.joined import SHARE
from scenarios.scene_file import load_any

STEPS = (10.0, 20.0, 30.0)


@cache
def bowl(name: str, gap: float):
    """A bowl of the LWR4+ whose bottom is lower by a gap, and its parts."""
    scene = load_any(name)
    scene = scene.with_changes(anatomy=replace(scene.anatomy, at=(0.0, 0.0, -0.126 - gap)), duration=1.5)
    return scene, build_parts(scene.anatomy, np.array(scene.port))


def pushed(name: str, gap: float, newtons: float, enforcement: str, **options: str):
    """Figures of a run in which the hand suddenly pushes down and does not let go."""
    scene, parts = bowl(name, gap)
    scene = scene.with_changes(hand=Push(times=(0.05,), wrenches=((0.0, 0.0, -newtons, 0.0, 0.0, 0.0),)))
    return summary(run_hands_on(scene, parts=parts, enforcement=enforcement, **options), scene, parts)


@pytest.mark.parametrize("newtons", STEPS)
@pytest.mark.parametrize("gap", [0.0, 0.006])
@pytest.mark.parametrize("name", ["bowl-tip", "bowl-tool"])
def test_projected_runs_never_enter_and_are_passive(name, gap, newtons):
    by_rows, by_both = (pushed(name, gap, newtons, e) for e in ("vfi", "both"))
    for found in (by_rows, by_both):
        assert found["passivity_excess_J"] <= 1e-9 and found["passivity_excess_chord_J"] <= 1e-4
        assert found["stopped_cycles"] == 0
    for where in ("at_samples", "between_samples"):
        assert by_rows["clearance_m"][where] >= ROUNDING - 1e-7
        assert by_rows["clearance_m"][where] < 1e-5, "the hand pushes the tool onto the boundary"
        assert by_both["clearance_m"][where] >= SHARE * 0.0115


def test_the_plain_admittance_enters_where_they_do_not():
    found = {n: pushed("bowl-tip", 0.006, n, "admittance")["clearance_m"]["between_samples"] for n in STEPS}
    assert found[10.0] > 0.0 > found[30.0]
    assert pushed("bowl-tool", 0.006, 30.0, "admittance")["clearance_m"]["between_samples"] < 0.0


def test_nobody_keeps_it_out_in_none():
    found = pushed("bowl-tip", 0.0, 10.0, "none")
    assert found["clearance_m"]["between_samples"] < 0.0 and found["contact_fraction"] == 0.0


@pytest.mark.parametrize("robot", ["lwr4plus", "neuro8"])
def test_led_slowly_both_is_the_admittance(robot):
    """The potential stops the tool before a row acts at all; without it only the boundary does."""
    scene = load_any("bowl-tip", robot).with_changes(duration=6.0)
    parts = build_parts(scene.anatomy, np.array(scene.port))
    found = {e: summary(run_hands_on(scene, parts=parts, enforcement=e), scene, parts) for e in METHODS[1:]}
    alone, rows, both = (found[e]["clearance_m"]["at_samples"] for e in ("admittance", "vfi", "both"))
    assert abs(found["both"]["constraint_work_J"]) < 1e-12, "no row acts"
    assert found["vfi"]["constraint_work_J"] < -1e-6
    assert min(alone, both) > 10.0 * rows > 0.0
    assert max(f["passivity_excess_J"] for f in found.values()) <= 1e-9
    assert max(f["guided_reference_port_error_m"] for f in found.values()) <= 5e-6


def test_unknown_enforcement_names_the_known_ones():
    with pytest.raises(UnknownNameError, match="admittance, both, none, vfi"):
        chosen(bowl("bowl-tip", 0.0)[0], enforcement="potential")


def test_where_the_controller_gives_no_command_it_holds_and_says_why():
    scene, parts = bowl("bowl-tip", 0.0)
    admittance, method = enforce(chosen(scene, enforcement="vfi"), scene.build_robot(), parts)
    still, method._still = method._still, np.full(7, np.nan)
    motion = method.step(0.004, np.array([0.0, 0.0, -5.0, 0.0, 0.0, 0.0]))
    assert motion.state.name == "HOLD" and "no velocity keeps all" in motion.reason
    assert not motion.qdot.any() and not motion.v.any()
    record = admittance.ring[0]
    assert record[admittance.columns["state"]][0] == motion.state
    method._still = still
    assert method.step(0.008, np.zeros(6)).state.name == "RUN", "and goes on when there is one again"


@pytest.mark.parametrize("guard", ["off", "watch", "act"])
def test_guard_counts_or_acts_on_the_plain_admittance(guard):
    """Pushed with 30 N it would enter: off knows nothing of it, watch counts, act keeps the tool outside."""
    found = pushed("bowl-tip", 0.006, 30.0, "admittance", guard=guard)
    assert (found["guard_interventions"] > 0) == (guard != "off")
    assert (found["clearance_m"]["between_samples"] > 0.0) == (guard == "act")


def test_guard_leaves_a_slow_hand_alone():
    found = {g: pushed("bowl-tip", 0.0, 5.0, "admittance", guard=g) for g in ("watch", "act")}
    for figures in found.values():
        assert figures["guard_interventions"] == 0
    assert found["watch"]["clearance_m"] == found["act"]["clearance_m"]


def test_rows_verified_and_not():
    """The guard of the projection: what it finds is what the period's curvature costs, and the rows hold without it."""
    found = {g: pushed("bowl-tool", 0.0, 20.0, "vfi", guard=g) for g in ("off", "watch", "act")}
    assert found["off"]["guard_interventions"] == 0
    assert abs(found["off"]["clearance_m"]["at_samples"] - found["act"]["clearance_m"]["at_samples"]) < 1e-5
    assert found["off"]["clearance_m"] == found["watch"]["clearance_m"]


def test_joint_metric_injects_energy_on_a_guided_run():
    """The difference that readings.md asks to see: at least 0.01 J in the bowl, where the free metric has none."""
    scene = load_any("bowl-tool").with_changes(duration=12.0)
    parts = build_parts(scene.anatomy, np.array(scene.port))
    runs = {m: run_hands_on(scene, parts=parts, enforcement="vfi", metric=m) for m in ("free", "joints")}
    excess = {m: summary(trace, scene, parts)["passivity_excess_J"] for m, trace in runs.items()}
    assert excess["free"] <= 1e-9 and excess["joints"] >= 1e-2
