"""How smooth a motion is: the jerk of a point."""

import numpy as np
from scipy.signal import savgol_filter

from primitives.checks import Array

WINDOW = 0.04
"""Seconds over which a cubic is fitted. The joints move in steps of a period each: differences would tell these."""
ORDER = 3


def jerk(positions: Array, period: float) -> Array:
    """(k,) norm of the third derivative of positions (m, 3), metres, in m/s^3.

    At each sample the third derivative of the cubic that fits the samples of `WINDOW` around it best (Savitzky and
    Golay), at least seven of them. Only whole windows count, so k = m - (window - 1); 0 samples where m is too small.
    """
    window = max(2 * round(0.5 * WINDOW / period) + 1, 2 * ORDER + 1)
    if len(positions) < window:
        return np.zeros(0)
    found = savgol_filter(positions, window, ORDER, deriv=3, delta=period, axis=0)
    half = window // 2
    out: Array = np.linalg.norm(found[half : len(found) - half], axis=1)
    return out
