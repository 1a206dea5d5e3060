"""A first scene for an arm that is not in the project."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from primitives import DHRow, Robot
from primitives.errors import InputError
from scenarios.robots import urdf_path
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
