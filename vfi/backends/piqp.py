"""PIQP, a proximal interior-point method."""

from vfi.backends.scaled import through_qpsolvers

# Without a bound on the duality gap the answer keeps the rows and misses the optimum by 1e-3 rad/s.
OPTIONS = {
    "eps_abs": 1e-10,
    "eps_rel": 0.0,
    "check_duality_gap": True,
    "eps_duality_gap_abs": 1e-12,
    "eps_duality_gap_rel": 0.0,
    "max_iter": 100,
}

SOLVER = through_qpsolvers("piqp", "proximal interior point (PIQP)", OPTIONS, warm=False)
