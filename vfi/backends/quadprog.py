"""quadprog, the Goldfarb-Idnani method; under the GPL, so it comes with the extra `solvers-gpl` only."""

from vfi.backends.scaled import through_qpsolvers

SOLVER = through_qpsolvers("quadprog", "Goldfarb-Idnani (quadprog, GPL: extra solvers-gpl)", {}, warm=False)
