"""A uniform grid over points, and the points near a segment by it: what a whole tool can touch, without looking at all.

Points are stored sorted by cell, cells x-major, so the cells of one column along z are one contiguous range of points.
A query finds for each column within the segment's bounding slabs where the column meets the segment's capsule, which
is convex: one interval, three square roots, however many cells it spans.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, number
from primitives.compiled import compiled
from primitives.errors import InputError

NOT_FINITE = -1
"""What a query returns for numbers that are not finite, or a reach or length below zero."""
NO_ROOM = -2
"""What a query returns where the arrays for its result are too short."""
LARGEST = 1e100
"""Metres; beyond it squares leave the range of a float."""

_GROWTH = 2.0 ** (1.0 / 3.0)
_HALF_DIAGONAL = 0.5 * 3.0**0.5
_SMALLEST = 1e-9
_ROUNDING = 1e-14
_SLACK = 1e-6
"""Of a cell, by which a query looks further than it must, so that no rounding of a cell's face loses a point."""


class VoxelGrid(NamedTuple):
    """N points sorted by cell, in the coordinates they were given in.

    Attributes
    ----------
    points : (N, 3) metres, sorted by cell; cells are ordered x-major, so along z they are neighbours.
    order : (N,) int64, index of each sorted point among the points as they were given.
    start : (cells + 1,) int64, first sorted point of each cell.
    shape : (3,) int64, cells along each axis.
    origin : (3,) corner of cell (0, 0, 0), metres.
    cell : edge of a cell, metres.
    """

    points: Array
    order: np.ndarray
    start: np.ndarray
    shape: np.ndarray
    origin: Array
    cell: float


def _cells(extent: Array, cell: float, most: int) -> tuple[Array, float]:
    """Cells along each axis, and the edge, grown by the cube root of two until there are at most that many."""
    shape = np.floor(extent / cell) + 1.0
    while not np.prod(shape) <= most:
        cell *= _GROWTH
        shape = np.floor(extent / cell) + 1.0
    return shape, cell


def build_grid(points: ArrayLike, cell: float | None = None) -> VoxelGrid:
    """A grid over points (N, 3), metres.

    Parameters
    ----------
    cell : edge of a cell, metres; larger where more than 4 N + 64 cells would be needed. None for the smallest of
        which N / 4 + 64 cells fill the points' bounding box: 5.6 mm for 10^4 points of an organ's surface, 2.8 mm
        for 10^5. Queries are fastest near a quarter to a third of the reach, and little slower within a factor of two.

    Raises
    ------
    InputError : no points, not finite or beyond 1e100 m, or a cell <= 0.
    """
    given = array(points, (None, 3), "points of a voxel grid")
    count = len(given)
    if not count:
        raise InputError("points of a voxel grid: expected at least one point, got none")
    if np.abs(given).max() >= LARGEST:
        raise InputError(f"points of a voxel grid: expected coordinates below {LARGEST:g} m; check their unit")
    origin = given.min(axis=0)
    extent = given.max(axis=0) - origin
    with np.errstate(over="ignore"):
        if cell is None:
            wanted, most = float(extent.max()) / count, count // 4 + 64
        else:
            wanted, most = number(cell, "cell of a voxel grid, metres", positive=True), 4 * count + 64
        shape, edge = _cells(extent, max(wanted, _SMALLEST), most)
    place = np.minimum(np.floor((given - origin) / edge), shape - 1.0).astype(np.int64)
    counts = shape.astype(np.int64)
    key = (place[:, 0] * counts[1] + place[:, 1]) * counts[2] + place[:, 2]
    order = np.argsort(key, kind="stable")
    start = np.zeros(int(counts.prod()) + 1, dtype=np.int64)
    np.cumsum(np.bincount(key, minlength=len(start) - 1), out=start[1:])
    return VoxelGrid(np.ascontiguousarray(given[order]), order, start, counts, origin, edge)


@compiled("int64(float64, int64)")
def _clip(value: float, count: int) -> int:
    """A number as an index 0 ... count - 1."""
    return int(min(max(value, 0.0), float(count - 1)))


