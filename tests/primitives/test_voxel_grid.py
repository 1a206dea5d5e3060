"""The voxel grid against brute force, to the bit."""

from typing import Any

import numpy as np
import pytest

from primitives.compiled import JIT_DISABLED
from primitives.errors import InputError
from primitives.voxel_grid import NO_ROOM, NOT_FINITE, VoxelGrid, build_grid, near_segment, nearest_to_segment

CASES = 60 if JIT_DISABLED else 3000


def query(kernel: Any, grid: VoxelGrid, base: Any, direction: Any, length: float, reach: float) -> Any:
    """Status, and copies of what was found."""
    n = len(grid.points)
    index, place, distance = np.full(n, -7), np.full(n, np.nan), np.full(n, np.nan)
    count = kernel(
        grid.points,
        grid.start,
        grid.shape,
        grid.origin,
        grid.cell,
        np.array(base, dtype=float),
        np.array(direction, dtype=float),
        float(length),
        float(reach),
        index,
        place,
        distance,
    )
    return count, index[: max(count, 0)], place[: max(count, 0)], distance[: max(count, 0)]


def brute(points: Any, base: Any, direction: Any, length: float) -> Any:
    """Place and squared distance of every point, in the order of operations of the kernel."""
    q = points - base
    s = np.clip(q[:, 0] * direction[0] + q[:, 1] * direction[1] + q[:, 2] * direction[2], 0.0, length)
    e = q - s[:, None] * direction
    return s, e[:, 0] * e[:, 0] + e[:, 1] * e[:, 1] + e[:, 2] * e[:, 2]


def random_points(rng: Any, kind: str) -> Any:
    points = rng.normal(size=(int(rng.integers(1, 300)), 3)) * 0.05
    if kind == "plane":
        points[:, rng.integers(3)] = 0.0
    elif kind == "line":
        points[:, 1:] = 0.0
    elif kind == "lattice":
        points = np.round(points / 0.01) * 0.01
    elif kind == "all equal":
        points[:] = points[0]
    elif kind == "far outlier":
        points[0] *= 1e4
    elif kind == "far from zero":
        points += 1e3
    return points


def random_segment(rng: Any, points: Any, kind: str) -> Any:
    direction = rng.normal(size=3)
    choice = rng.integers(5)
    if choice == 0:
        direction = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    elif choice == 1:
        direction[rng.integers(3)] *= 10.0 ** -rng.integers(1, 17)
    elif choice == 2:
        direction[rng.permutation(3)[:2]] *= 10.0 ** -rng.integers(1, 17)
    base = points[rng.integers(len(points))] + rng.normal(size=3) * rng.choice([0.0, 0.01, 0.1, 1.0])
    if kind == "lattice":
        base = np.round(base / 0.005) * 0.005
    return base, direction / np.linalg.norm(direction), rng.choice([0.0, 0.01, 0.05, 0.43, 10.0])


