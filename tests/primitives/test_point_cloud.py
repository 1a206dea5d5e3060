"""Clouds of spheres: what they are made of, that they cover, and how they are moved, queried and refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from primitives import dual_quaternion as dq
from primitives.compiled import JIT_DISABLED
from primitives.errors import FileError, InputError, UnknownNameError
from primitives.files.mesh_file import read_surface
from primitives.point_cloud import PointCloud, into_frame
from primitives.surface import Surface
from primitives.units import check_size
from tests.primitives.geometry_files import ply
from tests.primitives.meshes import SMOOTH, ball, sheet, tube

KIDNEY = Path(__file__).parents[2].parent / "shared" / "data" / "kidney"
POSE = dq.from_rotation_translation(np.array([0.8, 0.0, 0.6, 0.0]), np.array([0.1, -0.2, 0.3]))
LEAF = 0.004


@pytest.fixture(scope="module")
def cloud() -> PointCloud:
    return PointCloud.from_surface(ball(), leaf=LEAF, pose=POSE)


@pytest.mark.parametrize("surface", SMOOTH.values(), ids=SMOOTH)
def test_spheres_of_a_cloud_cover_the_surface_it_is_made_from(surface: Surface) -> None:
    made = PointCloud.from_surface(surface, leaf=LEAF, seed=1)
    assert made.radius == pytest.approx(LEAF * np.sqrt(3.0) / 2.0, rel=1e-15)
    assert made.gap is not None
    assert made.gap.size <= made.radius
    assert cKDTree(made.points).query(surface.samples(3e-4, 5))[0].max() <= made.gap.size
    np.testing.assert_array_equal(made.points, PointCloud.from_surface(surface, leaf=LEAF, seed=1).points)


def test_a_small_part_that_shares_a_voxel_with_a_large_one_gets_a_sphere_of_its_own() -> None:
    large, small = sheet(LEAF, LEAF), sheet(1e-4, 1e-4)
    corner = small.vertices + 0.95 * LEAF
    both = Surface(np.concatenate([large.vertices, corner]), np.concatenate([large.faces, small.faces + 4]))
    made = PointCloud.from_surface(both, leaf=LEAF)
    assert (len(made.points), made.added) == (2, 1)
    assert made.gap is not None
    assert made.gap.size <= made.radius
    assert np.abs(made.points[1] - corner.mean(axis=0)).max() < 1e-4


def test_density_is_that_of_one_point_in_each_cube_a_sphere_holds() -> None:
    made = PointCloud(np.zeros((1, 3)), np.sqrt(3.0) / 2.0 * 0.004041)
    assert made.density == pytest.approx(0.004041**-3, rel=1e-12)
    assert made.radius == pytest.approx(np.sqrt(3.0) / (2.0 * made.density ** (1.0 / 3.0)), rel=1e-12)


def test_points_with_gaps_are_refused_with_the_numbers(cloud: PointCloud) -> None:
    points = np.array(cloud.points)
    middle = points[7]
    left = points[np.linalg.norm(points - middle, axis=1) > 1.6 * cloud.radius]
    with pytest.raises(
        InputError, match=r"spheres of 3.464 mm .* leave gaps.*estimated from the points, is [4-7]\."
    ) as e:
        PointCloud.from_points(left, leaf=LEAF)
    assert "about 1 such places" in str(e.value)
    assert 'gaps="fill"' in str(e.value)
    with pytest.raises(InputError, match=r"measured, is [4-7].* [01]\.\d+ % of the surface is not covered"):
        PointCloud.from_points(left, leaf=LEAF, surface=ball())


@pytest.mark.parametrize("known", [False, True])
def test_gaps_are_filled_on_request(cloud: PointCloud, known: bool) -> None:
    points = np.array(cloud.points)
    left = points[np.linalg.norm(points - points[7], axis=1) > 1.6 * cloud.radius]
    surface = ball() if known else None
    filled = PointCloud.from_points(left, leaf=LEAF, gaps="fill", surface=surface)
    assert 1 <= filled.added == len(filled.points) - len(left) <= 12
    np.testing.assert_array_equal(filled.points[: len(left)], left)
    assert filled.gap is not None
    assert filled.gap.size <= filled.radius
    assert cKDTree(filled.points).query(ball().samples(3e-4))[0].max() < (1.0 if known else 1.05) * filled.radius


def test_without_a_radius_the_gap_is_the_radius(cloud: PointCloud) -> None:
    made = PointCloud.from_points(cloud.points)
    assert made.gap is not None
    assert made.radius == made.gap.size
    assert made.radius == pytest.approx(cloud.gap.size if cloud.gap else 0.0, rel=0.05)


def test_equal_points_are_kept_once_in_their_order() -> None:
    given = np.array([[0.0, 0.0, 0.003], [0.0, 0.0, 0.0], [0.0, 0.0, 0.003], [0.002, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(PointCloud.from_points(given, radius=0.003).points, given[[0, 1, 3]])


def test_one_point_is_a_cloud_where_its_radius_is_given() -> None:
    made = PointCloud.from_points([[0.1, 0.2, 0.3]], radius=0.01)
    assert made.segment_distance([0.1, 0.2, 0.4], [0.1, 0.3, 0.4]) == pytest.approx(0.09, abs=1e-16)
    assert made.gap is not None
    assert made.gap.size == 0.0


def test_units_scale_points_only() -> None:
    made = PointCloud.from_points([[1.0, 2.0, 3.0]], radius=0.01, unit="mm")
    np.testing.assert_allclose(made.points, [[0.001, 0.002, 0.003]], rtol=1e-15)
    assert made.radius == 0.01


def test_a_cloud_moves_with_its_pose(cloud: PointCloud) -> None:
    other = dq.from_rotation_translation(np.array([0.5, 0.5, -0.5, 0.5]), np.array([-0.4, 0.0, 0.2]))
    moved = cloud.moved(other)
    assert moved.grid is cloud.grid
    assert moved.points is cloud.points
    np.testing.assert_allclose(cloud.pose, POSE, atol=1e-16)
    expected = cloud.points @ dq.rotation_matrix(other).T + dq.translation(other)
    np.testing.assert_allclose(moved.world_points, expected, atol=1e-16)
    np.testing.assert_allclose(moved.placement, [*dq.rotation_matrix(other).ravel(), *dq.translation(other)])


def test_queries_are_those_of_the_world(cloud: PointCloud) -> None:
    rng = np.random.default_rng(6)
    world = cloud.world_points
    for k in range(40):
        a, b = rng.normal(size=3) * 0.05 + dq.translation(POSE), rng.normal(size=3) * 0.05 + dq.translation(POSE)
        if k % 8 == 0:
            b = a.copy()
        length = float(np.linalg.norm(b - a))
        s = np.clip((world - a) @ (b - a) / max(length, 1e-30), 0.0, length)
        away = np.linalg.norm(world - a - s[:, None] * (b - a) / max(length, 1e-30), axis=1)
        index, place, distance = cloud.near(a, b, 0.02)
        assert sorted(index) == np.flatnonzero(away <= 0.02).tolist()
        np.testing.assert_allclose(distance, away[index], atol=1e-15)
        np.testing.assert_allclose(place, s[index], atol=1e-14)
        assert cloud.segment_distance(a, b) == pytest.approx(away.min() - cloud.radius, abs=1e-15)
    points = rng.normal(size=(30, 3))
    expected = np.linalg.norm(points[:, None, :] - world, axis=2).min(axis=1) - cloud.radius
    np.testing.assert_allclose(cloud.distance(points), expected, atol=1e-15)


def test_into_frame_is_the_inverse_of_the_pose(cloud: PointCloud) -> None:
    local, along = np.empty(3), np.empty(3)
    world, direction = np.array([0.3, 0.1, -0.7]), np.array([0.6, 0.0, 0.8])
    into_frame(cloud.placement, world, direction, local, along)
    rotation = dq.rotation_matrix(POSE)
    np.testing.assert_allclose(rotation @ local + dq.translation(POSE), world, atol=1e-16)
    np.testing.assert_allclose(rotation @ along, direction, atol=1e-16)


@pytest.mark.parametrize("radius", [0.002, 0.0034, 0.0036, 0.005, 0.01])
def test_a_resampled_cloud_still_covers(cloud: PointCloud, radius: float) -> None:
    other = cloud.resampled(radius=radius)
    assert other.radius == radius
    assert other.gap is not None
    assert other.gap.size <= radius
    slack = 1.05 if radius < LEAF * 0.86 else 1.0
    assert cKDTree(other.points).query(ball().samples(3e-4))[0].max() <= slack * radius
    np.testing.assert_array_equal(other.pose, cloud.pose)
    if radius > 0.004:
        assert len(other.points) < len(cloud.points)


def test_arrays_of_a_cloud_are_its_own(cloud: PointCloud) -> None:
    given = np.array(cloud.points)
    made = PointCloud(given, 0.01)
    given[0] = 7.0
    assert made.points.max() < 1.0
    for value in (made.points, made.pose):
        with pytest.raises(ValueError, match="read-only"):
            value[0] = 1.0


def test_a_file_with_triangles_is_sampled_and_one_with_points_is_taken(tmp_path: Path) -> None:
    surface = tube()
    path = tmp_path / "tube.ply"
    path.write_bytes(ply("<", vertices=1e3 * surface.vertices, faces=surface.faces.tolist(), kind="double"))
    made = PointCloud.from_file(path, radius=0.003, unit="mm", expected=0.1)
    np.testing.assert_array_equal(
        made.points, PointCloud.from_surface(read_surface(path, unit="mm"), radius=0.003).points
    )
    assert np.ptp(made.points, axis=0).max() == pytest.approx(0.08, abs=0.003)
    with pytest.raises(InputError, match=r'tube.ply: it is 80 m long .* looks like millimetres; give unit "mm"'):
        PointCloud.from_file(path, radius=0.003, expected=0.1)
    path.write_bytes(ply("<", vertices=made.points, faces=[], kind="double"))
    taken = PointCloud.from_file(path, radius=0.003, gaps="fill", pose=POSE)
    np.testing.assert_array_equal(taken.points[: len(made.points)], made.points)
    np.testing.assert_allclose(taken.pose, POSE, atol=1e-15)
    path.write_bytes(b"ply\n")
    with pytest.raises(FileError, match="end_header"):
        PointCloud.from_file(path, radius=0.003)


@pytest.mark.parametrize(
    ("extent", "expected", "unit", "said"),
    [
        (90.0, 0.11, "m", 'looks like millimetres; give unit "mm"'),
        (9.0, 0.11, "m", 'looks like centimetres; give unit "cm"'),
        (9e-5, 0.11, "mm", 'looks like metres; give unit "m"'),
        (9e-4, 0.11, "mm", 'looks like metres; give unit "m"'),
        (1e6, 0.11, "m", "is it the right file"),
        (0.0, 0.11, "m", "is it the right file"),
        (np.inf, 0.11, "m", "is it the right file"),
    ],
)
def test_a_size_that_is_another_units_is_refused(extent: float, expected: float, unit: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        check_size(extent, expected, unit=unit)


def test_a_size_near_the_expected_one_is_believed() -> None:
    for factor in (0.11, 1.0, 9.9):
        check_size(0.11 * factor, 0.11)


BAD: list[tuple[Any, str]] = [
    (lambda: PointCloud.from_points(np.zeros((0, 3)), radius=0.01), "at least one, got none"),
    (lambda: PointCloud.from_points([[0.0, np.nan, 0.0]], radius=0.01), "finite"),
    (lambda: PointCloud.from_points([[0.0, np.inf, 0.0]], radius=0.01), "finite"),
    (lambda: PointCloud.from_points([0.0, 0.0, 0.0], radius=0.01), "shape"),
    (lambda: PointCloud.from_points([["a", "b", "c"]], radius=0.01), "numbers"),
    (lambda: PointCloud.from_points([[1e101, 0.0, 0.0]], radius=0.01), "check their unit"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0]], radius=0.0), "> 0"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0]], radius=np.nan), "finite"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0]], leaf=-1.0), "> 0"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0]], radius=0.01, leaf=0.01), "give one of them"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0]]), "give the radius"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0]], radius=0.01, pose=np.zeros(8)), "unit dual quaternion"),
    (lambda: PointCloud.from_points([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], radius=0.01), "is 50 mm, at .0.05, 0, 0. m"),
    (lambda: PointCloud.from_points([[0, 0, 0], [1e6, 0, 0]], radius=0.01, gaps="fill"), "look for stray points"),
    (lambda: PointCloud.from_points([[0, 0, 0]], radius=1e-6, surface=sheet(), gaps="fill"), "check the units"),
    (lambda: PointCloud.from_surface(sheet()), "give the radius"),
    (lambda: PointCloud.from_surface(Surface(np.zeros((1, 3)), np.array([])), radius=0.01), "without area"),
    (lambda: PointCloud.from_surface(sheet(500.0, 500.0), radius=0.01), "check the unit"),
    (lambda: PointCloud(np.zeros((1, 3)), 0.01).near([0, 0, 0], [0, 0, np.nan], 0.1), "finite"),
    (lambda: PointCloud(np.zeros((1, 3)), 0.01).near([0, 0, 0], [0, 0, 1], -0.1), ">= 0"),
    (lambda: PointCloud(np.zeros((1, 3)), 0.01).near([0, 0, 0], [0, 0, 1e120], 0.1), "1e100"),
    (lambda: PointCloud(np.zeros((1, 3)), 0.01).moved(np.zeros(8)), "unit dual quaternion"),
    (lambda: PointCloud(np.zeros((1, 3)), 0.01).resampled(), "give the radius"),
]


@pytest.mark.parametrize(("make", "said"), BAD)
def test_what_makes_no_cloud_is_refused(make: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()


def test_names_that_are_not_known_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="fill, refuse"):
        PointCloud.from_points([[0.0, 0.0, 0.0]], radius=0.01, gaps="ignore")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="cm, m, mm"):
        PointCloud.from_points([[0.0, 0.0, 0.0]], radius=0.01, unit="km")


@pytest.mark.skipif(JIT_DISABLED, reason="tens of thousands of points")
def test_the_cloud_of_the_real_vessels_covers_them_and_its_like_is_made_again() -> None:
    if not KIDNEY.exists():
        pytest.skip(f"needs the files of {KIDNEY}")
    mesh = read_surface(KIDNEY / "renal_vessels_left.ply")
    points = read_surface(KIDNEY / "renal_vessels_left_cloud.ply").vertices
    given = PointCloud.from_points(points, leaf=0.004041, surface=mesh)
    assert given.radius == pytest.approx(0.0035, rel=2e-4)
    assert given.gap is not None
    assert given.gap.size == pytest.approx(0.00328, abs=1e-5)
    with pytest.raises(InputError, match="estimated from the points"):
        PointCloud.from_points(points, leaf=0.004041)
    filled = PointCloud.from_points(points, leaf=0.004041, gaps="fill")
    assert filled.added < 25
    ours = PointCloud.from_file(KIDNEY / "renal_vessels_left.stl", leaf=0.004041, expected=0.1)
    assert len(ours.points) == pytest.approx(995, rel=0.03)
    # Voxels that begin elsewhere average elsewhere.
    assert cKDTree(ours.points).query(points)[0].mean() < 0.5 * 0.004041
