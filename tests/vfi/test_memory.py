"""The memory of a cycle: blocks that lie side by side, the same numbers for Python and for compiled code."""

import numpy as np
import pytest

from primitives.constraint import ConstraintSet
from primitives.memory import Memory, cube, integer_matrix, integers, matrix, vector
from tests.vfi.arms import pair, paper_constraints
from vfi.controller import Controller
from vfi.memory import Real, Whole
from vfi.record import columns, width
from vfi.tasks import PoseTask, VelocityTask


def memory(sizes: int) -> Memory:
    real = {block: ((0,), (3,), (2, 4), (2, 3, 2))[(int(block) + sizes) % 4] for block in Real}
    whole = {block: ((0,), (5,), (3, 2))[(int(block) + sizes) % 3] for block in Whole}
    return Memory(real, whole)


@pytest.mark.parametrize("sizes", range(12))
def test_blocks_partition_the_memory(sizes):
    """Each number belongs to exactly one block: writing to one leaves all others alone."""
    m = memory(sizes)
    for views, flat in ((m.real, m.floats), (m.whole, m.integers)):
        assert sum(view.size for view in views.values()) == flat.size
        for k, view in enumerate(views.values(), 1):
            view[...] = k
        for k, view in enumerate(views.values(), 1):
            assert np.all(view == k)


@pytest.mark.parametrize("sizes", range(12))
def test_compiled_code_sees_the_same_blocks(sizes):
    m = memory(sizes)
    m.floats[:], m.integers[:] = np.arange(m.floats.size), np.arange(m.integers.size)
    for block, view in m.real.items():
        see = {1: vector, 2: matrix, 3: cube}[view.ndim]
        seen = see(m.floats, m.float_layout, int(block))
        assert seen.shape == view.shape and np.array_equal(seen, view)
        if view.size:
            seen.flat[0] = -1.0
            assert view.flat[0] == -1.0, "a view, not a copy"
    for block, view in m.whole.items():
        see = {1: integers, 2: integer_matrix}[view.ndim]
        seen = see(m.integers, m.integer_layout, int(block))
        assert seen.shape == view.shape and np.array_equal(seen, view)


def test_every_block_of_a_controller_is_there_and_numbered_without_gaps():
    for kind in (Real, Whole):
        assert sorted(kind) == list(range(len(kind)))


@pytest.mark.parametrize("user_rows", [0, 3])
@pytest.mark.parametrize("task", [PoseTask(), VelocityTask()])
def test_columns_of_a_record_lie_side_by_side(task, user_rows):
    c = Controller(pair(), paper_constraints(), task, period=1e-3, group="moving", user_rows=user_rows, ring=3)
    used = np.zeros(width(c._memory), dtype=int)
    for where in columns(c._memory).values():
        used[where] += 1
    assert np.all(used == 1) and c.ring.shape == (3, len(used))
    sizes = {name: where.stop - where.start for name, where in c.columns.items()}
    assert sizes["q"] == 16 and sizes["qdot"] == 8 and sizes["margin"] == sizes["distance"] == 4
    assert sizes["slack"] == 4 + user_rows and sizes["multiplier"] == 4 + user_rows + 16
    assert sizes["t"] == sizes["state"] == sizes["resolves"] == 1


def test_no_constraints_and_one():
    for constraints in (ConstraintSet(), paper_constraints("").enforcing(["C4"])):
        c = Controller(pair(), constraints, VelocityTask(), period=1e-3)
        assert c._memory.real[Real.MARGIN].shape == (len(constraints),)
