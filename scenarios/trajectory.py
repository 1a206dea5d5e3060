"""References that are known beforehand: poses joined by screw linear interpolation."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.checks import Array, array, number
from primitives.errors import InputError


class Station(NamedTuple):
    """A pose that a reference passes.

    Attributes
    ----------
    name : what people call it. t : when, seconds. pose : (8,) unit dual quaternion.
    """

    name: str
    t: float
    pose: Array


@dataclass(frozen=True)
class Waypoint:
    """A pose of the tool tip relative to its orientation at the start.

    Attributes
    ----------
    position : (3,) metres, world.
    rotation : (3,) rotation vector in the world, radians, applied on the left of the first orientation.

    Raises
    ------
    InputError : values of another shape, or not finite.
    """

    position: tuple[float, float, float]
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("position", "rotation"):
            value = array(getattr(self, name), (3,), f"{name} of Waypoint")
            object.__setattr__(self, name, tuple(value.tolist()))


@dataclass(frozen=True)
class PoseTrajectory:
    """Waypoints joined by ScLERP, each segment in the same time and linear in it; the last one is held.

    Attributes
    ----------
    waypoints : at least one. segment : seconds from one to the next.

    Raises
    ------
    InputError : no waypoint, something that is none, or a time that is not > 0.
    """

    waypoints: tuple[Waypoint, ...]
    segment: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "waypoints", tuple(self.waypoints))
        if not self.waypoints:
            raise InputError("PoseTrajectory: expected at least one waypoint, got none")
        for waypoint in self.waypoints:
            if not isinstance(waypoint, Waypoint):
                raise InputError(f"PoseTrajectory: expected a Waypoint, got {waypoint!r}")
        number(self.segment, "segment of PoseTrajectory, seconds", positive=True)

    def poses(self, first_orientation: ArrayLike) -> Array:
        """(k, 8) unit dual quaternions of the waypoints, for a first orientation (4,) [w x y z].

        Raises
        ------
        InputError : no unit quaternion.
        """
        r0 = conversions.as_pose(
            np.r_[array(first_orientation, (4,), "first orientation"), np.zeros(4)], "first orientation"
        )[:4]
        out = []
        for w in self.waypoints:
            turn = dq.exponential(np.r_[0.0, 0.5 * np.asarray(w.rotation), np.zeros(4)])[:4]
            out.append(dq.from_rotation_translation(dq.quaternion_product(turn, r0), np.array(w.position, dtype=float)))
        return np.array(out)

    def check(self) -> None:
        """Nothing that is not known already, unlike of a record."""

    def stations(self, first_orientation: ArrayLike) -> list[Station]:
        """The waypoints, when they are due; errors as for `poses`."""
        return [Station(f"waypoint {i + 1}", i * self.segment, x) for i, x in enumerate(self.poses(first_orientation))]

    def sample(self, first_orientation: ArrayLike, period: float, cycles: int) -> Array:
        """(cycles, 8) the reference at t = 0, T, 2 T, ... for a period T in seconds; errors as for `poses`."""
        number(period, "period of the reference, seconds", positive=True)
        poses = self.poses(first_orientation)
        out = np.empty((cycles, 8))
        last = len(poses) - 1
        for k in range(cycles):
            u = k * period / self.segment
            i = min(int(u), last)
            out[k] = poses[last] if i == last else dq.sclerp(poses[i], poses[i + 1], u - i)
        return out
