"""The memory of a cycle: one array of floats and one of integers, cut into named blocks.

Handing thirty arrays to a compiled function costs 50 ns each per call; two arrays and their layouts cost nothing to
speak of. Compiled code asks for a block by name (`vector`, `matrix`, `cube`, `integers`, `integer_matrix`), Python by
`Memory.real` and `Memory.whole`, which are views of the same numbers.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import block

MEMORY = "float64[::1], int64[:,::1], int64[::1], int64[:,::1]"
"""The memory in the signature of a compiled function: floats, their layout, integers, their layout."""


Shape = tuple[int, ...]


class Memory:
    """Zeroed blocks of given shapes.

    Parameters
    ----------
    real, whole : shape of every block by its number, 0, 1, ..; a dimension may be zero.

    Attributes
    ----------
    floats, float_layout, integers, integer_layout : the arrays, and where the blocks lie in them.
    real, whole : views by block.
    """

    def __init__(self, real: Mapping[Any, Shape], whole: Mapping[Any, Shape]):
        self.float_layout, size = _layout(real)
        self.floats: Array = np.zeros(size)
        self.integer_layout, size = _layout(whole)
        self.integers = np.zeros(size, dtype=np.int64)
        self.arguments = self.floats, self.float_layout, self.integers, self.integer_layout
        """What compiled functions take, in the order of MEMORY."""
        self.real: dict[Any, Array] = {
            name: _view(self.floats, self.float_layout[name], shape) for name, shape in real.items()
        }
        self.whole: dict[Any, np.ndarray] = {
            name: _view(self.integers, self.integer_layout[name], shape) for name, shape in whole.items()
        }


def _layout(shapes: Mapping[Any, Shape]) -> tuple[np.ndarray, int]:
    """Rows of offset and three dimensions, and the size of it all."""
    layout, offset = np.ones((len(shapes), 4), dtype=np.int64), 0
    for name, row in enumerate(layout):
        shape = shapes[name]
        row[0], row[1 : 1 + len(shape)] = offset, shape
        offset += int(np.prod(shape))
    return layout, offset


def _view(memory: Any, row: np.ndarray, shape: tuple[int, ...]) -> Any:
    return memory[row[0] : row[0] + int(np.prod(shape))].reshape(shape)


def addresses(memory: Memory, ring: Array) -> np.ndarray:
    """(5, 3) int64: address and shape of each array of a memory, in the order of MEMORY, and of a ring of records.

    An entry point that takes this instead of five arrays is called 0.3 us faster. Keep all of them alive beside it.
    """
    parts = (memory.floats, memory.float_layout, memory.integers, memory.integer_layout, ring)
    return np.array([(part.ctypes.data, *part.shape, 1)[:3] for part in parts], dtype=np.int64)


@compiled("float64[::1](float64[::1], int64[:,::1], int64)")
def vector(memory: Array, layout: np.ndarray, name: int) -> Array:
    """A block of one dimension."""
    view: Array = block(memory, layout[name, 0], (layout[name, 1],))
    return view


@compiled("int64(float64[::1], float64[:,::1], int64, int64)")
def put(block: Array, ring: Array, row: int, at: int) -> int:
    """Copy a block of one dimension into ring[row] from column `at` on; returns the column after it."""
    for i in range(block.shape[0]):
        ring[row, at + i] = block[i]
    return at + len(block)


@compiled("float64[:,::1](float64[::1], int64[:,::1], int64)")
def matrix(memory: Array, layout: np.ndarray, name: int) -> Array:
    """A block of two dimensions."""
    view: Array = block(memory, layout[name, 0], (layout[name, 1], layout[name, 2]))
    return view


@compiled("float64[:,:,::1](float64[::1], int64[:,::1], int64)")
def cube(memory: Array, layout: np.ndarray, name: int) -> Array:
    """A block of three dimensions."""
    view: Array = block(memory, layout[name, 0], (layout[name, 1], layout[name, 2], layout[name, 3]))
    return view


@compiled("int64[::1](int64[::1], int64[:,::1], int64)")
def integers(memory: np.ndarray, layout: np.ndarray, name: int) -> np.ndarray:
    """A block of integers of one dimension."""
    view: np.ndarray = block(memory, layout[name, 0], (layout[name, 1],))
    return view


@compiled("int64[:,::1](int64[::1], int64[:,::1], int64)")
def integer_matrix(memory: np.ndarray, layout: np.ndarray, name: int) -> np.ndarray:
    """A block of integers of two dimensions."""
    view: np.ndarray = block(memory, layout[name, 0], (layout[name, 1], layout[name, 2]))
    return view
