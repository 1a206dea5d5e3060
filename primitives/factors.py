"""The factors that the active-set solver keeps up: J and the triangular R of the active rows, in one scratch array.

work[:n] is J, work[n:2n] is R, work[2n] the multipliers; see `active_set` for what they mean.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled


@compiled(
    "float64(float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], int64, float64[:,::1], int64)"
)
def unit_row(A: Array, b: Array, low: Array, high: Array, scale: Array, k: int, work: Array, at: int) -> float:
    """Write the unit normal of row k to work[at] and return its bound."""
    m, n = A.shape
    if k < m:
        for j in range(n):
            work[at, j] = A[k, j] * scale[k]
        return float(b[k] * scale[k])
    for j in range(n):
        work[at, j] = 0.0
    if k < m + n:
        work[at, k - m] = 1.0
        return float(low[k - m])
    work[at, k - m - n] = -1.0
    return float(-high[k - m - n])


@compiled("int64(float64[:,::1], float64[:,::1])")
def inverse_factor(H: Array, work: Array) -> int:
    """Write J = L^-T of H = L L^T to work[:n]; 0 where H is not positive definite, else 1."""
    n = H.shape[0]
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j]
            for k in range(j):
                total -= work[n + i, k] * work[n + j, k]
            if i > j:
                work[n + i, j] = total * work[j, j]
            elif total > 0.0:
                work[n + i, i] = np.sqrt(total)
                work[i, i] = 1.0 / work[n + i, i]
            else:
                return 0
    for i in range(n):
        for j in range(i):
            work[i, j] = 0.0
        for j in range(i + 1, n):
            total = 0.0
            for k in range(i, j):
                total -= work[n + j, k] * work[i, k]
            work[i, j] = total * work[j, j]
    return 1


@compiled("void(float64[:,::1], int64, int64, int64)")
def project_row(work: Array, n: int, normal: int, out: int) -> None:
    """work[out] = J^T work[normal]."""
    for j in range(n):
        work[out, j] = 0.0
    for i in range(n):
        value = work[normal, i]
        if value != 0.0:
            for j in range(n):
                work[out, j] += value * work[i, j]


@compiled("void(float64[:,::1], int64, int64, int64)")
def add_row(work: Array, n: int, d: int, count: int) -> None:
    """Make work[d] = J^T a the column `count` of R: rotate the columns of J so that its tail becomes zero."""
    y = work[d, n - 1]
    square = y * y
    for j in range(n - 1, count, -1):
        x = work[d, j - 1]
        if y == 0.0:
            y, square = x, x * x
            continue
        square += x * x
        length = np.sqrt(square)
        inverse = 1.0 / length
        c, s, y = x * inverse, y * inverse, length
        for i in range(n):
            p, q = work[i, j - 1], work[i, j]
            work[i, j - 1] = c * p + s * q
            work[i, j] = c * q - s * p
    work[d, count] = y
    for i in range(count + 1):
        work[n + i, count] = work[d, i]


@compiled("void(float64[:,::1], int64, int64[::1], int64[::1], int64, int64)")
def drop_row(work: Array, n: int, active: np.ndarray, mask: np.ndarray, u: int, place: int) -> None:
    """Take the active row at `place` out of R, u and the list, and rotate R back to triangular form."""
    count = active[0]
    mask[active[1 + place]] = 0
    for j in range(place, count - 1):
        active[1 + j] = active[2 + j]
        work[u, j] = work[u, j + 1]
        for i in range(j + 2):
            work[n + i, j] = work[n + i, j + 1]
    for j in range(place, count - 1):
        x, y = work[n + j, j], work[n + j + 1, j]
        length = np.sqrt(x * x + y * y)
        if length == 0.0:
            continue
        c, s = x / length, y / length
        for k in range(j, count - 1):
            p, q = work[n + j, k], work[n + j + 1, k]
            work[n + j, k] = c * p + s * q
            work[n + j + 1, k] = c * q - s * p
        for i in range(n):
            p, q = work[i, j], work[i, j + 1]
            work[i, j] = c * p + s * q
            work[i, j + 1] = c * q - s * p
    active[0] = count - 1


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], int64[::1],"
    "float64[:,::1], float64[::1])"
)
def minimum_on_active(
    g: Array, A: Array, b: Array, low: Array, high: Array, scale: Array, active: np.ndarray, work: Array, x: Array
) -> None:
    """Minimum with the active rows as equalities, and their multipliers in work[2n].

    x = J1 w - J2 J2^T g and R u = J1^T g + w, with R^T w = b of the active rows.
    """
    n, count = g.shape[0], active[0]
    u, projected, normal = 2 * n, 2 * n + 1, 2 * n + 2
    for j in range(n):
        work[projected, j] = 0.0
    for i in range(n):
        for j in range(n):
            work[projected, j] += work[i, j] * g[i]
    for i in range(count):
        w = unit_row(A, b, low, high, scale, active[1 + i], work, normal)
        for j in range(i):
            w -= work[n + j, i] * work[u, j]
        work[u, i] = w / work[n + i, i]
    for i in range(n):
        total = 0.0
        for j in range(count):
            total += work[i, j] * work[u, j]
        for j in range(count, n):
            total -= work[i, j] * work[projected, j]
        x[i] = total
    for i in range(count - 1, -1, -1):
        total = work[u, i] + work[projected, i]
        for j in range(i + 1, count):
            total -= work[n + i, j] * work[u, j]
        work[u, i] = total / work[n + i, i]
