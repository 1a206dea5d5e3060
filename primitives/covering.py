"""Points whose spheres cover a surface: from points that were given, from the surface, or from a finer cloud."""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from primitives.checks import Array, array, number
from primitives.cloud_gap import estimated_gap, missing_between, places_between
from primitives.coverage import Gap, largest_gap, missing, one_in_each, uncovered, voxel_average
from primitives.errors import InputError
from primitives.surface import Surface
from primitives.voxel_grid import LARGEST

CUBE = 0.5 * sqrt(3.0)
"""Radius of the sphere around a cube of edge 1: d_c over the edge of the cube that holds one point, paper A, (8)."""

_OVERSAMPLED = 8.0
"""Samples of a surface along one edge of a voxel, before they are averaged."""


class Covering(NamedTuple):
    """Spheres that cover a surface.

    Attributes
    ----------
    points : (N, 3) metres. radius : metres.
    gap : the largest gap of the surface, at most the radius.
    added : how many of the points, the last ones, were added to close gaps.
    """

    points: Array
    radius: float
    gap: Gap
    added: int


def sphere_radius(radius: float | None, leaf: float | None) -> float | None:
    """d_c, metres, from itself or from the edge of the voxels that hold one point each: sqrt(3) / 2 leaf, paper A, (8).

    Raises
    ------
    InputError : both given, or one that is not > 0. None where neither is given.
    """
    if radius is not None and leaf is not None:
        raise InputError("point cloud: radius and leaf each give the radius of the spheres; give one of them")
    if leaf is not None:
        return CUBE * number(leaf, "leaf of a point cloud, metres", positive=True)
    return None if radius is None else number(radius, "radius of a point cloud, metres", positive=True)


def needed_radius(radius: float | None, leaf: float | None) -> float:
    """`sphere_radius`, of which one must be given."""
    wanted = sphere_radius(radius, leaf)
    if wanted is None:
        raise InputError("point cloud: give the radius of its spheres or the leaf of its voxels, metres")
    return wanted


def distinct(points: ArrayLike) -> Array:
    """Points (N, 3) in their order, each value once.

    Raises
    ------
    InputError : none, not finite, or beyond 1e100 m.
    """
    given = array(points, (None, 3), "points of a point cloud")
    if not len(given):
        raise InputError("points of a point cloud: expected at least one, got none")
    if np.abs(given).max() >= LARGEST:
        raise InputError(f"points of a point cloud: expected coordinates below {LARGEST:g} m; check their unit")
    _, first = np.unique(given, axis=0, return_index=True)
    return np.ascontiguousarray(given[np.sort(first)])


def covered_by(points: Array, radius: float | None, surface: Surface | None, fill: bool) -> Covering:
    """Given points (N, 3), all different, where their spheres cover; with what is missing where `fill` is set.

    radius : metres, None for the smallest that covers. surface : what they lie on; None for an estimate.

    Raises
    ------
    InputError : a gap larger than the radius where `fill` is not set, or a single point without a radius.
    """
    gap = _measured(points, radius, surface)
    if radius is None:
        if not gap.size > 0.0:
            raise InputError("point cloud: a single point has no spacing to tell a radius from; give the radius")
        return Covering(points, gap.size, gap, 0)
    if gap.size <= radius:
        return Covering(points, radius, gap, 0)
    if not fill:
        raise InputError(_refusal(points, radius, gap, surface))
    extra = missing_between(points, radius) if surface is None else missing(points, radius, surface)
    return _completed(points, extra, radius, surface)


def covering(surface: Surface, radius: float, seed: int) -> Covering:
    """Spheres of a radius, metres, that are proved to cover a surface.

    Dense samples are averaged in voxels, the down-sampling of paper A, section 5. Where a voxel holds one flat piece
    of the surface its mean is never farther from it than d_c; places that stay uncovered where a voxel holds several
    are added.

    Raises
    ------
    InputError : a surface without area, or one so large beside the radius that it needs too many samples.
    """
    leaf = radius / CUBE
    points = distinct(voxel_average(surface.samples(leaf / _OVERSAMPLED, seed), leaf))
    return _completed(points, missing(points, radius, surface), radius, surface)


def thinned(points: Array, gap: Gap, radius: float) -> Covering:
    """Spheres of another radius, metres, that cover what points (N, 3) with a known gap lie on.

    Every place of the surface is within the gap of an old point, so it stays covered where every old point is within
    radius - gap of a new one. Where the radius is smaller than the gap, the old points are kept and others added.
    """
    room = radius - gap.size
    if room <= 0.0:
        return _completed(points, missing_between(points, radius), radius, None)
    kept = distinct(voxel_average(points, radius / CUBE))
    count = len(kept)
    while True:
        distance, _ = cKDTree(kept).query(points)
        far = distance > room
        if not far.any():
            return Covering(kept, radius, Gap(float(distance.max()) + gap.size, gap.at), len(kept) - count)
        kept = np.concatenate([kept, points[far][one_in_each(points[far], 2.0 * room, distance[far])]])


def _measured(points: Array, radius: float | None, surface: Surface | None) -> Gap:
    return estimated_gap(points, radius) if surface is None else largest_gap(points, surface)


def _completed(points: Array, extra: Array, radius: float, surface: Surface | None) -> Covering:
    """Points with those that were missing; that no gap is left is known, and the measure is rounded up."""
    every = np.concatenate([points, extra])
    gap = _measured(every, radius, surface)
    return Covering(every, radius, Gap(min(gap.size, radius), gap.at), len(extra))


def _refusal(points: Array, radius: float, gap: Gap, surface: Surface | None) -> str:
    """Why a cloud is refused, in numbers."""
    if surface is None:
        where, distance = places_between(points, radius)
        open_ = distance > radius
        places = len(one_in_each(where[open_], 2.0 * radius, distance[open_]))
        found, share = "estimated from the points", f"there are about {places} such places"
        remedy = "if they are not on the surface, give the surface that the points were taken from"
    else:
        found, share = "measured", f"{100.0 * uncovered(points, radius, surface):.2g} % of the surface is not covered"
        remedy = "sample the surface again with PointCloud.from_surface"
    at = ", ".join(f"{x:.4g}" for x in gap.at)
    return (
        f"point cloud: spheres of {1e3 * radius:.4g} mm around its points leave gaps. The largest, {found}, is "
        f"{1e3 * gap.size:.4g} mm, at ({at}) m; {share}. Needed: a radius of {1e3 * gap.size:.4g} mm or a spacing "
        f'{gap.size / radius:.3g} times finer; gaps="fill" adds the missing spheres; {remedy}'
    )
