"""The memory of a cycle: one array of floats and one of integers, cut into named blocks.

Handing thirty arrays to a compiled function costs 50 ns each per call; two arrays and their layouts cost nothing to
speak of. Compiled code asks for a block by name (`vector`, `matrix`, `cube`, `integers`), Python by `Memory.real` and
`Memory.whole`, which are views of the same numbers.
"""

from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled

MEMORY = "float64[::1], int64[:,::1], int64[::1], int64[:,::1]"
"""The memory in the signature of a compiled function: floats, their layout, integers, their layout."""


class Real(IntEnum):
    """Blocks of floats. n joints, d of them decided, f frames, e entities, m constraints, r = m + user rows."""

    PLACEMENT = 0
    FRAME_PLACEMENT = 1
    GEOMETRY = 2
    SIDE = 3
    SAFE = 4
    SETTINGS = 5
    WEIGHT = 6
    ETA = 7
    TOLERANCE = 8
    LIMITS = 9
    Q = 10
    QDOT = 11
    GIVEN = 12
    REFERENCE = 13
    TWIST = 14
    JOINT_POSE = 15
    POSE = 16
    JACOBIAN = 17
    DISTANCE = 18
    MARGIN = 19
    ROW = 20
    RESIDUAL = 21
    RATE = 22
    DEMAND = 23
    SLACK = 24
    TIP = 25
    ERROR = 26
    TASK = 27
    H = 28
    G = 29
    A = 30
    B = 31
    LOW = 32
    HIGH = 33
    V = 34
    CANDIDATE = 35
    LAST = 36
    MULTIPLIER = 37
    SCALE = 38
    WORK = 39
    Q_NEXT = 40
    JOINT_POSE_NEXT = 41
    POSE_NEXT = 42
    DISTANCE_NEXT = 43
    MARGIN_NEXT = 44
    DEFECT = 45
    RELAXED_H = 46
    RELAXED_G = 47
    RELAXED_A = 48
    RELAXED_B = 49
    RELAXED_LOW = 50
    RELAXED_HIGH = 51
    RELAXED_V = 52
    RELAXED_MULTIPLIER = 53
    RELAXED_WORK = 54
    RELAXED_SCALE = 55
    TARGET = 56
    LAST_DEFECT = 57
    SHORTFALL = 58


class Whole(IntEnum):
    """Blocks of integers."""

    PARENT = 0
    PRISMATIC = 1
    FRAME_JOINT = 2
    ADDRESS = 3
    FRAME = 4
    ENFORCED = 5
    SAFETY_CLASS = 6
    ANGULAR = 7
    STATUS = 8
    STATUS_NEXT = 9
    DECIDED = 10
    ACTIVE = 11
    MASK = 12
    RELAXED_ACTIVE = 13
    RELAXED_MASK = 14
    OPTIONS = 15
    OUTCOME = 16


class Memory:
    """Zeroed blocks of given shapes.

    Parameters
    ----------
    real, whole : shape of every block; a dimension may be zero.

    Attributes
    ----------
    floats, float_layout, integers, integer_layout : what compiled functions take.
    real, whole : views by block.
    """

    def __init__(self, real: Mapping[Real, tuple[int, ...]], whole: Mapping[Whole, tuple[int, ...]]):
        self.float_layout, size = _layout([real[block] for block in Real])
        self.floats: Array = np.zeros(size)
        self.integer_layout, size = _layout([whole[block] for block in Whole])
        self.integers = np.zeros(size, dtype=np.int64)
        self.real: dict[Real, Array] = {
            block: _view(self.floats, self.float_layout[block], real[block]) for block in Real
        }
        self.whole = {block: _view(self.integers, self.integer_layout[block], whole[block]) for block in Whole}


def _layout(shapes: list[tuple[int, ...]]) -> tuple[np.ndarray, int]:
    """Rows of offset and three dimensions, and the size of it all."""
    layout, offset = np.ones((len(shapes), 4), dtype=np.int64), 0
    for row, shape in zip(layout, shapes, strict=True):
        row[0], row[1 : 1 + len(shape)] = offset, shape
        offset += int(np.prod(shape))
    return layout, offset


def _view(memory: Any, row: np.ndarray, shape: tuple[int, ...]) -> Any:
    return memory[row[0] : row[0] + int(np.prod(shape))].reshape(shape)


@compiled("float64[::1](float64[::1], int64[:,::1], int64)")
def vector(memory: Array, layout: np.ndarray, block: int) -> Array:
    """A block of one dimension."""
    return memory[layout[block, 0] : layout[block, 0] + layout[block, 1]]


@compiled("float64[:,::1](float64[::1], int64[:,::1], int64)")
def matrix(memory: Array, layout: np.ndarray, block: int) -> Array:
    """A block of two dimensions."""
    start, rows, columns = layout[block, 0], layout[block, 1], layout[block, 2]
    return memory[start : start + rows * columns].reshape((rows, columns))


@compiled("float64[:,:,::1](float64[::1], int64[:,::1], int64)")
def cube(memory: Array, layout: np.ndarray, block: int) -> Array:
    """A block of three dimensions."""
    start, depth, rows, columns = layout[block, 0], layout[block, 1], layout[block, 2], layout[block, 3]
    return memory[start : start + depth * rows * columns].reshape((depth, rows, columns))


@compiled("int64[::1](int64[::1], int64[:,::1], int64)")
def integers(memory: np.ndarray, layout: np.ndarray, block: int) -> np.ndarray:
    """A block of integers of one dimension."""
    return memory[layout[block, 0] : layout[block, 0] + layout[block, 1]]


@compiled("int64[:,::1](int64[::1], int64[:,::1], int64)")
def integer_matrix(memory: np.ndarray, layout: np.ndarray, block: int) -> np.ndarray:
    """A block of integers of two dimensions."""
    start, rows, columns = layout[block, 0], layout[block, 1], layout[block, 2]
    return memory[start : start + rows * columns].reshape((rows, columns))
