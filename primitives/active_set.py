"""The dense active-set solver of the hot path.

The dual method of D. Goldfarb and A. Idnani, "A numerically stable dual method for solving strictly convex quadratic
programs", Mathematical Programming 27, 1983: start at the unconstrained minimum, add violated rows one by one, drop
those whose multiplier would turn negative. Warm start: rows that were active in the last cycle are added first.

Rows are numbered 0..m-1 for A v >= b, m..m+n-1 for v >= low, m+n..m+2n-1 for -v >= -high. J is L^-T Q and R the
triangular factor, so that J^T H J = I and J^T N = [R; 0] for the matrix N of active normals.
"""

from enum import IntEnum

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.factors import add_row, drop_row, inverse_factor, minimum_on_active, project_row, unit_row


class SolverStatus(IntEnum):
    """What a solver says of its own answer; verification does not rely on it."""

    OPTIMAL = 0
    INFEASIBLE = 1
    NOT_CONVERGED = 2
    NOT_CONVEX = 3
    NOT_SOLVED = 4


OPTIMAL = int(SolverStatus.OPTIMAL)
INFEASIBLE = int(SolverStatus.INFEASIBLE)
NOT_CONVERGED = int(SolverStatus.NOT_CONVERGED)
NOT_CONVEX = int(SolverStatus.NOT_CONVEX)
NOT_SOLVED = int(SolverStatus.NOT_SOLVED)

FEASIBLE = 1e-11
"""A row of unit normal counts as satisfied above minus this; ten times more for every round after the second."""
TOLERATED = 1e-7
"""A row that depends on the active ones to rounding, and is violated by less, is left at that."""
DEPENDENT = 1e-20
"""Share of a normal's squared length, in the metric of H, that must lie outside the active ones."""
ROUNDS = 20
"""Iterations allowed per row and variable."""
HELD, LEFT = 1, 2
"""Marks in the mask: a row that is active, and one that is left at a tolerated violation for as long as it stays so."""


def work_rows(n: int) -> int:
    """Rows of n that `solve` needs as scratch."""
    return 2 * n + 6


@compiled("void(float64[:,::1], int64[::1], int64, int64)")
def _keep_conflict(work: Array, active: np.ndarray, r: int, p: int) -> None:
    """Leave in the list the rows that row p contradicts: a_p = sum r_i a_i, of which those with r_i < 0 count."""
    kept = 0
    for i in range(active[0]):
        k = active[1 + i]
        if work[r, i] < -1e-9:
            active[1 + kept] = k
            kept += 1
    active[1 + kept] = p
    active[0] = kept + 1


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], int64[::1],"
    "int64[::1], float64[:,::1], float64[::1])"
)
def _settle(
    g: Array,
    A: Array,
    b: Array,
    low: Array,
    high: Array,
    scale: Array,
    active: np.ndarray,
    mask: np.ndarray,
    work: Array,
    x: Array,
) -> None:
    """As `minimum_on_active`, and rows of negative multiplier are dropped, the most negative first, until none is."""
    n = g.shape[0]
    while True:
        minimum_on_active(g, A, b, low, high, scale, active, work, x)
        place, least = -1, 0.0
        for i in range(active[0]):
            if work[2 * n, i] < least:
                place, least = i, work[2 * n, i]
        if place < 0:
            return
        drop_row(work, n, active, mask, 2 * n, place)


