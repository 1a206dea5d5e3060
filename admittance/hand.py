"""Models of the human hand: what wrench it puts on the handle, given where the handle is.

All are reproducible: what is random comes from a seed. A hand is asked once a cycle, with times that grow; `reset`
takes it back to its beginning.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from primitives.checks import Array, array, number
from primitives.errors import InputError

ROUNDING = 1e-9
"""Seconds by which a sum of periods may miss a delay."""


class Hand(Protocol):
    """What holds the handle."""

    def wrench(self, t: float, position: Array, velocity: Array) -> Array:
        """(6,) [force; torque] on the handle, N and Nm, world axes; for position (3,) in m and velocity (3,) in m/s."""

    def reset(self) -> None:
        """Forget what was before."""


@dataclass(frozen=True, eq=False)
class ScriptedHand:
    """A wrench that is a given function of time, whatever the handle does.

    Attributes
    ----------
    times : (k,) seconds, growing. wrenches : (k, 6) N and Nm. Before the first time it is zero, after the last the
        last one stays.
    interpolate : True for straight lines between them, False to hold each until the next.
    end : seconds; later it is zero.

    Raises
    ------
    InputError : wrong sizes, not finite, or times that do not grow.
    """

    times: Array
    wrenches: Array
    interpolate: bool = False
    end: float = np.inf

    def __post_init__(self) -> None:
        times = array(self.times, (None,), "times of a hand")
        wrenches = array(self.wrenches, (len(times), 6), "wrenches of a hand")
        if not len(times) or not np.all(np.diff(times) > 0.0):
            raise InputError(f"times of a hand: expected at least one, growing, got {times.tolist()[:8]}")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "wrenches", wrenches)

    def wrench(self, t: float, position: Array, velocity: Array) -> Array:
        """See `Hand`."""
        i = int(np.searchsorted(self.times, t, side="right")) - 1
        if i < 0 or not t <= self.end:
            return np.zeros(6)
        out: Array = self.wrenches[i].copy()
        if self.interpolate and i < len(self.times) - 1:
            share = (t - self.times[i]) / (self.times[i + 1] - self.times[i])
            out += share * (self.wrenches[i + 1] - self.wrenches[i])
        return out

    def reset(self) -> None:
        """Nothing is remembered."""


@dataclass(eq=False)
class SpringHand:
    """A hand that pulls the handle along waypoints by a spring and a damper, as hard as it can but no harder.

    Attributes
    ----------
    times : (k,) seconds, growing. waypoints : (k, 3) metres; straight lines between them, held before and after.
    stiffness, damping : N/m and N s/m. most : largest force, N.

    Raises
    ------
    InputError : wrong sizes, not finite, times that do not grow, or a number out of range.
    """

    times: Array
    waypoints: Array
    stiffness: float = 300.0
    damping: float = 20.0
    most: float = 30.0

    def __post_init__(self) -> None:
        self.times = array(self.times, (None,), "times of a hand")
        self.waypoints = array(self.waypoints, (len(self.times), 3), "waypoints of a hand")
        if not len(self.times) or not np.all(np.diff(self.times) > 0.0):
            raise InputError(f"times of a hand: expected at least one, growing, got {self.times.tolist()[:8]}")
        self.stiffness = number(self.stiffness, "stiffness of a hand", low=0.0)
        self.damping = number(self.damping, "damping of a hand", low=0.0)
        self.most = number(self.most, "largest force of a hand", positive=True)

    def target(self, t: float) -> Array:
        """(3,) where the hand wants the handle at a time."""
        return np.array([np.interp(t, self.times, axis) for axis in self.waypoints.T])

    def wrench(self, t: float, position: Array, velocity: Array) -> Array:
        """See `Hand`; a pure force."""
        force = self.stiffness * (self.target(t) - position) - self.damping * velocity
        size = float(np.linalg.norm(force))
        if size > self.most:
            force *= self.most / size
        return np.concatenate([force, np.zeros(3)])

    def reset(self) -> None:
        """Nothing is remembered."""


@dataclass(eq=False)
class Tremor:
    """A hand that trembles: a band-limited force of random phases on top of another hand's wrench.

    The sum of `tones` sines of frequencies drawn from the band, in random directions, scaled to an rms.

    Attributes
    ----------
    hand : the hand that trembles. rms : N, of the force's norm. low, high : the band, Hz; 8 to 12 is physiological.

    Raises
    ------
    InputError : a number out of range.
    """

    hand: Hand
    rms: float = 0.5
    low: float = 8.0
    high: float = 12.0
    seed: int = 0
    tones: int = 16
    _frequency: Array = field(init=False, repr=False)
    _phase: Array = field(init=False, repr=False)
    _amplitude: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.rms = number(self.rms, "rms of a tremor", low=0.0)
        self.low = number(self.low, "lowest frequency of a tremor", positive=True)
        self.high = number(self.high, "highest frequency of a tremor", low=self.low)
        rng = np.random.default_rng(self.seed)
        tones = int(number(self.tones, "tones of a tremor", low=1))
        self._frequency = rng.uniform(self.low, self.high, tones)
        self._phase = rng.uniform(0.0, 2.0 * np.pi, tones)
        direction = rng.normal(size=(tones, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        # A sine of amplitude a has the mean square a^2 / 2, and those of different frequencies add up.
        self._amplitude = direction * self.rms * np.sqrt(2.0 / tones)

    def wrench(self, t: float, position: Array, velocity: Array) -> Array:
        """See `Hand`."""
        out = self.hand.wrench(t, position, velocity)
        out[:3] += np.sin(2.0 * np.pi * self._frequency * t + self._phase) @ self._amplitude
        return out

    def reset(self) -> None:
        """Also of the hand."""
        self.hand.reset()


@dataclass(eq=False)
class Delay:
    """A hand that sees the handle as it was some seconds ago.

    Attributes
    ----------
    hand : the hand. seconds : how long ago; before anything was seen that long ago it sees the first it saw.

    Raises
    ------
    InputError : a delay below zero.
    """

    hand: Hand
    seconds: float
    _seen: "deque[tuple[float, Array, Array]]" = field(init=False, repr=False, default_factory=deque)

    def __post_init__(self) -> None:
        self.seconds = number(self.seconds, "delay of a hand", low=0.0)

    def wrench(self, t: float, position: Array, velocity: Array) -> Array:
        """See `Hand`."""
        self._seen.append((t, np.array(position), np.array(velocity)))
        while len(self._seen) > 1 and self._seen[1][0] <= t - self.seconds + ROUNDING:
            self._seen.popleft()
        _, then_position, then_velocity = self._seen[0]
        return self.hand.wrench(t, then_position, then_velocity)

    def reset(self) -> None:
        """Also of the hand."""
        self._seen.clear()
        self.hand.reset()
