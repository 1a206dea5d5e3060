"""OSQP, an operator-splitting method."""

from vfi.backends.scaled import through_qpsolvers

# At its default tolerances OSQP leaves rows violated by millimetres per second.
OPTIONS = {"eps_abs": 1e-9, "eps_rel": 0.0, "max_iter": 20_000, "raise_error": False}

SOLVER = through_qpsolvers("osqp", "operator splitting, first order (OSQP)", OPTIONS, warm=True, sparse=True)
