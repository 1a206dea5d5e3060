"""docs/metrics.md: every key of both summaries is defined there, with a unit, and nothing that is none."""

import re
from pathlib import Path

import numpy as np
import pytest

from scenarios.analysis import hands_on_metrics, metrics
from scenarios.analysis.kept import kept_summary
from scenarios.analysis.measures import OF_HANDS_ON, measures
from scenarios.anatomy.parts import build_parts
from scenarios.by_hand import metrics as by_hand
from scenarios.by_hand.run import run_by_hand
from scenarios.hands_on.run import run_hands_on
from scenarios.run import run
from scenarios.scene_file import load_any, load_scene

PAGE = Path(__file__).parents[2] / "docs" / "metrics.md"
MARGINS = {f"min_margin_{where}{unit}" for where in ("", "between_") for unit in ("m", "rad")}
OPEN = {"contact_force_N", "ports_J", "limited_cycles", "versions", *MARGINS}
"""Whose inner keys are names of other things."""


def documented(*where):
    """The keys of the page's table for some kinds of scene; ".rms" after `a.max` is `a.rms`."""
    out = set()
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) != 4 or {*cells[3].split(", ")}.isdisjoint({*where, "all"}):
            continue
        base = ""
        for name in re.findall(r"`([^`]+)`", cells[0]):
            base = base if name.startswith(".") else name.split(".")[0]
            out.add(base + name if name.startswith(".") else name)
    return {name.split(".")[0] if name.split(".")[0] in OPEN else name for name in out}


def keys(summary):
    out = set()
    for name, value in summary.items():
        nested = isinstance(value, dict) and name not in OPEN
        out |= {f"{name}.{inner}" for inner in value} if nested else {name}
    return out


@pytest.fixture(scope="module")
def led():
    scene = load_any("bowl-tip").with_changes(duration=0.2)
    parts = build_parts(scene.anatomy, np.array(scene.port))
    return hands_on_metrics.summary(run_hands_on(scene, parts=parts), scene, parts)


def test_of_scenes_led_by_a_hand(led):
    assert keys(led) == documented("hand")


def test_of_scenes_that_follow_a_trajectory():
    scene = load_scene("S5").with_changes(duration=0.2)
    trace = run(scene, period=0.008)
    found = metrics.summary(trace) | kept_summary(trace, scene, {})
    assert keys(found) == documented("trajectory")


def test_of_scenes_that_follow_one_by_hand():
    scene = load_scene("S5-hand").with_changes(duration=0.2)
    trace = run_by_hand(scene)
    found = by_hand.summary(trace) | kept_summary(trace, scene, {})
    assert keys(found) == documented("trajectory", "by hand")
    assert all(measure.of(found) is not None for measure in measures([found]))


def test_what_a_comparison_shows_is_there_in_every_run(led):
    for measure in OF_HANDS_ON:
        value = measure.of(led)
        assert value is None or np.isfinite(value)
        assert measure.key in keys(led)
