"""A first scene for an arm that is not in the project."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from primitives import DHRow, Robot
from primitives.errors import InputError
from scenarios.check import check_any
from scenarios.check.finding import Severity
from scenarios.cli import app
from scenarios.robots import urdf_path
from scenarios.run import run
from scenarios.scene_file import load_any
from scenarios.starter.motion import CONDITION, TURN, condition, first_motion

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
ARMS = {"six_axis": (EXAMPLES / "six_axis.urdf", "tool_tip"), "lwr4plus": (urdf_path("lwr4plus"), "tip")}


@pytest.fixture(params=ARMS)
def robot(request):
    path, tip = ARMS[request.param]
    return Robot.from_urdf(path, tip=tip)


def test_the_motion_goes_in_along_the_shaft_beyond_the_plane_and_turns_about_the_port(robot):
    m = first_motion(robot)
    kinematics = robot.kinematics(m.start)
    np.testing.assert_allclose(m.tip, kinematics.translation(robot.tip))
    axis = kinematics.rotation(robot.tip)[:, 2]
    np.testing.assert_allclose(np.cross(m.tip - m.port, axis), 0.0, atol=1e-12)
    assert (m.tip - m.port) @ axis > 0.0
    start, inside, aside, back = m.positions
    height = lambda p: (p - m.plane) @ -m.axis  # noqa: E731
    assert height(start) > 0.0 > height(inside)
    np.testing.assert_allclose(np.cross(inside - start, axis), 0.0, atol=1e-6)
    assert np.linalg.norm(aside - m.port) == pytest.approx(np.linalg.norm(start - m.port), abs=1e-6)
    turned = Rotation.from_rotvec(m.rotations[2]).apply(axis)
    np.testing.assert_allclose(np.cross(aside - m.port, turned), 0.0, atol=1e-6)
    assert np.linalg.norm(m.rotations[2]) == pytest.approx(TURN, abs=1e-6)
    np.testing.assert_allclose(back, start, atol=1e-9)


def test_the_start_is_within_the_limits_and_away_from_singularities(robot):
    m = first_motion(robot)
    assert np.all(robot.limits.lower < m.start) and np.all(m.start < robot.limits.upper)
    jacobian = robot.kinematics(m.start).jacobian(robot.tip).copy()
    jacobian[:3] /= np.linalg.norm(m.tip)
    assert np.linalg.cond(jacobian) == pytest.approx(m.condition)
    assert m.condition <= CONDITION
    np.testing.assert_array_equal(first_motion(robot).start, m.start)


def test_a_start_that_is_given_is_taken_or_refused_for_what_is_wrong_with_it(robot):
    good = first_motion(robot).start
    np.testing.assert_array_equal(first_motion(robot, good + 0.001).start, good + 0.001)
    assert condition(robot, np.zeros(robot.n)) > CONDITION
    for start, words in (
        (np.zeros(robot.n), "singularity"),
        (np.full(robot.n, 9.0), "outside the limits of joint1"),
        (good[1:], "expected shape"),
    ):
        with pytest.raises(InputError, match=words):
            first_motion(robot, start)


def test_arms_of_few_joints_get_a_start_too_unless_two_joints_do_the_same():
    planar = Robot.from_dh([DHRow("revolute", 0.0, 0.3, 0.0, 0.0, -1.0, 1.0, 1.0)] * 3)
    assert first_motion(planar).condition <= CONDITION
    slides = Robot.from_dh([DHRow("prismatic", 0.0, 0.3, 0.0, 0.0, -1.0, 1.0, 1.0)] * 2)
    with pytest.raises(InputError, match="does every joint move the tip"):
        first_motion(slides)


def init(*arguments):
    return CliRunner().invoke(app, ["init", *map(str, arguments)])


@pytest.mark.parametrize("kind", [(), ("--hands-on",)])
@pytest.mark.parametrize("arm", ARMS)
def test_a_scene_for_an_arm_passes_the_check_and_runs_at_once(tmp_path, arm, kind):
    path, tip = ARMS[arm]
    out = tmp_path / "first.yaml"
    done = init(path, "--tip", tip, "-o", out, *kind)
    assert done.exit_code == 0, done.output
    assert "0 errors, 0 warnings" in done.stdout
    scene = load_any(out)
    assert scene.constraints.names == (("plane",) if kind else ("port", "plane"))
    report = check_any(scene)
    assert report.ok and not [f for f in report.findings if f.severity == Severity.WARNING]
    ran = CliRunner().invoke(app, ["run", str(out), "--json", *(["--enforcement", "vfi"] if kind else [])])
    assert ran.exit_code == 0, ran.output
    (result,) = json.loads(ran.stdout)
    if kind:
        assert result["port_error_m"]["max"] < 1e-4
    else:
        assert result["violated"] == [] and result["min_margin_m"]["plane"] < 5e-3


def test_the_scene_without_its_plane_enforced_would_go_beyond_it(tmp_path):
    """So the plane acts in the run above, and not the reference's own shape."""
    path, tip = ARMS["six_axis"]
    out = tmp_path / "first.yaml"
    assert init(path, "--tip", tip, "-o", out).exit_code == 0
    scene = load_any(out)
    free = run(scene.with_changes(constraints=scene.constraints.enforcing([])), guard="off")
    assert free["margin"][:, 1].min() < -5e-3


def test_what_init_refuses(tmp_path):
    path, _ = ARMS["six_axis"]
    taken = tmp_path / "taken.yaml"
    taken.write_text("mine")
    few = tmp_path / "few.urdf"
    few.write_text(
        '<robot name="few"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
        '<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    for arguments, words in (
        ((path, "-o", taken), "is there already"),
        ((path, "-o", tmp_path / "scene.txt"), 'ends in ".yaml"'),
        ((path, "-o", tmp_path / "new.yaml", "--tip", "tool_tap"), 'Did you mean "tool_tip"?'),
        ((path, "-o", tmp_path / "new.yaml", "--start", "0,0,x"), "expected numbers with commas"),
        ((path, "-o", tmp_path / "new.yaml", "--start", "0,0,0,0,0,0"), "singularity"),
        ((few, "-o", tmp_path / "new.yaml", "--hands-on"), "needs 6 joints, it has 1"),
        ((tmp_path / "none.urdf", "-o", tmp_path / "new.yaml"), "none.urdf"),
    ):
        done = init(*arguments)
        assert done.exit_code == 2 and words in done.stderr and "Traceback" not in done.output, (words, done.output)
    assert taken.read_text() == "mine" and not (tmp_path / "new.yaml").exists()
