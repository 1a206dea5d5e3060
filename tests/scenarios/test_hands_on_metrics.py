"""Figures of merit of hands-on runs, each against another computation of the same, on traces made for it."""

import json
from functools import cache
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from primitives.point_cloud import PointCloud
from scenarios.analysis import hands_on_metrics as metrics
from scenarios.analysis.hands_on_metrics import between, clearance, guided, port_offset, slipped, summary
from scenarios.analysis.tool_poses import shaft_lines
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any

RNG = np.random.default_rng(7)


@cache
def setting(name="hands-on-tool", robot="lwr4plus"):
    scene = load_any(name, robot)
    return scene, scene.build_robot(), build_parts(scene.anatomy, np.array(scene.port))


@cache
def short_run():
    scene, _, parts = setting()
    return run_hands_on(scene.with_changes(duration=0.2), parts=parts)


def with_values(trace, **values):
    """The trace with the values of some quantities replaced."""
    records = trace.records.copy()
    for name, value in values.items():
        records[:, trace.columns[name]] = np.reshape(value, (len(records), -1))
    return Trace(trace.header, trace.columns, records, trace.events)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def reaching(scene, robot, targets):
    """Joints (k, n) at which the shaft ends at these points (k, 3), by Newton steps from the first configuration."""
    out = np.tile(np.array(scene.start), (len(targets), 1))
    for q, target in zip(out, targets, strict=True):
        for _ in range(8):
            at = robot.kinematics(q)
            q += np.linalg.pinv(at.jacobian(scene.shaft)[:3]) @ (target - at.translation(scene.shaft))
    return out


def under_the_port(count, scene):
    """Points (k, 3) of the world, metres."""
    return np.array(scene.port) + RNG.normal(size=(count, 3)) * [0.05, 0.05, 0.01] - [0.0, 0.0, 0.2]


def shaft_at(robot, frame, q):
    """Ends (k, 3) and directions (k, 3) of the shaft at joints (k, n), by Pinocchio."""
    data, out = robot.model.createData(), []
    for row in q:
        pin.framesForwardKinematics(robot.model, data, row)
        pose = data.oMf[robot.model.getFrameId(frame)]
        out.append([pose.translation.copy(), pose.rotation[:, 2].copy()])
    return tuple(np.swapaxes(np.array(out), 0, 1))


# Where the shaft is


def test_the_shaft_is_where_pinocchio_says():
    scene, robot, _ = setting()
    q = RNG.uniform(robot.limits.lower, robot.limits.upper, (20, robot.n))
    trace = with_values(run_hands_on(scene.with_changes(duration=0.08), parts=setting()[2]), plant_q=q)
    ends, axes = shaft_lines(scene, robot, trace)
    data = robot.model.createData()
    for k in range(len(q)):
        pin.framesForwardKinematics(robot.model, data, q[k])
        pose = data.oMf[robot.model.getFrameId(scene.shaft)]
        np.testing.assert_allclose(ends[k], pose.translation, atol=1e-12)
        np.testing.assert_allclose(axes[k], pose.rotation[:, 2], atol=1e-12)


def test_port_offset_is_the_smallest_distance_along_the_line():
    port = np.array([0.1, -0.2, 0.3])
    ends, axes = port + RNG.normal(size=(50, 3)), unit(RNG.normal(size=(50, 3)))
    ends[0], axes[0] = port + 0.4 * axes[0], axes[0]
    found = port_offset(port, ends, axes)
    np.testing.assert_allclose(found, np.linalg.norm(np.cross(port - ends, axes), axis=1), atol=1e-12)
    assert found[0] < 1e-15
    along = np.linspace(-4.0, 4.0, 4001)[:, None]
    for k in range(5):
        assert found[k] == pytest.approx(np.linalg.norm(ends[k] + along * axes[k] - port, axis=1).min(), abs=2e-5)


# Clearance


@pytest.mark.parametrize(("name", "length"), [("hands-on-tip", 0.0), ("hands-on-tool", 0.43)])
def test_clearance_is_that_of_all_pairs_in_numpy(name, length):
    scene, robot, parts = setting(name)
    q = reaching(scene, robot, under_the_port(60, scene))
    ends, axes = shaft_at(robot, scene.shaft, q)
    cloud = parts["vessels"].cloud
    points = cloud.world_points
    place = np.clip(((points[None] - ends[:, None]) * -axes[:, None]).sum(axis=2), 0.0, length)
    nearest = ends[:, None] - place[..., None] * axes[:, None]
    distance = np.linalg.norm(points[None] - nearest, axis=2).min(axis=1)
    expected = distance - cloud.radius - scene.constraints["vessels"].safe_distance
    np.testing.assert_allclose(clearance(scene, robot, parts, q), expected, atol=1e-12)
    assert expected.min() < 0.0 < expected.max(), "some of the shafts enter, some do not"


