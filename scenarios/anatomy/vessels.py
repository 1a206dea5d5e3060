"""Vessels: a tree of capsules along smooth centre lines, with their exact distances."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, number
from primitives.errors import InputError
from primitives.surface import Surface
from scenarios.anatomy.shape import Shape, grid_faces

_CHUNK = 2_000_000
"""Pairs of a point and a capsule that are looked at together."""


class Branch(NamedTuple):
    """One vessel: a cubic Bezier curve as its centre line, and its radii.

    Attributes
    ----------
    control : four points (3,), metres; the first on the parent's centre line.
    first, last : radius at its beginning and end, metres.
    """

    control: Sequence[ArrayLike]
    first: float
    last: float

    def at(self, places: ArrayLike) -> Array:
        """Points (m, 3) of the centre line at places (m,) in [0, 1]."""
        s = np.asarray(places, dtype=float)[:, None]
        a, b, c, d = (array(p, (3,), "control point of a vessel") for p in self.control)
        out: Array = (1 - s) ** 3 * a + 3 * (1 - s) ** 2 * s * b + 3 * (1 - s) * s**2 * c + s**3 * d
        return out


@dataclass(frozen=True, eq=False)
class Vessels(Shape):
    """The union of capsules.

    The distance is exact outside and on the surface; inside it is negative and no larger in size than the depth. A
    mesh of it leaves out triangles that lie inside, not those that cross into another capsule.

    Parameters
    ----------
    starts, ends : (m, 3) the capsules' axes, metres.
    radii : (m,) metres.

    Raises
    ------
    InputError : no capsules, or arrays that do not fit one another, or a radius that is not > 0.
    """

    starts: Array
    ends: Array
    radii: Array

    def __post_init__(self) -> None:
        super().__post_init__()
        radii = array(self.radii, (None,), "radii of Vessels")
        if not len(radii) or radii.min() <= 0.0:
            raise InputError(f"radii of Vessels: expected numbers > 0, got {radii.tolist()}")
        values = {"starts": array(self.starts, (len(radii), 3), "starts of Vessels")}
        values |= {"ends": array(self.ends, (len(radii), 3), "ends of Vessels"), "radii": radii}
        for name, value in values.items():
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def tree(cls, branches: Iterable[Branch], pieces: int) -> Self:
        """Capsules along the centre lines of branches, so many pieces each, whose radii taper from piece to piece."""
        starts, ends, radii = [], [], []
        for branch in branches:
            line = branch.at(np.linspace(0.0, 1.0, pieces + 1))
            starts.append(line[:-1])
            ends.append(line[1:])
            middle = (np.arange(pieces) + 0.5) / pieces
            first, last = (number(r, "radius of a vessel, metres", positive=True) for r in branch[1:])
            radii.append(first + (last - first) * middle)
        if not starts:
            raise InputError("vessels: expected at least one branch, got none")
        return cls(np.concatenate(starts), np.concatenate(ends), np.concatenate(radii))

    def _each(self, points: Array) -> Array:
        """Signed distance (n, m) of n points from each capsule."""
        axis = self.ends - self.starts
        square = (axis * axis).sum(axis=1)
        offset = points[:, None, :] - self.starts
        place = (offset * axis).sum(axis=2) / np.where(square > 0.0, square, 1.0)
        away = offset - np.clip(place, 0.0, 1.0)[..., None] * axis
        out: Array = np.linalg.norm(away, axis=2) - self.radii
        return out

    def _distance(self, points: Array) -> Array:
        parts = np.array_split(points, len(points) * len(self.radii) // _CHUNK + 1)
        return np.concatenate([self._each(p).min(axis=1) for p in parts])

    def _segment_distance(self, start: Array, direction: Array, length: Array) -> Array:
        out = np.empty(len(start))
        for i in range(len(start)):
            away = _between_segments(start[i], length[i] * direction[i], self.starts, self.ends - self.starts)
            out[i] = (away - self.radii).min()
        return out

    def _surface(self, edge: float) -> Surface:
        vertices, faces, owner, count = [], [], [], 0
        for k in range(len(self.radii)):
            points, triangles = _capsule(self.starts[k], self.ends[k], float(self.radii[k]), edge)
            vertices.append(points)
            faces.append(triangles + count)
            owner.append(np.full(len(triangles), k))
            count += len(points)
        every, triangles, owners = np.concatenate(vertices), np.concatenate(faces), np.concatenate(owner)
        # A triangle whose corners lie in one other capsule lies in it altogether, since a capsule is convex.
        inside = np.concatenate([self._each(p) < 0.0 for p in np.array_split(every, len(every) // 20_000 + 1)])
        hidden = inside[triangles].all(axis=1)
        hidden[np.arange(len(triangles)), owners] = False
        used, faces_left = np.unique(triangles[~hidden.any(axis=1)], return_inverse=True)
        return Surface(every[used], faces_left.reshape(-1, 3))


def _between_segments(a: Array, u: Array, b: Array, v: Array) -> Array:
    """Distances (m,) of the segment a + s u, s in [0, 1], from m segments b + t v.

    The smallest is at an end of one of them, or between the lines where both feet lie inside.
    """
    best = np.full(len(b), np.inf)
    for p in (a, a + u):
        best = np.minimum(best, _point_segment(p - b, v))
    for q in (b, b + v):
        best = np.minimum(best, _point_segment(q - a, np.broadcast_to(u, v.shape)))
    normal = np.cross(u, v)
    square = (normal * normal).sum(axis=1)
    crossing = square > 1e-24 * (u @ u) * (v * v).sum(axis=1)
    scale = np.where(crossing, square, 1.0)
    offset = b - a
    s = (np.cross(offset, v) * normal).sum(axis=1) / scale
    t = (np.cross(offset, u) * normal).sum(axis=1) / scale
    between = crossing & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    lines = np.abs((offset * normal).sum(axis=1)) / np.sqrt(scale)
    return np.where(between, np.minimum(best, lines), best)


def _point_segment(offset: Array, axis: Array) -> Array:
    """Length of offset - t axis for the best t in [0, 1]; rows of both."""
    square = (axis * axis).sum(axis=1)
    t = np.clip((offset * axis).sum(axis=1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    out: Array = np.linalg.norm(offset - t[:, None] * axis, axis=1)
    return out


def _capsule(start: Array, end: Array, radius: float, edge: float) -> tuple[Array, np.ndarray]:
    """Vertices and triangles of one capsule."""
    around = max(int(np.ceil(2.0 * np.pi * radius / edge)), 8)
    caps = max(around // 4, 2)
    length = float(np.linalg.norm(end - start))
    along = max(int(np.ceil(length / edge)), 1)
    z = (end - start) / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    polar = np.linspace(0.0, 0.5 * np.pi, caps + 1)
    body = length * np.arange(1, along) / along
    height = np.concatenate([-radius * np.cos(polar), body, length + radius * np.cos(polar[::-1])])
    across = np.concatenate([radius * np.sin(polar), np.full(along - 1, radius), radius * np.sin(polar[::-1])])
    azimuth = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    ring = np.cos(azimuth)[:, None] * x + np.sin(azimuth)[:, None] * y
    points = start + height[:, None, None] * z + across[:, None, None] * ring
    return points.reshape(-1, 3), grid_faces(len(height), around)
