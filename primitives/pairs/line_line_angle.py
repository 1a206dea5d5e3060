"""Angle between the directions of two lines: a cone around one of them. Its margin is in radians."""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE, scratch
from primitives.pair import Pair
from primitives.vectors import CONTACT, DEGENERATE, OK, cross, dot


@compiled(PAIR_SIGNATURE)
def line_line_angle(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """phi = atan2(|l_a x l_b|, <l_a, l_b>) in [0, pi], radians; the primary part of (25).

    Singular set: phi or pi - phi below CONTACT, gradient zero and DEGENERATE.
    """
    n = scratch(3)
    cross(a, 3, b, 3, n, 0)
    sine = np.sqrt(dot(n, 0, n, 0))
    cosine = dot(a, 3, b, 3)
    angle = np.arctan2(sine, cosine)
    gradient[:] = 0.0
    if sine < CONTACT:
        return angle, DEGENERATE
    for i in range(3):
        gradient[3 + i] = (cosine * a[3 + i] - b[3 + i]) / sine
        gradient[9 + i] = (cosine * b[3 + i] - a[3 + i]) / sine
    return angle, OK


PAIR = Pair("line_line_angle", "line", "line", "rad", line_line_angle)
