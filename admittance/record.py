"""The record of a cycle: one row of floats with named columns, written by the compiled cycle into a ring.

Time, wrench, velocities and damping are those of the cycle; configuration, port error, repulsion, clearance, handle,
condition and energies are those it led to. So (q of this record - q of the one before) / T = qdot.
"""

import numpy as np

from admittance.memory import Real, Whole
from admittance.outcome import Book, Slot, Touch
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, Memory, integers, put, vector

HEADS = 2
"""Columns that every record begins with: t, and cycle_us, which the controller writes."""

_BLOCKS = (
    ("q", Real.Q),
    ("qdot", Real.QDOT),
    ("v", Real.V),
    ("x_c", Real.X_C),
    ("wrench", Real.WRENCH),
    ("repulsion", Real.F_R),
    ("free_repulsion", Real.F_RX),
    ("distance", Real.DISTANCE),
    ("margin", Real.MARGIN),
    ("damping", Real.D),
    ("handle", Real.HANDLE),
    ("singular", Real.SINGULAR),
)


def columns(memory: Memory) -> dict[str, slice]:
    """Where each quantity stands in a record.

    "t" and "cycle_us"; the outcome's slots, clearance (m) and the ledger's entries (J) in lower case; q (n,),
    qdot (d,), v (m,), x_c (2,), wrench (6,) as measured, repulsion (6,) [force; torque] at the shaft frame's origin
    (37) by the regions, free_repulsion (m,) Z_x F_r and what the constraints add, distance and margin (c,) of each
    constraint in m or rad, damping (m,), handle (12,) rotation row by row and position, singular (4,) smallest and
    largest singular value of J_t, their ratio, and the bound of its rate (-inf far from the limit).
    """
    names = ["t", "cycle_us", *(s.name.lower() for s in Slot), Touch.CLEARANCE.name.lower()]
    names += [b.name.lower() if b != Book.LIMITED else "limited_work" for b in Book]
    out = {name: slice(i, i + 1) for i, name in enumerate(names)}
    at = len(names)
    for name, block in _BLOCKS:
        size = memory.real[block].size
        out[name] = slice(at, at + size)
        at += size
    return out


def width(memory: Memory) -> int:
    """Number of columns of a record."""
    return max(int(s.stop) for s in columns(memory).values())


@compiled(f"void({MEMORY}, float64, float64[:,::1], int64)")
def write_record(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, t: float, ring: Array, row: int) -> None:
    """Write the record of this cycle to ring[row], in the order of `columns`."""
    ring[row, 0] = t
    ring[row, 1] = 0.0
    outcome, at = integers(w, wl, Whole.OUTCOME), HEADS
    for i in range(outcome.shape[0]):
        ring[row, at + i] = outcome[i]
    at += outcome.shape[0]
    ring[row, at] = vector(f, fl, Real.TOUCH)[Touch.CLEARANCE]
    at = put(vector(f, fl, Real.LEDGER), ring, row, at + 1)
    at = put(vector(f, fl, Real.Q), ring, row, at)
    at = put(vector(f, fl, Real.QDOT), ring, row, at)
    at = put(vector(f, fl, Real.V), ring, row, at)
    at = put(vector(f, fl, Real.X_C), ring, row, at)
    at = put(vector(f, fl, Real.WRENCH), ring, row, at)
    at = put(vector(f, fl, Real.F_R), ring, row, at)
    at = put(vector(f, fl, Real.F_RX), ring, row, at)
    at = put(vector(f, fl, Real.DISTANCE), ring, row, at)
    at = put(vector(f, fl, Real.MARGIN), ring, row, at)
    at = put(vector(f, fl, Real.D), ring, row, at)
    at = put(vector(f, fl, Real.HANDLE), ring, row, at)
    put(vector(f, fl, Real.SINGULAR), ring, row, at)
