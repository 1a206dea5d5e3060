"""What a controller drives: `reset`, `step(command)` and `push(wrench)`, one file a plant."""

from collections.abc import Mapping
from typing import Protocol

from numpy.typing import ArrayLike

from primitives.checks import Array
from primitives.errors import ActiveConstraintsError
from vfi.messages import Command, Measurement


class PlantError(ActiveConstraintsError):
    """The simulation of a plant broke down: it says what, when, and what may help. Only `reset` makes it usable."""


class Plant(Protocol):
    """Something that can be measured, commanded in steps of one period, and pushed by a hand."""

    def reset(self) -> Measurement:
        """Go to the start, let go of the handle; the measurement there, at t = 0."""

    def step(self, command: Command) -> Measurement:
        """Execute a command for one period; the measurement after it.

        Raises
        ------
        InputError : the command is of another size, or not finite.
        PlantError : the simulation broke down.
        """

    def push(self, wrench: ArrayLike) -> Array:
        """Let the hand push the handle, from now on until the next push.

        Parameters
        ----------
        wrench : (6,) [force; torque], N and Nm, world axes, at the handle.

        Returns
        -------
        (6,) the wrench as the sensor reads it now, world axes, at the sensor.

        Raises
        ------
        InputError : not six finite numbers.
        """

    @property
    def contact_forces(self) -> Mapping[str, Array]:
        """Force (3,) on the tools of each obstacle they can touch, N, world axes, at the last measurement."""
