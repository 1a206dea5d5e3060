"""What can come of a cycle: states, reasons, what limited the motion, and where the compiled cycle writes it down."""

from enum import IntEnum

from primitives.state import State as State


class Reason(IntEnum):
    """Why the state is what it is."""

    NONE = 0
    VELOCITY = 1
    """Joint velocity limits: the free velocity was scaled down as a whole."""
    POSITION = 2
    """Joint position limits: the free velocity was projected onto what they allow."""
    CONDITION = 3
    """Near a singularity of J_t: only motions that do not make it worse were let through."""
    OFFSET = 4
    """Joint limits left too little room for the motion back to the port."""
    SUBSTEPS = 5
    """The robust integrator came to its smallest sub-step and scaled the velocity."""
    INSIDE = 6
    """A point of a forbidden region lies inside its safe distance: psi >= 1."""
    SINGULAR = 7
    """J_t has lost rank, or its null space turned too far within one cycle."""
    WRENCH = 8
    """The measured wrench has a number that is NaN or infinite."""
    CEILING = 9
    """The measured wrench is larger than a hand's can be."""
    TIME = 10
    """The time did not grow, or is no finite number."""
    INPUT = 11
    """The input has not the shape or kind that was declared."""
    NOT_FINITE = 12
    """The motion came out as a number that is not finite; it was not carried out."""
    UNDECIDED = 13
    """What decides on the proposed velocity found none."""
    VIOLATED = 14
    """An enforced constraint has a margin of zero or less."""


class Limited(IntEnum):
    """What limited the motion of a cycle: bits, as several may have."""

    NONE = 0
    VELOCITY = 1
    POSITION = 2
    CONDITION = 4
    OFFSET = 8
    SUBSTEPS = 16


class Slot(IntEnum):
    """Places in the block `Whole.OUTCOME`."""

    STATE = 0
    REASON = 1
    LIMITED = 2
    """Bits of `Limited`."""
    WHERE = 3
    """Cloud point that the reason is about, -1 where none."""
    SUBSTEPS = 4
    """Sub-steps of this cycle; 0 where there was no motion."""
    REJECTED = 5
    """Sub-steps that were tried and taken back."""
    REGION = 6
    """Region of the nearest cloud point, -1 where none is within sight."""
    POINT = 7
    """The nearest cloud point, as an index into the cloud as it was given."""
    NEARBY = 8
    """Cloud points within sight."""
    CONSTRAINT = 9
    """The enforced constraint whose margin is the smallest share of its range, -1 where there is none."""


class Touch(IntEnum):
    """Places in the block `Real.TOUCH`: the tool and the forbidden regions."""

    POTENTIAL = 0
    """J, of regions and constraints."""
    CLEARANCE = 1
    """Metres between the tool's surface and the nearest sphere; the sight where none is nearer."""


class Setting(IntEnum):
    """Places in the block `Real.SETTINGS`."""

    PERIOD = 0
    ALPHA = 1
    BETA = 2
    PORT_GAIN = 3
    STIFFNESS = 4
    RANGE = 5
    LINEAR_BELOW = 6
    SIGHT = 7
    LIMIT_GAIN = 8
    CONDITION_LIMIT = 9
    FORCE_CEILING = 10
    TORQUE_CEILING = 11


class Option(IntEnum):
    """Places in the block `Whole.OPTIONS`."""

    FORM = 0
    INTEGRATOR = 1
    IMPLICIT_DAMPING = 2
    IMPLICIT_STIFFNESS = 3
    STARTED = 4
    """1 when the rates of the printed form have a cycle before them."""
    EVALUATED = 5
    """Reason why the present configuration allows no motion, 0 where it does."""
    PORT = 6
    """1 where a shaft is kept in a port; else the free coordinates are the joints themselves."""


class Form(IntEnum):
    """Forms of the target dynamics."""

    REDUCED = 0
    ANALYTIC = 1
    PRINTED = 2


class Integrator(IntEnum):
    """Integrators."""

    EULER = 0
    SEMI_IMPLICIT = 1
    RK4 = 2
    ROBUST = 3


class Book(IntEnum):
    """Places in the block `Real.LEDGER`, all in J but the power; see `energy`."""

    STORAGE = 0
    KINETIC = 1
    POTENTIAL = 2
    HAND = 3
    HAND_CHORD = 4
    DISSIPATED = 5
    NUMERICAL = 6
    LIMITED = 7
    BARRIER = 8
    CLOUDS = 9
    EXCESS = 10
    EXCESS_CHORD = 11
    LOWEST = 12
    LOWEST_CHORD = 13
    POWER = 14
