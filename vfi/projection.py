"""The passive projection: a free velocity is moved onto inequalities in the metric of its own inertia and damping.

    v+ = argmin 1/2 (v - v_ref)^T X (v - v_ref)   subject to   a_i^T v >= b_i   and   low <= B v + offset <= high

With the reference of a target admittance, v_ref = (M + T D)^-1 (M v + T f) and X = M + T D, a step obeys

    1/2 v+^T M v+ - 1/2 v^T M v = T f^T v+  -  T v+^T D v+  -  1/2 |v+ - v|_M^2  +  sum lambda_i b_i

whatever the signs: stationarity, X (v+ - v_ref) = sum lambda_i a_i, times v+, and lambda_i (a_i^T v+ - b_i) = 0. So it
takes energy out wherever every b_i <= 0, that is, wherever standing still is allowed; a moving or violated constraint,
whose b_i is positive, does the work sum lambda_i b_i. A projection in another metric has no such identity.
"""

from typing import NamedTuple

import numpy as np

from primitives.active_set import NOT_SOLVED, OPTIMAL, solve, work_rows
from primitives.checks import Array
from primitives.compiled import compiled
from vfi.qp import SolverStatus


@compiled(
    "int64(float64[:,::1], float64[::1], float64[:,::1], float64[::1], float64[:,::1], float64[::1], float64[::1],"
    "float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], float64[::1], int64[::1],"
    "int64[::1], float64[::1], float64[:,::1])"
)
def project(
    metric: Array,
    v_ref: Array,
    rows: Array,
    demand: Array,
    basis: Array,
    offset: Array,
    low: Array,
    high: Array,
    A: Array,
    b: Array,
    g: Array,
    unbounded: Array,
    v: Array,
    multiplier: Array,
    active: np.ndarray,
    mask: np.ndarray,
    scale: Array,
    work: Array,
) -> int:
    """Fill v (m,) and the multipliers of rows (k,), lower and upper bounds (d,) of the joints; returns the status.

    Rows and bounds become A (k + 2 d, m) and b; what follows b is scratch of `primitives.active_set.solve`, of
    its sizes for these rows, and unbounded (2, m flattened) holds -inf and inf.
    """
    m, k, d = v_ref.shape[0], rows.shape[0], basis.shape[0]
    for i in range(k):
        b[i] = demand[i]
        for j in range(m):
            A[i, j] = rows[i, j]
    for i in range(d):
        b[k + i] = low[i] - offset[i]
        b[k + d + i] = offset[i] - high[i]
        for j in range(m):
            A[k + i, j] = basis[i, j]
            A[k + d + i, j] = -basis[i, j]
    for i in range(m):
        g[i] = 0.0
        for j in range(m):
            g[i] -= metric[i, j] * v_ref[j]
    active[0] = 0
    return int(solve(metric, g, A, b, unbounded[:m], unbounded[m:], v, multiplier, active, mask, scale, work))


class Projected(NamedTuple):
    """What a projection gives, for k rows and d joints.

    Attributes
    ----------
    v : (m,) v+; zero where the status is not OPTIMAL.
    multipliers : (k,) of the rows. joints : (2, d) of the joints' lower and upper bounds. All >= 0.
    constraint_work : sum of lambda_i b_i, joules of one step when the metric is M + T D in SI units.
    status : of the solver.
    """

    v: Array
    multipliers: Array
    joints: Array
    constraint_work: float
    status: SolverStatus


class Projection:
    """The projection with its memory, for m free coordinates and d joints; it grows with the rows it is given.

    Parameters
    ----------
    coordinates, joints : m and d.
    """

    def __init__(self, coordinates: int, joints: int):
        self._m, self._d = coordinates, joints
        self._g, self._v = np.empty(coordinates), np.empty(coordinates)
        self._unbounded = np.concatenate([np.full(coordinates, -np.inf), np.full(coordinates, np.inf)])
        self._active = np.zeros(coordinates + 2, dtype=np.int64)
        self._work = np.empty((work_rows(coordinates), coordinates))
        self._room = -1

    def _grow(self, rows: int) -> None:
        self._room = 2 * rows
        total = self._room + 2 * self._d
        self._A, self._b, self._scale = np.empty((total, self._m)), np.empty(total), np.empty(total)
        self._multiplier = np.empty(total + 2 * self._m)
        self._mask = np.zeros(total + 2 * self._m, dtype=np.int64)

    def solve(
        self,
        v_ref: Array,
        metric: Array,
        rows: Array,
        demand: Array,
        basis: Array,
        offset: Array,
        low: Array,
        high: Array,
    ) -> Projected:
        """Project v_ref (m,); all arrays are contiguous float64.

        Parameters
        ----------
        v_ref, metric : (m,) and X (m, m), positive definite.
        rows, demand : a_i (k, m) and b_i (k,): per second, in the margins' unit.
        basis, offset, low, high : B (d, m) and (d,): joint velocities are B v + offset, rad/s and m/s.
        """
        k = len(rows)
        if k > self._room:
            self._grow(k)
        total = k + 2 * self._d
        multiplier = self._multiplier[: total + 2 * self._m]
        status = SolverStatus(NOT_SOLVED)
        if np.isfinite(v_ref).all() and np.isfinite(metric).all():
            status = SolverStatus(
                project(
                    metric,
                    v_ref,
                    rows,
                    demand,
                    basis,
                    offset,
                    low,
                    high,
                    self._A[:total],
                    self._b[:total],
                    self._g,
                    self._unbounded,
                    self._v,
                    multiplier,
                    self._active,
                    self._mask[: total + 2 * self._m],
                    self._scale[:total],
                    self._work,
                )
            )
        if status != OPTIMAL or not np.isfinite(self._v).all():
            failed = status if status != OPTIMAL else SolverStatus(NOT_SOLVED)
            return Projected(np.zeros(self._m), np.zeros(k), np.zeros((2, self._d)), 0.0, failed)
        used = multiplier[:total] > 0.0
        done = float(multiplier[:total][used] @ self._b[:total][used])
        joints = multiplier[k:total].reshape(2, self._d).copy()
        return Projected(self._v.copy(), multiplier[:k].copy(), joints, done, status)
