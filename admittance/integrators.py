"""One period of the target dynamics: explicit Euler, semi-implicit Euler, Runge-Kutta, and a robust integrator.

Paper A says "Euler" at 4 ms. Explicit Euler is linearly unstable there against one cloud point from about 20 N, so
semi-implicit Euler is the default. Both can step across the barrier, which holds little energy; `robust` cannot: it is
linearly implicit in the potential's Gauss-Newton stiffness and takes smaller steps where points come near.
"""

import numpy as np

from admittance.damping import fill_damping
from admittance.dense import inner, transform, transform_transposed
from admittance.energy import book_explicit, book_forces, book_remainder, book_step, kinetic_energy, sum_of_kinetic_terms
from admittance.limits import fill_limits, fit_offset, limit_velocity
from admittance.memory import CLOUDS, MEMORY, Real, Whole, integers, matrix, vector
from admittance.model import accelerate, apply_hand, evaluate, propose, to_port
from admittance.outcome import Book, Form, Integrator, Limited, Option, Reason, Setting, Slot, Touch
from primitives.checks import Array
from primitives.compiled import compiled

SHARE = 0.3
"""Of its clearance, by which a point may come nearer in a sub-step of the robust integrator."""
KEPT = 0.5
"""Of the smallest clearance, that must be left after a sub-step."""
HALVINGS = 12
"""From a period to the smallest sub-step, T/4096."""
MOST = 64
"""Sub-steps of a cycle; the last of them takes all the time that is left, with a velocity scaled to fit."""


