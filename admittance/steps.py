"""Euler steps of the reduced and the full form: everything up to the configuration that is to be evaluated next.

Paper A says "Euler" at 4 ms. Explicit Euler is linearly unstable there against one cloud point from about 20 N, so
semi-implicit Euler is the default. Both can step across the barrier, which holds little energy.
"""

import numpy as np

from admittance.damping import fill_damping
from admittance.dense import transform, transform_transposed
from admittance.energy import (
    book_explicit,
    book_forces,
    book_remainder,
    book_step,
    kinetic_energy,
    sum_of_kinetic_terms,
)
from admittance.limits import fill_limits, fit_offset, limit_velocity
from admittance.memory import Real, Whole
from admittance.model import accelerate, propose, to_port
from admittance.outcome import Book, Form, Integrator, Limited, Option, Reason, Setting, Slot, State
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers, matrix, vector

DONE = -1
"""The cycle's motion is complete."""
START = 0
KEEP = 10
"""Q_TRIAL was evaluated and is to be kept."""
BACK = 11
"""Q was evaluated again, after a trial that gave numbers that are not finite."""


@compiled(f"void({MEMORY})")
def damp(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """D at the present velocity and repulsion; without a port it stays what it is."""
    if not integers(w, wl, Whole.OPTIONS)[Option.PORT]:
        return
    gains, redundant = matrix(f, fl, Real.DAMPING), vector(f, fl, Real.REDUNDANT)[0]
    fill_damping(gains, redundant, vector(f, fl, Real.V), vector(f, fl, Real.F_RX), vector(f, fl, Real.D))


@compiled(f"void({MEMORY})")
def bound(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Bounds of the joint velocities at Q, and the offset cut so that it keeps them."""
    low, high = matrix(f, fl, Real.LOW), matrix(f, fl, Real.HIGH)
    eta = vector(f, fl, Real.SETTINGS)[Setting.LIMIT_GAIN]
    fill_limits(vector(f, fl, Real.Q), integers(w, wl, Whole.DECIDED), matrix(f, fl, Real.LIMITS), eta, low, high)
    if fit_offset(vector(f, fl, Real.OFFSET), low, high) < 1.0:
        integers(w, wl, Whole.OUTCOME)[Slot.LIMITED] |= Limited.OFFSET


@compiled(f"void({MEMORY}, float64[::1])")
def limit(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, v: Array) -> None:
    """Change a free velocity v (m,) to one that the limits allow, in the metric of the step."""
    done = limit_velocity(
        v,
        matrix(f, fl, Real.Z),
        vector(f, fl, Real.OFFSET),
        matrix(f, fl, Real.LOW),
        matrix(f, fl, Real.HIGH),
        vector(f, fl, Real.SINGULAR_ROW),
        vector(f, fl, Real.SINGULAR)[3],
        matrix(f, fl, Real.METRIC),
        matrix(f, fl, Real.LIMIT_ROWS),
        vector(f, fl, Real.LIMIT_DEMAND),
        vector(f, fl, Real.LIMIT_COST),
        vector(f, fl, Real.LIMIT_GIVEN),
        vector(f, fl, Real.UNBOUNDED),
        vector(f, fl, Real.LIMIT_MULTIPLIER),
        integers(w, wl, Whole.LIMIT_ACTIVE),
        integers(w, wl, Whole.LIMIT_MASK),
        vector(f, fl, Real.LIMIT_SCALE),
        matrix(f, fl, Real.LIMIT_WORK),
    )
    integers(w, wl, Whole.OUTCOME)[Slot.LIMITED] |= done


@compiled(f"void({MEMORY}, float64, float64[::1])")
def try_velocity(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float, v: Array) -> None:
    """QDOT = Z^T v + OFFSET (19), and Q_TRIAL = Q + h QDOT."""
    trial, qdot, decided = vector(f, fl, Real.Q_TRIAL), vector(f, fl, Real.QDOT), integers(w, wl, Whole.DECIDED)
    transform_transposed(matrix(f, fl, Real.Z), v, qdot)
    qdot += vector(f, fl, Real.OFFSET)
    trial[:] = vector(f, fl, Real.Q)
    for j in range(decided.shape[0]):
        trial[decided[j]] += h * qdot[j]


@compiled(f"int64({MEMORY})")
def reference(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """First half of a semi-implicit step of the reduced form: V_REF, METRIC, OFFSET and bounds; 0 where that fails."""
    options, period = integers(w, wl, Whole.OPTIONS), vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    damp(f, fl, w, wl)
    to_port(f, fl, w, wl)
    bound(f, fl, w, wl)
    return propose(f, fl, w, wl, period, options[Option.IMPLICIT_DAMPING], options[Option.IMPLICIT_STIFFNESS])


@compiled(f"int64({MEMORY})")
def accept(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Second half: enter V_NEXT, whoever decided on it, make it the state and move with it."""
    new, period = vector(f, fl, Real.V_NEXT), vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    book_step(f, fl, w, wl, period, integers(w, wl, Whole.OPTIONS)[Option.IMPLICIT_DAMPING])
    try_velocity(f, fl, w, wl, period, new)
    vector(f, fl, Real.V)[:] = new
    return KEEP


@compiled(f"int64({MEMORY})")
def semi_implicit(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """v+ = X^-1 (M v + T f), within the limits; q+ = q + T qdot(v+)."""
    new = vector(f, fl, Real.V_NEXT)
    new[:] = 0.0
    if reference(f, fl, w, wl):
        new[:] = vector(f, fl, Real.V_REF)
    limit(f, fl, w, wl, new)
    return accept(f, fl, w, wl)


@compiled(f"int64({MEMORY})")
def euler(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """q+ = q + T qdot(v), v within the limits; v+ = v + T M^-1 (f - D v)."""
    v, new, used = vector(f, fl, Real.V), vector(f, fl, Real.V_NEXT), vector(f, fl, Real.COMMANDED)
    M, D, hand = vector(f, fl, Real.INERTIA), vector(f, fl, Real.D), vector(f, fl, Real.F_HAND)
    F_rx, period = vector(f, fl, Real.F_RX), vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    damp(f, fl, w, wl)
    to_port(f, fl, w, wl)
    bound(f, fl, w, wl)
    propose(f, fl, w, wl, period, 0, 0)
    used[:] = v
    limit(f, fl, w, wl, used)
    for i in range(v.shape[0]):
        force = hand[i] - D[i] * used[i] + F_rx[i]
        new[i] = used[i] + period * force / M[i]
    book_explicit(f, fl, w, wl, period)
    try_velocity(f, fl, w, wl, period, used)
    v[:] = new
    return KEEP


@compiled(f"int64({MEMORY})")
def full_step(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """One Euler step of the full form, qdot+ = qdot + T qddot, moving with qdot+ (semi-implicit) or qdot (explicit).

    The limits act on its free part, and the rest is its offset: qdot = Z^T v + A^+ A qdot (19), (21).
    """
    settings, options = vector(f, fl, Real.SETTINGS), integers(w, wl, Whole.OPTIONS)
    explicit, T = options[Option.INTEGRATOR] == Integrator.EULER, settings[Setting.PERIOD]
    A, Z_plus_T = matrix(f, fl, Real.A), matrix(f, fl, Real.Z_PLUS_T)
    rate, offset = vector(f, fl, Real.RATE), vector(f, fl, Real.OFFSET)
    v, v_ref, new = vector(f, fl, Real.V), vector(f, fl, Real.V_REF), vector(f, fl, Real.V_NEXT)
    book, M, D = vector(f, fl, Real.LEDGER), vector(f, fl, Real.INERTIA), vector(f, fl, Real.D)
    qddot, port, remember = (
        vector(f, fl, Real.ACCELERATION),
        vector(f, fl, Real.PORT_RATE),
        vector(f, fl, Real.PROGRESS),
    )
    damp(f, fl, w, wl)
    remember[0] = kinetic_energy(M, v)
    remember[1] = sum_of_kinetic_terms(book)
    accelerate(f, fl, w, wl, rate)
    propose(f, fl, w, wl, T, 0, 0)
    matrix(f, fl, Real.A_LAST)[:, :] = A
    matrix(f, fl, Real.Z_PLUS_T_LAST)[:, :] = Z_plus_T
    options[Option.STARTED] = 1
    if not explicit:
        rate += T * qddot
    transform(Z_plus_T, rate, v_ref)
    transform(A, rate, port)
    transform(matrix(f, fl, Real.A_PLUS), port, offset)
    bound(f, fl, w, wl)
    new[:] = v_ref
    limit(f, fl, w, wl, new)
    for i in range(v.shape[0]):
        book[Book.LIMITED] += new[i] * M[i] * (new[i] - v_ref[i])
        book[Book.DISSIPATED] += T * D[i] * new[i] * new[i]
        book[Book.POWER] += T * D[i] * new[i] * new[i]
    book_forces(f, fl, w, wl, T, new)
    try_velocity(f, fl, w, wl, T, new)
    v[:] = new
    rate[:] = vector(f, fl, Real.QDOT)
    if explicit:
        rate += T * qddot
    return KEEP


@compiled(f"int64({MEMORY}, int64)")
def keep(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, blocked: int) -> int:
    """Stay where Q_TRIAL was evaluated; in the full form the free velocity follows from qdot there (21).

    A configuration that is not finite is not kept, and nothing is left of the velocity that led to it.
    """
    q, trial, v, rate = (
        vector(f, fl, Real.Q),
        vector(f, fl, Real.Q_TRIAL),
        vector(f, fl, Real.V),
        vector(f, fl, Real.RATE),
    )
    if blocked == Reason.NOT_FINITE:
        outcome = integers(w, wl, Whole.OUTCOME)
        outcome[Slot.STATE] = State.HOLD
        outcome[Slot.REASON] = Reason.NOT_FINITE
        trial[:] = q
        v[:] = 0.0
        rate[:] = 0.0
        return BACK
    q[:] = trial
    if integers(w, wl, Whole.OPTIONS)[Option.FORM] != Form.REDUCED:
        M, remember = vector(f, fl, Real.INERTIA), vector(f, fl, Real.PROGRESS)
        if blocked != Reason.SINGULAR:
            transform(matrix(f, fl, Real.Z_PLUS_T), rate, v)
        book_remainder(f, fl, w, wl, kinetic_energy(M, v) - remember[0], remember[1])
    return DONE
