"""Signed distance from a point to a plane; paper V, (15)-(16)."""

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import PAIR_SIGNATURE
from primitives.pair import Pair
from primitives.vectors import OK


@compiled(PAIR_SIGNATURE)
def point_plane(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
    """d = <t, n> - d_pi, metres, positive on the side of the normal; (15). Singular set: none."""
    distance = 0.0
    for i in range(3):
        offset = a[i] - b[i]
        distance += offset * b[3 + i]
        gradient[i] = b[3 + i]
        gradient[3 + i] = 0.0
        gradient[6 + i] = -b[3 + i]
        gradient[9 + i] = offset
    return distance, OK


PAIR = Pair("point_plane", "point", "plane", "m", point_plane)