@pytest.mark.parametrize("name", ["hands-on-tip", "hands-on-tool", "bowl-tip", "bowl-tool"])
@pytest.mark.parametrize("robot", ["lwr4plus", "neuro8"])
def test_clearance_never_promises_more_than_the_exact_shape(name, robot):
    """The spheres cover the surface: of a tool outside, they tell no more than its distance from the exact shape."""
    scene, arm, parts = setting(name, robot)
    near = parts[scene.regions[0].second.name].cloud.world_points
    wanted = near[RNG.integers(0, len(near), 300)] + RNG.normal(size=(300, 3)) * scene.parameters.d_0
    q = reaching(scene, arm, wanted)
    ends, axes = shaft_at(arm, scene.shaft, q)
    np.testing.assert_allclose(ends, wanted, atol=1e-6)
    found = np.full(len(ends), np.inf)
    for region in scene.regions:
        shape, cloud = parts[region.second.name].shape, parts[region.second.name].cloud
        if region.first.kind == "point":
            exact = shape.distance(ends)
        else:
            exact = shape.segment_distance(ends, ends - scene.parameters.shaft_length * axes)
        found = np.minimum(found, exact - region.safe_distance)
        assert cloud.radius < 0.006
    given = clearance(scene, arm, parts, q)
    outside = found > 0.0
    assert np.count_nonzero(outside & (found < scene.parameters.d_0)) > 10
    assert (given <= found + 1e-9)[outside].all()
    assert (given >= found - max(parts[r.second.name].cloud.radius for r in scene.regions) - 1e-4)[outside].all()


def test_without_regions_there_is_no_clearance_to_tell():
    scene, robot, parts = setting()
    free = scene.with_changes(constraints=scene.constraints.enforcing([]), duration=0.08)
    assert np.isposinf(clearance(free, robot, parts, reaching(scene, robot, under_the_port(3, scene)))).all()
    figures = summary(run_hands_on(free, parts=parts), free, parts)
    assert figures["clearance_m"] == {"at_samples": None, "between_samples": None}
    assert figures["contact_fraction"] == 0.0
    assert not figures["slipped"]
    json.loads(json.dumps(figures, allow_nan=False))


@pytest.mark.parametrize("name", ["hands-on-tip", "hands-on-tool"])
def test_between_samples_the_smallest_clearance_is_that_of_dense_samples(name):
    """Coarse steps over a region, of which some dip into it between two samples."""
    scene, robot, parts = setting(name)
    sphere = PointCloud(np.array([scene.first_end(robot) + np.array([0.0, 0.012, -0.02])]), 0.004)
    parts = {"vessels": parts["vessels"]._replace(cloud=sphere)}
    for seed in range(6):
        rng = np.random.default_rng(seed)
        q = np.array(scene.start) + np.cumsum(rng.normal(size=(40, robot.n)) * 0.03, axis=0) * [1, 1, 0.3, 1, 1, 1, 1]
        found = between(scene, robot, parts, q)
        shares = np.arange(1, 10)[:, None] / 10
        dense = np.vstack([a + shares * (b - a) for a, b in pairwise(q)])
        expected = clearance(scene, robot, parts, dense).reshape(-1, 9).min(axis=1)
        at = clearance(scene, robot, parts, q)
        looked = np.isfinite(found)
        np.testing.assert_allclose(found[looked], expected[looked], atol=1e-12)
        assert (expected[~looked] >= at.min()).all(), "what was left out holds nothing smaller"
        assert min(found.min(), at.min()) == pytest.approx(min(expected.min(), at.min()), abs=1e-12)


def test_a_dip_between_two_samples_is_seen():
    """Two samples on either side of a thin region; the way between goes through it."""
    scene, robot, parts = setting("hands-on-tip")
    q = np.array([scene.start, scene.start])
    q[0, 0] -= 0.05
    q[1, 0] += 0.05
    middle = scene.first_end(robot)
    parts = {"vessels": parts["vessels"]._replace(cloud=PointCloud(middle[None], 0.002))}
    assert clearance(scene, robot, parts, q).min() > 0.02
    assert between(scene, robot, parts, q).min() == pytest.approx(-0.002, abs=1e-6)


# Guided motion, slips, contact