@compiled(f"void({MEMORY})")
def damp(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """D at the present velocity and repulsion."""
    gains, redundant = matrix(f, fl, Real.DAMPING), vector(f, fl, Real.REDUNDANT)[0]
    fill_damping(gains, redundant, vector(f, fl, Real.V), vector(f, fl, Real.F_RX), vector(f, fl, Real.D))


@compiled(f"void({MEMORY})")
def bound(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Bounds of the joint velocities at Q, and the offset cut so that it keeps them."""
    low, high = matrix(f, fl, Real.LOW), matrix(f, fl, Real.HIGH)
    eta = vector(f, fl, Real.SETTINGS)[Setting.LIMIT_GAIN]
    fill_limits(vector(f, fl, Real.Q), integers(w, wl, Whole.DECIDED), matrix(f, fl, Real.LIMITS), eta, low, high)
    if fit_offset(vector(f, fl, Real.OFFSET), low, high) < 1.0:
        integers(w, wl, Whole.OUTCOME)[Slot.LIMITED] |= int(Limited.OFFSET)


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
        matrix(f, fl, Real.METRIC_FACTOR),
        matrix(f, fl, Real.ROW),
        matrix(f, fl, Real.PUSH),
        vector(f, fl, Real.DUAL),
    )
    integers(w, wl, Whole.OUTCOME)[Slot.LIMITED] |= done


@compiled(f"void({MEMORY}, float64, float64[::1])")
def try_velocity(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float, v: Array) -> None:
    """QDOT = Z^T v + OFFSET (19), and Q_TRIAL = Q + h QDOT."""
    q, trial, qdot = vector(f, fl, Real.Q), vector(f, fl, Real.Q_TRIAL), vector(f, fl, Real.QDOT)
    transform_transposed(matrix(f, fl, Real.Z), v, qdot)
    qdot += vector(f, fl, Real.OFFSET)
    trial[:] = q
    decided = integers(w, wl, Whole.DECIDED)
    for j in range(decided.shape[0]):
        trial[decided[j]] += h * qdot[j]


@compiled(f"int64({MEMORY}, {CLOUDS})")
def adopt(
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
) -> int:
    """Move to Q_TRIAL and evaluate there; returns the `Reason` that stands against motion, 0 if none.

    A configuration that is not finite is not moved to, and nothing is left of the velocity that led to it.
    """
    q, trial = vector(f, fl, Real.Q), vector(f, fl, Real.Q_TRIAL)
    blocked = evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, trial)
    if blocked == Reason.NOT_FINITE:
        vector(f, fl, Real.V)[:] = 0.0
        vector(f, fl, Real.RATE)[:] = 0.0
        evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, q)
        return blocked
    q[:] = trial
    return blocked


@compiled(f"int64({MEMORY})")
def reference(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """The first half of a reduced semi-implicit step: V_REF, METRIC, OFFSET and the bounds; 0 where that fails."""
    options, period = integers(w, wl, Whole.OPTIONS), vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    damp(f, fl, w, wl)
    to_port(f, fl, w, wl)
    bound(f, fl, w, wl)
    return propose(
        f, fl, w, wl, period, options[Option.IMPLICIT_DAMPING], options[Option.IMPLICIT_STIFFNESS]
    )


@compiled(f"int64({MEMORY}, {CLOUDS})")
def accept(
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
) -> int:
    """The second half: book, carry out and keep V_NEXT, whoever decided on it."""
    v, new, period = vector(f, fl, Real.V), vector(f, fl, Real.V_NEXT), vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    book_step(f, fl, w, wl, period, integers(w, wl, Whole.OPTIONS)[Option.IMPLICIT_DAMPING])
    try_velocity(f, fl, w, wl, period, new)
    v[:] = new
    return adopt(f, fl, w, wl, points, order, start, index, place, distance, near)


@compiled(f"int64({MEMORY}, {CLOUDS})")
def semi_implicit(
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
) -> int:
    """v+ = X^-1 (M v + T f), within the limits; q+ = q + T qdot(v+)."""
    new = vector(f, fl, Real.V_NEXT)
    new[:] = 0.0
    if reference(f, fl, w, wl):
        new[:] = vector(f, fl, Real.V_REF)
    limit(f, fl, w, wl, new)
    return accept(f, fl, w, wl, points, order, start, index, place, distance, near)


@compiled(f"int64({MEMORY}, {CLOUDS})")
def euler(
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
) -> int:
    """q+ = q + T qdot(v), v within the limits; v+ = v + T M^-1 (f - D v)."""
    v, new, used = vector(f, fl, Real.V), vector(f, fl, Real.V_NEXT), vector(f, fl, Real.COMMANDED)
    M, D, hand, F_rx = vector(f, fl, Real.INERTIA), vector(f, fl, Real.D), vector(f, fl, Real.F_HAND), vector(f, fl, Real.F_RX)
    period = vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    damp(f, fl, w, wl)
    to_port(f, fl, w, wl)
    bound(f, fl, w, wl)
    propose(f, fl, w, wl, period, 0, 0)
    used[:] = v
    limit(f, fl, w, wl, used)
    for i in range(v.shape[0]):
        force = hand[i] - D[i] * used[i]
        if i < 4:
            force += F_rx[i]
        new[i] = used[i] + period * force / M[i]
    book_explicit(f, fl, w, wl, period)
    try_velocity(f, fl, w, wl, period, used)
    v[:] = new
    return adopt(f, fl, w, wl, points, order, start, index, place, distance, near)


@compiled(f"float64({MEMORY}, int64[::1], float64[:,::1], float64, float64[::1])")
def approach(
    f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, index: np.ndarray, near: Array, h: float, v: Array
) -> float:
    """Largest approach of a point within sight in h seconds, in shares of what it may be; at most 1 is allowed."""
    worst = 0.0
    for i in range(integers(w, wl, Whole.OUTCOME)[Slot.NEARBY]):
        rate = near[i, 0] * v[0] + near[i, 1] * v[1] + near[i, 2] * v[2] + near[i, 3] * v[3]
        worst = max(worst, -h * rate / (SHARE * near[i, 4]))
    return worst


@compiled(f"int64({MEMORY}, {CLOUDS})")
def robust(
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
) -> int:
    """(M + h D + h^2 K) v+ = M v + h f in sub-steps in which no point comes nearer by more than 0.3 of its clearance.

    The linear prediction sets h, and the clearance found at the end of the sub-step must be at least half of what it
    was, else the sub-step is taken back. At the smallest h, and when the sub-steps run out, the velocity is scaled
    until it passes; the clearance is then positive whatever the hand does.
    """
    settings, outcome = vector(f, fl, Real.SETTINGS), integers(w, wl, Whole.OUTCOME)
    v, new, q, touch = vector(f, fl, Real.V), vector(f, fl, Real.V_NEXT), vector(f, fl, Real.Q), vector(f, fl, Real.TOUCH)
    period, book, offset = settings[Setting.PERIOD], vector(f, fl, Real.LEDGER), vector(f, fl, Real.OFFSET)
    smallest, left = period / 2.0**HALVINGS, period
    outcome[Slot.SUBSTEPS] = 0
    while left > 0.5 * smallest:
        last = outcome[Slot.SUBSTEPS] == MOST - 1
        h, clearance = left, touch[Touch.CLEARANCE]
        apply_hand(f, fl, w, wl)
        damp(f, fl, w, wl)
        while True:
            to_port(f, fl, w, wl)
            bound(f, fl, w, wl)
            new[:] = 0.0
            if propose(f, fl, w, wl, h, 1, 1):
                new[:] = vector(f, fl, Real.V_REF)
            limit(f, fl, w, wl, new)
            share = approach(f, fl, w, wl, index, near, h, new)
            final = last or h <= smallest
            if share > 1.0:
                if not final:
                    h = max(0.5 * h, smallest)
                    continue
                new /= share
                outcome[Slot.LIMITED] |= int(Limited.SUBSTEPS)
            try_velocity(f, fl, w, wl, h, new)
            trial = vector(f, fl, Real.Q_TRIAL)
            # What is entered now is taken back where the sub-step is: the forces are gone once it is evaluated.
            hand, barrier, dissipated = book[Book.HAND], book[Book.BARRIER], book[Book.DISSIPATED]
            numerical, limited, power = book[Book.NUMERICAL], book[Book.LIMITED], book[Book.POWER]
            book_step(f, fl, w, wl, h, 1)
            blocked = evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, trial)
            if blocked == 0 and touch[Touch.CLEARANCE] >= KEPT * min(clearance, settings[Setting.SIGHT]):
                break
            outcome[Slot.REJECTED] += 1
            book[Book.HAND], book[Book.BARRIER], book[Book.DISSIPATED] = hand, barrier, dissipated
            book[Book.NUMERICAL], book[Book.LIMITED], book[Book.POWER] = numerical, limited, power
            evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, q)
            apply_hand(f, fl, w, wl)
            if not final:
                h = max(0.5 * h, smallest)
                continue
            outcome[Slot.LIMITED] |= int(Limited.SUBSTEPS)
            new[:] = 0.0
            offset[:] = 0.0
            book_step(f, fl, w, wl, left, 1)
            v[:] = new
            return 0
        q[:] = trial
        v[:] = new
        left -= h
        outcome[Slot.SUBSTEPS] += 1
    return 0


@compiled(f"void({MEMORY}, int64, float64[::1], float64[::1])")
def slope(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, form: int, dq: Array, dv: Array) -> None:
    """Derivatives of the state at the evaluated configuration: q (d,), and v (m,) or qdot (d,)."""
    apply_hand(f, fl, w, wl)
    v = vector(f, fl, Real.V)
    if form == Form.REDUCED:
        damp(f, fl, w, wl)
        to_port(f, fl, w, wl)
        transform_transposed(matrix(f, fl, Real.Z), v, dq)
        dq += vector(f, fl, Real.OFFSET)
        D, M, hand = vector(f, fl, Real.D), vector(f, fl, Real.INERTIA), vector(f, fl, Real.F_HAND)
        F_rx = vector(f, fl, Real.F_RX)
        for i in range(v.shape[0]):
            force = hand[i] - D[i] * v[i]
            if i < 4:
                force += F_rx[i]
            dv[i] = force / M[i]
        return
    qdot = vector(f, fl, Real.RATE)
    transform(matrix(f, fl, Real.Z_PLUS_T), qdot, v)
    damp(f, fl, w, wl)
    dq[:] = qdot
    accelerate(f, fl, w, wl, qdot)
    dv[:] = vector(f, fl, Real.ACCELERATION)


@compiled(f"int64({MEMORY}, {CLOUDS})")
def runge_kutta(
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
) -> int:
    """The classical fourth-order step; where a stage cannot be evaluated or a limit acts, a semi-implicit step instead.

    The measured wrench is held over the step and moved with the handle in every stage.
    """
    settings, form = vector(f, fl, Real.SETTINGS), integers(w, wl, Whole.OPTIONS)[Option.FORM]
    q, trial, v = vector(f, fl, Real.Q), vector(f, fl, Real.Q_TRIAL), vector(f, fl, Real.V)
    state = v if form == Form.REDUCED else vector(f, fl, Real.RATE)
    book, D, M = vector(f, fl, Real.LEDGER), vector(f, fl, Real.D), vector(f, fl, Real.INERTIA)
    T, decided, stage = settings[Setting.PERIOD], integers(w, wl, Whole.DECIDED), matrix(f, fl, Real.STAGE)
    d, size = decided.shape[0], state.shape[0]
    first, dq, ds, sum_q, sum_s = stage[0, :size], stage[1], stage[2, :size], stage[3], stage[4, :size]
    free = stage[5, : v.shape[0]]
    first[:] = state
    free[:] = v
    sum_q[:] = 0.0
    sum_s[:] = 0.0
    before = kinetic_energy(M, v)
    hand, barrier, dissipated, power = book[Book.HAND], book[Book.BARRIER], book[Book.DISSIPATED], book[Book.POWER]
    entered = sum_of_kinetic_terms(book)
    fits = 1
    for k in range(4):
        slope(f, fl, w, wl, form, dq, ds)
        weight = T / 3.0 if 0 < k < 3 else T / 6.0
        for j in range(d):
            sum_q[j] += weight * dq[j]
        for i in range(size):
            sum_s[i] += weight * ds[i]
        book_forces(f, fl, w, wl, weight, v)
        for i in range(v.shape[0]):
            book[Book.DISSIPATED] += weight * D[i] * v[i] * v[i]
            book[Book.POWER] += weight * D[i] * v[i] * v[i]
        h = T if k == 2 else 0.5 * T
        trial[:] = q
        for j in range(d):
            trial[decided[j]] += h * dq[j] if k < 3 else sum_q[j]
        for i in range(size):
            state[i] = first[i] + (h * ds[i] if k < 3 else sum_s[i])
        if k < 3 and evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, trial):
            fits = 0
            break
    if fits:
        vector(f, fl, Real.OFFSET)[:] = 0.0
        bound(f, fl, w, wl)
        low, high = matrix(f, fl, Real.LOW), matrix(f, fl, Real.HIGH)
        for j in range(d):
            speed = sum_q[j] / T
            if not low[1, j] <= speed <= high[1, j]:
                fits = 0
        if inner(vector(f, fl, Real.SINGULAR_ROW), v) < vector(f, fl, Real.SINGULAR)[3]:
            fits = 0
    if fits:
        blocked = adopt(f, fl, w, wl, points, order, start, index, place, distance, near)
        if form != Form.REDUCED and blocked == 0:
            transform(matrix(f, fl, Real.Z_PLUS_T), state, v)
        book_remainder(f, fl, w, wl, kinetic_energy(M, v) - before, entered)
        return blocked
    state[:] = first
    v[:] = free
    book[Book.HAND], book[Book.BARRIER], book[Book.DISSIPATED], book[Book.POWER] = hand, barrier, dissipated, power
    evaluate(f, fl, w, wl, points, order, start, index, place, distance, near, q)
    apply_hand(f, fl, w, wl)
    if form == Form.REDUCED:
        return semi_implicit(f, fl, w, wl, points, order, start, index, place, distance, near)
    return full_step(f, fl, w, wl, points, order, start, index, place, distance, near)


@compiled(f"int64({MEMORY}, {CLOUDS})")
def full_step(
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
) -> int:
    """One Euler step of the full form, qdot+ = qdot + T qddot, moving with qdot+ (semi-implicit) or qdot (explicit).

    The limits act on its free part, and the rest is its offset: qdot = Z^T v + A^+ A qdot (19), (21).
    """
    settings, options = vector(f, fl, Real.SETTINGS), integers(w, wl, Whole.OPTIONS)
    explicit, T = options[Option.INTEGRATOR] == Integrator.EULER, settings[Setting.PERIOD]
    A, A_plus, Z = matrix(f, fl, Real.A), matrix(f, fl, Real.A_PLUS), matrix(f, fl, Real.Z)
    Z_plus_T, rate, offset = matrix(f, fl, Real.Z_PLUS_T), vector(f, fl, Real.RATE), vector(f, fl, Real.OFFSET)
    v, v_ref, new = vector(f, fl, Real.V), vector(f, fl, Real.V_REF), vector(f, fl, Real.V_NEXT)
    book, M, D = vector(f, fl, Real.LEDGER), vector(f, fl, Real.INERTIA), vector(f, fl, Real.D)
    qddot, port = vector(f, fl, Real.ACCELERATION), vector(f, fl, Real.PORT_RATE)
    before = kinetic_energy(M, v)
    entered = sum_of_kinetic_terms(book)
    damp(f, fl, w, wl)
    accelerate(f, fl, w, wl, rate)
    propose(f, fl, w, wl, T, 0, 0)
    matrix(f, fl, Real.A_LAST)[:, :] = A
    matrix(f, fl, Real.Z_PLUS_T_LAST)[:, :] = Z_plus_T
    options[Option.STARTED] = 1
    if not explicit:
        rate += T * qddot
    transform(Z_plus_T, rate, v_ref)
    transform(A, rate, port)
    transform(A_plus, port, offset)
    bound(f, fl, w, wl)
    new[:] = v_ref
    limit(f, fl, w, wl, new)
    for i in range(v.shape[0]):
        book[Book.LIMITED] += new[i] * M[i] * (new[i] - v_ref[i])
        book[Book.DISSIPATED] += T * D[i] * new[i] * new[i]
        book[Book.POWER] += T * D[i] * new[i] * new[i]
    book_forces(f, fl, w, wl, T, new)
    try_velocity(f, fl, w, wl, T, new)
    rate[:] = vector(f, fl, Real.QDOT)
    if explicit:
        rate += T * qddot
    blocked = adopt(f, fl, w, wl, points, order, start, index, place, distance, near)
    if blocked == 0:
        transform(Z_plus_T, rate, v)
    else:
        v[:] = new
    book_remainder(f, fl, w, wl, kinetic_energy(M, v) - before, entered)
    return blocked


@compiled(f"int64({MEMORY}, {CLOUDS})")
def integrate(
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
) -> int:
    """One period by the chosen form and integrator; returns the `Reason` against further motion, 0 if none."""
    options = integers(w, wl, Whole.OPTIONS)
    integrator = options[Option.INTEGRATOR]
    integers(w, wl, Whole.OUTCOME)[Slot.SUBSTEPS] = 1
    if integrator == Integrator.RK4:
        return runge_kutta(f, fl, w, wl, points, order, start, index, place, distance, near)
    if options[Option.FORM] != Form.REDUCED:
        return full_step(f, fl, w, wl, points, order, start, index, place, distance, near)
    if integrator == Integrator.EULER:
        return euler(f, fl, w, wl, points, order, start, index, place, distance, near)
    if integrator == Integrator.ROBUST:
        return robust(f, fl, w, wl, points, order, start, index, place, distance, near)
    return semi_implicit(f, fl, w, wl, points, order, start, index, place, distance, near)
