"""The 1-norm linear program of paper V, (8), in its canonical form, by HiGHS.

    minimise    [-1^T J, 1^T J, 2 1^T, 0, 0, 0] g,   g = [v_P, v_N, y, z_A, z_B, z] >= 0,   v = v_P - v_N
    subject to  J v - y + z_A         = -eta x~
                1^T (v_P + v_N) + z_B = beta |x~|_1
                W v + z               = w

W stacks [I; -I] with the bounds (joint limits and velocity limits merged) and -A with -b for every enforced row. For
S5 and eight joints that is 29 rows and 53 variables. Several pose tasks stand one below the other in J and x~. The
second row, |v|_1 <= beta |x~|_1, is the paper's and is kept here only: it contradicts Remark 1, since with x~ = 0
nothing may move that has to be pushed out.
"""

import highspy
import numpy as np

from primitives.checks import Array
from vfi.backends import Solver
from vfi.qp import QP, SolverStatus

BETA_OVER_ETA = 40.0 / 50.0
"""beta = 40 with eta = 50 as in the paper; the target of the program holds eta x~, so their ratio is what counts."""
TOLERANCE = 1e-10
ITERATIONS = 10_000
"""Of the simplex method; a cold start of S5 takes about 30."""


class _SilentHighs(highspy.Highs):
    """HiGHS without its banner, which its constructor prints to stdout before anybody can tell it not to."""

    def enableCallbacks(self) -> None:
        self.setOptionValue("output_flag", False)
        super().enableCallbacks()  # type: ignore[no-untyped-call]


class PaperLP:
    """The program bound to a controller's memory; the basis is kept from solve to solve.

    Parameters
    ----------
    qp : views of the controller's program. Rows that have never had a demand are left out; one that has had one
        stays, as 0 v + z = 0 where it has none.
    """

    def __init__(self, qp: QP):
        self.qp = qp
        self._rows = np.zeros(0, dtype=np.int64)
        self._basis: highspy.HighsBasis | None = None
        self._highs = _SilentHighs()  # type: ignore[no-untyped-call]
        for option, value in (
            ("output_flag", False),
            ("threads", 1),
            ("presolve", "off"),
            ("solver", "simplex"),
            ("simplex_iteration_limit", ITERATIONS),
            ("primal_feasibility_tolerance", TOLERANCE),
            ("dual_feasibility_tolerance", TOLERANCE),
        ):
            self._highs.setOptionValue(option, value)

    def matrices(self) -> tuple[Array, Array, Array]:
        """Dense constraint matrix, right-hand side and cost of the canonical form, as they stand now."""
        J, target, A, b = self.qp.task, self.qp.error, self.qp.A, self.qp.b
        k, n = J.shape
        rows = np.union1d(self._rows, np.flatnonzero(b != -np.inf))
        if len(rows) > len(self._rows):
            self._rows, self._basis = rows, None
        W = np.vstack([np.eye(n), -np.eye(n), -A[rows]])
        w = np.concatenate([self.qp.high, -self.qp.low, -b[rows]])
        void = w == np.inf
        W[void], w[void] = 0.0, 0.0
        r = len(w)
        matrix = np.zeros((k + 1 + r, 2 * n + 2 * k + 1 + r))
        matrix[:k, :n], matrix[:k, n : 2 * n] = J, -J
        matrix[:k, 2 * n : 2 * n + k], matrix[:k, 2 * n + k : 2 * n + 2 * k] = -np.eye(k), np.eye(k)
        matrix[k, : 2 * n] = 1.0
        matrix[k, 2 * n + 2 * k] = 1.0
        matrix[k + 1 :, :n], matrix[k + 1 :, n : 2 * n] = W, -W
        matrix[k + 1 :, 2 * n + 2 * k + 1 :] = np.eye(r)
        right = np.concatenate([-target, [BETA_OVER_ETA * np.abs(target).sum()], w])
        cost = np.zeros(matrix.shape[1])
        cost[:n], cost[n : 2 * n], cost[2 * n : 2 * n + k] = -J.sum(axis=0), J.sum(axis=0), 2.0
        return matrix, right, cost

    def solve(self, v: Array, multiplier: Array) -> SolverStatus:
        """Solve the program as it stands; see `vfi.backends.Backend`."""
        matrix, right, cost = self.matrices()
        if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
            # HiGHS iterates for ever on a NaN.
            return SolverStatus.NOT_SOLVED
        rows, variables = matrix.shape
        n, (k, _) = len(v), self.qp.task.shape
        lp = highspy.HighsLp()
        lp.num_row_, lp.num_col_ = rows, variables
        lp.col_cost_, lp.row_lower_, lp.row_upper_ = cost, right, right
        lp.col_lower_, lp.col_upper_ = np.zeros(variables), np.full(variables, highspy.kHighsInf)
        lp.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
        lp.a_matrix_.num_col_, lp.a_matrix_.num_row_ = variables, rows
        filled = matrix != 0.0
        lp.a_matrix_.start_ = np.concatenate([[0], np.cumsum(filled.sum(axis=1))]).astype(np.int32)
        lp.a_matrix_.index_ = np.nonzero(filled)[1].astype(np.int32)
        lp.a_matrix_.value_ = matrix[filled]
        self._highs.passModel(lp)
        if self._basis is not None:
            self._highs.setBasis(self._basis)
        self._highs.run()
        status = self._highs.getModelStatus()
        if status != highspy.HighsModelStatus.kOptimal and self._basis is not None:
            # An unlucky basis ends in "unknown" once in ten thousand cycles.
            self._basis = None
            self._highs.clearSolver()
            self._highs.run()
            status = self._highs.getModelStatus()
        if status == highspy.HighsModelStatus.kInfeasible:
            return SolverStatus.INFEASIBLE
        if status != highspy.HighsModelStatus.kOptimal:
            return SolverStatus.NOT_CONVERGED
        solution, self._basis = self._highs.getSolution(), self._highs.getBasis()
        g, dual = np.asarray(solution.col_value), np.asarray(solution.row_dual)
        v[:] = g[:n] - g[n : 2 * n]
        multiplier[:] = 0.0
        bounds, m = dual[k + 1 : k + 1 + 2 * n], len(self.qp.b)
        multiplier[self._rows] = np.maximum(-dual[k + 1 + 2 * n :], 0.0)
        multiplier[m : m + n], multiplier[m + n :] = np.maximum(-bounds[n:], 0.0), np.maximum(-bounds[:n], 0.0)
        return SolverStatus.OPTIMAL


SOLVER = Solver(
    "lp", "1-norm linear program of the VFI paper with its beta row, by HiGHS", PaperLP, tracks_pose_only=True
)
