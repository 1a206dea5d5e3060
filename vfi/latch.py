"""From when on a controller stays in HOLD or FAULT until somebody acknowledges."""

from typing import NamedTuple

from primitives.checks import number
from primitives.errors import InputError
from vfi.outcome import State


class Latch(NamedTuple):
    """How many cycles on end HOLD and FAULT last until they stay.

    Attributes
    ----------
    hold : cycles without a velocity that holds, or with old inputs; a conflict that is over sooner passes by itself.
    fault : cycles with an input that cannot be used.
    """

    hold: int = 5
    fault: int = 1


LATCH = Latch()


class Keeper:
    """Counts, and remembers what stays and why."""

    def __init__(self, latch: Latch | None):
        self.latch = latch
        self.state, self.reason = State.RUN, ""
        self.bad = self.faulty = 0
        """Cycles on end in HOLD or FAULT, and in FAULT."""

    def note(self, state: int, reason: str, t: float) -> bool:
        """Count a cycle in HOLD or FAULT; whether it is the one from which on its state stays."""
        self.bad += 1
        self.faulty = self.faulty + 1 if state == State.FAULT else 0
        if self.latch is None or state <= self.state:
            return False
        if state == State.FAULT and self.faulty >= self.latch.fault:
            self.state = State.FAULT
        elif self.state == State.RUN and self.bad >= self.latch.hold:
            self.state = State.HOLD
        else:
            return False
        self.reason = f"{self.state.name} since t = {t:.6g} s, until it is acknowledged: {reason}"
        return True

    def forget(self) -> None:
        """Begin anew."""
        self.state, self.reason, self.bad, self.faulty = State.RUN, "", 0, 0


def checked(latch: Latch | None) -> Latch | None:
    """The same, raises InputError where its numbers are out of range."""
    if latch is None:
        return None
    if not isinstance(latch, Latch):
        raise InputError(f"latch: expected a Latch or None, got {latch!r}")
    for name, value in latch._asdict().items():
        if number(value, f"{name} of Latch", low=1.0) != int(value):
            raise InputError(f"{name} of Latch: expected a whole number of cycles, got {value:g}")
    return latch
