"""What a film shows of a hands-on run: the plant's joints, port and anatomy, and the forces."""

import numpy as np
import pytest

from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.run import run_hands_on
from scenarios.robots import robots
from scenarios.run import run
from scenarios.scene_file import load_any, load_scene
from scenarios.view.shown import ALLOWED, FORBIDDEN, shown


@pytest.fixture(scope="module")
def trace():
    scene = load_any("hands-on-tip", "neuro8").with_changes(duration=0.2)
    return run_hands_on(scene, enforcement="vfi")


def test_hands_on_run_is_shown_with_port_and_anatomy(trace):
    scene, robot = load_any("hands-on-tip", "neuro8"), robots["neuro8"].build()
    found = shown(trace, robot, None, ())
    np.testing.assert_array_equal(found.q, trace["plant_q"])
    assert found.frames == (found.tool_end,) == ("shaft",) and found.method == "vfi" and len(found.constraints) == 0
    assert tuple(found.port.centre) == scene.port
    assert {c.name: c.rgba for c in found.clouds} == {"organ": ALLOWED, "vessels": FORBIDDEN}
    parts = build_parts(scene.anatomy, np.array(scene.port))
    for cloud in found.clouds:
        np.testing.assert_array_equal(cloud.points, parts[cloud.name].cloud.world_points)


def test_text_says_distance_and_forces(trace):
    rows = shown(trace, robots["neuro8"].build(), None, ()).rows
    k = len(trace.records) - 1
    named = dict(rows(k))
    assert set(named) == {"clearance", "hand", "repulsion"}
    assert named["hand"] == f"{np.linalg.norm(trace['hand_wrench'][k, :3]):.1f} N"
    nearest = int(np.argmin(trace["clearance"]))
    assert dict(rows(nearest))["clearance"].startswith((f"{1e3 * trace['clearance'][nearest]:.2f}", "over"))


def test_run_along_a_trajectory_is_shown_with_its_margins():
    scene = load_scene("S1").with_changes(duration=0.08)
    trace = run(scene)
    found = shown(trace, scene.build_robot(), None, ())
    assert found.constraints == scene.constraints
    assert found.tool_end is None and found.port is None and len(found.clouds) == 0
    rows = dict(found.rows(0))
    assert list(rows) == ["C1", "C2", "C3", "C4"] and rows["C1"] == "8.00 mm (watched)"
