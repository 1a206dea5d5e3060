"""Storage function, work and the passivity ledger (paper A, (28), (38)), kept up by every cycle at constant cost.

Storage V_f = 1/2 v^T M v + V; erratum to (28): the potentials are functions of p_t. Between any two cycles
V_f grows by exactly

    hand - dissipated + numerical + limited + barrier + clouds

hand : T (Z J_t^T F_th)^T v_c, the work of the measured wrench, held over a step, with the free velocity v_c commanded
    meanwhile; hand_chord is the same with the handle's displacement and rotation.
dissipated : T v_c^T D v_c >= 0.
numerical : what integrating in steps adds, -1/2 |v+ - v|_M^2 for a semi-implicit step and +1/2 |v+ - v|_M^2 for an
    explicit one, and the difference of D's work where it is taken at another velocity.
limited : by limits, and by stopping; <= 0.
barrier : change of the potential plus the work of its force, zero in continuous time.
clouds : change of the potential where a cloud was moved or replaced: work of whoever moved it.

The passivity excess is the largest growth of V_f - hand (- clouds) over any interval so far: the running maximum of
S_k - min S_j, j <= k, where S is that difference. A passive motion has none.
"""

import numpy as np

from admittance.memory import Real
from admittance.outcome import Book, Touch
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, matrix, vector


@compiled("float64(float64[::1], float64[::1])")
def kinetic_energy(M: Array, v: Array) -> float:
    """1/2 v^T M v, J."""
    value = 0.0
    for i in range(v.shape[0]):
        value += 0.5 * M[i] * v[i] * v[i]
    return value


@compiled(f"void({MEMORY}, float64, float64[::1])")
def book_forces(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float, v: Array) -> None:
    """Enter the work of hand and repulsion over h seconds of the free velocity v (m,)."""
    book, hand, F_rx = vector(f, fl, Real.LEDGER), vector(f, fl, Real.F_HAND), vector(f, fl, Real.F_RX)
    for i in range(v.shape[0]):
        book[Book.HAND] += h * hand[i] * v[i]
        book[Book.BARRIER] += h * F_rx[i] * v[i]


@compiled(f"void({MEMORY}, float64, int64)")
def book_step(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float, damping: int) -> None:
    """Enter a semi-implicit step of h seconds from V by V_REF to V_NEXT, before anything is evaluated anew.

    `limited` is v+^T X (v+ - v_ref). With implicit stiffness (which METRIC then holds) h^2 v+^T K v+ is numerical too.
    """
    book, D, M = vector(f, fl, Real.LEDGER), vector(f, fl, Real.D), vector(f, fl, Real.INERTIA)
    v, v_ref, new, X = (
        vector(f, fl, Real.V),
        vector(f, fl, Real.V_REF),
        vector(f, fl, Real.V_NEXT),
        matrix(f, fl, Real.METRIC),
    )
    for i in range(v.shape[0]):
        book[Book.DISSIPATED] += h * D[i] * new[i] * new[i]
        book[Book.POWER] += h * D[i] * new[i] * new[i]
        change = new[i] - v[i]
        book[Book.NUMERICAL] -= 0.5 * M[i] * change * change
        if not damping:
            book[Book.NUMERICAL] += h * D[i] * new[i] * change
        for j in range(v.shape[0]):
            book[Book.LIMITED] += new[i] * X[i, j] * (new[j] - v_ref[j])
            extra = X[i, j]
            if i == j:
                extra -= M[i]
                if damping:
                    extra -= h * D[i]
            book[Book.NUMERICAL] -= new[i] * extra * new[j]
    book_forces(f, fl, w, wl, h, new)


@compiled(f"void({MEMORY}, float64)")
def book_explicit(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float) -> None:
    """Enter an explicit step of h seconds: V was cut to COMMANDED by the limits, moved the arm, and became V_NEXT."""
    book, D, M = vector(f, fl, Real.LEDGER), vector(f, fl, Real.D), vector(f, fl, Real.INERTIA)
    v, c, new = vector(f, fl, Real.V), vector(f, fl, Real.COMMANDED), vector(f, fl, Real.V_NEXT)
    for i in range(v.shape[0]):
        change = new[i] - c[i]
        book[Book.LIMITED] += 0.5 * M[i] * (c[i] * c[i] - v[i] * v[i])
        book[Book.NUMERICAL] += 0.5 * M[i] * change * change
        book[Book.DISSIPATED] += h * D[i] * c[i] * c[i]
        book[Book.POWER] += h * D[i] * c[i] * c[i]
    book_forces(f, fl, w, wl, h, c)


