"""Procedural anatomy: exact distances against dense sampling, clouds against the shapes, placement under the port."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from primitives import dual_quaternion as dq
from primitives.compiled import JIT_DISABLED
from primitives.errors import InputError
from primitives.files.mesh_file import read_surface
from primitives.surface import Surface
from scenarios.anatomy import (
    Anatomy,
    Bowl,
    Branch,
    Ellipsoid,
    Shape,
    Vessels,
    bowl_for,
    cortex,
    kidney,
    placed_under,
    under_port,
)

KIDNEY = Path(__file__).parents[2].parent / "shared" / "data" / "kidney"
PORT = np.array([-0.6053, -0.2203, 0.0])
POSE = dq.from_rotation_translation(
    np.array([0.5, -0.5, 0.5, 0.5]) @ np.diag([1.0, 1.0, 1.0, 1.0]), np.array([0.3, -0.2, 0.1])
)

SHAPES: dict[str, Shape] = {
    "ellipsoid": Ellipsoid(np.array([0.027, 0.055, 0.022]), pose=POSE),
    "prolate": Ellipsoid(np.array([0.02, 0.02, 0.05])),
    "oblate": Ellipsoid(np.array([0.05, 0.03, 0.05])),
    "flat": Ellipsoid(np.array([0.05, 0.001, 0.02])),
    "sphere": Ellipsoid(np.array([0.03, 0.03, 0.03])),
    "shallow bowl": Bowl(0.012, 0.3),
    "half a sphere": Bowl(0.03, 0.5 * np.pi, pose=POSE),
    "nearly a sphere": Bowl(0.03, 2.6),
    "kidney's vessels": kidney().vessels.placed(POSE),
    "cortex's vessels": cortex().vessels,
    "one capsule": Vessels(np.zeros((1, 3)), np.array([[0.0, 0.03, 0.0]]), np.array([0.004])),
    "one ball": Vessels(np.zeros((1, 3)), np.zeros((1, 3)), np.array([0.004])),
}
both = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


@cache
def size(shape: Shape) -> float:
    return float(np.ptp(shape.surface(0.003).bounds, axis=0).max())


def around(shape: Shape, count: int, seed: int) -> Any:
    """Points near, in and far from a shape; some in its planes and on its axes."""
    rng = np.random.default_rng(seed)
    local = rng.normal(size=(count, 3)) * 0.6 * size(shape)
    local[: count // 4] *= rng.integers(0, 2, (count // 4, 3))
    local[count // 4 : count // 3] *= [1.0, 1e-9, 1.0]
    local[count // 3 : count // 2] *= 0.05
    pose = np.array(shape.pose)
    return local @ dq.rotation_matrix(pose).T + dq.translation(pose)


@both
def test_distance_is_that_of_the_nearest_sample(shape: Shape) -> None:
    """From above to rounding, from below to the spacing of the samples and the flatness of the triangles."""
    edge = size(shape) / 40
    mesh = shape.surface(edge)
    samples = mesh.samples(edge / 4)
    points = around(shape, 200, 1)
    nearest, _ = cKDTree(samples).query(points)
    distance = shape.distance(points)
    assert np.isfinite(distance).all()
    error = nearest - np.abs(distance)
    outside = distance > 0.0
    assert error[outside].max() < edge / 2
    assert error[outside].min() > -edge / 8
    assert np.abs(shape.distance(mesh.vertices)).max() < (0.005 if isinstance(shape, Vessels) else 1e-15)
    assert shape.distance(samples).max() < edge / 8


@pytest.mark.parametrize("name", ["ellipsoid", "prolate", "oblate", "flat", "sphere"])
def test_foot_on_an_ellipsoid_lies_on_it_along_its_normal(name: str) -> None:
    shape = SHAPES[name]
    assert isinstance(shape, Ellipsoid)
    local = around(shape.placed([1, 0, 0, 0, 0, 0, 0, 0]), 600, 2)
    for axis in range(3):
        on_axis = np.zeros((50, 3))
        on_axis[:, axis] = np.linspace(0.0, 2.0, 50) * shape.axes[axis]
        local = np.concatenate([local, on_axis])
    feet = shape._feet(local)
    np.testing.assert_allclose(((feet / shape.axes) ** 2).sum(axis=1), 1.0, atol=1e-14)
    normal = feet / shape.axes**2
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(np.cross(local - feet, normal)).max() < 1e-15


def test_a_sphere_is_a_sphere() -> None:
    points = around(SHAPES["sphere"], 300, 3)
    np.testing.assert_allclose(SHAPES["sphere"].distance(points), np.linalg.norm(points, axis=1) - 0.03, atol=1e-16)
    assert SHAPES["sphere"].distance([[0.0, 0.0, 0.0]]) == -0.03


@both
def test_segment_distance_is_the_smallest_along_it(shape: Shape) -> None:
    rng = np.random.default_rng(4)
    start, end = around(shape, 60, 5), around(shape, 60, 6)[::-1].copy()
    end[:6] = start[:6]
    end[6:12] = start[6:12] + 1e-9 * rng.normal(size=(6, 3))
    end[12:24, rng.permutation(3)[:2]] = start[12:24, rng.permutation(3)[:2]]
    end[24:30, :2] = start[24:30, :2] + 1e-8
    found = shape.segment_distance(start, end)
    assert np.isfinite(found).all()
    s = np.linspace(0.0, 1.0, 501)[:, None]
    along = np.stack([shape.distance(a + s * (b - a)) for a, b in zip(start, end, strict=True)])
    step = np.linalg.norm(end - start, axis=1) / 500
    assert (found <= along.min(axis=1) + 1e-15).all()
    assert (found >= along.min(axis=1) - 0.5 * step - 1e-15).all()
    # Where a parabola through the smallest sample and its neighbours describes the distance, its vertex is met.
    best = np.clip(along.argmin(axis=1), 1, 499)
    rows = np.arange(60)
    left, middle, right = (along[rows, best + i] for i in (-1, 0, 1))
    curved = left - 2.0 * middle + right
    smooth = (curved > 1e-12) & (curved < 0.1 * step) & (middle <= left) & (middle <= right)
    vertex = middle - (left - right) ** 2 / np.where(smooth, 8.0 * curved, 1.0)
    assert np.abs(found - vertex)[smooth].max(initial=0.0) < 0.05 * step.max()


@both
def test_distance_moves_with_the_shape(shape: Shape) -> None:
    pose = dq.from_rotation_translation(np.array([0.8, 0.0, 0.6, 0.0]), np.array([0.1, 0.2, -0.3]))
    points, other = around(shape, 50, 7), around(shape, 50, 8)
    move = dq.rotation_matrix(pose).T
    moved = shape.placed(dq.product(pose, np.array(shape.pose)))
    there, then = points @ move + dq.translation(pose), other @ move + dq.translation(pose)
    np.testing.assert_allclose(moved.distance(there), shape.distance(points), atol=1e-15)
    np.testing.assert_allclose(moved.segment_distance(there, then), shape.segment_distance(points, other), atol=1e-14)


@pytest.mark.parametrize("name", ["ellipsoid", "half a sphere", "cortex's vessels", "one capsule"])
def test_a_cloud_covers_the_shape_and_only_the_shape(name: str) -> None:
    shape = SHAPES[name]
    radius = size(shape) / 12
    cloud = shape.cloud(radius, 1)
    samples = shape.surface(radius / 8).samples(radius / 8, seed=99)
    # The mesh that the cloud covers is flat between its vertices; the samples lie on a finer one.
    assert cloud.distance(samples).max() < 0.01 * radius
    assert cloud.gap is not None
    assert cloud.gap.size <= radius
    assert np.abs(shape.distance(cloud.world_points)).max() < radius
    np.testing.assert_array_equal(shape.cloud(radius, 1).points, cloud.points)


@pytest.mark.skipif(JIT_DISABLED, reason="thousands of samples")
def test_a_kidney_fits_the_larger_arm() -> None:
    organ, vessels = kidney()
    assert np.ptp(organ.surface(0.005).bounds, axis=0).max() == pytest.approx(0.11, abs=1e-15)
    assert isinstance(vessels, Vessels)
    assert 0.006 <= 2.0 * vessels.radii.min() + 2e-4 <= 2.0 * vessels.radii.max() <= 0.016
    assert _in_one_piece(vessels)
    assert 500 < len(vessels.cloud(0.0035).points) < 2000


def test_a_cortex_fits_the_smaller_arm() -> None:
    bowl, vessels = cortex()
    assert isinstance(bowl, Bowl)
    assert bowl.radius == 0.012
    assert 0.001 <= 2.0 * vessels.radii.min() <= 2.0 * vessels.radii.max() <= 0.002
    assert _in_one_piece(vessels)
    assert bowl.distance(vessels.starts).max() < 0.0015
    assert len(bowl.cloud(0.001).points) < 2000


def _in_one_piece(vessels: Vessels) -> bool:
    """Each capsule meets one of those before it."""
    joined = [True]
    for k in range(1, len(vessels.radii)):
        before = Vessels(vessels.starts[:k], vessels.ends[:k], vessels.radii[:k])
        apart = before.segment_distance(vessels.starts[k : k + 1], vessels.ends[k : k + 1])[0]
        joined.append(apart < vessels.radii[k])
    return all(joined)


def test_a_gap_above_a_bowl_is_the_distance_of_its_point() -> None:
    bowl, point = bowl_for(0.006, 0.012)
    assert bowl.distance([point])[0] == pytest.approx(0.006, abs=1e-17)


def test_vessels_taper_from_first_to_last_along_their_curve() -> None:
    branch = Branch([[0, 0, 0], [0, 0, 0.01], [0, 0.01, 0.02], [0, 0.02, 0.02]], 0.004, 0.002)
    vessels = Vessels.tree([branch], 20)
    assert (np.diff(vessels.radii) < 0.0).all()
    np.testing.assert_allclose([vessels.radii.max(), vessels.radii.min()], [0.00395, 0.00205])
    np.testing.assert_array_equal(vessels.starts[0], [0.0, 0.0, 0.0])
    np.testing.assert_allclose(vessels.ends[-1], [0.0, 0.02, 0.02])
    deviation = vessels.distance(branch.at(np.linspace(0.0, 1.0, 500)))
    assert deviation.max() < -0.9 * 0.002


def test_an_ellipsoids_mesh_is_closed_and_turned_outwards() -> None:
    mesh = Ellipsoid(np.array([0.027, 0.055, 0.022])).surface(0.002)
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    volume = (a * np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * np.pi * 0.027 * 0.055 * 0.022, rel=0.01)


def test_a_vessels_mesh_is_turned_outwards_and_hides_nothing_outside() -> None:
    capsule = SHAPES["one capsule"].surface(0.0005)
    a, b, c = np.moveaxis(capsule.triangles, 1, 0)
    expected = np.pi * 0.004**2 * 0.03 + 4.0 / 3.0 * np.pi * 0.004**3
    assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(expected, rel=0.01)
    vessels = cortex().vessels
    rng = np.random.default_rng(9)
    which = rng.integers(len(vessels.radii), size=2000)
    start, axis = vessels.starts[which], (vessels.ends - vessels.starts)[which]
    across = np.cross(axis, rng.normal(size=(2000, 3)))
    across *= (vessels.radii[which] / np.linalg.norm(across, axis=1))[:, None]
    on = start + rng.random((2000, 1)) * axis + across
    outer = on[vessels.distance(on) > -1e-12]
    assert len(outer) > 500
    nearest, _ = cKDTree(vessels.surface(1e-4).samples(5e-5)).query(outer)
    assert nearest.max() < 1e-4


@pytest.mark.parametrize("facing", [[0, 0, 1], [0, 0, -1], [1, 0, 0], [1, -2, 3], [1e-14, 0, -1]])
@pytest.mark.parametrize("axis", [[0, 0, -1], [0.3, 0.0, -1.0]])
def test_placement_puts_the_target_at_the_depth_and_turns_the_face_to_the_port(facing: Any, axis: Any) -> None:
    target = np.array([0.01, 0.02, 0.03])
    down = np.array(axis) / np.linalg.norm(axis)
    for turn in (0.0, 1.0):
        pose = placed_under(PORT, 0.12, target=target, facing=facing, turn=turn, axis=axis)
        rotation = dq.rotation_matrix(pose)
        np.testing.assert_allclose(rotation @ target + dq.translation(pose), PORT + 0.12 * down, atol=1e-15)
        np.testing.assert_allclose(rotation @ np.array(facing) / np.linalg.norm(facing), -down, atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-14)


def test_a_turn_is_about_the_tools_axis() -> None:
    first, second = (
        dq.rotation_matrix(placed_under(PORT, 0.1, target=[0, 0, 0], facing=[1, 2, 3], turn=t)) for t in (0.0, 0.7)
    )
    turned = np.array([[np.cos(0.7), np.sin(0.7), 0.0], [-np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(second, turned @ first, atol=1e-15)


def check_under_port(vessels: Surface, organ: Surface, depth: float) -> None:
    pose = under_port(PORT, depth, vessels=vessels, organ=organ, turn=0.4)
    v, o = vessels.placed(pose), organ.placed(pose)
    assert max(v.bounds[1, 2], o.bounds[1, 2]) == pytest.approx(-depth, abs=1e-15)
    middles = [s.areas @ s.triangles.mean(axis=1) / s.area for s in (v, o)]
    assert middles[0][2] > middles[1][2]
    for middle in middles:
        np.testing.assert_allclose(middle[:2], PORT[:2], atol=1e-12)


def test_vessels_face_the_port() -> None:
    organ, vessels = kidney()
    check_under_port(vessels.surface(0.002), organ.surface(0.004), 0.09)


def test_vessels_of_a_real_kidney_face_the_port() -> None:
    if not KIDNEY.exists():
        pytest.skip(f"needs the files of {KIDNEY}")
    check_under_port(read_surface(KIDNEY / "renal_vessels_left.ply"), read_surface(KIDNEY / "kidney_left.ply"), 0.1)


def test_an_anatomy_is_placed_as_one() -> None:
    placed = cortex().placed(POSE)
    assert isinstance(placed, Anatomy)
    np.testing.assert_allclose(placed.organ.pose, placed.vessels.pose)
    np.testing.assert_allclose(placed.organ.distance([dq.translation(POSE)]), 0.012, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Ellipsoid(np.array([0.1, 0.0, 0.1])), "> 0"),
        (lambda: Ellipsoid(np.array([0.1, 0.1])), "shape"),
        (lambda: Bowl(-0.1, 1.0), "> 0"),
        (lambda: Bowl(0.1, 3.2), "between 0 and pi"),
        (lambda: Bowl(0.1, 0.0), "between 0 and pi"),
        (lambda: Vessels(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)), "radii"),
        (lambda: Vessels(np.zeros((2, 3)), np.zeros((1, 3)), np.ones(2)), "ends of Vessels"),
        (lambda: Vessels.tree([], 3), "at least one branch"),
        (lambda: Bowl(0.1, 1.0).surface(0.0), "> 0"),
        (lambda: Bowl(0.1, 1.0).cloud(-1.0), "> 0"),
        (lambda: Bowl(0.1, 1.0).distance([0.0, 0.0, 0.0]), "shape"),
        (lambda: Bowl(0.1, 1.0).distance([[0.0, np.nan, 0.0]]), "finite"),
        (lambda: Bowl(0.1, 1.0).segment_distance(np.zeros((2, 3)), np.zeros((1, 3))), "as many starts"),
        (lambda: Bowl(0.1, 1.0, pose=np.zeros(8)), "unit dual quaternion"),
        (lambda: placed_under(PORT, -0.1, target=[0, 0, 0], facing=[0, 0, 1]), "> 0"),
        (lambda: placed_under(PORT, 0.1, target=[0, 0, 0], facing=[0, 0, 0]), "direction"),
        (
            lambda: under_port(PORT, 0.1, vessels=Surface(np.eye(3), []), organ=Surface(np.eye(3), [])),  # type: ignore[arg-type]
            "around the middle",
        ),
    ],
)
def test_what_makes_no_anatomy_is_refused(make: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()
