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
    SINGULAR = 14
    """A port that must always be kept cannot be: the rows of all such ports have lost rank."""
    STALE = 15
    """Something of the measurement is older than it may be."""
    LATCHED = 16
    """HOLD or FAULT stays until it is acknowledged."""


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
    LIMIT_GAIN = 2
    RECOVERY_LINEAR = 3
    RECOVERY_ANGULAR = 4
    REACH = 5
    """Up to which margin the points of clouds get rows, metres."""


class Option(IntEnum):
    """Places in the block `Whole.OPTIONS`."""

    GUARD = 0
    TASK = 1
    ROBOT_FRAMES = 2
    SECOND_SOLVER = 3
    """1 where the active-set kernel stands behind another solver."""
    BASIS = 4
    """A `Basis`."""
    FIXED = 5
    """Rows that are there in every cycle; those of the points of clouds come after them."""
    CONTACTS = 6
    """Points of clouds that have rows in this cycle."""
    BLENDING = 7
    """1 while a constraint is on its way to other numbers."""
    PORTS = 8
    """1 where a constraint has another form than rows."""
    CUTS = 9
    """Cuts that the program has got in this cycle."""
    STOP = 10
    """The state, HOLD or FAULT, that this cycle has to take whatever its program is; else 0."""
    WHY = 11
    """The `Reason` of that."""


class Basis(IntEnum):
    """In which variables the program is solved."""

    JOINTS = 0
    GIVEN = 1
    """Those of a basis that comes with the reference."""
    PORTS = 2
    """Those of the motions that keep the ports which must always be kept."""


class Form(IntEnum):
    """How a constraint becomes a part of the program."""

    ROWS = 0
    EQUALITY = 1
    """A shaft that must always run through its port: two rows, A v = -eta x_c (paper A, (7))."""
    SOFT = 2
    """A shaft that is to run through its port as far as all rows allow: a term of the cost."""


class Blend(IntEnum):
    """Columns of the block `Real.BLEND`: the way of a constraint from some numbers to others."""

    TIME = 0
    """From 0 to 1, where it ends."""
    STEP = 1
    FORCE_FROM = 2
    FORCE_TO = 3
    ETA_FROM = 4
    ETA_TO = 5
    SAFE_FROM = 6
    SAFE_TO = 7


class Work(IntEnum):
    """What the parts of a projected step do to the motion, J; see `vfi.energy`."""

    KEEPING = 0
    """Rows whose margin may shrink: <= 0."""
    RECOVERING = 1
    """Rows that lead out of a violation: the demanded rate's part."""
    MOVING = 2
    """The motion of what is kept away from: the residual's part."""
    PORT = 3
    """The motion that leads back to the port."""
    LIMITS = 4
    """Joint limits."""
    GUARD = 5
    """Scaling down what verification refused."""
