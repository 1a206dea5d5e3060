"""ProxQP, a proximal augmented Lagrangian method, by ProxSuite's own interface.

qpsolvers does not pass on `eps_primal_inf`, at whose default ProxQP calls one feasible program in three infeasible,
nor does it keep the object that a warm start needs.
"""

from typing import Any

import numpy as np
from proxsuite import proxqp

from primitives.checks import Array
from vfi.backends import Solver
from vfi.backends.rows import scaled_rows
from vfi.qp import QP, SolverStatus

# Without a bound on the duality gap the answer keeps the rows and misses the optimum.
SETTINGS = {
    "eps_abs": 1e-9,
    "eps_rel": 0.0,
    "check_duality_gap": True,
    "eps_duality_gap_abs": 1e-8,
    "eps_duality_gap_rel": 0.0,
    "eps_primal_inf": 1e-14,
    "eps_dual_inf": 1e-14,
    "max_iter": 500,
}
UNBOUNDED = 1e20
"""What ProxQP takes for no upper bound of a row."""


class ProxQP:
    """ProxQP bound to a controller's program; warm-started as long as the number of rows in force stays the same.

    Parameters
    ----------
    qp : views of the program.
    """

    def __init__(self, qp: QP):
        self.qp = qp
        self._rows = -1
        self._solver: Any = None

    def _fresh(self, n: int, rows: int) -> Any:
        solver = proxqp.dense.QP(n, 0, rows, True)
        for name, value in SETTINGS.items():
            setattr(solver.settings, name, value)
        solver.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
        return solver

    def solve(self, v: Array, multiplier: Array) -> SolverStatus:
        """Solve the program as it stands; see `vfi.backends.Backend`."""
        qp, (rows, scale, A, b) = self.qp, scaled_rows(self.qp)
        data = {
            "H": qp.H,
            "g": qp.g,
            "C": A,
            "l": b,
            "u": np.full(len(b), UNBOUNDED),
            "l_box": qp.low,
            "u_box": qp.high,
        }
        if len(rows) == self._rows:
            self._solver.update(**data)
        else:
            self._rows, self._solver = len(rows), self._fresh(len(v), len(rows))
            self._solver.init(A=None, b=None, **data)
        self._solver.solve()
        results, status = self._solver.results, self._solver.results.info.status
        if status != proxqp.QPSolverOutput.PROXQP_SOLVED:
            self._rows = -1
            infeasible = status == proxqp.QPSolverOutput.PROXQP_PRIMAL_INFEASIBLE
            return SolverStatus.INFEASIBLE if infeasible else SolverStatus.NOT_CONVERGED
        v[:] = results.x
        m, n, z = len(qp.b), len(v), np.asarray(results.z)
        multiplier[:] = 0.0
        multiplier[rows] = np.maximum(-z[: len(rows)], 0.0) * scale
        multiplier[m : m + n] = np.maximum(-z[len(rows) :], 0.0)
        multiplier[m + n :] = np.maximum(z[len(rows) :], 0.0)
        return SolverStatus.OPTIMAL


SOLVER = Solver("proxqp", "proximal augmented Lagrangian (ProxSuite)", ProxQP)
