"""The quadratic program of a cycle, what solvers are given and what they answer.

minimise    1/2 v^T H v + g^T v
subject to  A v >= b,   low <= v <= high
"""

from typing import NamedTuple

from primitives.active_set import SolverStatus as SolverStatus
from primitives.checks import Array


class QP(NamedTuple):
    """Views of the cycle's own memory; their contents change each cycle.

    Attributes
    ----------
    H, g : (n, n) positive definite, (n,).
    A, b : (m, n), (m,): A v >= b; b is -inf for rows that are not in force.
    low, high : (n,) bounds.
    task, error : (k, n) and (k,) of the tracking task, |task v + error| being what the cost squares; for solvers that
        take another norm.
    """

    H: Array
    g: Array
    A: Array
    b: Array
    low: Array
    high: Array
    task: Array
    error: Array