@compiled("Tuple((float64, float64))(float64[::1], int64, float64, float64, float64, float64)")
def _part(direction: Array, axis: int, offset: float, length: float, low: float, high: float) -> tuple[float, float]:
    """The part [s0, s1] of a segment that lies between two planes across an axis; s0 > s1 where there is none."""
    d = direction[axis]
    if abs(d) * length < 1e-12 * (high - low):
        return (0.0, length) if low <= offset + length * abs(d) and offset - length * abs(d) <= high else (1.0, 0.0)
    a, b = (low - offset) / d, (high - offset) / d
    return max(min(a, b), 0.0), min(max(a, b), length)


@compiled("Tuple((float64, float64))(float64[::1], float64, float64, float64, float64)")
def _column(direction: Array, length: float, x: float, y: float, radius: float) -> tuple[float, float]:
    """Where a line along z at (x, y) from the segment's base lies within a radius of the segment: [low, high].

    The capsule is convex, so its two end spheres and those crossings of the cylinder whose foot lies on the segment
    bound the interval. low > high where there is none.
    """
    dx, dy, dz = direction[0], direction[1], direction[2]
    square = radius * radius
    low, high = np.inf, -np.inf
    across = x * x + y * y
    if across <= square:
        high = np.sqrt(square - across)
        low = -high
    ex, ey, ez = x - length * dx, y - length * dy, length * dz
    beyond = square - ex * ex - ey * ey
    if beyond >= 0.0:
        half = np.sqrt(beyond)
        low, high = min(low, ez - half), max(high, ez + half)
    slope = dx * dx + dy * dy
    along = x * dx + y * dy
    inside = along * dz * along * dz - slope * (across - along * along - square)
    if slope > 1e-14 and inside >= 0.0:
        half = np.sqrt(inside)
        for root in ((along * dz - half) / slope, (along * dz + half) / slope):
            if 0.0 <= along + root * dz <= length:
                low, high = min(low, root), max(high, root)
    return low, high


@compiled("Tuple((float64, float64))(float64[:,::1], int64, float64[::1], float64[::1], float64)")
def _apart(points: Array, k: int, base: Array, direction: Array, length: float) -> tuple[float, float]:
    """The place of a segment that is nearest to point k, and the square of their distance."""
    x, y, z = points[k, 0] - base[0], points[k, 1] - base[1], points[k, 2] - base[2]
    s = min(max(x * direction[0] + y * direction[1] + z * direction[2], 0.0), length)
    x -= s * direction[0]
    y -= s * direction[1]
    z -= s * direction[2]
    return s, x * x + y * y + z * z


@compiled("float64(float64[::1], float64[::1], float64, float64)")
def _size(base: Array, direction: Array, length: float, reach: float) -> float:
    """Sum of what a query holds; not below `LARGEST` where it cannot be answered."""
    for i in range(3):
        if not abs(direction[i]) <= 1.0 + 1e-6:
            return np.inf
    if not (length >= 0.0 and reach >= 0.0):
        return np.inf
    return float(abs(base[0]) + abs(base[1]) + abs(base[2]) + length + reach)


_QUERY = (
    "int64(float64[:,::1], int64[::1], int64[::1], float64[::1], float64, float64[::1], float64[::1], float64, float64,"
)
_FOUND = "int64[::1], float64[::1], float64[::1])"


