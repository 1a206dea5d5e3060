"""The ideal plant: joints move exactly as commanded, q + T q̇ after one period."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, number
from scenarios.plants import VelocityCommand
from vfi.messages import Measurement


class KinematicPlant:
    """Joints as integrators; those that are not commanded stand still, and nothing moves them but commands.

    Parameters
    ----------
    start : (n,) rad and m. decided : (d,) indices of the commanded joints. period : T, seconds.
    noise : standard deviation of the measured q, rad and m; the joints themselves move exactly.
    seed : of the noise.
    """

    contact_forces: Mapping[str, Array] = MappingProxyType({})
    """There is nothing to touch."""
    handle = None
    """It is where the commands lead it."""

    def __init__(self, start: Array, decided: np.ndarray, period: float, *, noise: float = 0.0, seed: int = 0):
        self._start, self._decided, self._period = np.array(start, dtype=float), decided, period
        self._noise, self._seed = number(noise, "noise of the plant", low=0.0), seed
        self.reset()

    def reset(self) -> Measurement:
        """See `scenarios.plants.Plant`."""
        self._cycle, self._q, self._qdot = 0, self._start.copy(), np.zeros_like(self._start)
        self._wrench: Array | None = None
        self._random = np.random.default_rng(self._seed)
        return self._measure()

    def step(self, command: VelocityCommand) -> Measurement:
        """See `scenarios.plants.Plant`."""
        self._qdot[self._decided] = array(command.qdot, self._decided.shape, "velocities of the command")
        self._q += self._period * self._qdot
        self._cycle += 1
        return self._measure()

    def push(self, wrench: ArrayLike) -> Array:
        """See `scenarios.plants.Plant`: the sensor is ideal and sits at the handle, so it reads the push itself."""
        self._wrench = array(wrench, (6,), "wrench of the hand")
        return self._wrench.copy()

    def _measure(self) -> Measurement:
        q = self._q.copy()
        if self._noise > 0.0:
            q += self._noise * self._random.standard_normal(len(q))
        return Measurement(self._cycle * self._period, q, self._qdot.copy(), self._wrench)
