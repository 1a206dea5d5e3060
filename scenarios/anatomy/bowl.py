"""A concave bowl: part of a sphere's surface, open towards +z of its frame, in which a tool can keep contact."""

from dataclasses import dataclass

import numpy as np

from primitives.checks import Array, number
from primitives.errors import InputError
from primitives.surface import Surface
from scenarios.anatomy.shape import Shape, grid_faces

_VERTICAL = 1e-12
"""Share of a segment's direction across the axis, squared, below which it is taken to be parallel to it."""


@dataclass(frozen=True, eq=False)
class Bowl(Shape):
    """The part of a sphere around the frame's origin whose polar angle from -z is at most the opening angle.

    It is a surface without a thickness: its distance is never negative.

    Parameters
    ----------
    radius : of the sphere, metres.
    opening : angle between -z and the rim, seen from the centre, rad, in (0, pi).

    Raises
    ------
    InputError : a radius or angle out of its range.
    """

    radius: float
    opening: float

    def __post_init__(self) -> None:
        super().__post_init__()
        number(self.radius, "radius of Bowl, metres", positive=True)
        if not 0.0 < number(self.opening, "opening of Bowl, rad") < np.pi:
            raise InputError(f"opening of Bowl: expected an angle between 0 and pi rad, got {self.opening:g}")

    @property
    def _rim(self) -> tuple[float, float]:
        """Radius and height of the rim."""
        return float(self.radius * np.sin(self.opening)), float(-self.radius * np.cos(self.opening))

    def _distance(self, points: Array) -> Array:
        rim, height = self._rim
        across = np.hypot(points[:, 0], points[:, 1])
        from_centre = np.hypot(across, points[:, 2])
        facing = np.arctan2(across, -points[:, 2]) <= self.opening
        to_rim = np.hypot(across - rim, points[:, 2] - height)
        return np.where(facing | (from_centre == 0.0), np.abs(from_centre - self.radius), to_rim)

    def _segment_distance(self, start: Array, direction: Array, length: Array) -> Array:
        # Wherever the smallest distance lies, it is at an end, or where the segment meets the sphere or the cone over
        # the rim, or at the foot of the centre, or where the distance from the rim's circle is stationary.
        rim, height = self._rim
        across, up = (start[:, :2] * direction[:, :2]).sum(axis=1), direction[:, 2]
        slope = (direction[:, :2] ** 2).sum(axis=1)
        wide, deep = (start[:, :2] ** 2).sum(axis=1), start[:, 2]
        along = across + deep * up
        places = [np.zeros(len(start)), length, -along, (height - deep) * up]
        places += _roots(np.ones(len(start)), along, wide + deep**2 - self.radius**2)
        sine, cosine = np.sin(self.opening) ** 2, np.cos(self.opening) ** 2
        places += _roots(
            slope * cosine - up**2 * sine, across * cosine - deep * up * sine, wide * cosine - deep**2 * sine
        )
        places += list(_stationary(across, slope, up, wide, deep - height, rim))
        every = np.clip(np.stack(places), 0.0, length)
        points = start + every[..., None] * direction
        return np.asarray(self._distance(points.reshape(-1, 3)).reshape(every.shape).min(axis=0))

    def _surface(self, edge: float) -> Surface:
        around = max(int(np.ceil(2.0 * np.pi * self.radius / edge)), 8)
        rows = max(int(np.ceil(self.opening * self.radius / edge)), 4) + 1
        polar = np.linspace(0.0, self.opening, rows)[:, None]
        azimuth = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
        unit = np.stack(
            [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), -np.cos(polar) + 0.0 * azimuth], axis=-1
        )
        return Surface(self.radius * unit.reshape(-1, 3), grid_faces(rows, around))


def _roots(a: Array, half: Array, c: Array) -> list[Array]:
    """Both roots of a s^2 + 2 half s + c, where they are real, else the place nearest to a root; finite always."""
    root = np.sqrt(np.maximum(half * half - a * c, 0.0))
    q = -(half + np.copysign(root, half))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return [np.nan_to_num(q / a, nan=0.0), np.nan_to_num(c / q, nan=0.0)]


def _stationary(across: Array, slope: Array, up: Array, wide: Array, deep: Array, rim: float) -> Array:
    """Real parts (4, m) of the places where a line's distance from a circle of radius `rim` about z is stationary.

    With w = wide + 2 across s + slope s^2 the squared distance from the axis, the condition is
    (s + across + deep up) sqrt(w) = rim (across + slope s), squared a quartic.
    """
    steep = slope < _VERTICAL
    a = np.where(steep, 1.0, slope)
    b = across + deep * up
    one = np.ones_like(b)
    linear, quadratic = np.stack([one, b]), np.stack([a, 2.0 * across, wide])
    square = np.stack([linear[0] ** 2, 2.0 * linear[0] * linear[1], linear[1] ** 2])
    quartic = np.zeros((5, len(b)))
    for i in range(3):
        for j in range(3):
            quartic[i + j] += square[i] * quadratic[j]
    quartic[2:] -= rim**2 * np.stack([a**2, 2.0 * a * across, across**2])
    companion = np.zeros((len(b), 4, 4))
    companion[:, 1:, :3] = np.eye(3)
    companion[:, 0, :] = -(quartic[1:] / quartic[0]).T
    return np.where(steep, 0.0, np.linalg.eigvals(companion).real.T)
