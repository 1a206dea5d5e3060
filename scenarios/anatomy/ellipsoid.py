"""An ellipsoid, the organ of the procedural scenes, with its exact signed distance.

The foot x of a point y solves x_i = a_i^2 y_i / (t + a_i^2) for the largest root t of
sum (a_i y_i / (t + a_i^2))^2 = 1 (D. Eberly, "Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid",
2013). The sum falls monotonically for t > -min a^2, so bisection finds the root to the last digit, whatever the axes.
"""

from dataclasses import dataclass

import numpy as np

from primitives.checks import Array, array
from primitives.errors import InputError
from primitives.surface import Surface
from scenarios.anatomy.shape import Shape, grid_faces

_HALVINGS = 110
"""Enough for the root of a double, and of the place along a segment, to its last digit."""
_VANISHED = 1e-30
"""Share of the first bracket below which there is no root but the end of the bracket."""


@dataclass(frozen=True, eq=False)
class Ellipsoid(Shape):
    """A solid ellipsoid, its axes those of its frame.

    Parameters
    ----------
    axes : (3,) semi-axes, metres, > 0.

    Raises
    ------
    InputError : an axis that is not > 0.
    """

    axes: Array

    def __post_init__(self) -> None:
        super().__post_init__()
        axes = array(self.axes, (3,), "semi-axes of Ellipsoid")
        if axes.min() <= 0.0:
            raise InputError(f"semi-axes of Ellipsoid: expected numbers > 0, got {axes.tolist()}")
        axes.setflags(write=False)
        object.__setattr__(self, "axes", axes)

    def _feet(self, points: Array) -> Array:
        """Nearest points of the surface (m, 3)."""
        a, y = self.axes, np.abs(points)
        least = a.min()
        # In tau = t + least^2 the root lies between these; the sum is >= 1 at the lower one and <= 1 at the upper.
        gap = a * a - least * least
        shortest = gap == 0.0
        low = least * np.linalg.norm(y[:, shortest], axis=1)
        high = widest = np.linalg.norm(a * y, axis=1)
        for _ in range(_HALVINGS):
            tau = 0.5 * (low + high)
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                ratio = np.where(y > 0.0, a * y / (tau[:, None] + gap), 0.0)
                outside = (ratio * ratio).sum(axis=1) > 1.0
            low, high = np.where(outside, tau, low), np.where(outside, high, tau)
        with np.errstate(divide="ignore", invalid="ignore"):
            feet = np.where(y > 0.0, a * a * y / (high[:, None] + gap), 0.0)
        # Near the middle of the plane across the shortest axis there is no root: the foot lies off that plane.
        flat = ~(y[:, shortest] > 0.0).any(axis=1) & (high <= _VANISHED * widest)
        rest = np.maximum(1.0 - ((feet / a)[:, ~shortest] ** 2).sum(axis=1), 0.0)
        first = int(np.argmax(shortest))
        feet[:, first] = np.where(flat, least * np.sqrt(rest), feet[:, first])
        return np.asarray(np.copysign(feet, points))

    def _distance(self, points: Array) -> Array:
        inside = ((points / self.axes) ** 2).sum(axis=1) < 1.0
        away = np.linalg.norm(points - self._feet(points), axis=1)
        return np.asarray(np.where(inside, -away, away))

    def _segment_distance(self, start: Array, direction: Array, length: Array) -> Array:
        # The signed distance from a convex body is convex, so its slope along the segment, the outward normal at the
        # foot times the direction, changes its sign once.
        low, high = np.zeros(len(start)), length.copy()
        for _ in range(_HALVINGS // 2):
            middle = 0.5 * (low + high)
            normal = self._feet(start + middle[:, None] * direction) / self.axes**2
            falling = (normal * direction).sum(axis=1) < 0.0
            low, high = np.where(falling, middle, low), np.where(falling, high, middle)
        places = np.stack([np.zeros(len(start)), low, high, length])
        every = self._distance((start + places[..., None] * direction).reshape(-1, 3))
        return np.asarray(every.reshape(places.shape).min(axis=0))

    def _surface(self, edge: float) -> Surface:
        # Four parts of equal numbers, so that the ends of the axes are vertices.
        around = max(4 * int(np.ceil(0.5 * np.pi * self.axes.max() / edge)), 8)
        rows = around // 2 + 1
        polar = np.linspace(0.0, np.pi, rows)[:, None]
        azimuth = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
        unit = np.stack(
            [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar) + 0.0 * azimuth], axis=-1
        )
        return Surface(unit.reshape(-1, 3) * self.axes, grid_faces(rows, around)[:, ::-1])