def test_guided_is_slow_for_long():
    period, k = 0.01, 300
    ends, axes = np.zeros((k, 3)), np.tile([0.0, 0.0, 1.0], (k, 1))
    ends[:, 0] = np.cumsum(np.full(k, 0.05 * period))
    assert guided(ends, axes, period).all()
    fast = ends.copy()
    fast[100:, 0] += 0.02 * period
    found = guided(fast, axes, period)
    settling = round(metrics.SETTLING / period)
    assert np.flatnonzero(~found).tolist() == list(range(100, 100 + settling))
    turned = axes.copy()
    angle = np.where(np.arange(k) >= 200, 0.3 * period, 0.0)
    turned[:, 0], turned[:, 2] = np.sin(angle), np.cos(angle)
    assert np.flatnonzero(~guided(ends, turned, period)).tolist() == list(range(200, min(k, 200 + settling)))


@pytest.mark.parametrize(
    ("speed", "expected"),
    [(0.0, False), (0.01, False), (0.05, False), (0.07, True), (1.0, True)],
)
def test_a_slip_is_a_contact_that_ends_with_a_jump(speed, expected):
    """Beyond d_0 = 11.5 mm within 0.2 s is 57.5 mm/s."""
    t = np.arange(0.0, 2.0, 0.004)
    away = np.where(t > 1.0, 0.0115 + speed * (t - 1.0), 0.01)
    assert slipped(t <= 1.0, away, 0.0115, 0.004) is expected
    assert not slipped(np.ones(len(t), dtype=bool), away, 0.0115, 0.004)
    assert not slipped(np.zeros(len(t), dtype=bool), away, 0.0115, 0.004)


def test_a_contact_that_ends_with_the_run_is_no_slip():
    touching, away = np.ones(100, dtype=bool), np.zeros(100)
    touching[-1], away[-1] = False, 0.002
    assert not slipped(touching, away, 0.0115, 0.004)


# The summary


def test_the_summary_is_made_of_the_traces_columns():
    scene, robot, parts = setting()
    trace = short_run()
    k = len(trace.t)
    wrench = np.zeros((k, 6))
    wrench[7] = [3.0, 0.0, -4.0, 9.0, 9.0, 9.0]
    repulsion = np.zeros((k, 6))
    repulsion[10:15, 2], repulsion[20, 4] = 6.0, 1.0
    x_c = np.zeros((k, 2))
    x_c[3] = [3e-4, -4e-4]
    state, limited = np.zeros(k), np.zeros(k)
    state[5:8], state[8:10] = 1.0, [2.0, 3.0]
    limited[5], limited[6], limited[7] = 1.0, 3.0, 20.0
    ledger = {name: np.linspace(0.0, top, k) for name, top in (("hand", 2.0), ("dissipated", 1.5), ("excess", 0.25))}
    made = with_values(trace, hand_wrench=wrench, repulsion=repulsion, x_c=x_c, state=state, limited=limited, **ledger)
    found = summary(made, scene, parts)
    assert found["max_force_N"] == 5.0
    assert found["max_repulsion_N"] == 6.0
    assert found["contact_fraction"] == pytest.approx(6 / k)
    assert found["reference_port_error_m"]["max"] == pytest.approx(5e-4)
    assert found["reference_port_error_m"]["rms"] == pytest.approx(5e-4 / np.sqrt(k))
    assert (found["degraded_cycles"], found["stopped_cycles"]) == (3, 2)
    assert found["limited_cycles"] == {"velocity": 2, "position": 1, "singularity": 1, "port": 0, "substeps": 1}
    assert (found["hand_work_J"], found["dissipated_J"], found["passivity_excess_J"]) == (2.0, 1.5, 0.25)
    ends, axes = shaft_lines(scene, robot, trace)
    assert found["travel_m"] == pytest.approx(sum(np.linalg.norm(b - a) for a, b in pairwise(ends)))
    offset = np.linalg.norm(np.cross(np.array(scene.port) - ends, axes), axis=1)
    assert found["port_error_m"]["max"] == pytest.approx(offset.max(), abs=1e-15)
    assert found["port_error_m"]["rms"] == pytest.approx(np.sqrt(np.mean(offset**2)), abs=1e-15)
    assert found["cycles"] == k
    assert found["contact_force_N"] == {}


def test_contact_forces_are_named_after_what_is_touched():
    scene, _, parts = setting()
    trace = run_hands_on(scene.with_changes(duration=0.02), parts=parts, plant="mujoco")
    force = np.zeros((len(trace.t), 3))
    force[2] = [2.0, -3.0, 6.0]
    found = summary(
        with_values(trace, contact_organ=force, contact_port=0 * force, contact_vessels=0 * force), scene, parts
    )
    assert found["contact_force_N"] == {"port": 0.0, "organ": 7.0, "vessels": 0.0}
