"""Forbidden regions: which cloud is kept away from which part of the tool, and how all of them become flat arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.checks import Array, number
from primitives.elements import Point, Segment
from primitives.errors import InputError
from primitives.voxel_grid import VoxelGrid


class Cloud(Protocol):
    """A surface covered by spheres: what a region needs to know of it."""

    @property
    def grid(self) -> VoxelGrid:
        """Points in the cloud's own frame, metres."""

    @property
    def radius(self) -> float:
        """d_c of (8): radius of the sphere about each point, metres."""


@dataclass(frozen=True, eq=False)
class Region:
    """A cloud that a part of the tool stays out of.

    Attributes
    ----------
    name : by which it is moved and replaced, and which messages use.
    cloud : see `Cloud`.
    element : what is kept away: a `Point` (the tip) or a `Segment` (the axis of the whole tool) on the shaft frame.
    tool_radius : r, metres; 0 for a tip.
    pose : (8,) unit dual quaternion of the cloud's frame in the world; None where they are the same.

    Raises
    ------
    InputError : an element of another kind, a radius below zero, or no pose.
    """

    name: str
    cloud: Cloud
    element: Point | Segment
    tool_radius: float = 0.0
    pose: ArrayLike | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.element, Point | Segment):
            raise InputError(f'region "{self.name}": expected a Point or a Segment, got {type(self.element).__name__}')
        object.__setattr__(self, "tool_radius", number(self.tool_radius, f'tool radius of "{self.name}"', low=0.0))
        number(self.cloud.radius, f'radius of the cloud of "{self.name}"', low=0.0)
        if self.pose is not None:
            object.__setattr__(self, "pose", conversions.as_pose(self.pose, f'pose of region "{self.name}"'))

    @property
    def safe(self) -> float:
        """d_c + r, metres: the distance from a cloud point that the element's axis keeps."""
        return self.cloud.radius + self.tool_radius

    def with_cloud(self, cloud: Cloud) -> "Region":
        """The region with another cloud."""
        return replace(self, cloud=cloud)

    def with_pose(self, pose: ArrayLike) -> "Region":
        """The region with its cloud elsewhere."""
        return replace(self, pose=pose)

    def row(self) -> Array:
        """(12,) element's point, direction and length, safe distance, and the grid's cell and origin."""
        geometry, grid = self.element.geometry, self.cloud.grid
        # A point has no direction, but the query wants a unit vector.
        direction = geometry[3:6] if geometry[6] > 0.0 else [0.0, 0.0, 1.0]
        return np.array([*geometry[:3], *direction, geometry[6], self.safe, grid.cell, *grid.origin])

    def twelve(self) -> Array:
        """(12,) pose of the cloud's frame in the world, rotation row by row and translation."""
        if self.pose is None:
            return np.array([1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0, 0, 0, 0])
        pose = np.asarray(self.pose, dtype=np.float64)
        return np.concatenate([dq.rotation_matrix(pose).ravel(), dq.translation(pose)])


Points = tuple[Array, np.ndarray, np.ndarray, np.ndarray, Array, Array, Array]


def lay_out(regions: Sequence[Region]) -> tuple[Points, np.ndarray]:
    """All grids one after the other with room for what a query finds (see `memory.CLOUDS`), and where each lies (R, 7).

    A row says: first point, points, first cell, cells + 1, and the grid's shape.
    """
    grids = [region.cloud.grid for region in regions]
    sizes, cells = [len(g.points) for g in grids], [len(g.start) for g in grids]
    table = np.zeros((len(grids), 7), dtype=np.int64)
    for i, grid in enumerate(grids):
        table[i] = [sum(sizes[:i]), sizes[i], sum(cells[:i]), cells[i], *grid.shape]
    largest, total = max(sizes, default=0), sum(sizes)
    points: Points = (
        np.concatenate([np.zeros((0, 3)), *[g.points for g in grids]]),
        np.concatenate([np.zeros(0, dtype=np.int64), *[g.order for g in grids]]),
        np.concatenate([np.zeros(0, dtype=np.int64), *[g.start for g in grids]]),
        np.zeros(largest, dtype=np.int64),
        np.zeros(largest),
        np.zeros(largest),
        np.zeros((total, 5)),
    )
    return points, table
