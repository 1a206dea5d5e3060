"""The largest gap of a cloud of which no surface is known, from the points alone.

Around each point the surface is taken to be flat, and the point's Voronoi cell is cut with the tangent plane: a convex
polygon, each corner of which is as far from the point as from two neighbours. Those three points are a triangle of the
surface, and the middle of its circumcircle is the place between them that is farthest from each. Cutting the
cell of space, not a cell of projections, keeps points of another wall behind this one out of it.
"""

import numpy as np
from scipy.spatial import cKDTree

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.coverage import Gap, one_in_each
from primitives.errors import InputError

EDGE = 3.0
"""A hole wider than this many radii (or typical spacings) cannot be told from the edge of an open surface."""

FILLED = 10
"""Spheres that may be added to close gaps, for each point of a cloud."""

_MARGIN = 100
_PLANE = 12
"""Neighbours that a tangent plane is fitted to."""
_FIRST, _LAST = 32, 256
"""Neighbours that a cell is cut by, at first and where these leave it open."""
_SEEN = 13.0
"""Spacings across a half disc that holds that many neighbours: the widest hole that its rim sees across."""
_CORNERS = 16
"""Corners of a cell that are looked at; a Voronoi cell of a surface has six on average."""
_CHUNK = 20_000
_DECIDED, _UNDECIDED = 0, 1


@compiled("int64(float64[:,::1], int64[::1], int64, float64, float64, float64, int64, float64[:,::1], int64[::1])")
def _cut(
    x: Array, label: np.ndarray, size: int, u: float, v: float, h: float, name: int, y: Array, named: np.ndarray
) -> int:
    """Cut a convex polygon to u x + v y <= h and give the new edge a name; labels are those of the edge that follows.

    y and named are scratch as long as x and label. Returns the corners that remain.
    """
    out = 0
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        here, there = u * x[i, 0] + v * x[i, 1] - h, u * x[j, 0] + v * x[j, 1] - h
        if here <= 0.0:
            y[out, 0], y[out, 1], named[out] = x[i, 0], x[i, 1], label[i]
            out += 1
        if (here <= 0.0) != (there <= 0.0):
            t = here / (here - there)
            y[out, 0], y[out, 1] = x[i, 0] + t * (x[j, 0] - x[i, 0]), x[i, 1] + t * (x[j, 1] - x[i, 1])
            named[out] = name if here <= 0.0 else label[i]
            out += 1
    for i in range(out):
        x[i, 0], x[i, 1], label[i] = y[i, 0], y[i, 1], named[i]
    return out


@compiled("void(float64[:,::1], int64[::1], int64[:,::1], float64[:,:,::1], float64, int64[:,:,::1], int64[::1])")
def _corners(
    points: Array, which: np.ndarray, near: np.ndarray, basis: Array, bound: float, pairs: np.ndarray, state: np.ndarray
) -> None:
    """For each of some points the pairs of neighbours that make the corners of its cell.

    near (m, k) : neighbours of each, nearest first. basis (m, 3, 3) : columns 1 and 2 span the tangent plane.
    bound : half the edge of the square that a cell is cut from, metres; its own corners do not count.
    pairs (m, c, 2), state (m,) : results, -1 where there are fewer; undecided where further neighbours could still
    cut the cell.
    """
    k = near.shape[1]
    x, y = np.empty((k + 8, 2)), np.empty((k + 8, 2))
    label, named = np.empty(k + 8, dtype=np.int64), np.empty(k + 8, dtype=np.int64)
    for row in range(which.shape[0]):
        p, size = which[row], 4
        for i in range(4):
            x[i, 0], x[i, 1] = bound if i in (0, 3) else -bound, bound if i < 2 else -bound
            label[i] = -1
        state[row] = _UNDECIDED
        for j in range(k):
            q = near[row, j]
            if q == p:
                continue
            u, v, square, farthest = 0.0, 0.0, 0.0, 0.0
            for i in range(3):
                d = points[q, i] - points[p, i]
                u, v, square = u + basis[row, i, 1] * d, v + basis[row, i, 2] * d, square + d * d
            for i in range(size):
                farthest = max(farthest, x[i, 0] * x[i, 0] + x[i, 1] * x[i, 1])
            if square > 4.0 * farthest:
                state[row] = _DECIDED
                break
            size = _cut(x, label, size, u, v, 0.5 * square, q, y, named)
        for i in range(pairs.shape[1]):
            a, b = (label[i - 1 if i else size - 1], label[i]) if i < size else (-1, -1)
            pairs[row, i, 0], pairs[row, i, 1] = (a, b) if a >= 0 and b >= 0 else (-1, -1)


