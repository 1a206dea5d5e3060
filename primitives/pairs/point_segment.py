"""Distance from a point to a segment, the axis of a capsule."""

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE
from primitives.pair import Pair
from primitives.vectors import between_points, foot


@compiled(PAIR_SIGNATURE)
def point_segment(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |t - c|, c the segment's nearest point, metres.

    Continuous, and differentiable but for d < CONTACT, where the gradient is zero and DEGENERATE is returned.
    """
    return between_points(a, b, 0.0, min(max(foot(b, a), 0.0), b[6]), gradient)


PAIR = Pair("point_segment", "point", "segment", "m", point_segment)
