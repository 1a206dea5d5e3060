"""The active-set kernel as an entry of the table; the compiled cycle calls it without leaving compiled code."""

from vfi.backends import Solver

SOLVER = Solver("active-set", "dense dual active-set kernel inside the compiled cycle (default)", None)
