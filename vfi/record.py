"""The record of a cycle: one row of floats with named columns, written by the compiled cycle into a ring."""

from enum import IntEnum

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, Memory, integer_matrix, integers, put, vector
from vfi.memory import Real, Whole
from vfi.outcome import Option, Slot


class Head(IntEnum):
    """Columns that every record begins with; `cycle_us` is written by the controller."""

    T = 0
    CYCLE_US = 1


HEADS = len(Head)

_BLOCKS = (
    ("q", Real.Q),
    ("qdot", Real.V),
    ("reference", Real.REFERENCE),
    ("pose", Real.TIP),
    ("error", Real.ERROR),
    ("shortfall", Real.SHORTFALL),
    ("distance", Real.DISTANCE),
    ("margin", Real.MARGIN),
    ("slack", Real.NOTED_SLACK),
    ("multiplier", Real.NOTED_MULTIPLIER),
    ("free", Real.FREE),
    ("work", Real.WORK_DONE),
)


def columns(memory: Memory) -> dict[str, slice]:
    """Where each quantity stands in a record: "t", "cycle_us", the outcome's slots in lower case, and the blocks.

    q (n,), qdot (d,), reference, pose and error (8,) a pose task or (d,), distance and margin (m,), slack (r,),
    multiplier (r + 2d,): rows, lower bounds, upper bounds; of a cloud the largest slack and the sum of multipliers of
    its points. shortfall is by how much the solver's first answer falls short of its rows, at most, in the margins'
    unit per second. free and work are those of a program in a basis; see `vfi.outcome.Work`.
    """
    names = [h.name.lower() for h in Head] + [s.name.lower() for s in Slot]
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


@compiled(f"void({MEMORY})")
def note_multipliers(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Slacks and multipliers as the record holds them: the points of a cloud, and cuts, count for their constraint."""
    multiplier, slack = vector(f, fl, Real.MULTIPLIER), vector(f, fl, Real.SLACK)
    noted, yielded = vector(f, fl, Real.NOTED_MULTIPLIER), vector(f, fl, Real.NOTED_SLACK)
    fixed, rows = yielded.shape[0], slack.shape[0]
    for i in range(fixed):
        noted[i] = multiplier[i]
        yielded[i] = slack[i]
    owner, cloud = integers(w, wl, Whole.OWNER), integer_matrix(w, wl, Whole.CLOUD)
    cut, uncut = integers(w, wl, Whole.CUT), rows - integers(w, wl, Whole.OPTIONS)[Option.CUTS]
    for i in range(fixed, uncut):
        place = cloud[owner[i - fixed], 0]
        noted[place] += multiplier[i]
        yielded[place] = max(yielded[place], slack[i])
    for i in range(uncut, rows):
        noted[cut[i - uncut]] += multiplier[i]
    for i in range(fixed, noted.shape[0]):
        noted[i] = multiplier[rows + i - fixed]


@compiled(f"void({MEMORY}, float64, float64[:,::1], int64)")
def write_record(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, t: float, ring: Array, row: int) -> None:
    """Write the record of this cycle to ring[row], in the order of `columns`."""
    ring[row, Head.T] = t
    ring[row, Head.CYCLE_US] = 0.0
    outcome, at = integers(w, wl, Whole.OUTCOME), HEADS
    for i in range(outcome.shape[0]):
        ring[row, at + i] = outcome[i]
    at += outcome.shape[0]
    at = put(vector(f, fl, Real.Q), ring, row, at)
    at = put(vector(f, fl, Real.V), ring, row, at)
    at = put(vector(f, fl, Real.REFERENCE), ring, row, at)
    at = put(vector(f, fl, Real.TIP), ring, row, at)
    at = put(vector(f, fl, Real.ERROR), ring, row, at)
    at = put(vector(f, fl, Real.SHORTFALL), ring, row, at)
    at = put(vector(f, fl, Real.DISTANCE), ring, row, at)
    at = put(vector(f, fl, Real.MARGIN), ring, row, at)
    at = put(vector(f, fl, Real.NOTED_SLACK), ring, row, at)
    at = put(vector(f, fl, Real.NOTED_MULTIPLIER), ring, row, at)
    at = put(vector(f, fl, Real.FREE), ring, row, at)
    put(vector(f, fl, Real.WORK_DONE), ring, row, at)
