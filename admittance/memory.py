"""The memory of a cycle: one array of floats and one of integers, cut into named blocks, and the regions' points.

Compiled code asks for a block by name (`vector`, `matrix`, `cube`, `integers`), Python by `Memory.real` and
`Memory.whole`, which are views of the same numbers. The clouds are arrays of their own, so that they can be replaced.
"""

from collections.abc import Mapping
from enum import IntEnum, auto
from typing import Any

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled

MEMORY = "float64[::1], int64[:,::1], int64[::1], int64[:,::1]"
"""The memory in the signature of a compiled function: floats, their layout, integers, their layout."""
CLOUDS = "float64[:,::1], int64[::1], int64[::1], int64[::1], float64[::1], float64[::1], float64[:,::1]"
"""The regions' points likewise: points, order, start of all regions one after the other, and what a query fills:
index, place, distance, and for each point within sight its row of [d clearance / d v (4), clearance]."""


class _FromZero(IntEnum):
    @staticmethod
    def _generate_next_value_(name: str, start: int, count: int, last_values: list[Any]) -> int:
        return count


class Real(_FromZero):
    """Blocks of floats: n joints, d of them decided, m = d - 2 free coordinates, R regions; three frames."""

    PLACEMENT = auto()
    FRAME_PLACEMENT = auto()
    PORT = auto()
    SENSOR = auto()
    WEIGHT = auto()
    INERTIA = auto()
    DAMPING = auto()
    REDUNDANT = auto()
    LIMITS = auto()
    SETTINGS = auto()
    REGION = auto()
    REGION_POSE = auto()
    Q = auto()
    Q_TRIAL = auto()
    Q_LAST = auto()
    V = auto()
    V_REF = auto()
    V_NEXT = auto()
    COMMANDED = auto()
    QDOT = auto()
    RATE = auto()
    OFFSET = auto()
    WRENCH = auto()
    F_TH = auto()
    F_HAND = auto()
    F_R = auto()
    F_RX = auto()
    D = auto()
    STIFFNESS = auto()
    TOUCH = auto()
    SEGMENT = auto()
    AXIS = auto()
    FOUND = auto()
    LOCAL = auto()
    JOINT_POSE = auto()
    POSE = auto()
    JACOBIAN = auto()
    HANDLE = auto()
    HANDLE_LAST = auto()
    J = auto()
    GRAM = auto()
    FACTOR = auto()
    SCRATCH = auto()
    P = auto()
    X_C = auto()
    A_X = auto()
    A = auto()
    A_PLUS = auto()
    Z_X = auto()
    G = auto()
    G_LAST = auto()
    Z = auto()
    Z_PLUS_T = auto()
    Z_WORK = auto()
    Z_FACTOR = auto()
    A_LAST = auto()
    Z_PLUS_T_LAST = auto()
    SINGULAR = auto()
    SINGULAR_ROW = auto()
    METRIC = auto()
    METRIC_FACTOR = auto()
    LOW = auto()
    HIGH = auto()
    ROW = auto()
    PUSH = auto()
    DUAL = auto()
    TWIST = auto()
    J_RATE = auto()
    P_RATE = auto()
    Z_RATE = auto()
    A_X_RATE = auto()
    ACCELERATION = auto()
    DIRECTION = auto()
    EIGEN = auto()
    FREE = auto()
    FREE_RATE = auto()
    PORT_RATE = auto()
    STAGE = auto()
    LEDGER = auto()
    LEDGER_LAST = auto()
    PROGRESS = auto()


class Whole(_FromZero):
    """Blocks of integers."""

    PARENT = auto()
    PRISMATIC = auto()
    FRAME_JOINT = auto()
    DECIDED = auto()
    REGION = auto()
    OPTIONS = auto()
    OUTCOME = auto()


class Memory:
    """Zeroed blocks of given shapes.

    Parameters
    ----------
    real, whole : shape of every block; a dimension may be zero.

    Attributes
    ----------
    arguments : floats, their layout, integers, their layout: what compiled functions take.
    real, whole : views by block.
    """

    def __init__(self, real: Mapping[Real, tuple[int, ...]], whole: Mapping[Whole, tuple[int, ...]]):
        float_layout, size = _layout([real[block] for block in Real])
        floats: Array = np.zeros(size)
        integer_layout, size = _layout([whole[block] for block in Whole])
        numbers = np.zeros(size, dtype=np.int64)
        self.arguments = floats, float_layout, numbers, integer_layout
        self.real: dict[Real, Array] = {block: _view(floats, float_layout[block], real[block]) for block in Real}
        self.whole = {block: _view(numbers, integer_layout[block], whole[block]) for block in Whole}


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
