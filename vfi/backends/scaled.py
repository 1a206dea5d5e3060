"""Solvers of qpsolvers, bound to a controller's program.

Their budget is a number of iterations, not of seconds, so that a run repeats to the bit.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import qpsolvers
from scipy.sparse import csc_matrix

from primitives.checks import Array
from primitives.errors import SolverError
from vfi.backends import Backend, Solver
from vfi.backends.rows import scaled_rows
from vfi.qp import QP, SolverStatus


class ScaledQP:
    """A solver of qpsolvers; the rows are scaled to unit length, and what is not in force is left out.

    Parameters
    ----------
    qp : views of the program.
    solver : name that qpsolvers knows it by.
    options : what the solver is called with: tolerances, limit of iterations.
    warm : start from the last answer.
    sparse : hand the matrices over in compressed columns.

    Raises
    ------
    SolverError : the solver is not installed.
    """

    def __init__(self, qp: QP, solver: str, options: Mapping[str, Any], *, warm: bool, sparse: bool):
        if solver not in qpsolvers.available_solvers:
            found = ", ".join(qpsolvers.available_solvers)
            raise SolverError(
                f'solver "{solver}" is not installed; install it with: pip install {solver}. Found: {found}'
            )
        self.qp, self._solver, self._options, self._warm = qp, solver, dict(options), warm
        self._form: Callable[[Array], Any] = csc_matrix if sparse else np.asarray
        self._last: Array | None = None

    def solve(self, v: Array, multiplier: Array) -> SolverStatus:
        """Solve the program as it stands; see `vfi.backends.Backend`."""
        qp, n, m = self.qp, len(v), len(self.qp.b)
        rows, scale, A, b = scaled_rows(qp)
        G, h = (self._form(-A), -b) if len(rows) else (None, None)
        problem = qpsolvers.Problem(self._form(qp.H), qp.g, G, h, lb=qp.low, ub=qp.high)
        initial, self._last = (self._last if self._warm else None), None
        solution = qpsolvers.solve_problem(problem, self._solver, initvals=initial, **self._options)
        if not solution.found or solution.x is None:
            return SolverStatus.NOT_CONVERGED
        v[:] = solution.x
        self._last = v.copy()
        multiplier[:] = 0.0
        if solution.z is not None and len(rows):
            multiplier[rows] = np.maximum(solution.z, 0.0) * scale
        if solution.z_box is not None and len(solution.z_box):
            multiplier[m : m + n] = np.maximum(-solution.z_box, 0.0)
            multiplier[m + n :] = np.maximum(solution.z_box, 0.0)
        return SolverStatus.OPTIMAL


def through_qpsolvers(
    name: str, summary: str, options: Mapping[str, Any], *, warm: bool, sparse: bool = False
) -> Solver:
    """An entry of the table for a solver of qpsolvers."""

    def bind(qp: QP) -> Backend:
        return ScaledQP(qp, name, options, warm=warm, sparse=sparse)

    return Solver(name, summary, bind)
