"""`Pull`: where a hand wants the end of the shaft, and the hand on the handle that leads it there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from admittance.hand import Delay, Hand, SpringHand, Tremor
from primitives.checks import Array, array, known, number
from primitives.errors import InputError
from primitives.point_cloud import PointCloud

Way = Literal["to", "into", "across"]
WAYS: tuple[Way, ...] = get_args(Way)
STEPS = 25
"""Pieces in which the handle's way from one waypoint to the next is led, so that the end of the shaft goes straight."""
NEAREST_TO_PORT = 1e-3
"""How near to the port a waypoint may lie, metres: there the shaft has no direction."""


@dataclass(frozen=True)
class Waypoint:
    """Where the hand wants the end of the shaft at a time.

    Attributes
    ----------
    t : seconds.
    at : (3,) relative to the port, metres, world axes; or the name of a part of the anatomy.
    beyond : metres. For the name of a part: how far beyond the part's point that is nearest to the last waypoint.
    way : for a name: "into", straight on from the last waypoint, or "across", on the line from the port through that
        point, so that the shaft leans on it. "to" for a position.

    Raises
    ------
    InputError : not finite, a negative time, a position at the port, or a way that does not fit.
    """

    t: float
    at: tuple[float, float, float] | str
    beyond: float = 0.0
    way: Way = "to"

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", number(self.t, "t of Waypoint", low=0.0))
        object.__setattr__(self, "beyond", number(self.beyond, "beyond of Waypoint"))
        known("way", self.way, WAYS)
        if isinstance(self.at, str) != (self.way != "to"):
            raise InputError(f'Waypoint: "into" and "across" go with a part\'s name, got {self.at!r} and "{self.way}"')
        if not isinstance(self.at, str):
            at = array(self.at, (3,), "at of Waypoint")
            if np.linalg.norm(at) < NEAREST_TO_PORT:
                raise InputError(f"at of Waypoint: expected a place off the port, got {at.tolist()}")
            object.__setattr__(self, "at", tuple(at.tolist()))


@dataclass(frozen=True)
class Pull:
    """A spring-damper hand on the handle that leads the end of the shaft along waypoints.

    Attributes
    ----------
    waypoints : in the order of their times; the hand leads from where the shaft's end is at the start.
    stiffness, damping, most : of the hand, N/m, N s/m, N; see `admittance.hand.SpringHand`.
    tremor : rms of a force of 8 to 12 Hz on top, N. delay : seconds by which the hand sees late.

    Raises
    ------
    InputError : no waypoints, times that do not grow, a number out of range.
    """

    waypoints: tuple[Waypoint, ...]
    stiffness: float = 300.0
    damping: float = 20.0
    most: float = 30.0
    tremor: float = 0.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "waypoints", tuple(self.waypoints))
        times = [w.t for w in self.waypoints]
        if not times or not all(a < b for a, b in pairwise(times)):
            raise InputError(f"waypoints of a pull: expected at least one, with growing times, got {times[:8]}")
        for name in ("stiffness", "damping", "tremor", "delay"):
            object.__setattr__(self, name, number(getattr(self, name), f"{name} of a pull", low=0.0))
        object.__setattr__(self, "most", number(self.most, "most of a pull", positive=True))

    def targets(self, port: Array, start: Array, parts: Mapping[str, PointCloud]) -> Array:
        """(k, 3) where each waypoint is in the world, metres; start (3,) is the shaft's end before the first.

        Raises
        ------
        UnknownNameError : a waypoint at a part that the anatomy has not.
        """
        out = [start]
        for waypoint in self.waypoints:
            if isinstance(waypoint.at, str):
                cloud = parts[known("part of the anatomy", waypoint.at, parts)]
                points = cloud.world_points
                nearest = points[np.argmin(np.linalg.norm(points - out[-1], axis=1))]
                origin = out[-1] if waypoint.way == "into" else port
                away = nearest - origin
                out.append(nearest + waypoint.beyond * away / max(float(np.linalg.norm(away)), 1e-9))
            else:
                out.append(port + waypoint.at)
        return np.array(out[1:])

    def hand(self, port: Array, start: Array, length: float, parts: Mapping[str, PointCloud], seed: int) -> Hand:
        """The hand itself; length is from the shaft's end to the handle, metres, seed that of its tremor.

        Raises
        ------
        InputError : a way that leads through the port; others see `targets`.
        """
        times, targets = [0.0, *(w.t for w in self.waypoints)], np.vstack([start, self.targets(port, start, parts)])
        if times[1] == 0.0:
            times, targets = times[1:], targets[1:]
        fine = _densely(times)
        ends = np.column_stack([np.interp(fine, times, axis) for axis in targets.T])
        for t, a, b in zip(times, targets, [*targets[1:], targets[-1]], strict=True):
            if (past := _distance_of_way(port, a, b)) < NEAREST_TO_PORT:
                raise InputError(
                    f"waypoints of a pull: the way from {t:g} s on passes the port at {past * 1e3:.2g} mm, where the "
                    "shaft has no direction; lead it around, or stay on one side"
                )
        hand: Hand = SpringHand(
            fine, np.array([handle_for(end, port, length) for end in ends]), self.stiffness, self.damping, self.most
        )
        if self.tremor > 0.0:
            hand = Tremor(hand, rms=self.tremor, seed=seed)
        return Delay(hand, self.delay) if self.delay > 0.0 else hand


def handle_for(end: Array, port: Array, length: float) -> Array:
    """(3,) where the handle is when the shaft goes through the port and ends at a point (3,), metres."""
    along = end - port
    return end - length * along / np.linalg.norm(along)


def _distance_of_way(point: Array, start: Array, end: Array) -> float:
    """Of a point from a straight way, metres."""
    way, away = end - start, point - start
    share = float(np.clip(away @ way / max(float(way @ way), 1e-30), 0.0, 1.0))
    return float(np.linalg.norm(away - share * way))


def _densely(times: Sequence[float]) -> Array:
    pieces = [np.linspace(a, b, STEPS, endpoint=False) for a, b in pairwise(times)]
    return np.array([*np.concatenate([*pieces, [times[-1]]])])
