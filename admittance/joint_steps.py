"""One step of the target admittance in joint coordinates, M dv/dt + D v = J^T F with diagonal M and D, and its books.

The storage is 1/2 v^T M v. Each step it grows by exactly

    hand - dissipated + numerical + limited

hand : T (J^T F)^T v+, the work of the wrench, held over the step. dissipated : T v+^T D v+. numerical :
-1/2 |v+ - v|_M^2. limited : v+^T (M + T D) (v+ - v_ref), what limits or another's decision did; see `energy`.
"""

from enum import IntEnum

import numpy as np

from admittance.energy import kinetic_energy, raise_excess
from admittance.outcome import Limited
from primitives.checks import Array
from primitives.compiled import compiled


class JointBook(IntEnum):
    """Places in the ledger, J; the excess is the largest growth of storage - hand over any interval so far."""

    STORAGE = 0
    HAND = 1
    DISSIPATED = 2
    NUMERICAL = 3
    LIMITED = 4
    EXCESS = 5
    LOWEST = 6


@compiled(
    "void(float64[:,::1], int64[::1], float64[::1], float64[::1], float64[::1], float64, float64[::1],"
    "float64[::1], float64[::1])"
)
def propose(
    jacobian: Array,
    decided: np.ndarray,
    wrench: Array,
    M: Array,
    D: Array,
    period: float,
    v: Array,
    torque: Array,
    v_ref: Array,
) -> None:
    """Fill torque = J^T F and v_ref = (M + T D)^-1 (M v + T torque), all (d,), for a jacobian (6, n) and F (6,)."""
    for j in range(decided.shape[0]):
        torque[j] = 0.0
        for r in range(6):
            torque[j] += jacobian[r, decided[j]] * wrench[r]
        v_ref[j] = (M[j] * v[j] + period * torque[j]) / (M[j] + period * D[j])


@compiled("int64(float64[::1], float64[:,::1], float64[:,::1])")
def limit(v: Array, low: Array, high: Array) -> int:
    """Change v (d,) so that it keeps the bounds of `limits.fill_limits`; returns bits of `Limited`.

    First the projection onto the position limits, which in a diagonal metric is each joint's own, then scaling as a
    whole to the velocity limits. Both leave standing still allowed, so neither puts energy in.
    """
    done, share = 0, 1.0
    for j in range(v.shape[0]):
        cut = min(max(v[j], low[0, j]), high[0, j])
        if cut != v[j]:
            done |= Limited.POSITION
        v[j] = cut
        if cut > high[1, j]:
            share = min(share, high[1, j] / cut)
        elif cut < low[1, j]:
            share = min(share, low[1, j] / cut)
    if share < 1.0:
        done |= Limited.VELOCITY
        for j in range(v.shape[0]):
            v[j] *= share
    return done


@compiled(
    "void(float64[::1], float64[::1], float64, float64[::1], float64[::1], float64[::1], float64[::1], float64[::1])"
)
def enter(M: Array, D: Array, period: float, torque: Array, v: Array, v_ref: Array, new: Array, book: Array) -> None:
    """Enter the step from v by v_ref to new, all (d,), in the ledger."""
    for j in range(v.shape[0]):
        change = new[j] - v[j]
        book[JointBook.HAND] += period * torque[j] * new[j]
        book[JointBook.DISSIPATED] += period * D[j] * new[j] * new[j]
        book[JointBook.NUMERICAL] -= 0.5 * M[j] * change * change
        book[JointBook.LIMITED] += new[j] * (M[j] + period * D[j]) * (new[j] - v_ref[j])
    book[JointBook.STORAGE] = kinetic_energy(M, new)
    raise_excess(book, JointBook.EXCESS, JointBook.LOWEST, book[JointBook.STORAGE] - book[JointBook.HAND])
