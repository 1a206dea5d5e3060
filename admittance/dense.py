"""The little dense algebra that a cycle needs: products, Cholesky, and the eigenvalues of a symmetric matrix.

For matrices of at most ten rows a call into LAPACK costs more than the arithmetic, and allocates.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled

SWEEPS = 12
"""Jacobi sweeps over a symmetric matrix at most; six rows need about six to full precision."""


@compiled("void(float64[:,::1], float64[:,::1], float64[:,::1])")
def multiply(a: Array, b: Array, out: Array) -> None:
    """out = a b; out must not be one of them."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            value = 0.0
            for k in range(a.shape[1]):
                value += a[i, k] * b[k, j]
            out[i, j] = value


@compiled("void(float64[:,::1], float64[::1], float64[::1])")
def transform(a: Array, x: Array, out: Array) -> None:
    """out = a x; out must not be x."""
    for i in range(a.shape[0]):
        value = 0.0
        for j in range(a.shape[1]):
            value += a[i, j] * x[j]
        out[i] = value


@compiled("void(float64[:,::1], float64[::1], float64[::1])")
def transform_transposed(a: Array, x: Array, out: Array) -> None:
    """out = a^T x; out must not be x."""
    out[:] = 0.0
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[j] += a[i, j] * x[i]


@compiled("float64(float64[::1], float64[::1])")
def inner(a: Array, b: Array) -> float:
    """a^T b."""
    value = 0.0
    for i in range(a.shape[0]):
        value += a[i] * b[i]
    return value


@compiled("int64(float64[:,::1], float64[:,::1])")
def cholesky(a: Array, factor: Array) -> int:
    """Lower factor of a symmetric positive definite matrix, of which the lower half is read.

    Returns 0 where a pivot is not positive, not finite, or lost to rounding (below 1e-14 of its diagonal entry).
    """
    n = a.shape[0]
    for j in range(n):
        pivot = a[j, j]
        for k in range(j):
            pivot -= factor[j, k] * factor[j, k]
        if not (pivot > 1e-14 * a[j, j] and pivot < np.inf):
            return 0
        root = np.sqrt(pivot)
        factor[j, j] = root
        for i in range(j + 1, n):
            value = a[i, j]
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            factor[i, j] = value / root
            factor[j, i] = 0.0
    return 1


@compiled("void(float64[:,::1], float64[::1])")
def substitute(factor: Array, x: Array) -> None:
    """Replace x by (L L^T)^-1 x."""
    n = factor.shape[0]
    for i in range(n):
        value = x[i]
        for k in range(i):
            value -= factor[i, k] * x[k]
        x[i] = value / factor[i, i]
    for i in range(n - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, n):
            value -= factor[k, i] * x[k]
        x[i] = value / factor[i, i]


@compiled("void(float64[:,::1], float64[:,::1])")
def substitute_columns(factor: Array, x: Array) -> None:
    """Replace each column of x (n, k) by (L L^T)^-1 of it."""
    n = factor.shape[0]
    for c in range(x.shape[1]):
        for i in range(n):
            value = x[i, c]
            for k in range(i):
                value -= factor[i, k] * x[k, c]
            x[i, c] = value / factor[i, i]
        for i in range(n - 1, -1, -1):
            value = x[i, c]
            for k in range(i + 1, n):
                value -= factor[k, i] * x[k, c]
            x[i, c] = value / factor[i, i]


@compiled("void(float64[:,::1], float64[:,::1])")
def eigen(a: Array, vectors: Array) -> None:
    """Diagonalise a symmetric matrix in place by Jacobi rotations: a becomes diagonal, vectors' columns its own."""
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        off, size = 0.0, 0.0
        for i in range(n):
            size += a[i, i] * a[i, i]
            for j in range(i):
                off += a[i, j] * a[i, j]
        if not off > 1e-32 * size:
            return
        for p in range(n - 1):
            for q in range(p + 1, n):
                if not abs(a[p, q]) > 1e-17 * (abs(a[p, p]) + abs(a[q, q])):
                    continue
                theta = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(n):
                    x, y = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * x - s * y, s * x + c * y
                for k in range(n):
                    x, y = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * x - s * y, s * x + c * y
                for k in range(n):
                    x, y = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * x - s * y, s * x + c * y
