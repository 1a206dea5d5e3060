"""DAQP, a dual active-set method."""

from vfi.backends.scaled import through_qpsolvers

OPTIONS = {"primal_tol": 1e-9, "dual_tol": 1e-12, "iter_limit": 1000}

SOLVER = through_qpsolvers("daqp", "dual active set (DAQP)", OPTIONS, warm=False)
