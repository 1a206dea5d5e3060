"""The state of whatever commands an arm, after a cycle: one scale for both methods."""

from enum import IntEnum


class State(IntEnum):
    """From the best to the gravest."""

    RUN = 0
    """The command is what the method asks for: the optimum, or the motion of the target dynamics."""
    DEGRADED = 1
    """The command holds, but something had to yield or held the motion back; the reason names it."""
    HOLD = 2
    """No command could be found that holds: zero velocity."""
    FAULT = 3
    """The input or the geometry cannot be used: zero velocity."""
