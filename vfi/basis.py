"""The program in fewer variables: v = basis y + offset, with y free of what must always hold.

The basis comes with the reference (the free-motion coordinates of a target admittance), or spans the motions that
satisfy the equalities E v = e: with E^T = Q [R; 0], offset = Q_1 R^-T e and basis = Q_2. Bounds of v are rows for y.
"""

import numpy as np

from primitives.active_set import solve
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers, matrix, vector
from vfi.memory import Real, Whole
from vfi.outcome import Option
from vfi.relaxation import relax
from vfi.tasks import PROJECTION

RANK = 1e-7
"""Of the largest entry on the triangle's diagonal: below it the equalities have lost rank."""
NEVER = -1.0
"""Demand of a row that cannot yield."""


@compiled("int64(float64[:,::1], float64[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1])")
def eliminate(E: Array, e: Array, Q: Array, W: Array, basis: Array, offset: Array) -> int:
    """Basis (d, d - p) of E v = 0 and offset (d,), the shortest v with E v = e, by Householder's reflections.

    Q (d, d) and W (d, p) are scratch. Returns 0 where the p rows have lost rank, else 1.
    """
    p, d = E.shape
    for i in range(d):
        for j in range(d):
            Q[i, j] = 1.0 if i == j else 0.0
        for j in range(p):
            W[i, j] = E[j, i]
    largest = 0.0
    for c in range(p):
        square = 0.0
        for i in range(c, d):
            square += W[i, c] * W[i, c]
        length = np.sqrt(square)
        largest = max(largest, length)
        if not length > RANK * largest:
            return 0
        pivot = -length if W[c, c] > 0.0 else length
        W[c, c] -= pivot
        square = 0.0
        for i in range(c, d):
            square += W[i, c] * W[i, c]
        for j in range(c + 1, p):
            total = 0.0
            for i in range(c, d):
                total += W[i, c] * W[i, j]
            for i in range(c, d):
                W[i, j] -= 2.0 * total / square * W[i, c]
        for r in range(d):
            total = 0.0
            for i in range(c, d):
                total += Q[r, i] * W[i, c]
            for i in range(c, d):
                Q[r, i] -= 2.0 * total / square * W[i, c]
        W[c, c] = pivot
    for i in range(d):
        offset[i] = 0.0
        for j in range(d - p):
            basis[i, j] = Q[i, p + j]
    for c in range(p):
        for j in range(c):
            e[c] -= W[j, c] * e[j]
        e[c] /= W[c, c]
        for i in range(d):
            offset[i] += Q[i, c] * e[c]
    return 1


@compiled("void(float64[::1], float64[::1], float64[::1])")
def shorten(offset: Array, low: Array, high: Array) -> None:
    """Scale the offset down to where the bounds allow it, as far as they allow standing still."""
    share = 1.0
    for i in range(offset.shape[0]):
        if offset[i] > high[i] >= 0.0:
            share = min(share, high[i] / offset[i])
        if offset[i] < low[i] <= 0.0:
            share = min(share, low[i] / offset[i])
    for i in range(offset.shape[0]):
        offset[i] *= share


