"""The handful of vector operations and the status words that the kernels of all pairs share."""

from typing import Final

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.intrinsics import scratch

OK: Final = 0
"""Distance and gradient are those of the pair's formula."""
DEGENERATE: Final = 1
"""The distance is right, its gradient does not exist here and is returned as zero."""
IN_BAND: Final = 2
"""Inside the pair's declared band: distance and gradient are those of the limiting formula that its docstring names."""

CONTACT: Final = 1e-9
"""Metres (radians for angles) below which a distance that is a norm has no usable gradient."""
PARALLEL: Final = 1e-4
"""Sine of the angle below which two infinite lines are treated as parallel."""


@compiled("void(float64[::1], float64[::1])")
def copy(source: Array, out: Array) -> None:
    """out = source, of one length; numba's assignment of slices takes three times as long."""
    for i in range(source.shape[0]):
        out[i] = source[i]


@compiled("float64(float64[::1], int64, float64[::1], int64)")
def dot(a: Array, i: int, b: Array, j: int) -> float:
    """Inner product of a[i:i+3] and b[j:j+3]."""
    return float(a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2])


@compiled("void(float64[::1], int64, float64[::1], int64, float64[::1], int64)")
def cross(a: Array, i: int, b: Array, j: int, out: Array, k: int) -> None:
    """out[k:k+3] = a[i:i+3] x b[j:j+3]; out must not overlap the factors."""
    out[k] = a[i + 1] * b[j + 2] - a[i + 2] * b[j + 1]
    out[k + 1] = a[i + 2] * b[j] - a[i] * b[j + 2]
    out[k + 2] = a[i] * b[j + 1] - a[i + 1] * b[j]


@compiled("Tuple((float64, int64))(float64[::1], float64[::1], float64, float64, float64[::1])")
def between_points(a: Array, b: Array, s: float, t: float, gradient: Array) -> tuple[float, int]:
    """Distance of the closest points a.point + s a.direction and b.point + t b.direction, and its gradient.

    At closest points the derivatives of s and t do not enter: either the difference is perpendicular to the
    direction or the parameter is held at an end. So the gradient is u for the point and s u for the direction.
    """
    difference = scratch(3)
    square = 0.0
    for i in range(3):
        difference[i] = a[i] + s * a[3 + i] - b[i] - t * b[3 + i]
        square += difference[i] * difference[i]
    distance = np.sqrt(square)
    if distance < CONTACT:
        gradient[:] = 0.0
        return distance, DEGENERATE
    for i in range(3):
        u = difference[i] / distance
        gradient[i] = u
        gradient[3 + i] = s * u
        gradient[6 + i] = -u
        gradient[9 + i] = -t * u
    return distance, OK


@compiled("float64(float64[::1], float64[::1])")
def foot(line: Array, point: Array) -> float:
    """Parameter of the point of a line, in metres from line.point along its direction, that is nearest to a point."""
    return float(line[3] * (point[0] - line[0]) + line[4] * (point[1] - line[1]) + line[5] * (point[2] - line[2]))
