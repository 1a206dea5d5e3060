"""Other solvers for the program of a cycle; one file each, found by `solvers`.

Nothing a back end answers is trusted: the controller verifies it like the answer of its own kernel.
"""

import sys
from collections.abc import Callable
from typing import NamedTuple, Protocol

from primitives.checks import Array
from primitives.errors import InputError
from primitives.plugins import Registry
from vfi.qp import QP, SolverStatus


class Backend(Protocol):
    """A solver bound to the memory of one controller."""

    def solve(self, v: Array, multiplier: Array) -> SolverStatus:
        """Solve the program as it stands now.

        Parameters
        ----------
        v : (n,) where the answer goes.
        multiplier : (m + 2n,) where the multipliers of rows, lower and upper bounds go; zeros where unknown.
        """


class Solver(NamedTuple):
    """An entry of the table of solvers.

    Attributes
    ----------
    name : e.g. "lp".
    summary : one line.
    bind : from the views of a controller's program to a `Backend`; None for the compiled kernel itself.
    tracks_pose_only : True where the program makes sense for pose tasks alone.
    """

    name: str
    summary: str
    bind: Callable[[QP], Backend] | None
    tracks_pose_only: bool = False


def _check(solver: Solver) -> None:
    if solver.bind is not None and not callable(solver.bind):
        raise InputError(f'solver "{solver.name}": bind must be callable')


solvers: Registry[Solver] = Registry("solver", sys.modules[__name__], "SOLVER", _check)
"""Every solver that `Controller` takes by name."""
