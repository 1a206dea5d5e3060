"""Constraints on clouds lowered to arrays, once, for the compiled searches of `primitives.cloud_rows`."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array, known
from primitives.constraint import ConstraintSet
from primitives.elements import Cloud
from primitives.errors import InputError
from primitives.voxel_grid import VoxelGrid


class Spheres(Protocol):
    """A surface covered by spheres of one radius, e.g. a `PointCloud`: what a constraint needs to know of it."""

    @property
    def grid(self) -> VoxelGrid:
        """Points in the cloud's own frame, metres."""

    @property
    def radius(self) -> float:
        """d_c of paper A, (8): radius of the sphere about each point, metres."""

    @property
    def pose(self) -> Array:
        """(8,) unit dual quaternion of the cloud's frame in what it is attached to."""


class CloudTable(NamedTuple):
    """The C constraints on clouds among m constraints; `primitives.cloud_rows` says what the arrays hold.

    Attributes
    ----------
    at, sphere, placement : of the constraints. points, cells : all grids one after the other.
    largest : points of the largest cloud. total : points of all constraints, i.e. the most rows that there can be.
    """

    at: np.ndarray
    sphere: Array
    placement: Array
    points: Array
    cells: np.ndarray
    largest: int
    total: int


def tabulate_clouds(constraints: ConstraintSet, clouds: Mapping[str, Spheres]) -> CloudTable:
    """The constraints on clouds as arrays; clouds holds the points of each by name, and may hold others.

    Raises
    ------
    UnknownNameError : a constraint on a cloud that is not among them.
    InputError : something among them that is no cloud.
    """
    items = [(i, c) for i, c in enumerate(constraints) if c.is_cloud]
    at, sphere, placement = (
        np.zeros((len(items), 8), dtype=np.int64),
        np.zeros((len(items), 6)),
        np.zeros((len(items), 12)),
    )
    grids: dict[str, tuple[int, int]] = {}
    points, cells = [np.zeros((0, 3))], [np.zeros(0, dtype=np.int64)]
    first = corner = largest = total = 0
    for row, (i, c) in enumerate(items):
        assert isinstance(c.second, Cloud)
        name = c.second.name
        cloud = clouds[known("point cloud", name, clouds)]
        if not hasattr(cloud, "grid") or not hasattr(cloud, "radius"):
            raise InputError(f'cloud "{name}": expected a PointCloud, got {type(cloud).__name__}')
        grid = cloud.grid
        if name not in grids:
            grids[name] = first, corner
            points.append(grid.points)
            cells.append(grid.start)
            first, corner = first + len(grid.points), corner + len(grid.start)
        at[row] = [i, grids[name][0], len(grid.points), grids[name][1], len(grid.start), *grid.shape]
        sphere[row] = [cloud.radius, c.safe_distance, grid.cell, *grid.origin]
        pose = dq.product(np.array(c.second.dual_quaternion), np.array(cloud.pose))
        placement[row] = [*dq.rotation_matrix(pose).ravel(), *dq.translation(pose)]
        largest, total = max(largest, len(grid.points)), total + len(grid.points)
    return CloudTable(at, sphere, placement, np.concatenate(points), np.concatenate(cells), largest, total)
