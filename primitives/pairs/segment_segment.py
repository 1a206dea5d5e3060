"""Distance between two segments: capsules, when their radii are added to the safe distance.

Closest points as in V. J. Lumelsky, "On fast computation of distance between line segments", 1985: the foot of the
infinite lines, clamped to the first segment, projected to the second, clamped, and projected back.
"""

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE, scratch
from primitives.pair import Pair
from primitives.vectors import between_points, cross, dot


@compiled("float64(float64, float64)")
def _clamp(value: float, high: float) -> float:
    return min(max(value, 0.0), high)


@compiled(PAIR_SIGNATURE)
def segment_segment(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |c_a - c_b|, the closest points of both segments, metres.

    Continuous everywhere. Singular sets: d < CONTACT, gradient zero and DEGENERATE; and segments that overlap within
    the sine PARALLEL of being parallel. There many pairs are closest, exactly or to 1e-12 m, a rounding of the
    directions moves the closest one by d/sine^2 times as much, and the gradient is that of one of them (the middle of
    the overlap when they are exactly parallel): a generalised gradient. It jumps where the closest pair does.
    """
    n = scratch(9)
    cross(a, 3, b, 3, n, 0)
    square = dot(n, 0, n, 0)
    for i in range(3):
        n[3 + i] = b[i] - a[i]
    along_a = dot(n, 3, a, 3)
    along_b = -dot(n, 3, b, 3)
    cosine = dot(a, 3, b, 3)
    if square > 1e-30:
        cross(n, 3, b, 3, n, 6)
        s = _clamp(dot(n, 6, n, 0) / square, a[6])
    else:
        end = along_a + cosine * b[6]
        s = 0.5 * (_clamp(min(along_a, end), a[6]) + _clamp(max(along_a, end), a[6]))
    t = _clamp(along_b + s * cosine, b[6])
    s = _clamp(along_a + t * cosine, a[6])
    return between_points(a, b, s, t, gradient)


PAIR = Pair("segment_segment", "segment", "segment", "m", segment_segment)
