"""The compiled cycle: check the wrench, move for one period, keep the books, write the record; one call.

Where something else decides on the velocity, `begin_reference` is the first half of it.
"""

import numpy as np

from admittance.energy import close_books, kinetic_energy
from admittance.integrators import advance
from admittance.memory import CLOUDS, Real, Whole
from admittance.model import apply_hand, evaluate, settle
from admittance.outcome import Book, Limited, Option, Reason, Setting, Slot, State
from admittance.record import write_record
from admittance.steps import DONE, KEEP, START, accept, keep, reference
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers, vector
from primitives.verification import all_finite


@compiled(f"void({MEMORY}, int64, int64)")
def judge(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, state: int, reason: int) -> None:
    """Write down a state and its reason, unless a graver state stands there."""
    outcome = integers(w, wl, Whole.OUTCOME)
    if state > outcome[Slot.STATE]:
        outcome[Slot.STATE] = state
        outcome[Slot.REASON] = reason


@compiled(f"int64({MEMORY})")
def begin(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Take the wrench in; returns the state, RUN where the arm may move.

    A wrench that is not finite or above its ceiling is kept out: zero stands in its place.
    """
    outcome, options = integers(w, wl, Whole.OUTCOME), integers(w, wl, Whole.OPTIONS)
    for slot in (Slot.STATE, Slot.REASON, Slot.LIMITED, Slot.SUBSTEPS, Slot.REJECTED):
        outcome[slot] = 0
    outcome[Slot.WHERE] = -1
    wrench, settings = vector(f, fl, Real.WRENCH), vector(f, fl, Real.SETTINGS)
    vector(f, fl, Real.HANDLE_LAST)[:] = vector(f, fl, Real.HANDLE)
    vector(f, fl, Real.LEDGER)[Book.POWER] = 0.0
    if not all_finite(wrench):
        judge(f, fl, w, wl, State.FAULT, Reason.WRENCH)
        wrench[:] = 0.0
    force = np.hypot(np.hypot(wrench[0], wrench[1]), wrench[2])
    torque = np.hypot(np.hypot(wrench[3], wrench[4]), wrench[5])
    if force > settings[Setting.FORCE_CEILING] or torque > settings[Setting.TORQUE_CEILING]:
        judge(f, fl, w, wl, State.FAULT, Reason.CEILING)
        wrench[:] = 0.0
    if options[Option.EVALUATED]:
        judge(f, fl, w, wl, State.HOLD, options[Option.EVALUATED])
    apply_hand(f, fl, w, wl)
    return int(outcome[Slot.STATE])


@compiled(f"void({MEMORY})")
def rest(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """No motion in this cycle, and none left over; the energy that was in it is entered as taken by the limits."""
    book = vector(f, fl, Real.LEDGER)
    book[Book.LIMITED] -= book[Book.KINETIC]
    vector(f, fl, Real.V)[:] = 0.0
    vector(f, fl, Real.V_NEXT)[:] = 0.0
    vector(f, fl, Real.RATE)[:] = 0.0
    vector(f, fl, Real.QDOT)[:] = 0.0


@compiled(f"void({MEMORY}, int64, float64, float64[:,::1], int64)")
def conclude(
    f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, blocked: int, t: float, ring: Array, row: int
) -> None:
    """After the motion, or none: the state it leaves, the books and the record. blocked: the `Reason` at the new q."""
    outcome, options = integers(w, wl, Whole.OUTCOME), integers(w, wl, Whole.OPTIONS)
    limited = outcome[Slot.LIMITED]
    options[Option.EVALUATED] = blocked
    if blocked:
        judge(f, fl, w, wl, State.HOLD, blocked)
        if blocked == Reason.INSIDE:
            outcome[Slot.WHERE] = outcome[Slot.POINT]
    if blocked != Reason.SINGULAR:
        settle(f, fl, w, wl)
    if limited & Limited.SUBSTEPS:
        judge(f, fl, w, wl, State.DEGRADED, Reason.SUBSTEPS)
    if limited & Limited.CONDITION:
        judge(f, fl, w, wl, State.DEGRADED, Reason.CONDITION)
    if limited & Limited.POSITION:
        judge(f, fl, w, wl, State.DEGRADED, Reason.POSITION)
    if limited & Limited.VELOCITY:
        judge(f, fl, w, wl, State.DEGRADED, Reason.VELOCITY)
    if limited & Limited.OFFSET:
        judge(f, fl, w, wl, State.DEGRADED, Reason.OFFSET)
    close_books(f, fl, w, wl, vector(f, fl, Real.SETTINGS)[Setting.PERIOD])
    write_record(f, fl, w, wl, t, ring, row)


@compiled(f"void({MEMORY}, int64, int64, float64, float64[:,::1], int64)")
def refuse(
    f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, state: int, reason: int, t: float, ring: Array, row: int
) -> None:
    """A cycle without a motion: its input could not be read, or nothing could be decided; it counts no wrench."""
    vector(f, fl, Real.WRENCH)[:] = 0.0
    begin(f, fl, w, wl)
    judge(f, fl, w, wl, state, reason)
    rest(f, fl, w, wl)
    conclude(f, fl, w, wl, integers(w, wl, Whole.OPTIONS)[Option.EVALUATED], t, ring, row)


@compiled(f"int64({MEMORY})")
def begin_reference(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """The first half of a cycle whose velocity something else decides on; returns the state, RUN where it may move."""
    if begin(f, fl, w, wl) == State.RUN and not reference(f, fl, w, wl):
        judge(f, fl, w, wl, State.HOLD, Reason.SINGULAR)
    return int(integers(w, wl, Whole.OUTCOME)[Slot.STATE])


@compiled(f"void({MEMORY}, {CLOUDS}, int64, float64, float64[:,::1], int64)")
def cycle(
    f: Array,
    fl: np.ndarray,
    w: np.ndarray,
    wl: np.ndarray,
    points: Array,
    order: np.ndarray,
    start: np.ndarray,
    index: np.ndarray,
    place: Array,
    distance: Array,
    near: Array,
    given: int,
    t: float,
    ring: Array,
    row: int,
) -> None:
    """One cycle: from the wrench to the next configuration, its books and ring[row].

    given = 0 is the plain method; with given = 1 the cycle was begun by `begin_reference`, and V_NEXT, as something
    else decided on it, moves the arm and becomes the state.
    """
    q, before, outcome = vector(f, fl, Real.Q), vector(f, fl, Real.Q_LAST), integers(w, wl, Whole.OUTCOME)
    blocked = integers(w, wl, Whole.OPTIONS)[Option.EVALUATED]
    before[:] = q
    if not given:
        begin(f, fl, w, wl)
    elif not np.isfinite(kinetic_energy(vector(f, fl, Real.INERTIA), vector(f, fl, Real.V_NEXT))):
        judge(f, fl, w, wl, State.HOLD, Reason.NOT_FINITE)
    if outcome[Slot.STATE] == State.RUN:
        outcome[Slot.SUBSTEPS] = 1
        phase = accept(f, fl, w, wl) if given else advance(f, fl, w, wl, near, START, 0)
        while phase != DONE:
            trial = vector(f, fl, Real.Q_TRIAL)
            blocked = evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, trial)
            # What was accepted is kept as it is, whichever integrator the plain method has.
            phase = (
                keep(f, fl, w, wl, blocked) if given and phase == KEEP else advance(f, fl, w, wl, near, phase, blocked)
            )
        qdot, decided = vector(f, fl, Real.QDOT), integers(w, wl, Whole.DECIDED)
        for j in range(decided.shape[0]):
            qdot[j] = (q[decided[j]] - before[decided[j]]) / vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    else:
        rest(f, fl, w, wl)
    conclude(f, fl, w, wl, blocked, t, ring, row)
