"""`Push`: a hand whose wrench is given beforehand, written in the scene or recorded on a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from admittance.hand import Hand, ScriptedHand, Tremor
from admittance.hand_file import load_hand
from primitives.checks import Array, array, number
from primitives.errors import InputError
from primitives.point_cloud import PointCloud

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Push:
    """A wrench on the handle that is a function of time, whatever the handle does.

    Attributes
    ----------
    times, wrenches : seconds, growing, and (6,) [force; torque] at each, N and Nm, world axes at the handle. The last
        one lasts on.
    file : a CSV record in their place, see `admittance.hand_file.load_hand`; the hand lets go where it ends.
    interpolate : straight lines from one wrench to the next, else each lasts until the next.
    tremor : rms of a force of 8 to 12 Hz on top, N.

    Raises
    ------
    InputError : neither or both of wrenches and a file, times that do not grow, not finite.
    """

    times: tuple[float, ...] = ()
    wrenches: tuple[Six, ...] = ()
    file: str = ""
    interpolate: bool = False
    tremor: float = 0.0

    def __post_init__(self) -> None:
        if bool(self.file) == bool(self.times):
            raise InputError("hand of a scene: expected wrenches or the file of a record, one of them")
        times = array(self.times, (None,), "times of a push")
        wrenches = array(self.wrenches if times.size else np.zeros((0, 6)), (len(times), 6), "wrenches of a push")
        if not all(a < b for a, b in pairwise(times)):
            raise InputError(f"times of a push: expected growing ones, got {times.tolist()[:8]}")
        object.__setattr__(self, "times", tuple(times.tolist()))
        object.__setattr__(self, "wrenches", tuple(tuple(row) for row in wrenches.tolist()))
        object.__setattr__(self, "tremor", number(self.tremor, "tremor of a push", low=0.0))

    def hand(self, port: Array, start: Array, length: float, parts: Mapping[str, PointCloud], seed: int) -> Hand:
        """The hand itself; seed is that of its tremor.

        Raises
        ------
        FileError : a record that cannot be read.
        """
        hand: Hand
        if self.file:
            hand = load_hand(self.file, interpolate=self.interpolate)
        else:
            hand = ScriptedHand(np.array(self.times), np.array(self.wrenches), self.interpolate)
        return Tremor(hand, rms=self.tremor, seed=seed) if self.tremor > 0.0 else hand
