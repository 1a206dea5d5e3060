"""The rows of a program as other solvers like them: those in force, each of unit length."""

import numpy as np

from primitives.checks import Array
from primitives.errors import SolverError
from vfi.qp import QP


def scaled_rows(qp: QP) -> tuple[np.ndarray, Array, Array, Array]:
    """Numbers of the rows in force (k,), their scales (k,), and the scaled A (k, n) and b (k,).

    A row of length zero with a demand cannot be scaled and is handed over as it is, for the solver to refuse.

    Raises
    ------
    SolverError : a number of the program is NaN; most solvers would drop its row and answer "found".
    """
    if any(np.isnan(block).any() for block in qp[:6]):
        raise SolverError("the program holds a number that is NaN")
    length = np.linalg.norm(qp.A, axis=1)
    rows = np.flatnonzero((qp.b > -np.inf) & ((length > 0.0) | (qp.b > 0.0)))
    scale = 1.0 / np.where(length[rows] > 0.0, length[rows], 1.0)
    return rows, scale, qp.A[rows] * scale[:, None], qp.b[rows] * scale
