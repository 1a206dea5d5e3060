"""The classical Runge-Kutta method of fourth order, in either form."""

import numpy as np

from admittance.dense import inner, transform, transform_transposed
from admittance.energy import book_forces, book_remainder, kinetic_energy, sum_of_kinetic_terms
from admittance.memory import Real, Whole
from admittance.model import accelerate, apply_hand, to_port
from admittance.outcome import Book, Form, Option, Setting
from admittance.steps import DONE, KEEP, START, bound, damp, full_step, keep, semi_implicit
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers, matrix, vector

LAST = 4
"""Phase after the sum of all four stages was evaluated; phases 1 to 3 come after the stages before."""
INSTEAD = 5
"""Q was evaluated again: a semi-implicit step instead."""


@compiled(f"void({MEMORY}, int64, float64[::1], float64[::1])")
def slope(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, form: int, dq: Array, ds: Array) -> None:
    """Derivatives of q (d,) and of the state, v (m,) or qdot (d,), at the evaluated configuration."""
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
            force = hand[i] - D[i] * v[i] + F_rx[i]
            ds[i] = force / M[i]
        return
    qdot = vector(f, fl, Real.RATE)
    transform(matrix(f, fl, Real.Z_PLUS_T), qdot, v)
    damp(f, fl, w, wl)
    dq[:] = qdot
    accelerate(f, fl, w, wl, qdot)
    ds[:] = vector(f, fl, Real.ACCELERATION)


@compiled(f"int64({MEMORY})")
def fits(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """1 where the sum of the stages keeps all limits."""
    vector(f, fl, Real.OFFSET)[:] = 0.0
    bound(f, fl, w, wl)
    low, high = matrix(f, fl, Real.LOW), matrix(f, fl, Real.HIGH)
    total, period = matrix(f, fl, Real.STAGE)[3], vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    for j in range(total.shape[0]):
        if not low[1, j] <= total[j] / period <= high[1, j]:
            return 0
    return int(inner(vector(f, fl, Real.SINGULAR_ROW), vector(f, fl, Real.V)) >= vector(f, fl, Real.SINGULAR)[3])


@compiled(f"int64({MEMORY}, int64, int64)")
def runge_kutta(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, phase: int, blocked: int) -> int:
    """Go on from a phase to the next configuration that is to be evaluated; see `integrators`.

    The measured wrench is held over the period and moved with the handle in every stage. Where a stage cannot be
    evaluated or a limit acts, a semi-implicit step is taken instead.
    """
    form, T = integers(w, wl, Whole.OPTIONS)[Option.FORM], vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    q, trial, v = vector(f, fl, Real.Q), vector(f, fl, Real.Q_TRIAL), vector(f, fl, Real.V)
    state = v if form == Form.REDUCED else vector(f, fl, Real.RATE)
    book, D, M = vector(f, fl, Real.LEDGER), vector(f, fl, Real.D), vector(f, fl, Real.INERTIA)
    before, remember = vector(f, fl, Real.LEDGER_LAST), vector(f, fl, Real.PROGRESS)
    decided, stage = integers(w, wl, Whole.DECIDED), matrix(f, fl, Real.STAGE)
    d, size = decided.shape[0], state.shape[0]
    first, dq, ds, sum_q, sum_s = stage[0, :size], stage[1], stage[2, :size], stage[3], stage[4, :size]
    free = stage[5, : v.shape[0]]
    if phase == KEEP:
        return keep(f, fl, w, wl, blocked)
    if phase == LAST:
        if keep(f, fl, w, wl, blocked) == DONE and form == Form.REDUCED:
            book_remainder(f, fl, w, wl, kinetic_energy(M, v) - remember[0], remember[1])
        return DONE
    if phase == INSTEAD:
        apply_hand(f, fl, w, wl)
        return semi_implicit(f, fl, w, wl) if form == Form.REDUCED else full_step(f, fl, w, wl)
    if phase == START:
        first[:] = state
        free[:] = v
        sum_q[:] = 0.0
        sum_s[:] = 0.0
        before[:] = book
        remember[0] = kinetic_energy(M, v)
        remember[1] = sum_of_kinetic_terms(book)
    good = blocked == 0
    if good:
        slope(f, fl, w, wl, form, dq, ds)
        weight = T / 3.0 if 0 < phase < 3 else T / 6.0
        h = T if phase == 2 else 0.5 * T
        book_forces(f, fl, w, wl, weight, v)
        for i in range(v.shape[0]):
            book[Book.DISSIPATED] += weight * D[i] * v[i] * v[i]
            book[Book.POWER] += weight * D[i] * v[i] * v[i]
        trial[:] = q
        for j in range(d):
            sum_q[j] += weight * dq[j]
            trial[decided[j]] += h * dq[j] if phase < 3 else sum_q[j]
        for i in range(size):
            sum_s[i] += weight * ds[i]
            state[i] = first[i] + (h * ds[i] if phase < 3 else sum_s[i])
        if phase < 3:
            return phase + 1
        good = fits(f, fl, w, wl) == 1
    if good:
        return LAST
    state[:] = first
    v[:] = free
    book[:] = before
    trial[:] = q
    return INSTEAD
