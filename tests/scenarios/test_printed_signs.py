"""The paper prints all four distance errors with the wrong sign; a program built from them must not pass for S5.

With the printed signs every constraint is turned around: C1 and C4 become keep-inside, C2 and C3 keep-outside.
"""

from dataclasses import replace

import numpy as np

from primitives.constraint import ConstraintSet
from scenarios.analysis.metrics import summary
from scenarios.run import run
from scenarios.scene_file import load_scene

TURNED = {"outside": "inside", "inside": "outside"}


def printed(scene):
    """The scene with the signs that the paper prints."""
    return scene.with_changes(
        constraints=ConstraintSet(replace(c, keep=TURNED[c.keep]) for c in scene.constraints),
    )


def right_margins(trace, turned):
    """Smallest margins in the right sense: those that were turned around are turned back."""
    names = list(trace.header["constraints"])
    return {n: float((-trace.margin(n) if turned else trace.margin(n)).min()) for n in names}


def passes(trace, *, turned):
    """What S5 has to show: nothing violated, no infeasible cycle, and a tool that follows its reference."""
    result = summary(trace)
    kept = all(margin >= -1e-5 for margin in right_margins(trace, turned).values())
    feasible = result["infeasible_cycles"] == 0 and result["stopped_cycles"] == 0
    return kept and feasible and result["task_error"]["max"] < 4.1e-3


def test_right_signs_pass():
    assert passes(run(load_scene("S5"), period=0.008), turned=False)


def test_printed_signs_fail_with_and_without_guard_and_in_the_lp():
    scene = printed(load_scene("S5"))
    for options in ({"guard": "act"}, {"guard": "off"}, {"guard": "off", "solver": "lp"}):
        assert not passes(run(scene, period=0.008, **options), turned=True), options


def test_each_single_printed_sign_fails():
    scene = load_scene("S5")
    for name in scene.constraints.names:
        mutant = scene.with_changes(
            constraints=ConstraintSet(
                replace(c, keep=TURNED[c.keep]) if c.name == name else c for c in scene.constraints
            )
        )
        trace = run(mutant, period=0.008)
        margin = trace.margin(name)
        kept = all(trace.margin(n).min() >= -1e-5 for n in scene.constraints.names if n != name) and (
            (-margin).min() >= -1e-5
        )
        result = summary(trace)
        tracks = result["task_error"]["max"] < 4.1e-3
        assert not (kept and tracks and result["infeasible_cycles"] == 0 and result["stopped_cycles"] == 0), name


def test_a_frozen_robot_does_not_pass_either():
    """Margins alone would let a robot pass that never moves; tracking must be asked for too."""
    trace = run(load_scene("S5"), period=0.008)
    frozen = np.linalg.norm(trace["reference"] - trace["reference"][0], axis=1).max()
    assert frozen > 4.1e-3
