"""What can come of a cycle: states, reasons, guard modes, and where the compiled cycle writes them down."""

from enum import IntEnum

from primitives.state import State as State


class Guard(IntEnum):
    """What verification does with a command that fails it."""

    OFF = 0
    WATCH = 1
    ACT = 2


class Reason(IntEnum):
    """Why the state is what it is."""

    NONE = 0
    NOT_FINITE = 1
    """A number of the measurement or the reference is NaN or infinite."""
    NO_ROW = 2
    """A constraint at a place where its gradient does not exist."""
    INFEASIBLE = 3
    """No velocity within the joint limits keeps all rows, not even with the slack that is allowed."""
    SOLVER = 4
    """The solver found no answer, or one that is not finite."""
    NOT_KEPT = 5
    """Neither re-solving nor halving gave a command that keeps its constraints for a period."""
    HALVED = 6
    """Re-solving did not help; the command was scaled down."""
    SLACK = 7
    """Rows were in conflict and yielded as far as they are allowed to."""
    ACCELERATION = 8
    """The acceleration limits yielded to the other joint limits or to a constraint."""
    SECOND_SOLVER = 9
    """The chosen solver found no answer; the active-set solver did."""
    REFERENCE = 10
    """The reference pose is not a unit dual quaternion."""
    MEASUREMENT = 11
    """Something of the measurement or the reference has not the shape or kind that was declared."""
    RECOVERING = 12
    """An enforced constraint is violated and is being left; the place is its index."""
    OUT_OF_RANGE = 13
    """A decided joint is outside its range and is being driven back; the place is its index among them."""


class Slot(IntEnum):
    """Places in the block `Whole.OUTCOME`."""

    STATE = 0
    REASON = 1
    WHERE = 2
    """Index of the constraint that the reason is about, -1 where none."""
    SOLVER = 3
    INFEASIBLE = 4
    """1 when the program as declared had no solution."""
    RESOLVES = 5
    HALVINGS = 6
    INTERVENED = 7
    """1 when the first answer failed verification."""


class Setting(IntEnum):
    """Places in the block `Real.SETTINGS`."""

    PERIOD = 0
    DAMPING = 1
    GAIN = 2
    LIMIT_GAIN = 3
    RECOVERY_LINEAR = 4
    RECOVERY_ANGULAR = 5


class Option(IntEnum):
    """Places in the block `Whole.OPTIONS`."""

    GUARD = 0
    TASK = 1
    TIP = 2
    ROBOT_FRAMES = 3
    SECOND_SOLVER = 4
    """1 where the active-set kernel stands behind another solver."""
