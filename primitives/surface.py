"""`Surface`: triangles, and points spread evenly over them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, number
from primitives.conversions import as_pose
from primitives.errors import InputError

MAX_SAMPLES = 20_000_000
"""Points that `Surface.samples` will spread; more would need a spacing nobody means."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh, closed or open; without faces a bare set of points.

    Parameters
    ----------
    vertices : (V, 3) metres, V >= 1.
    faces : (F, 3) indices of each triangle's vertices, counter-clockwise seen from outside; F may be 0.

    Raises
    ------
    InputError : no vertices, not finite, or an index out of range; names the face.
    """

    vertices: Array
    faces: np.ndarray

    def __post_init__(self) -> None:
        vertices = array(self.vertices, (None, 3), "vertices of a surface")
        if not len(vertices):
            raise InputError("vertices of a surface: expected at least one, got none")
        faces = np.array(self.faces)
        if faces.size == 0:
            faces = np.zeros((0, 3), dtype=np.int64)
        if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer):
            raise InputError(f"faces of a surface: expected whole numbers (any, 3), got {faces.dtype} {faces.shape}")
        wrong = np.flatnonzero(((faces < 0) | (faces >= len(vertices))).any(axis=1))
        if len(wrong):
            raise InputError(
                f"face {wrong[0]} of a surface: expected vertices 0 to {len(vertices) - 1}, "
                f"got {faces[wrong[0]].tolist()}"
            )
        for name, value in (("vertices", vertices), ("faces", faces.astype(np.int64))):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @cached_property
    def triangles(self) -> Array:
        """(F, 3, 3) corners of each triangle, metres."""
        corners: Array = self.vertices[self.faces]
        return corners

    @cached_property
    def areas(self) -> Array:
        """(F,) m^2."""
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        out: Array = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return out

    @property
    def area(self) -> float:
        """Area of all triangles, m^2."""
        return float(self.areas.sum())

    @property
    def bounds(self) -> Array:
        """(2, 3) least and largest coordinates of the vertices, metres."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def placed(self, pose: ArrayLike) -> "Surface":
        """The same surface where a pose (8,), a unit dual quaternion, puts it."""
        x = as_pose(pose, "pose of a surface")
        return Surface(self.vertices @ dq.rotation_matrix(x).T + dq.translation(x), self.faces)

    def samples(self, spacing: float, seed: int = 0) -> Array:
        """Points (n, 3), one for each square of that edge, spread evenly by area; the same for the same seed.

        The area is cut into n equal strips along the list of triangles and a point drawn at random in each, so that
        every region gets its share to within a point.

        Raises
        ------
        InputError : no area, or more than `MAX_SAMPLES` points.
        """
        wanted = self.area / number(spacing, "spacing of samples, metres", positive=True) ** 2
        if not self.area > 0.0:
            raise InputError("samples of a surface: expected triangles, got a surface without area")
        if not wanted <= MAX_SAMPLES:
            raise InputError(
                f"samples of a surface: a spacing of {spacing:g} m on {self.area:g} m^2 needs {wanted:.3g} points, "
                f"more than {MAX_SAMPLES:g}; check the unit of the surface, or ask for a wider spacing"
            )
        rng = np.random.default_rng(seed)
        count = max(int(np.ceil(wanted)), 1)
        strip = (np.arange(count) + rng.random(count)) / count
        last = int(np.flatnonzero(self.areas)[-1])
        which = np.minimum(np.searchsorted(np.cumsum(self.areas) / self.area, strip, side="right"), last)
        a, b, c = np.moveaxis(self.triangles[which], 1, 0)
        u, v = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
        out: Array = a + u * ((1.0 - v) * (b - a) + v * (c - a))
        return out
