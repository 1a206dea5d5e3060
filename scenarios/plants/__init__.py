"""What a controller drives: `reset`, `step(command)` and `push(wrench)`, one file a plant."""

from collections.abc import Mapping
from typing import Protocol

from numpy.typing import ArrayLike

from primitives.checks import Array
from primitives.errors import ActiveConstraintsError
from vfi.messages import Measurement

PLANTS = ("kinematic", "mujoco")
"""By name: joints that move exactly as commanded, and servos in a physics engine."""


class PlantError(ActiveConstraintsError):
    """The simulation of a plant broke down: it says what, when, and what may help. Only `reset` makes it usable."""


class VelocityCommand(Protocol):
    """A command of the vfi controller, or a motion of the admittance."""

    @property
    def qdot(self) -> Array:
        """(d,) velocities of the decided joints for the period that begins, rad/s and m/s."""


class Plant(Protocol):
    """Something that can be measured, commanded in steps of one period, and pushed by a hand."""

    def reset(self) -> Measurement:
        """Go to the start, let go of the handle; the measurement there, at t = 0."""

    def step(self, command: VelocityCommand) -> Measurement:
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
    def handle(self) -> tuple[Array, Array] | None:
        """Position (3,) and velocity (3,) of the handle, m and m/s, world axes; None where it is where it should be."""

    @property
    def contact_forces(self) -> Mapping[str, Array]:
        """Force (3,) on the tools of each obstacle they can touch, N, world axes, at the last measurement."""
