"""Gaps on surfaces and of bare clouds, against formulas, dense sampling and one another."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from primitives.cloud_gap import EDGE, estimated_gap, missing_between
from primitives.compiled import JIT_DISABLED
from primitives.coverage import ENCLOSED, largest_gap, missing, one_in_each, uncovered, voxel_average
from primitives.errors import InputError
from primitives.surface import Surface
from tests.primitives.meshes import SMOOTH, ball, sheet, tube

smooth = pytest.mark.parametrize("surface", SMOOTH.values(), ids=SMOOTH)
LEAVES = (0.004,) if JIT_DISABLED else (0.003, 0.004)


def averaged(surface: Surface, leaf: float) -> Any:
    return voxel_average(surface.samples(leaf / 8), leaf)


def test_gap_of_one_point_is_the_far_corner() -> None:
    gap = largest_gap(np.zeros((1, 3)), sheet(0.03, 0.04))
    assert 0.05 <= gap.size <= 0.05 * (1.0 + ENCLOSED)
    np.testing.assert_array_equal(gap.at, [0.03, 0.04, 0.0])


def test_gap_of_a_square_lattice_is_half_its_diagonal() -> None:
    ticks = np.linspace(0.0, 0.05, 11)
    x, y = np.meshgrid(ticks, ticks)
    points = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    true = 0.0025 * np.sqrt(2.0)
    gap = largest_gap(points, sheet())
    assert true <= gap.size <= true * (1.0 + ENCLOSED)
    assert estimated_gap(points, 0.004).size == pytest.approx(true, rel=1e-12)
    # The corners of each square of side 5 mm are out of reach: area 25 - the part within r of its corners.
    r = 0.003
    angle = np.arccos(2.5 / 3.0)
    covered = np.pi * 9.0 - 4.0 * (9.0 * angle - 2.5 * np.sqrt(9.0 - 2.5**2))
    assert uncovered(points, r, sheet()) == pytest.approx(1.0 - covered / 25.0, abs=0.004)
    assert uncovered(points, 1.0001 * true, sheet()) == 0.0


@smooth
def test_gap_is_that_of_dense_samples(surface: Surface) -> None:
    points = averaged(surface, 0.005)
    samples = surface.samples(2e-4)
    sampled = cKDTree(points).query(samples)[0].max()
    gap = largest_gap(points, surface)
    assert sampled <= gap.size <= sampled + 3e-4
    assert cKDTree(points).query(gap.at)[0] == pytest.approx(gap.size / (1.0 + ENCLOSED), rel=1e-12)
    assert cKDTree(samples).query(gap.at)[0] < 4e-4


@smooth
@pytest.mark.parametrize("share", [0.6, 1.0])
def test_what_is_missing_covers(surface: Surface, share: float) -> None:
    """With the radius of the leaf little is missing, with less than half of it nearly everything."""
    leaf = 0.005
    points, radius = averaged(surface, leaf), share * leaf
    extra = missing(points, radius, surface)
    every = np.concatenate([points, extra])
    assert cKDTree(every).query(surface.samples(2e-4))[0].max() <= radius
    assert largest_gap(every, surface).size <= radius * (1.0 + ENCLOSED)
    if len(extra):
        assert np.abs(cKDTree(surface.samples(2e-4)).query(extra)[0]).max() < 4e-4
        assert not len(missing(every, radius, surface))
    assert bool(len(extra)) == (largest_gap(points, surface).size > radius * (1.0 + ENCLOSED)) or share == 1.0


def test_something_is_missing_between_too_few_points() -> None:
    assert len(missing(averaged(sheet(), 0.005), 0.002, sheet())) > 50


@smooth
@pytest.mark.parametrize("leaf", LEAVES)
def test_estimate_agrees_with_the_surface_where_it_is_smooth(surface: Surface, leaf: float) -> None:
    points = averaged(surface, leaf)
    radius = leaf * np.sqrt(3.0) / 2.0
    true = largest_gap(points, surface).size
    assert 0.9 * true <= estimated_gap(points, radius).size <= 1.02 * true
    assert 0.9 * true <= estimated_gap(points).size <= 1.02 * true


@pytest.mark.parametrize("hole", [1.3, 2.6])
@pytest.mark.parametrize("name", ["sheet", "tube"])
def test_estimate_sees_a_hole(name: str, hole: float) -> None:
    surface = SMOOTH[name]
    leaf = 0.003
    radius = leaf * np.sqrt(3.0) / 2.0
    middle = {"sheet": [0.025, 0.02, 0.0], "ball": [0.01, 0.02, 0.02], "tube": [0.012, 0.0, 0.04]}[name]
    points = averaged(surface, leaf)
    left = points[np.linalg.norm(points - middle, axis=1) > hole * radius]
    true = largest_gap(left, surface).size
    estimate = estimated_gap(left, radius)
    assert radius < true < EDGE * radius
    assert 0.8 * true <= estimate.size <= 1.2 * true
    assert np.linalg.norm(estimate.at - middle) < 1.5 * hole * radius
    filled = np.concatenate([left, missing_between(left, radius)])
    assert estimated_gap(filled, radius).size <= radius
    assert largest_gap(filled, surface).size < 1.1 * radius


@pytest.mark.skipif(JIT_DISABLED, reason="tens of thousands of points")
@pytest.mark.parametrize("hole", [0.0036, 0.009])
def test_estimate_sees_a_hole_many_spacings_wide(hole: float) -> None:
    points = ball().samples(0.0006)
    left = points[np.linalg.norm(points - [0.0, 0.0, 0.03], axis=1) > hole]
    assert estimated_gap(left, 0.0035).size == pytest.approx(largest_gap(left, ball()).size, rel=0.04)


def test_the_rim_of_an_open_surface_is_no_gap_and_a_hole_that_opens_it_is_not_seen() -> None:
    surface = ball(below=0.0)
    points = averaged(surface, 0.003)
    radius = 0.003 * np.sqrt(3.0) / 2.0
    assert estimated_gap(points, radius).size < radius
    left = points[np.linalg.norm(points - [0.03, 0.0, 0.0], axis=1) > 3.0 * radius]
    assert largest_gap(left, surface).size > 2.5 * radius
    assert estimated_gap(left, radius).size < radius


def test_an_open_end_of_a_thin_tube_is_taken_for_a_hole() -> None:
    surface = tube(radius=0.006)
    points = averaged(surface, 0.004)
    estimate = estimated_gap(points, 0.0035)
    assert largest_gap(points, surface).size < 0.0035
    assert 0.005 < estimate.size < 0.0061
    assert np.hypot(*estimate.at[:2]) < 0.001


def test_two_walls_near_one_another_are_two_walls() -> None:
    lower = averaged(sheet(), 0.003)
    both = np.concatenate([lower, lower[:, [1, 0, 2]] + np.array([0.0, 0.0, 0.012])])
    alone = estimated_gap(lower, 0.0026).size
    assert estimated_gap(both, 0.0026).size == pytest.approx(alone, rel=0.03)


@pytest.mark.parametrize(
    ("points", "gap"),
    [
        ([[0.0, 0.0, 0.0]], 0.0),
        ([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0]], 0.01),
        ([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.05, 0.0, 0.0]], 0.015),
        ([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0]], 0.01 * np.sqrt(2.0)),
        ([[0.0, 0.0, 0.0], [1e-12, 0.0, 0.0], [0.0, 1e-12, 0.0]], 0.5e-12 * np.sqrt(2.0)),
    ],
)
def test_gap_of_a_handful_of_points(points: Any, gap: float) -> None:
    assert estimated_gap(np.array(points), 0.02).size == pytest.approx(gap, rel=1e-9)


def test_one_in_each_cube_is_its_heaviest() -> None:
    rng = np.random.default_rng(1)
    points, weight = rng.normal(size=(400, 3)), rng.random(400)
    kept = one_in_each(points, 0.7, weight)
    cells = np.floor(points / 0.7)
    assert len(kept) == len(np.unique(cells, axis=0))
    for k in kept:
        assert weight[k] == weight[(cells == cells[k]).all(axis=1)].max()


def test_voxel_average_is_the_mean_of_each_cube() -> None:
    points = np.random.default_rng(1).normal(size=(300, 3))
    cells = np.floor(points / 0.7)
    expected = [points[(cells == c).all(axis=1)].mean(axis=0) for c in np.unique(cells, axis=0)]
    np.testing.assert_allclose(voxel_average(points, 0.7), expected, atol=1e-15)


def test_samples_are_even_on_the_surface_and_the_same_for_a_seed() -> None:
    surface = tube()
    samples = surface.samples(0.001, seed=3)
    assert len(samples) == np.ceil(surface.area / 1e-6)
    np.testing.assert_array_equal(samples, surface.samples(0.001, seed=3))
    assert not np.array_equal(samples, surface.samples(0.001, seed=4))
    assert np.abs(np.hypot(samples[:, 0], samples[:, 1]) - 0.012).max() < 0.012 * (1.0 - np.cos(np.pi / 48)) + 1e-15
    sides = np.floor(np.arctan2(samples[:, 1], samples[:, 0]) % (2.0 * np.pi) / (2.0 * np.pi / 48))
    _, counts = np.unique(sides, return_counts=True)
    assert np.abs(counts - len(samples) / 48).max() <= 2.0
    heights, _ = np.histogram(samples[:, 2], bins=8, range=(0.0, 0.08))
    assert np.abs(heights - len(samples) / 8).max() < 4.0 * np.sqrt(len(samples) / 8)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Surface(np.zeros((0, 3)), np.zeros((0, 3))), "at least one"),
        (lambda: Surface(np.full((3, 3), np.nan), np.array([[0, 1, 2]])), "finite"),
        (lambda: Surface(np.zeros((3, 3)), np.array([[0, 1, 3]])), "face 0 .* 0 to 2"),
        (lambda: Surface(np.zeros((3, 3)), np.array([[0, 1, -1]])), "face 0"),
        (lambda: Surface(np.zeros((3, 3)), np.array([[0.0, 1.0, 2.0]])), "whole numbers"),
        (lambda: Surface(np.zeros((3, 3)), np.array([[0, 1, 2]])).samples(0.1), "without area"),
        (lambda: Surface(np.zeros((3, 3)), np.array([])).samples(0.1), "without area"),
        (lambda: sheet(50.0, 50.0).samples(0.001), "check the unit"),
        (lambda: sheet().samples(0.0), "> 0"),
    ],
)
def test_what_is_no_surface_is_refused(make: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()
