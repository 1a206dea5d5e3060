"""Distance from a point to an infinite line, e.g. to keep a point in a cylinder; paper V, (23)-(24)."""

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE
from primitives.pair import Pair
from primitives.vectors import between_points, foot


@compiled(PAIR_SIGNATURE)
def point_line(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |t x l - m|, metres; (23). Singular set: d < CONTACT, gradient zero and DEGENERATE."""
    return between_points(a, b, 0.0, foot(b, a), gradient)


PAIR = Pair("point_line", "point", "line", "m", point_line)
