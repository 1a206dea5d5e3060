"""How deep and for how long a tool was inside a forbidden region."""

import numpy as np

from primitives.checks import Array


def penetration_depth(smallest: float | None) -> float:
    """Metres by which the smallest clearance of a run lies below zero; 0 where no region was entered."""
    return max(0.0, -smallest) if smallest is not None else 0.0


def time_inside(clearance: Array, period: float) -> float:
    """Seconds inside: the cycles at whose end the clearance (k,) is below zero, a period each."""
    return float(np.count_nonzero(clearance < 0.0) * period)
