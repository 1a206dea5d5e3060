"""`Shape`: a piece of procedural anatomy whose distance is known exactly, and which can be sampled into a cloud."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, number
from primitives.conversions import as_pose
from primitives.errors import InputError
from primitives.point_cloud import IDENTITY, PointCloud
from primitives.surface import Surface

_EDGES = 4.0
"""Triangle edges of the mesh along one radius of a cloud's spheres."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Shape(ABC):
    """A surface somewhere in the world; points and distances are in world coordinates, metres.

    Parameters
    ----------
    pose : (8,) unit dual quaternion of the shape's own frame in the world.
    """

    pose: Array = field(default_factory=IDENTITY.copy)

    def __post_init__(self) -> None:
        pose = as_pose(self.pose, f"pose of {type(self).__name__}")
        pose.setflags(write=False)
        object.__setattr__(self, "pose", pose)

    @abstractmethod
    def _surface(self, edge: float) -> Surface:
        """Triangles whose edges are about that long or shorter, in the shape's own frame."""

    @abstractmethod
    def _distance(self, points: Array) -> Array:
        """Of points (m, 3) in the shape's own frame, (m,)."""

    @abstractmethod
    def _segment_distance(self, start: Array, direction: Array, length: Array) -> Array:
        """Of segments start + s direction (m, 3), s in [0, length (m,)], in the shape's own frame; (m,)."""

    def placed(self, pose: ArrayLike) -> Self:
        """The same shape at another pose (8,)."""
        return replace(self, pose=as_pose(pose, f"pose of {type(self).__name__}"))

    def surface(self, edge: float) -> Surface:
        """A mesh for drawing, with vertices on the shape and edges of about a length or shorter, metres."""
        wanted = number(edge, "edge of a mesh, metres", positive=True)
        return self._surface(wanted).placed(self.pose)

    def cloud(self, radius: float, seed: int = 0) -> PointCloud:
        """The shape covered by spheres of a radius d_c, metres; the same for the same seed."""
        edge = number(radius, "radius of a cloud, metres", positive=True) / _EDGES
        return PointCloud.from_surface(self._surface(edge), radius=radius, seed=seed, pose=self.pose)

    def distance(self, points: ArrayLike) -> Array:
        """Distances (m,) of points (m, 3), metres; of closed shapes they are negative inside."""
        return self._distance(self._local(array(points, (None, 3), "points")))

    def segment_distance(self, start: ArrayLike, end: ArrayLike) -> Array:
        """Smallest distances (m,) along m segments from start (m, 3) to end (m, 3), metres; ends may coincide."""
        a, b = array(start, (None, 3), "starts of segments"), array(end, (None, 3), "ends of segments")
        if len(a) != len(b):
            raise InputError(f"segments: expected as many starts as ends, got {len(a)} and {len(b)}")
        a, b = self._local(a), self._local(b)
        length = np.linalg.norm(b - a, axis=1)
        unit = np.divide(b - a, length[:, None], out=np.tile([1.0, 0.0, 0.0], (len(a), 1)), where=length[:, None] > 0.0)
        return self._segment_distance(a, unit, length)

    def _local(self, points: Array) -> Array:
        back = dq.conjugate(np.array(self.pose))
        out: Array = points @ dq.rotation_matrix(back).T + dq.translation(back)
        return out


def grid_faces(rows: int, columns: int) -> np.ndarray:
    """Triangles (2 (rows - 1) columns, 3) between vertices that lie in rows, each of which is closed to a ring."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    here, right = i * columns + j, i * columns + (j + 1) % columns
    faces = np.stack([here, right, right + columns, here, right + columns, here + columns], axis=-1)
    return faces.reshape(-1, 3)