@compiled("float64(float64[::1])")
def sum_of_kinetic_terms(book: Array) -> float:
    """All entries that change the kinetic energy: hand, repulsion, dissipated, limited, numerical."""
    return float(
        book[Book.HAND] + book[Book.BARRIER] - book[Book.DISSIPATED] + book[Book.LIMITED] + book[Book.NUMERICAL]
    )


@compiled(f"void({MEMORY}, float64, float64)")
def book_remainder(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, kinetic: float, entered: float) -> None:
    """Enter as numerical what of a change of kinetic energy the forces entered since do not account for."""
    book = vector(f, fl, Real.LEDGER)
    book[Book.NUMERICAL] += kinetic - (sum_of_kinetic_terms(book) - entered)


@compiled("float64(float64[::1], float64[::1], float64[::1])")
def chord_work(wrench: Array, before: Array, after: Array) -> float:
    """Work of a wrench [force; torque] at a point that goes from one pose (12,) to another: F . dp + tau . d theta."""
    work, trace = 0.0, -1.0
    for r in range(3):
        work += wrench[r] * (after[9 + r] - before[9 + r])
        for c in range(3):
            trace += after[3 * r + c] * before[3 * r + c]
    # R_after R_before^T - its transpose = 2 sin(angle) times the axis' cross product.
    twice = 0.0
    turn = 0.0
    for r in range(3):
        a, b = (r + 2) % 3, (r + 1) % 3
        part = 0.0
        for c in range(3):
            part += after[3 * a + c] * before[3 * b + c] - after[3 * b + c] * before[3 * a + c]
        turn += wrench[3 + r] * part
        twice += part * part
    sine = np.sqrt(twice)
    if sine > 1e-12:
        turn *= np.arctan2(sine, trace) / sine
    else:
        turn *= 0.5
    return work + turn


@compiled("void(float64[::1], int64, int64, float64)")
def raise_excess(book: Array, excess: int, lowest: int, active: float) -> None:
    """Update the largest growth of a difference S over any interval, and the lowest S so far."""
    book[lowest] = min(book[lowest], active)
    book[excess] = max(book[excess], active - book[lowest])


@compiled(f"void({MEMORY}, float64)")
def close_books(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, period: float) -> None:
    """At the end of a cycle: the potential's change, storage, the chord's work, and the excess so far."""
    book = vector(f, fl, Real.LEDGER)
    potential = vector(f, fl, Real.TOUCH)[Touch.POTENTIAL]
    book[Book.BARRIER] += potential - book[Book.POTENTIAL]
    book[Book.POTENTIAL] = potential
    book[Book.KINETIC] = kinetic_energy(vector(f, fl, Real.INERTIA), vector(f, fl, Real.V))
    book[Book.STORAGE] = book[Book.KINETIC] + potential
    book[Book.HAND_CHORD] += chord_work(
        vector(f, fl, Real.WRENCH), vector(f, fl, Real.HANDLE_LAST), vector(f, fl, Real.HANDLE)
    )
    book[Book.POWER] /= period
    stored = book[Book.STORAGE] - book[Book.CLOUDS]
    raise_excess(book, Book.EXCESS, Book.LOWEST, stored - book[Book.HAND])
    raise_excess(book, Book.EXCESS_CHORD, Book.LOWEST_CHORD, stored - book[Book.HAND_CHORD])


@compiled(f"void({MEMORY})")
def open_books(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Begin with the storage at the evaluated start."""
    book = vector(f, fl, Real.LEDGER)
    book[:] = 0.0
    book[Book.POTENTIAL] = vector(f, fl, Real.TOUCH)[Touch.POTENTIAL]
    book[Book.KINETIC] = kinetic_energy(vector(f, fl, Real.INERTIA), vector(f, fl, Real.V))
    book[Book.STORAGE] = book[Book.POTENTIAL] + book[Book.KINETIC]
    book[Book.LOWEST] = book[Book.STORAGE]
    book[Book.LOWEST_CHORD] = book[Book.STORAGE]
