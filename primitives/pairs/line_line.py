"""Distance between two infinite lines; paper V, (25)-(37).

The lines of the paper's S2-S5. Their distance is discontinuous where they become parallel, so finite tool shafts are
better described as segments.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE, scratch
from primitives.pair import Pair
from primitives.vectors import CONTACT, DEGENERATE, IN_BAND, OK, PARALLEL, cross, dot


@compiled(PAIR_SIGNATURE)
def parallel_lines(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |D(l_a x l_b)| = |l_a x m_b + m_a x l_b|, metres; (34)-(35).

    The derivative with respect to a rotation depends on the origin of the world: in the limit the closest points are
    anywhere, and the moments place them at the foot of the origin.
    """
    work = scratch(24)
    cross(a, 0, a, 3, work, 0)
    cross(b, 0, b, 3, work, 3)
    cross(a, 3, work, 3, work, 6)
    cross(work, 0, b, 3, work, 9)
    square = 0.0
    for i in range(3):
        work[6 + i] += work[9 + i]
        square += work[6 + i] * work[6 + i]
    distance = np.sqrt(square)
    if distance < CONTACT:
        gradient[:] = 0.0
        return distance, DEGENERATE
    for i in range(3):
        work[6 + i] /= distance
    cross(b, 3, work, 6, work, 9)
    cross(a, 3, work, 6, work, 12)
    cross(a, 3, work, 9, gradient, 0)
    cross(b, 3, work, 12, gradient, 6)
    cross(work, 3, work, 6, gradient, 3)
    cross(work, 9, a, 0, work, 15)
    cross(work, 0, work, 6, gradient, 9)
    cross(work, 12, b, 0, work, 18)
    for i in range(3):
        gradient[3 + i] += work[15 + i]
        gradient[6 + i] = -gradient[6 + i]
        gradient[9 + i] = -(gradient[9 + i] + work[18 + i])
    return distance, IN_BAND


@compiled(PAIR_SIGNATURE)
def line_line(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |<p_a - p_b, n>| with n = l_a x l_b / |l_a x l_b|, metres; (29), (33), in closest-point form.

    Singular sets: lines that meet, d < CONTACT, gradient zero and DEGENERATE; lines within the sine PARALLEL of
    being parallel or anti-parallel, where (34)-(35) are used and IN_BAND is returned. Outside the band the derivative
    with respect to a rotation still grows like 1/angle.
    """
    n = scratch(9)
    cross(a, 3, b, 3, n, 0)
    sine = np.sqrt(dot(n, 0, n, 0))
    if sine < PARALLEL:
        return parallel_lines(a, b, gradient)
    for i in range(3):
        n[i] /= sine
        n[3 + i] = b[i] - a[i]
    signed = -dot(n, 3, n, 0)
    distance = abs(signed)
    if distance < CONTACT:
        gradient[:] = 0.0
        return distance, DEGENERATE
    cross(n, 3, b, 3, n, 6)
    s = dot(n, 6, n, 0) / sine
    cross(n, 3, a, 3, n, 6)
    t = dot(n, 6, n, 0) / sine
    sign = 1.0 if signed > 0.0 else -1.0
    for i in range(3):
        u = sign * n[i]
        gradient[i] = u
        gradient[3 + i] = s * u
        gradient[6 + i] = -u
        gradient[9 + i] = -t * u
    return distance, OK


PAIR = Pair("line_line", "line", "line", "m", line_line)
