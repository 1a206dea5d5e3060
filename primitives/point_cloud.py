"""`PointCloud`: a forbidden surface as points, each the centre of a sphere of radius d_c; paper A, (8)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, known, number
from primitives.cloud_gap import estimated_gap
from primitives.compiled import compiled
from primitives.conversions import as_pose
from primitives.coverage import Gap
from primitives.covering import (
    CUBE,
    Covering,
    covered_by,
    covering,
    distinct,
    needed_radius,
    sphere_radius,
    thinned,
)
from primitives.errors import InputError
from primitives.files.document import printable
from primitives.surface import Surface
from primitives.units import check_size, metres
from primitives.voxel_grid import LARGEST, VoxelGrid, build_grid, near_segment, nearest_to_segment

IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
IDENTITY.setflags(write=False)

Gaps = Literal["refuse", "fill"]


@compiled("void(float64[::1], float64[::1], float64[::1], float64[::1], float64[::1])")
def into_frame(placement: Array, base: Array, direction: Array, local_base: Array, local_direction: Array) -> None:
    """A point and a direction of the world in the coordinates of a frame whose pose in the world is given.

    placement (12,) : rotation row by row, then translation, as in `kinematics`. Results fill local_base (3,) and
    local_direction (3,), which must not be the arguments.
    """
    for i in range(3):
        local_base[i], local_direction[i] = 0.0, 0.0
        for j in range(3):
            local_base[i] += placement[3 * j + i] * (base[j] - placement[9 + j])
            local_direction[i] += placement[3 * j + i] * direction[j]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Spheres of one radius around points, which together cover a surface.

    The constructor takes spheres as they are, without a look at the gaps between them; `from_points` and
    `from_surface` see to it that there are none. Points and grid stay in the cloud's own frame: moving a cloud costs
    some tens of microseconds, whatever its size.

    Parameters
    ----------
    points : (N, 3) metres in the cloud's own frame, N >= 1. Points that are equal to the digit are kept once: a
        second one would double the force, not the region.
    radius : d_c of (8), metres.
    pose : (8,) unit dual quaternion of the cloud's frame in the world.
    gap : the largest gap of the covered surface; None where it was not measured.
    added : how many of the points, the last ones, were added to close gaps.

    Raises
    ------
    InputError : no points, not finite, beyond 1e100 m, or a radius <= 0.
    """

    points: Array
    radius: float
    pose: Array = field(default_factory=IDENTITY.copy)
    gap: Gap | None = None
    added: int = 0

    def __post_init__(self) -> None:
        points = distinct(self.points)
        points.setflags(write=False)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "radius", number(self.radius, "radius of a point cloud, metres", positive=True))
        self._put(self.pose)

    def _put(self, pose: ArrayLike) -> None:
        value = as_pose(pose, "pose of a point cloud")
        value.setflags(write=False)
        object.__setattr__(self, "pose", value)

    @classmethod
    def from_points(
        cls,
        points: ArrayLike,
        *,
        radius: float | None = None,
        leaf: float | None = None,
        surface: Surface | None = None,
        gaps: Gaps = "refuse",
        unit: str = "m",
        pose: ArrayLike = IDENTITY,
    ) -> Self:
        """A cloud of given points, whose largest gap is measured and must not exceed the radius.

        Parameters
        ----------
        points : (N, 3) in `unit`.
        radius, leaf : d_c, metres, or the edge, metres, of the voxels that the points were averaged in; d_c is then
            sqrt(3) / 2 leaf (8). Neither for the smallest radius that covers.
        surface : what the points were taken from, in the same frame, metres; the gap is then measured on it. Without
            it the gap is estimated from the points (`cloud_gap.estimated_gap`), too large where vessels branch.
        gaps : "refuse" one that exceeds the radius, or "fill" it with further spheres.

        Raises
        ------
        InputError : unusable points, both radius and leaf, or a gap that exceeds the radius: how large it is and
            where, how much is not covered, and what would help.
        """
        given = distinct(array(points, (None, 3), "points of a point cloud") * metres(unit))
        fill = known("way to treat gaps", gaps, get_args(Gaps)) == "fill"
        return cls._of(covered_by(given, sphere_radius(radius, leaf), surface, fill), pose)

    @classmethod
    def from_surface(
        cls,
        surface: Surface,
        *,
        radius: float | None = None,
        leaf: float | None = None,
        seed: int = 0,
        pose: ArrayLike = IDENTITY,
    ) -> Self:
        """Spheres that are proved to cover a surface: dense samples, averaged in voxels, and what is still missing.

        Parameters
        ----------
        surface : triangles, metres.
        radius, leaf : one of them, as in `from_points`.
        seed : of the samples; the same seed gives the same cloud to the bit.

        Raises
        ------
        InputError : not exactly one of radius and leaf, a surface without area, or one so large beside the radius
            that it would need more than 2 x 10^7 samples.
        """
        return cls._of(covering(surface, needed_radius(radius, leaf), seed), pose)

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        *,
        radius: float | None = None,
        leaf: float | None = None,
        gaps: Gaps = "refuse",
        unit: str = "m",
        expected: float | None = None,
        seed: int = 0,
        pose: ArrayLike = IDENTITY,
    ) -> Self:
        """The cloud of a PLY, STL, OBJ, GLB or PCD file: `from_surface` where it has triangles, else `from_points`.

        expected : about how long the thing is, metres; another size by more than ten times is refused.

        Raises
        ------
        FileError : a file that cannot be read. InputError : as the two say.
        """
        from primitives.files.mesh_file import read_surface

        surface = read_surface(path, unit=unit)
        if expected is not None:
            check_size(float(np.ptp(surface.bounds, axis=0).max()), expected, unit=unit, what=printable(str(path)))
        if len(surface.faces):
            return cls.from_surface(surface, radius=radius, leaf=leaf, seed=seed, pose=pose)
        return cls.from_points(surface.vertices, radius=radius, leaf=leaf, gaps=gaps, pose=pose)

    @classmethod
    def _of(cls, found: Covering, pose: ArrayLike) -> Self:
        return cls(found.points, found.radius, as_pose(pose, "pose of a point cloud"), found.gap, found.added)

    @property
    def density(self) -> float:
        """rho of (8), points per m^3: one for each cube that a sphere holds."""
        return float((CUBE / self.radius) ** 3)

    @cached_property
    def grid(self) -> VoxelGrid:
        """The points sorted into voxels, in the cloud's own frame; a moved cloud shares it."""
        return build_grid(self.points)

    @property
    def placement(self) -> Array:
        """(12,) rotation row by row and translation of the pose, for compiled code."""
        pose = np.array(self.pose)
        return np.concatenate([dq.rotation_matrix(pose).ravel(), dq.translation(pose)])

    @property
    def world_points(self) -> Array:
        """(N, 3) where the pose puts the points, metres."""
        pose = np.array(self.pose)
        out: Array = self.points @ dq.rotation_matrix(pose).T + dq.translation(pose)
        return out

    def moved(self, pose: ArrayLike) -> Self:
        """The same cloud at another pose (8,), sharing points and grid."""
        _ = self.grid
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._put(pose)
        return other

    def resampled(self, *, radius: float | None = None, leaf: float | None = None) -> Self:
        """The cloud with spheres of another radius: fewer points for a larger one, gaps filled for a smaller one.

        Raises
        ------
        InputError : not exactly one of radius and leaf.
        """
        wanted = needed_radius(radius, leaf)
        points = np.array(self.points)
        return self._of(thinned(points, self.gap or estimated_gap(points, wanted), wanted), self.pose)

    def near(self, start: ArrayLike, end: ArrayLike, reach: float) -> tuple[np.ndarray, Array, Array]:
        """Points within reach of a segment of the world, (3,) to (3,), metres; the ends may be one point.

        Returns
        -------
        Indices (k,) into `points`, places (k,) along the segment and distances (k,) of the points, metres.
        """
        return self._query(near_segment, start, end, number(reach, "reach, metres", low=0.0), len(self.points))

    def segment_distance(self, start: ArrayLike, end: ArrayLike) -> float:
        """Distance of a segment of the world from the spheres, metres; negative where it enters one."""
        _, _, distance = self._query(nearest_to_segment, start, end, 0.5 * LARGEST, 1)
        return float(distance[0]) - self.radius

    def distance(self, points: ArrayLike) -> Array:
        """Distances (m,) of points (m, 3) of the world from the spheres, metres; negative inside."""
        pose = dq.conjugate(np.array(self.pose))
        local = array(points, (None, 3), "points") @ dq.rotation_matrix(pose).T + dq.translation(pose)
        out: Array = self._tree.query(local)[0] - self.radius
        return out

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    def _query(
        self, kernel: Callable[..., int], start: ArrayLike, end: ArrayLike, reach: float, room: int
    ) -> tuple[np.ndarray, Array, Array]:
        a, b = array(start, (3,), "start of the segment"), array(end, (3,), "end of the segment")
        length = float(np.linalg.norm(b - a))
        direction = (b - a) / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
        base, along = np.empty(3), np.empty(3)
        into_frame(self.placement, a, direction, base, along)
        index, place, distance = np.empty(room, dtype=np.int64), np.empty(room), np.empty(room)
        g = self.grid
        arguments = (g.points, g.start, g.shape, g.origin, g.cell, base, along, length, reach, index, place, distance)
        count = kernel(*arguments)
        if count < 0:
            raise InputError(f"segment of a query: expected coordinates below 1e100 m, got {a.tolist()}, {b.tolist()}")
        return g.order[index[:count]], place[:count], distance[:count]
