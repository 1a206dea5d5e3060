"""Distance from an infinite line to a point, e.g. a shaft to its entry port; paper V, (21)-(22)."""

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE
from primitives.pair import Pair
from primitives.vectors import between_points, foot


@compiled(PAIR_SIGNATURE)
def line_point(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = |p x l_z - m_z|, metres; (21). Singular set: d < CONTACT, gradient zero and DEGENERATE."""
    return between_points(a, b, foot(a, b), 0.0, gradient)


PAIR = Pair("line_point", "line", "point", "m", line_point)