@compiled(_QUERY + "boolean," + _FOUND)
def _walk(
    points: Array,
    start: np.ndarray,
    shape: np.ndarray,
    origin: Array,
    cell: float,
    base: Array,
    direction: Array,
    length: float,
    reach: float,
    shrink: bool,
    index: np.ndarray,
    place: Array,
    distance: Array,
) -> int:
    """Points within reach of a segment; with `shrink` the nearest of them only, the reach shrinking to each found."""
    rounding = _ROUNDING * (length + reach)
    for i in range(3):
        rounding += _ROUNDING * (abs(base[i] - origin[i]) + abs(origin[i]) + cell * shape[i])
    slack = _SLACK * cell + rounding
    square, around, found = reach * reach, reach + slack, 0
    x, y, z = base[0] - origin[0], base[1] - origin[1], base[2] - origin[2]
    end = x + length * direction[0]
    low, high = np.floor((min(x, end) - around) / cell), np.floor((max(x, end) + around) / cell)
    if high < 0.0 or low > shape[0] - 1:
        return 0
    for i in range(_clip(low, shape[0]), _clip(high, shape[0]) + 1):
        s0, s1 = _part(direction, 0, x, length, i * cell - around, (i + 1) * cell + around)
        y0, y1 = y + s0 * direction[1], y + s1 * direction[1]
        low, high = np.floor((min(y0, y1) - around) / cell), np.floor((max(y0, y1) + around) / cell)
        if s0 > s1 or high < 0.0 or low > shape[1] - 1:
            continue
        for j in range(_clip(low, shape[1]), _clip(high, shape[1]) + 1):
            # A cell may hold a point within reach where its centre is within reach and half of its diagonal.
            z0, z1 = _column(
                direction, length, (i + 0.5) * cell - x, (j + 0.5) * cell - y, around + _HALF_DIAGONAL * cell
            )
            low, high = np.ceil((z + z0) / cell - 0.5), np.floor((z + z1) / cell - 0.5)
            if low > high or high < 0.0 or low > shape[2] - 1:
                continue
            column = (i * shape[1] + j) * shape[2]
            for k in range(start[column + _clip(low, shape[2])], start[column + _clip(high, shape[2]) + 1]):
                s, apart = _apart(points, k, base, direction, length)
                if apart > square or (shrink and found and apart == square):
                    continue
                at = 0 if shrink else found
                index[at], place[at], distance[at] = k, s, np.sqrt(apart)
                found = at + 1
                if shrink:
                    square, around = apart, distance[0] + slack
    return found


@compiled(_QUERY + _FOUND)
def near_segment(
    points: Array,
    start: np.ndarray,
    shape: np.ndarray,
    origin: Array,
    cell: float,
    base: Array,
    direction: Array,
    length: float,
    reach: float,
    index: np.ndarray,
    place: Array,
    distance: Array,
) -> int:
    """Every point within reach of the segment base + s direction, s in [0, length]; none is ever missed.

    Parameters
    ----------
    points, start, shape, origin, cell : the fields of a `VoxelGrid`.
    base : (3,) metres, in the grid's coordinates. direction : (3,) unit. length : metres, 0 for a point.
    reach : metres; a point at exactly this distance counts.
    index, place, distance : (N,) filled in sorted order of the points: place in `points`, s, distance, metres.

    Returns
    -------
    How many were found; `NOT_FINITE` where a number is not finite or beyond 1e100, a reach or length negative or a
    direction no unit vector; `NO_ROOM` where index, place or distance is shorter than the points.
    """
    count = points.shape[0]
    if index.shape[0] < count or place.shape[0] < count or distance.shape[0] < count:
        return NO_ROOM
    if not _size(base, direction, length, reach) < LARGEST:
        return NOT_FINITE
    return _walk(points, start, shape, origin, cell, base, direction, length, reach, False, index, place, distance)


@compiled(_QUERY + _FOUND)
def nearest_to_segment(
    points: Array,
    start: np.ndarray,
    shape: np.ndarray,
    origin: Array,
    cell: float,
    base: Array,
    direction: Array,
    length: float,
    reach: float,
    index: np.ndarray,
    place: Array,
    distance: Array,
) -> int:
    """The point nearest to a segment, of those within reach; of several the first in sorted order.

    Arguments as of `near_segment`; of index, place and distance the first item is filled. The cloud is searched at
    distances that double from one cell on, so a near point is found without a look at the others.

    Returns
    -------
    1, or 0 where none is within reach, or `NOT_FINITE` or `NO_ROOM` as `near_segment` does.
    """
    if index.shape[0] < 1 or place.shape[0] < 1 or distance.shape[0] < 1:
        return NO_ROOM
    if not _size(base, direction, length, reach) < LARGEST:
        return NOT_FINITE
    within = min(cell, reach)
    while True:
        found = _walk(points, start, shape, origin, cell, base, direction, length, within, True, index, place, distance)
        if found or within >= reach:
            return found
        within = min(2.0 * within, reach)
