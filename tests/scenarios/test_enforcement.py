"""One scene, several enforcements: what the plain admittance lets through, and what the projected one does not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from primitives.errors import UnknownNameError
from scenarios.analysis.hands_on_metrics import summary
from scenarios.hands_on.enforcement import ENFORCEMENTS, ROUNDING, SHARE, enforce
from scenarios.hands_on.parts import build_parts
from scenarios.hands_on.push import Push
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any

STEPS = (10.0, 20.0, 30.0)


@cache
def bowl(name: str, gap: float):
    """A bowl of the LWR4+ whose bottom is lower by a gap, and its parts."""
    scene = load_any(name)
    scene = scene.with_changes(anatomy=replace(scene.anatomy, at=(0.0, 0.0, -0.126 - gap)), duration=1.5)
    return scene, build_parts(scene.anatomy, np.array(scene.port))


def pushed(name: str, gap: float, newtons: float, enforcement: str):
    """Figures of a run in which the hand suddenly pushes down and does not let go."""
    scene, parts = bowl(name, gap)
    scene = scene.with_changes(hand=Push(times=(0.05,), wrenches=((0.0, 0.0, -newtons, 0.0, 0.0, 0.0),)))
    return summary(run_hands_on(scene, parts=parts, enforcement=enforcement), scene, parts)


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
    found = {e: summary(run_hands_on(scene, parts=parts, enforcement=e), scene, parts) for e in ENFORCEMENTS[1:]}
    alone, rows, both = (found[e]["clearance_m"]["at_samples"] for e in ("admittance", "vfi", "both"))
    assert found["both"]["constraint_work_J"] == 0.0 > found["vfi"]["constraint_work_J"]
    assert min(alone, both) > 10.0 * rows > 0.0
    assert max(f["passivity_excess_J"] for f in found.values()) <= 1e-9
    assert max(f["guided_reference_port_error_m"] for f in found.values()) <= 5e-6


def test_unknown_enforcement_names_the_known_ones():
    scene, parts = bowl("bowl-tip", 0.0)
    with pytest.raises(UnknownNameError, match="admittance, both, none, vfi"):
        enforce("potential", scene, scene.build_robot(), parts)


def test_where_no_velocity_keeps_all_rows_it_holds_and_says_why():
    """Rows that contradict one another, as two surfaces that close in on the tool would give."""
    scene, parts = bowl("bowl-tip", 0.0)
    admittance, method = enforce("vfi", scene, scene.build_robot(), parts)
    solve = method._projection.solve

    def squeezed(v_ref, metric, rows, demand, *joints):
        along = np.zeros((2, len(v_ref)))
        along[:, 0] = 1.0, -1.0
        return solve(v_ref, metric, along, np.ones(2), *joints)

    method._projection.solve = squeezed
    motion = method.step(0.004, np.array([0.0, 0.0, -5.0, 0.0, 0.0, 0.0]))
    assert motion.state.name == "HOLD" and "no velocity keeps all" in motion.reason
    assert not motion.qdot.any() and not motion.v.any()
    record = admittance.ring[0]
    assert record[admittance.columns["state"]][0] == motion.state
    assert method.step(0.008, np.zeros(6)).state.name == "HOLD", "it goes on asking"