@pytest.mark.parametrize("kind", ["volume", "plane", "line", "lattice", "all equal", "far outlier", "far from zero"])
def test_equals_brute_force(kind: str) -> None:
    rng = np.random.default_rng(11)
    found = 0
    for case in range(CASES // 7):
        points = random_points(rng, kind)
        grid = build_grid(points, None if case % 2 else 0.01)
        base, direction, length = random_segment(rng, points, kind)
        s, square = brute(grid.points, base, direction, length)
        for reach in (0.0, 0.005, 0.02, 0.1, float(np.sqrt(square.max())), 1e4):
            count, index, place, distance = query(near_segment, grid, base, direction, length, reach)
            expected = np.flatnonzero(square <= reach * reach)
            assert count == len(expected)
            np.testing.assert_array_equal(index, expected)
            np.testing.assert_array_equal(place, s[expected])
            np.testing.assert_array_equal(distance, np.sqrt(square[expected]))
            found += count
            nearest = int(np.argmin(square))
            count, index, place, distance = query(nearest_to_segment, grid, base, direction, length, reach)
            assert count == (square[nearest] <= reach * reach)
            if count:
                assert (index[0], place[0], distance[0]) == (nearest, s[nearest], np.sqrt(square[nearest]))
    assert found > CASES


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_segment_in_the_faces_of_cells_meets_the_points_on_both_sides(axis: int) -> None:
    """A lattice whose points lie on faces, a reach of exactly one spacing: the nine columns but their corners."""
    ticks = np.arange(6) * 0.25
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = build_grid(points, 0.25)
    base = np.full(3, 0.5)
    base[axis] = -1.0
    count, index, _, distance = query(near_segment, grid, base, np.eye(3)[axis], 4.0, 0.25)
    assert count == 5 * 6
    assert sorted(set(distance)) == [0.0, 0.25]
    across = np.delete(grid.points[index], axis, axis=1)
    assert np.abs(across - 0.5).max() == 0.25


@pytest.mark.parametrize("cell", [None, 0.004, 1e-9, 10.0])
def test_cells_are_contiguous_ranges_of_the_points_that_lie_in_them(cell: float | None) -> None:
    points = np.random.default_rng(3).normal(size=(500, 3)) * [0.05, 0.03, 0.02]
    grid = build_grid(points, cell)
    np.testing.assert_array_equal(grid.points, points[grid.order])
    assert sorted(grid.order) == list(range(500))
    assert len(grid.start) == np.prod(grid.shape) + 1
    assert (grid.start[0], grid.start[-1]) == (0, 500)
    counts = np.diff(grid.start)
    assert (counts >= 0).all()
    cells = np.repeat(np.arange(len(counts)), counts)
    corner = grid.origin + np.stack(np.unravel_index(cells, grid.shape), axis=-1) * grid.cell
    slack = 1e-9 * grid.cell
    assert ((grid.points >= corner - slack) & (grid.points <= corner + grid.cell + slack)).all()
    assert cell is None or grid.cell >= cell


def test_the_number_of_cells_is_bounded_whatever_the_cloud() -> None:
    rng = np.random.default_rng(4)
    sparse = rng.normal(size=(50, 3)) * 1e6
    outlier = np.r_[rng.normal(size=(1000, 3)) * 0.01, [[1e9, -1e9, 1e9]]]
    for points in (sparse, outlier, np.zeros((7, 3)), np.array([[0.0, 0.0, 1e90], [0.0, 0.0, 0.0]])):
        for cell in (None, 1e-3, 1e-300):
            grid = build_grid(points, cell)
            assert np.prod(grid.shape) <= 4 * len(points) + 64
            assert np.isfinite(grid.cell)


def test_nearest_is_found_from_very_far_away() -> None:
    grid = build_grid([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]])
    count, index, place, distance = query(nearest_to_segment, grid, [1e6, 0.0, 0.05 - 1e-3], [0.0, 1.0, 0.0], 0.3, 1e90)
    assert (count, place[0]) == (1, 0.0)
    assert grid.points[index[0], 2] == 0.0
    assert distance[0] == pytest.approx(1e6, rel=1e-12)


BAD = [
    ("base", [np.nan, 0.0, 0.0]),
    ("base", [0.0, np.inf, 0.0]),
    ("base", [0.0, 0.0, 1e200]),
    ("direction", [np.nan, 0.0, 1.0]),
    ("direction", [0.0, -np.inf, 0.0]),
    ("direction", [0.0, 0.0, 2.0]),
    ("length", np.nan),
    ("length", -0.1),
    ("length", np.inf),
    ("reach", np.nan),
    ("reach", -1e-9),
    ("reach", np.inf),
]


@pytest.mark.parametrize(("name", "value"), BAD)
@pytest.mark.parametrize("kernel", [near_segment, nearest_to_segment])
def test_a_query_that_has_no_answer_says_so(kernel: Any, name: str, value: Any) -> None:
    grid = build_grid(np.random.default_rng(5).normal(size=(20, 3)))
    fine = {"base": [0.0, 0.0, 0.0], "direction": [0.0, 0.0, 1.0], "length": 1.0, "reach": 10.0}
    assert query(kernel, grid, **fine)[0] > 0
    assert query(kernel, grid, **(fine | {name: value}))[0] == NOT_FINITE


def test_scratch_that_is_too_short_is_not_written_to() -> None:
    grid = build_grid(np.zeros((5, 3)))
    arguments = (grid.points, grid.start, grid.shape, grid.origin, grid.cell, np.zeros(3), np.array([1.0, 0.0, 0.0]))
    for short in range(3):
        scratch = [np.full(5, -7), np.full(5, -7.0), np.full(5, -7.0)]
        scratch[short] = scratch[short][:4]
        assert near_segment(*arguments, 0.0, 1.0, *scratch) == NO_ROOM
        assert all((a == -7).all() for a in scratch)
        scratch[short] = scratch[short][:0]
        assert nearest_to_segment(*arguments, 0.0, 1.0, *scratch) == NO_ROOM


@pytest.mark.parametrize(
    ("points", "cell", "said"),
    [
        (np.zeros((0, 3)), None, "at least one point"),
        ([[0.0, 0.0, np.nan]], None, "finite"),
        ([[0.0, 0.0, 1e100]], None, "check their unit"),
        ([0.0, 0.0, 0.0], None, "shape"),
        (np.zeros((2, 3)), 0.0, "> 0"),
        (np.zeros((2, 3)), np.nan, "finite"),
    ],
)
def test_points_that_make_no_grid_are_refused(points: Any, cell: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        build_grid(points, cell)
