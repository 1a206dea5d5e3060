"""What comes out of the admittance, cycle by cycle."""

from typing import NamedTuple

from admittance.outcome import Reason, State
from primitives.checks import Array


class Motion(NamedTuple):
    """What a cycle commands and where it leads.

    Attributes
    ----------
    q : (d,) position references of the decided joints for the end of the cycle, rad and m; always finite.
    qdot : (d,) velocities commanded for the cycle, (q - q before) / T.
    v : (d - 2,) free velocity: m/s along the shaft, rad/s about the port (world axes), redundant coordinates.
    state : RUN, DEGRADED, HOLD or FAULT.
    reason : empty in RUN; otherwise what held the motion back or what is wrong, in words.
    x_c : (2,) port error (1), metres.
    clearance : metres between the tool's surface and the nearest sphere of a region.
    margin : (c,) of every constraint in their order, metres or radians.
    handle : (3,) position of the handle, world, metres.
    handle_velocity : (3,) its mean velocity over the cycle, m/s.
    """

    q: Array
    qdot: Array
    v: Array
    state: State
    reason: str
    x_c: Array
    clearance: float
    margin: Array
    handle: Array
    handle_velocity: Array


class Proposal(NamedTuple):
    """A reference velocity for something else to decide on: qdot = basis v + offset, nearest to v_ref in the metric.

    Attributes
    ----------
    v_ref : (m,) free velocity that the target dynamics ask for.
    basis : (d, m) Z^T. offset : (d,) -k_c A^+ x_c, cut to the joint limits.
    metric : (m, m) M, + T D where the damping is implicit, + T^2 K_GN where the stiffness is.
    low, high : (d,) bounds of qdot from the joint limits.
    rows : (k, m) d clearance / d v of every cloud point within sight. clearances : (k,) metres.
    state, reason : as in `Motion`; where the state is HOLD or worse, `accept` stands still whatever it is given.
    """

    v_ref: Array
    basis: Array
    offset: Array
    metric: Array
    low: Array
    high: Array
    rows: Array
    clearances: Array
    state: State
    reason: str


WORDS = {
    Reason.NONE: "",
    Reason.VELOCITY: "joint velocity limits: the free velocity was scaled down as a whole",
    Reason.POSITION: "joint position limits: the free velocity was projected onto what they allow",
    Reason.CONDITION: "near a singularity of the shaft's Jacobian: only motions that do not make it worse pass",
    Reason.OFFSET: "joint limits leave too little room for the motion back to the port",
    Reason.SUBSTEPS: "the robust integrator came to its smallest sub-step and scaled the velocity",
    Reason.INSIDE: "a point of a forbidden region lies inside its safe distance; move the region or the tool away",
    Reason.VIOLATED: "it is enforced and must stay above zero; start again where it is",
    Reason.SINGULAR: "the shaft's Jacobian has lost rank; start again from another configuration",
    Reason.WRENCH: "the measured wrench has a number that is not finite",
    Reason.CEILING: "the measured wrench is larger than a hand's can be; see force_ceiling and torque_ceiling",
    Reason.TIME: "the time must be finite and grow from cycle to cycle",
    Reason.INPUT: "the input has not the shape or kind that was declared",
    Reason.UNDECIDED: "no velocity keeps all that was asked for; standing still",
    Reason.NOT_FINITE: "the motion came out as numbers that are not finite and was not carried out",
}
"""What each reason says to people."""
