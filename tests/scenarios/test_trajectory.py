"""References made of waypoints: where they pass, how fast, and against Pinocchio's screw motion."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from primitives import dual_quaternion as dq
from primitives.errors import InputError
from scenarios.neurosurgery import REFERENCE
from scenarios.scene_file import load_scene
from scenarios.trajectory import PoseTrajectory, Waypoint

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def se3(pose):
    return pin.SE3(dq.rotation_matrix(pose), dq.translation(pose))


def first_orientation():
    scene = load_scene("S1")
    return scene.build_robot().kinematics(np.array(scene.start)).pose("moving/tip")[:4]


def test_rotation_vectors_turn_in_the_world_on_the_left_of_the_first_orientation():
    first = first_orientation()
    R0 = dq.rotation_matrix(np.r_[first, np.zeros(4)])
    for waypoint, pose in zip(REFERENCE.waypoints, REFERENCE.poses(first), strict=True):
        expected = pin.exp3(np.array(waypoint.rotation)) @ R0
        assert np.abs(dq.rotation_matrix(pose) - expected).max() < 1e-14
        assert np.abs(dq.translation(pose) - waypoint.position).max() < 1e-16


def test_s1_starts_at_its_first_waypoint():
    scene = load_scene("S1")
    tip = scene.build_robot().kinematics(np.array(scene.start)).pose("moving/tip")
    first = scene.reference.poses(tip[:4])[0]
    assert np.abs(dq.translation(tip) - dq.translation(first)).max() < 1e-6
    assert np.abs(dq.nearest_sign(first, tip) - tip).max() < 1e-6


@pytest.mark.parametrize("period", [0.001, 0.005, 0.008])
def test_waypoints_are_met_on_time_and_the_last_one_is_held(period):
    first, cycles = first_orientation(), round(15.0 / period)
    poses, x = REFERENCE.poses(first), REFERENCE.sample(first, period, cycles)
    assert x.shape == (cycles, 8)
    for i, pose in enumerate(poses):
        at = x[round(4.0 * i / period)]
        assert np.abs(dq.nearest_sign(at, pose) - pose).max() < 1e-12
    held = x[round(12.0 / period) :]
    assert np.abs(held - held[0]).max() < 1e-12
    assert np.abs(np.einsum("ki,ki->k", x[:, :4], x[:, :4]) - 1.0).max() < 1e-12
    assert np.abs(np.einsum("ki,ki->k", x[:, :4], x[:, 4:])).max() < 1e-12


ANGLE = st.floats(-3.0, 3.0)
PLACE = st.floats(-1.0, 1.0)
VECTOR = st.tuples(PLACE, PLACE, PLACE)
WAYPOINTS = st.builds(Waypoint, VECTOR, st.tuples(ANGLE, ANGLE, ANGLE))


@given(WAYPOINTS, WAYPOINTS, st.floats(0.1, 10.0))
def test_a_segment_is_pinocchios_screw_motion_linear_in_time(a, b, segment):
    trajectory, n = PoseTrajectory((a, b), segment), 7
    start, end = (se3(p) for p in trajectory.poses(UPRIGHT))
    twist = pin.log6(start.actInv(end))
    if np.linalg.norm(twist.angular) > np.pi - 1e-3:
        return  # both ways round are equally short
    for k, x in enumerate(trajectory.sample(UPRIGHT, segment / n, n + 1)):
        expected = start * pin.exp6(k / n * twist)
        assert np.abs(se3(x).homogeneous - expected.homogeneous).max() < 1e-9


def test_the_reference_takes_the_short_way():
    trajectory = PoseTrajectory((Waypoint((0, 0, 0), (0, 0, 3.0)), Waypoint((0, 0, 0), (0, 0, -3.0))), 1.0)
    turned = [pin.log3(dq.rotation_matrix(x)) for x in trajectory.sample(UPRIGHT, 0.1, 11)]
    assert min(abs(r[2]) for r in turned) > 2.9


def test_one_waypoint_is_held():
    x = PoseTrajectory((Waypoint((1, 2, 3)),), 1.0).sample(UPRIGHT, 0.5, 5)
    assert np.array_equal(x, np.tile(x[0], (5, 1)))
    assert dq.translation(x[0]).tolist() == [1, 2, 3]


def test_the_same_sample_again_to_the_bit():
    first = first_orientation()
    assert REFERENCE.sample(first, 0.008, 500).tobytes() == REFERENCE.sample(first, 0.008, 500).tobytes()


def test_equal_values_are_equal():
    assert Waypoint(np.array([1, 2, 3]), [0, 0, 0]) == Waypoint((1.0, 2.0, 3.0))
    assert PoseTrajectory([Waypoint((1, 2, 3))], 1) == PoseTrajectory((Waypoint((1, 2, 3)),), 1.0)
    assert hash(REFERENCE) == hash(PoseTrajectory(list(REFERENCE.waypoints), 4))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PoseTrajectory((), 1.0), "at least one waypoint, got none"),
        (lambda: PoseTrajectory(((0, 0, 0),), 1.0), r"expected a Waypoint, got \(0, 0, 0\)"),
        (lambda: PoseTrajectory((Waypoint((0, 0, 0)),), 0.0), "segment of PoseTrajectory, seconds: .* > 0, got 0"),
        (lambda: PoseTrajectory((Waypoint((0, 0, 0)),), float("nan")), "finite"),
        (lambda: Waypoint((0, 0)), r"position of Waypoint: expected shape \(3\), got \(2,\)"),
        (lambda: Waypoint((0, 0, float("inf"))), "finite"),
        (lambda: Waypoint((0, 0, 0), (0, float("nan"), 0)), "rotation of Waypoint: expected finite"),
        (lambda: Waypoint("abc"), "expected numbers"),
        (lambda: REFERENCE.poses([1, 0, 0]), "first orientation: expected shape"),
        (lambda: REFERENCE.poses([2, 0, 0, 0]), "first orientation"),
        (lambda: REFERENCE.sample(UPRIGHT, 0.0, 10), "period"),
    ],
)
def test_bad_values_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
