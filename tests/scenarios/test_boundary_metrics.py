"""Force of the boundary, tangential freedom, jerk and penetration, each against another computation of the same."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from primitives.elements import Segment
from primitives.point_cloud import PointCloud
from scenarios.analysis.boundary_force import boundary_force, felt_clearance
from scenarios.analysis.free_motion import free_trace
from scenarios.analysis.hands_on_metrics import summary
from scenarios.analysis.jerk import jerk
from scenarios.analysis.penetration import penetration_depth, time_inside
from scenarios.analysis.tangential import along_boundary, contacts, tangential_freedom
from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.pull import Pull, Waypoint
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any

arms = pytest.mark.parametrize("robot", ["lwr4plus", "neuro8"])


@cache
def done(robot, enforcement, duration=6.0):
    """A run along the wall of a bowl."""
    scene = load_any("bowl-tip", robot).with_changes(duration=duration)
    parts = build_parts(scene.anatomy, np.array(scene.port))
    return run_hands_on(scene, enforcement=enforcement, parts=parts), scene, parts


# The force of the boundary


@arms
def test_of_potentials_alone_the_force_of_the_boundary_is_their_repulsion(robot):
    """The repulsion of each cycle is in the trace; what is left of the motion must be it."""
    trace, scene, _ = done(robot, "admittance")
    free = free_trace(trace, scene)
    found = boundary_force(trace, scene)[1:]
    push, away = trace["free_repulsion"][:-1], free.ends - np.array(scene.port)
    expected = push[:, :1] * free.axes + np.cross(push[:, 1:4], away) / np.sum(away**2, axis=1)[:, None]
    told = trace["limited"][1:] == 0.0
    np.testing.assert_allclose(found[told], expected[told], atol=1e-9)
    assert told.mean() > 0.9
    assert np.linalg.norm(expected, axis=1).max() > 5.0


@arms
def test_without_a_boundary_there_is_no_force_of_one(robot):
    trace, scene, _ = done(robot, "none")
    assert np.linalg.norm(boundary_force(trace, scene), axis=1).max() < 1e-9
    assert felt_clearance(np.linalg.norm(boundary_force(trace, scene), axis=1), np.ones(len(trace.t))) is None


@arms
def test_rows_are_felt_at_the_boundary_and_potentials_before_it(robot):
    felt = {}
    for enforcement in ("admittance", "vfi"):
        trace, scene, parts = done(robot, enforcement)
        found = summary(trace, scene, parts)
        felt[enforcement] = found["felt_clearance_m"]
        assert found["contact_fraction"] > 0.3, "contact is told for rows as well"
        held = found["max_boundary_force_N"]
        assert held > 0.5 * found["max_force_N"], "a pressed boundary presses back"
    assert 0.0 < felt["vfi"] < 0.4 * felt["admittance"] < 0.4 * scene.parameters.d_0


def test_felt_is_the_clearance_before_the_first_force_above_the_threshold():
    force = np.array([9.0, 0.0, 0.9, 1.1, 5.0])
    assert felt_clearance(force, np.array([5.0, 4.0, 3.0, 2.0, 1.0])) == 3.0
    assert felt_clearance(force, np.full(5, np.inf)) is None


# Tangential freedom


def test_what_a_wall_leaves_of_a_velocity_keeps_the_distance_and_loses_least_in_the_metric():
    rng = np.random.default_rng(5)
    v, a, damping = rng.normal(size=(50, 4)), rng.normal(size=(50, 4)), rng.uniform(0.5, 3.0, (50, 4))
    left = along_boundary(v, a, damping)
    np.testing.assert_allclose(np.sum(a * left, axis=1), 0.0, atol=1e-12)
    np.testing.assert_allclose(along_boundary(left, a, damping), left, atol=1e-12)
    for k in range(
        5
    ):  # the nearest of all velocities with a^T v = 0, by the normal equations of the constrained problem
        kkt = np.block([[np.diag(damping[k]), a[k][:, None]], [a[k][None], np.zeros((1, 1))]])
        expected = np.linalg.solve(kkt, [*(damping[k] * v[k]), 0.0])[:4]
        np.testing.assert_allclose(left[k], expected, atol=1e-12)


@arms
def test_contacts_are_the_nearest_of_all_points(robot):
    _, scene, parts = done(robot, "admittance")
    length = scene.parameters.shaft_length
    shaft = Segment.between([0.0, 0.0, 0.0], [0.0, 0.0, -length], frame=scene.shaft)
    (region,) = scene.regions
    scene = scene.with_changes(constraints=[replace(region, first=shaft)])
    trace, points = done(robot, "none")[0], parts["bowl"].cloud.world_points
    q = trace["plant_q"][:: len(trace.t) // 30]
    built = scene.build_robot()
    found = contacts(scene, built, parts, q)
    safe = parts["bowl"].cloud.radius + region.safe_distance
    assert found.near.any() and not found.near.all()
    for k in range(len(q)):
        end, axis = built.kinematics(q[k]).translation(scene.shaft), built.kinematics(q[k]).rotation(scene.shaft)[:, 2]
        place = np.clip((end - points) @ axis, 0.0, length)
        away = end - place[:, None] * axis - points
        distance = np.linalg.norm(away, axis=1)
        i = np.argmin(distance)
        assert found.near[k] == (distance[i] - safe <= scene.parameters.d_0)
        if found.near[k]:
            np.testing.assert_allclose(found.point[k], end - place[i] * axis, atol=1e-9)
            np.testing.assert_allclose(found.normal[k], away[i] / distance[i], atol=1e-9)


def dragged(damping_near):
    """A hand drags the tip along one wide sphere, with rows, or a potential and damping that grows near it."""
    scene = load_any("bowl-tip", "lwr4plus")
    start = scene.first_end(scene.build_robot())
    ball = PointCloud(np.array([start - [0.0, 0.0, 0.08]]), 0.075)
    hand = Pull((Waypoint(1.0, (0.0, 0.0, -0.17)), Waypoint(5.0, (0.03, 0.0, -0.17))), most=8.0)
    p = scene.parameters
    # As much damping on top, wherever there is repulsion at all, as there is far off at rest.
    p = replace(p, G=tuple(c + q for c, q in zip(p.D_c, p.Q, strict=True)), C=(1e9,) * 4)
    scene = scene.with_changes(hand=hand, parameters=p, duration=4.5)
    parts = build_parts(scene.anatomy, np.array(scene.port))
    parts = {"bowl": parts["bowl"]._replace(cloud=ball)}
    trace = run_hands_on(scene, parts=parts, enforcement="admittance" if damping_near else "vfi")
    return tangential_freedom(trace, scene, parts)


def test_a_smooth_boundary_takes_nothing_with_rows_and_much_with_damping():
    smooth, damped = dragged(False), dragged(True)
    assert smooth == pytest.approx(1.0, abs=0.1)
    assert 0.2 < damped < 0.55, "at most half the speed for the same force"


@arms
def test_a_tool_that_nothing_holds_is_free(robot):
    trace, scene, parts = done(robot, "none")
    assert tangential_freedom(trace, scene, parts) == pytest.approx(1.0, abs=0.05)


def test_a_tool_that_is_never_near_has_no_freedom_to_tell():
    trace, scene, parts = done("lwr4plus", "none")
    assert tangential_freedom(trace, scene.with_changes(constraints=()), parts) is None


# Jerk and penetration


@pytest.mark.parametrize("period", [0.001, 0.004, 0.02])
def test_the_jerk_of_a_cubic_is_exact_and_that_of_a_sine_nearly(period):
    t = np.arange(0.0, 2.0, period)[:, None]
    cubic = np.hstack([t**3, -2.0 * t**3 + t, t**2])
    np.testing.assert_allclose(jerk(cubic, period), 6.0 * np.sqrt(5.0), rtol=1e-6)
    omega = 2.0 * np.pi
    sine = np.hstack([np.sin(omega * t), np.zeros_like(t), np.zeros_like(t)])
    assert jerk(sine, period).max() == pytest.approx(omega**3, rel=0.1)


def test_short_motion_has_no_jerk_to_tell():
    assert len(jerk(np.zeros((6, 3)), 0.004)) == 0


def test_penetration():
    assert (penetration_depth(0.001), penetration_depth(None), penetration_depth(-0.002)) == (0.0, 0.0, 0.002)
    assert time_inside(np.array([0.1, -0.1, -1e-9, 0.0, np.inf]), 0.004) == pytest.approx(0.008)