def _places(points: Array, bound: float) -> Array:
    """Middles (m, 3) of the triangles that corners of the points' cells make, of those that hold their own middle."""
    count = len(points)
    tree = cKDTree(points)
    found = [np.zeros((0, 3))]
    which = np.arange(count)
    for k in (min(_FIRST, count), min(_LAST, count)):
        undecided = [which[:0]]
        for rows in np.array_split(which, len(which) // _CHUNK + 1):
            _, near = tree.query(points[rows], k=k)
            near = near.reshape(len(rows), k)
            local = points[near[:, : _PLANE + 1]]
            local = local - local.mean(axis=1, keepdims=True)
            _, basis = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local))
            pairs, state = np.empty((len(rows), _CORNERS, 2), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
            _corners(points, rows, near.astype(np.int64), np.ascontiguousarray(basis), bound, pairs, state)
            kept = pairs[..., 0] >= 0
            found.append(_circumcentres(points[np.c_[np.repeat(rows, _CORNERS)[kept.ravel()], pairs[kept]]]))
            undecided.append(rows[state == _UNDECIDED])
        which = np.concatenate(undecided)
    return np.concatenate(found)


def _circumcentres(corners: Array) -> Array:
    """Middle of the circle through the corners (m, 3, 3) of each triangle that holds it: at most m of them."""
    p, a, b = np.moveaxis(corners, 1, 0)
    a, b = a - p, b - p
    aa, bb, ab = (a * a).sum(axis=1), (b * b).sum(axis=1), (a * b).sum(axis=1)
    normal = np.cross(a, b)
    square = (normal * normal).sum(axis=1)
    holds = (ab >= 0.0) & (ab <= aa) & (ab <= bb) & (square > 1e-20 * aa * bb)
    aa, bb = aa[holds, None], bb[holds, None]
    out: Array = p[holds] + np.cross(aa * b[holds] - bb * a[holds], normal[holds]) / (2.0 * square[holds, None])
    return out


def typical_spacing(points: Array) -> float:
    """Median distance from a point to its nearest neighbour, metres; 0 for a single point."""
    if len(points) == 1:
        return 0.0
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))


def places_between(points: Array, radius: float | None = None) -> tuple[Array, Array]:
    """Places (m, 3) that lie between the points (N, 3), and their distances (m,) from them, metres.

    The arguments are those of `estimated_gap`. Holes much wider than the spacing are looked for in thinned copies
    of the cloud, each with twice the spacing of the one before; distances are always from the whole cloud.
    """
    spacing = typical_spacing(points)
    bound = EDGE * (spacing if radius is None else radius)
    found, level, edge = [points[:1]], points, spacing
    while spacing > 0.0 and len(level) > 2:
        found.append(_places(level, bound))
        if _SEEN * edge > 2.0 * bound:
            break
        edge *= 2.0
        level = np.ascontiguousarray(points[one_in_each(points, edge, np.zeros(len(points)))])
    where = np.concatenate(found)
    tree = cKDTree(points)
    distance, _ = tree.query(where)
    if len(points) > 1:
        nearest, partner = tree.query(points, k=2)
        where = np.concatenate([where, 0.5 * (points + points[partner[:, 1]])])
        distance = np.concatenate([distance, 0.5 * nearest[:, 1]])
    return where, distance


def estimated_gap(points: Array, radius: float | None = None) -> Gap:
    """The largest gap of the surface that points (N, 3), all different, lie on, estimated from them.

    Where the surface is smooth at the scale of the spacing it is 0.9 to 1.02 of the true one, the lower where that is
    at the rim of an open surface. The open end of a thin vessel, and the space between branches or between walls less
    than about three spacings apart, may be taken for a hole: then it is too large, by up to `EDGE` times. A hole that
    reaches the rim of an open surface is not seen, nor one wider than `EDGE` radii: without the surface nobody can
    tell it from the rim. A point without neighbours makes a gap of half its distance from the nearest.

    Parameters
    ----------
    radius : that of the spheres, metres; None where it is not known, and the typical spacing stands for it.
    """
    where, distance = places_between(points, radius)
    at = int(np.argmax(distance))
    return Gap(float(distance[at]), where[at])


def missing_between(points: Array, radius: float) -> Array:
    """Places (m, 3) that, added to the points (N, 3), leave no estimated gap above a radius; (0, 3) for none.

    Raises
    ------
    InputError : more than `FILLED` times as many as there are points: they lie too far apart to be one surface.
    """
    added = np.zeros((0, 3))
    while len(added) <= FILLED * (len(points) + _MARGIN):
        where, distance = places_between(np.concatenate([points, added]), radius)
        open_ = distance > radius
        if not open_.any():
            return added
        where = where[open_]
        added = np.concatenate([added, where[one_in_each(where, 2.0 * radius, distance[open_])]])
    raise InputError(
        f"point cloud: closing the gaps between {len(points)} points with spheres of {1e3 * radius:.4g} mm takes more "
        f"than {len(added)} others; check the unit and look for stray points, or give the surface they were taken from"
    )
