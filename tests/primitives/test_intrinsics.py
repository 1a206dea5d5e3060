"""Blocks and arrays by address: the same numbers, without a copy and without a count of references."""

import gc
import tracemalloc

import numpy as np
import pytest

from primitives.checks import Array
from primitives.compiled import JIT_DISABLED, compiled
from primitives.intrinsics import block, floats_at, integers_at, scratch
from primitives.memory import Memory, addresses, matrix, vector


@compiled("float64(float64[::1], int64, int64, int64)")
def weighted(memory: Array, start: int, rows: int, columns: int) -> float:
    """Sum of every entry of a block times (10 i + j), and the block doubled in place."""
    cut, total = block(memory, start, (rows, columns)), 0.0
    for i in range(rows):
        for j in range(columns):
            total += cut[i, j] * (10 * i + j)
            cut[i, j] *= 2.0
    return total


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (3, 2), (0, 4)])
@pytest.mark.parametrize("start", [0, 1, 5])
def test_a_block_is_a_view(shape: tuple[int, int], start: int) -> None:
    memory = np.arange(20.0)
    twin = memory.copy()
    view = twin[start : start + shape[0] * shape[1]].reshape(shape)
    expected = float(sum(view[i, j] * (10 * i + j) for i in range(shape[0]) for j in range(shape[1])))
    view *= 2.0
    assert weighted(memory, start, *shape) == expected
    np.testing.assert_array_equal(memory, twin)


@compiled("float64(int64[:,::1])")
def first_of_each(where: np.ndarray) -> float:
    """Adds one to the first float and the first integer, and gives the sum of all of the ring."""
    f = floats_at(where[0, 0], (where[0, 1],))
    w = integers_at(where[2, 0], (where[2, 1],))
    ring = floats_at(where[4, 0], (where[4, 1], where[4, 2]))
    f[0] += 1.0
    w[0] += 1
    total = 0.0
    for i in range(ring.shape[0]):
        for j in range(ring.shape[1]):
            total += ring[i, j]
    return total


def test_addresses_stand_for_the_arrays() -> None:
    memory, ring = Memory({0: (3,), 1: (2, 2)}, {0: (2,)}), np.arange(6.0).reshape(2, 3)
    memory.real[0][:], memory.whole[0][:] = 7.0, 4
    assert first_of_each(addresses(memory, ring)) == 15.0
    assert memory.real[0].tolist() == [8.0, 7.0, 7.0] and memory.whole[0].tolist() == [5, 4]


@compiled("float64(float64[::1], int64)")
def alternating(values: Array, turns: int) -> float:
    """Two scratch arrays in a loop do not overlap, nor with what they were filled from."""
    total = 0.0
    for k in range(turns):
        a, b = scratch(3), scratch(3)
        for i in range(3):
            a[i] = values[i] + k
            b[i] = -a[i]
        for i in range(3):
            total += a[i] * b[i]
    return total


def test_scratch_is_local() -> None:
    values = np.array([1.0, 2.0, 3.0])
    expected = -float(sum((v + k) ** 2 for k in range(4) for v in values))
    assert alternating(values, 4) == expected


@pytest.mark.skipif(JIT_DISABLED, reason="Python's own views are objects; only compiled code has none")
def test_blocks_leave_nothing_behind() -> None:
    """Views without a count are no objects: a hundred thousand of them hold nothing, and their memory stays whole."""
    memory = Memory({0: (3,), 1: (2, 2)}, {0: (2,)})
    for _ in range(1000):
        vector(memory.floats, memory.float_layout, 0)
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(100_000):
            vector(memory.floats, memory.float_layout, 0)
            matrix(memory.floats, memory.float_layout, 1)
        gc.collect()
        assert tracemalloc.get_traced_memory()[0] - before < 1000
    finally:
        tracemalloc.stop()
    memory.real[1][:] = 3.0
    assert matrix(memory.floats, memory.float_layout, 1).tolist() == [[3.0, 3.0], [3.0, 3.0]]
