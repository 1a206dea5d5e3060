"""How well spheres around points cover a surface: the largest gap, and the points that are missing.

A triangle lies within r of a point if its corners do. Triangles for which this cannot be shown with the point nearest
to their centre are split into four; so the largest gap is enclosed, and a covering is proved, not sampled.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from primitives.checks import Array
from primitives.errors import InputError
from primitives.surface import MAX_SAMPLES, Surface

ENCLOSED = 1e-3
"""Relative width to which the largest gap is enclosed."""


class Gap(NamedTuple):
    """The largest gap between the points of a cloud.

    Attributes
    ----------
    size : metres, distance from the surface's worst place to the nearest point; 0 where nothing lies between points.
    at : (3,) that place, metres.
    """

    size: float
    at: Array


def _split(triangles: Array) -> Array:
    """Each triangle (m, 3, 3) as four."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    parts = [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate(parts)


def _bounds(tree: cKDTree, triangles: Array) -> tuple[Array, Array, Array]:
    """Centre of each triangle, its distance from the points, and a bound on that of any place in the triangle."""
    centres = triangles.mean(axis=1)
    at_centre, nearest = tree.query(centres)
    corners = np.linalg.norm(triangles - tree.data[nearest][:, None, :], axis=2)
    return centres, at_centre, corners.max(axis=1)


def largest_gap(points: Array, surface: Surface) -> Gap:
    """The largest distance from a place of the surface to the nearest of the points (N, 3), from above to 0.1 %."""
    tree = cKDTree(points)
    distances, _ = tree.query(surface.vertices[surface.faces.ravel()])
    worst = int(np.argmax(distances))
    found, at = float(distances[worst]), surface.vertices[surface.faces.ravel()[worst]]
    triangles = surface.triangles
    while len(triangles):
        centres, at_centre, most = _bounds(tree, triangles)
        worst = int(np.argmax(at_centre))
        if at_centre[worst] > found:
            found, at = float(at_centre[worst]), centres[worst]
        triangles = _split(triangles[most > found * (1.0 + ENCLOSED)])
    return Gap(found * (1.0 + ENCLOSED), at)


def uncovered(points: Array, radius: float, surface: Surface, seed: int = 0) -> float:
    """Share of the surface's area that lies farther than a radius from the points, from samples radius / 8 apart."""
    distances, _ = cKDTree(points).query(surface.samples(0.125 * radius, seed))
    return float(np.mean(distances > radius))


def one_in_each(points: Array, edge: float, weight: Array) -> np.ndarray:
    """Indices of the points (n, 3) of largest weight in each cube of an edge, in ascending order."""
    cells = np.floor(points / edge)
    order = np.lexsort((-weight, cells[:, 2], cells[:, 1], cells[:, 0]))
    first = np.ones(len(points), dtype=bool)
    first[1:] = (np.diff(cells[order], axis=0) != 0.0).any(axis=1)
    return np.sort(order[first])


def missing(points: Array, radius: float, surface: Surface) -> Array:
    """Places of the surface (m, 3) which, added to the points (N, 3), cover it; (0, 3) where none is missing.

    It is proved that no place of the surface is then farther than the radius, metres, from a point. The places are
    where the gaps are largest, at most one in each cube of 2 radii at a time.

    Raises
    ------
    InputError : a surface so large beside the radius that it takes more than `MAX_SAMPLES` spheres.
    """
    if surface.area > MAX_SAMPLES * radius * radius:
        raise InputError(
            f"point cloud: covering {surface.area:g} m^2 with spheres of {radius:g} m takes more than {MAX_SAMPLES:g} "
            "of them; check the units"
        )
    added: list[Array] = []
    triangles = surface.triangles
    while len(triangles):
        tree = cKDTree(np.concatenate([points, *added]))
        centres, at_centre, most = _bounds(tree, triangles)
        open_ = most > radius
        small = np.ptp(triangles, axis=1).max(axis=1) < ENCLOSED * radius
        wanted = np.flatnonzero(open_ & ((at_centre > radius) | small))
        if len(wanted):
            wanted = wanted[one_in_each(centres[wanted], 2.0 * radius, at_centre[wanted])]
            added.append(centres[wanted])
            triangles = triangles[open_]
        else:
            triangles = _split(triangles[open_])
    return np.concatenate([np.zeros((0, 3)), *added])


def voxel_average(points: Array, leaf: float) -> Array:
    """The mean of the points (n, 3) in each cube of an edge `leaf`, metres: the down-sampling of paper A, section 5."""
    cells, inverse, counts = np.unique(np.floor(points / leaf), axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(cells), 3))
    np.add.at(sums, inverse.ravel(), points)
    return sums / counts[:, None]
