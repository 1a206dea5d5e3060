"""Distance between two points."""

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE
from primitives.pair import Pair
from primitives.vectors import between_points


@compiled(PAIR_SIGNATURE)
def point_point(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |p_a - p_b|, metres. Singular set: d < CONTACT, where the gradient is zero and DEGENERATE is returned."""
    return between_points(a, b, 0.0, 0.0, gradient)


PAIR = Pair("point_point", "point", "point", "m", point_point)
