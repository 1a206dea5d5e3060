"""Central differences of order six, in extended precision, and kernels compared with them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from primitives.pair import Kernel
from tests.primitives.pair_cases import Array, Distance, Long


def evaluated(kernel: Kernel, a: Array, b: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """Distance (N,), gradient (N, 12) and status (N,) of a kernel."""
    n = len(a)
    distance, gradient, status = np.empty(n), np.full((n, 12), np.nan), np.empty(n, dtype=np.int64)
    for i in range(n):
        distance[i], status[i] = kernel(a[i], b[i], gradient[i])
    return distance, gradient, status


def by_twists(gradient: Array, a: Array, b: Array) -> Array:
    """Derivative (N, 12) by translating and turning each element about its own point: p' = v, l' = w x l."""
    blocks = [gradient[:, :3], np.cross(a[:, 3:6], gradient[:, 3:6])]
    blocks += [gradient[:, 6:9], np.cross(b[:, 3:6], gradient[:, 9:])]
    return np.concatenate(blocks, axis=1)


def moved(e: Array, axis: int, by: Long) -> Long:
    """Elements translated along (axis 0 to 2) or turned about (3 to 5) an axis of the world through their own point."""
    out = e.astype(np.longdouble)
    if axis < 3:
        out[:, axis] += by
        return out
    i, j = (axis - 2) % 3, (axis - 1) % 3
    out[:, 3 + i] = np.cos(by) * e[:, 3 + i] - np.sin(by) * e[:, 3 + j]
    out[:, 3 + j] = np.sin(by) * e[:, 3 + i] + np.cos(by) * e[:, 3 + j]
    return out


STENCIL = ((1, 0.75), (2, -0.15), (3, np.longdouble(1) / 60))
"""Offsets and weights of central differences of order six: sum of w (f(x + k h) - f(x - k h)) / h."""


def differences(distance: Distance, a: Array, b: Array, step: Array) -> Long:
    """Central differences (N, 12) of a distance for the motions of `by_twists`."""
    out = np.zeros((len(a), 12), dtype=np.longdouble)
    for axis in range(6):
        for k, weight in STENCIL:
            for sign in (1, -1):
                by = sign * k * step.astype(np.longdouble)
                out[:, axis] += sign * weight * distance(moved(a, axis, by), b)
                out[:, 6 + axis] += sign * weight * distance(a, moved(b, axis, by))
    return out / step[:, None]


class Off(NamedTuple):
    """How far a kernel is from its oracle, (N,); infinite where it is not finite."""

    distance: Array
    gradient: Array
    status: NDArray[np.int64]


def off(kernel: Kernel, distance: Distance, a: Array, b: Array, step: Array, absolute: bool = False) -> Off:
    """Kernel against a distance and its central differences (by twists, in m/m and m/rad)."""
    d, gradient, status = evaluated(kernel, a, b)
    expected = distance(a, b)
    sign = np.where(expected < 0, -1.0, 1.0) if absolute else np.ones(len(a))
    apart = np.abs(by_twists(gradient, a, b) - sign[:, None] * differences(distance, a, b, step)).max(axis=1)
    return Off(_finite(np.abs(d - sign * expected)), _finite(apart), status)


def _finite(x: Long) -> Array:
    return np.asarray(np.where(np.isfinite(x), x, np.inf), dtype=np.float64)


def step_of(bend: Distance, a: Array, b: Array) -> Array:
    return np.asarray(5e-3 * np.minimum(bend(a, b), 1.0), dtype=np.float64)