@compiled(f"void({MEMORY})")
def change_variables(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Cost and rows of the program in y: that of the joints' (H, g), or |y - v_ref|^2 in the metric that was given."""
    basis, offset, H_y, g_y = (
        matrix(f, fl, Real.BASIS),
        vector(f, fl, Real.OFFSET),
        matrix(f, fl, Real.FREE_H),
        vector(f, fl, Real.FREE_G),
    )
    d, free = basis.shape
    if integers(w, wl, Whole.OPTIONS)[Option.TASK] == PROJECTION:
        metric, reference = matrix(f, fl, Real.METRIC), vector(f, fl, Real.REFERENCE)
        for a in range(free):
            g_y[a] = 0.0
            for b in range(free):
                H_y[a, b] = metric[a, b]
                g_y[a] -= metric[a, b] * reference[b]
    else:
        H, g = matrix(f, fl, Real.H), vector(f, fl, Real.G)
        for a in range(free):
            g_y[a] = 0.0
            for b in range(free):
                H_y[a, b] = 0.0
        for i in range(d):
            pull = g[i]
            for j in range(d):
                pull += H[i, j] * offset[j]
            for a in range(free):
                g_y[a] += basis[i, a] * pull
                for j in range(d):
                    for b in range(free):
                        H_y[a, b] += basis[i, a] * H[i, j] * basis[j, b]
    A, A_y = matrix(f, fl, Real.A), matrix(f, fl, Real.FREE_A)
    rows = A.shape[0]
    for i in range(rows):
        for a in range(free):
            value = 0.0
            for j in range(d):
                value += A[i, j] * basis[j, a]
            A_y[i, a] = value
    for j in range(d):
        for a in range(free):
            A_y[rows + j, a] = basis[j, a]
            A_y[rows + d + j, a] = -basis[j, a]


@compiled("float64(float64[:,::1], int64, float64[::1])")
def _along(A: Array, row: int, offset: Array) -> float:
    value = 0.0
    for j in range(offset.shape[0]):
        value += A[row, j] * offset[j]
    return value


@compiled(f"void({MEMORY})")
def expand(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """V = basis y + offset."""
    basis, y, v = matrix(f, fl, Real.BASIS), vector(f, fl, Real.FREE), vector(f, fl, Real.V)
    offset = vector(f, fl, Real.OFFSET)
    for i in range(v.shape[0]):
        v[i] = offset[i] + _along(basis, i, y)


@compiled(f"int64({MEMORY})")
def solve_in_basis(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Solve the program as it stands, in y; fills V and MULTIPLIER as in the joints. Returns the solver's status."""
    A, b, b_y = matrix(f, fl, Real.A), vector(f, fl, Real.B), vector(f, fl, Real.FREE_B)
    offset, low, high = vector(f, fl, Real.OFFSET), vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH)
    unbounded, free, rows, d = vector(f, fl, Real.UNBOUNDED), fl[Real.FREE, 1], A.shape[0], offset.shape[0]
    for i in range(rows):
        b_y[i] = b[i] - _along(A, i, offset)
    for j in range(d):
        b_y[rows + j] = low[j] - offset[j]
        b_y[rows + d + j] = offset[j] - high[j]
    status = solve(
        matrix(f, fl, Real.FREE_H),
        vector(f, fl, Real.FREE_G),
        matrix(f, fl, Real.FREE_A),
        b_y,
        unbounded[:free],
        unbounded[free:],
        vector(f, fl, Real.FREE),
        vector(f, fl, Real.MULTIPLIER),
        integers(w, wl, Whole.ACTIVE),
        integers(w, wl, Whole.MASK),
        vector(f, fl, Real.SCALE),
        matrix(f, fl, Real.FREE_WORK),
    )
    expand(f, fl, w, wl)
    return int(status)


@compiled(f"int64({MEMORY})")
def relax_in_basis(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Lower B, and raise SLACK by as much, where the rows contradict each other; see `vfi.relaxation.relax`."""
    A, b, slack, demand = (
        matrix(f, fl, Real.A),
        vector(f, fl, Real.B),
        vector(f, fl, Real.SLACK),
        vector(f, fl, Real.DEMAND),
    )
    b_y, slack_y, demand_y = (
        vector(f, fl, Real.FREE_B),
        vector(f, fl, Real.FREE_SLACK),
        vector(f, fl, Real.FREE_DEMAND),
    )
    classes, classes_y = integers(w, wl, Whole.SAFETY_CLASS), integers(w, wl, Whole.FREE_CLASS)
    offset, unbounded, free = vector(f, fl, Real.OFFSET), vector(f, fl, Real.UNBOUNDED), fl[Real.FREE, 1]
    for i in range(b_y.shape[0]):
        inside = i < b.shape[0]
        slack_y[i] = 0.0
        demand_y[i] = demand[i] - _along(A, i, offset) if inside else NEVER
        classes_y[i] = classes[i] if inside else 0
    status = relax(
        matrix(f, fl, Real.FREE_A),
        demand_y,
        unbounded[:free],
        unbounded[free:],
        classes_y,
        b_y,
        slack_y,
        matrix(f, fl, Real.RELAXED_H),
        vector(f, fl, Real.RELAXED_G),
        matrix(f, fl, Real.RELAXED_A),
        vector(f, fl, Real.RELAXED_B),
        vector(f, fl, Real.RELAXED_LOW),
        vector(f, fl, Real.RELAXED_HIGH),
        vector(f, fl, Real.RELAXED_V),
        vector(f, fl, Real.RELAXED_MULTIPLIER),
        integers(w, wl, Whole.RELAXED_ACTIVE),
        integers(w, wl, Whole.RELAXED_MASK),
        vector(f, fl, Real.RELAXED_SCALE),
        matrix(f, fl, Real.RELAXED_WORK),
    )
    for i in range(b.shape[0]):
        b[i] -= slack_y[i]
        slack[i] += slack_y[i]
    return int(status)
