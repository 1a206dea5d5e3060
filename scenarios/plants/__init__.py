"""What a controller drives: `reset() -> Measurement` and `step(command) -> Measurement`, one file each."""

from typing import Protocol

from vfi.messages import Command, Measurement


class Plant(Protocol):
    """Something that can be measured and commanded, in steps of one period."""

    def reset(self) -> Measurement:
        """Go to the start; the measurement there, at t = 0."""

    def step(self, command: Command) -> Measurement:
        """Execute a command for one period; the measurement after it."""