@compiled(
    "int64(float64[:,::1], float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1],"
    "float64[::1], float64[::1], int64[::1], int64[::1], float64[::1], float64[:,::1])"
)
def solve(
    H: Array,
    g: Array,
    A: Array,
    b: Array,
    low: Array,
    high: Array,
    x: Array,
    multiplier: Array,
    active: np.ndarray,
    mask: np.ndarray,
    scale: Array,
    work: Array,
) -> int:
    """Solve a strictly convex QP of n variables and m rows.

    Parameters
    ----------
    H, g, A, b, low, high : see `vfi.qp`.
    x : (n,) the answer.
    multiplier : (m + 2n,) multipliers of rows, lower and upper bounds, all >= 0.
    active : (n + 2,) count of active rows and their numbers; what it holds on entry is the warm start.
    mask : (m + 2n,) scratch, zero on entry and on return.
    scale : (m,) scratch. work : (`work_rows(n)`, n) scratch.

    Returns
    -------
    A `SolverStatus`; NOT_SOLVED where a number is NaN, or a row infinite. For INFEASIBLE the active rows are those in
    conflict, the last of them the one that did not fit.
    """
    m, n = A.shape
    u, normal, d, r = 2 * n, 2 * n + 2, 2 * n + 3, 2 * n + 4
    multiplier[:] = 0.0
    for k in range(m):
        square = 0.0
        for j in range(n):
            square += A[k, j] * A[k, j]
        if not np.isfinite(square) or np.isnan(b[k]):
            return NOT_SOLVED
        if square < 1e-28:
            scale[k] = 0.0
            if b[k] > FEASIBLE:
                active[0] = 1
                active[1] = k
                return INFEASIBLE
        else:
            scale[k] = 1.0 / np.sqrt(square)
    for j in range(n):
        if np.isnan(g[j]) or np.isnan(low[j]) or np.isnan(high[j]):
            return NOT_SOLVED
    if not inverse_factor(H, work):
        return NOT_CONVEX
    remembered = active[0]
    active[0] = 0
    for i in range(min(remembered, n)):
        k = active[1 + i]
        if k < 0 or k >= m + 2 * n or mask[k] or (k < m and (scale[k] == 0.0 or b[k] == -np.inf)):
            continue
        if np.isinf(unit_row(A, b, low, high, scale, k, work, normal)):
            continue
        project_row(work, n, normal, d)
        inside, outside = 0.0, 0.0
        for j in range(n):
            if j < active[0]:
                inside += work[d, j] * work[d, j]
            else:
                outside += work[d, j] * work[d, j]
        if outside > DEPENDENT * (inside + outside):
            add_row(work, n, d, active[0])
            active[1 + active[0]] = k
            active[0] += 1
            mask[k] = HELD
    _settle(g, A, b, low, high, scale, active, mask, work, x)
    status, settled, careful, feasible = NOT_CONVERGED, True, False, FEASIBLE
    for turn in range(ROUNDS * (m + 3 * n)):
        if turn > 2 * (m + 3 * n) and turn % (m + 3 * n) == 0 and feasible < TOLERATED:
            feasible *= 10.0
        if careful and not settled:
            _settle(g, A, b, low, high, scale, active, mask, work, x)
            settled = True
        worst, p = -feasible, -1
        for k in range(m):
            if mask[k] != HELD and scale[k] > 0.0 and b[k] > -np.inf:
                value = -b[k]
                for j in range(n):
                    value += A[k, j] * x[j]
                value *= scale[k]
                if value < worst and (mask[k] != LEFT or value < -TOLERATED):
                    worst, p = value, k
        for j in range(n):
            value, k = x[j] - low[j], m + j
            if value < worst and mask[k] != HELD and (mask[k] != LEFT or value < -TOLERATED):
                worst, p = value, k
            value, k = high[j] - x[j], m + n + j
            if value < worst and mask[k] != HELD and (mask[k] != LEFT or value < -TOLERATED):
                worst, p = value, k
        if p < 0:
            if settled:
                status = OPTIMAL
                break
            _settle(g, A, b, low, high, scale, active, mask, work, x)
            settled = True
            continue
        settled = False
        unit_row(A, b, low, high, scale, p, work, normal)
        mine = 0.0
        while True:
            count = active[0]
            project_row(work, n, normal, d)
            inside, outside = 0.0, 0.0
            for j in range(n):
                if j < count:
                    inside += work[d, j] * work[d, j]
                else:
                    outside += work[d, j] * work[d, j]
            for i in range(count - 1, -1, -1):
                total = work[d, i]
                for j in range(i + 1, count):
                    total -= work[n + i, j] * work[r, j]
                work[r, i] = total / work[n + i, i]
            dual_step, place = np.inf, -1
            for i in range(count):
                if work[r, i] > 0.0 and work[u, i] < dual_step * work[r, i]:
                    dual_step, place = work[u, i] / work[r, i], i
            free = outside > DEPENDENT * (inside + outside)
            primal_step = -worst / outside if free else np.inf
            step = min(dual_step, primal_step)
            if step == np.inf and not careful:
                # Rounding has accumulated in x: go on with an x that is computed anew in each turn.
                careful = True
                break
            if step == np.inf and worst > -TOLERATED:
                mask[p] = LEFT
                break
            if step == np.inf:
                for k in range(m + 2 * n):
                    mask[k] = 0
                _keep_conflict(work, active, r, p)
                return INFEASIBLE
            for i in range(count):
                work[u, i] -= step * work[r, i]
            mine += step
            if free:
                for i in range(n):
                    total = 0.0
                    for j in range(count, n):
                        total += work[i, j] * work[d, j]
                    x[i] += step * total
                worst += step * outside
            if step == primal_step:
                add_row(work, n, d, count)
                work[u, count] = mine
                active[1 + count] = p
                active[0] = count + 1
                mask[p] = HELD
                break
            drop_row(work, n, active, mask, u, place)
    for k in range(m + 2 * n):
        mask[k] = 0
    for i in range(active[0]):
        k = active[1 + i]
        multiplier[k] = work[u, i] * (scale[k] if k < m else 1.0)
    return status
