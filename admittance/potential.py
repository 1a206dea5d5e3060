"""Barrier potential and repulsion of a tip or a whole tool by covered clouds (paper A, (8)-(14), (34)-(37)).

For a cloud point with clearance c (distance to the tool's axis minus d_c, minus r for a whole tool) the potential is
V = (k/2) [ln(1 / (1 - psi))]^2 where c < d_0, with psi = (1 - c/d_0)^2, and zero beyond. Errata: the square of (9)
stands outside the logarithm, as only that has (13) for its derivative; for the whole tool d_c becomes d_c + r in the
range of (9), in (10) and in (12), which reads d_0 + d_c (+ r). psi >= 1, a clearance <= 0, is a point already inside.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, number, unit
from primitives.compiled import compiled
from primitives.errors import InputError
from primitives.voxel_grid import VoxelGrid, near_segment


@compiled("Tuple((float64, float64, float64))(float64, float64, float64, float64)")
def barrier(clearance: float, k: float, d_0: float, linear_below: float) -> tuple[float, float, float]:
    """Potential V (J), repulsive force -V' (N) and stiffness V'' (N/m) at a clearance (m): (9), (11)-(13).

    With clearance, d_0 and linear_below in radians the force is a torque, Nm.

    Below `linear_below` > 0 the potential goes on linearly, with the force it has there and no stiffness: finite at
    every clearance. With linear_below = 0 a clearance must be positive. 1 - psi = (c/d_0)(2 - c/d_0), so nothing is
    lost to cancellation near contact.
    """
    if clearance >= d_0 or k == 0.0:
        return 0.0, 0.0, 0.0
    c = max(clearance, linear_below)
    s = d_0 - c
    rest = (c / d_0) * (2.0 - c / d_0)
    logarithm = -np.log(rest)
    slope = 2.0 * s / (d_0 * d_0 * rest)
    force = k * logarithm * slope
    potential = 0.5 * k * logarithm * logarithm
    if clearance < c:
        return potential + force * (c - clearance), force, 0.0
    stiffness = k * (slope * slope + logarithm * (2.0 / (d_0 * d_0 * rest) + slope * slope))
    return potential, force, stiffness


_REPEL = (
    "int64(float64[:,::1], int64[::1], int64[::1], float64[::1], float64, float64[::1], float64[::1], float64[::1],"
    "float64, float64, float64, float64, float64, float64, float64[::1], float64[::1], float64[::1], int64,"
    "int64[::1], float64[::1], float64[::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1], float64[::1])"
)


@compiled(_REPEL)
def repel(
    points: Array,
    start: np.ndarray,
    shape: np.ndarray,
    origin: Array,
    cell: float,
    cloud: Array,
    base: Array,
    direction: Array,
    length: float,
    safe: float,
    sight: float,
    k: float,
    d_0: float,
    linear_below: float,
    tip: Array,
    port: Array,
    axis: Array,
    first: int,
    index: np.ndarray,
    place: Array,
    distance: Array,
    near: Array,
    F_r: Array,
    F_rx: Array,
    K: Array,
    found: Array,
) -> int:
    """Add the repulsion of one cloud on one segment of the shaft frame.

    Parameters
    ----------
    points, start, shape, origin, cell : the cloud's grid, in the cloud's own frame.
    cloud : (12,) pose of the cloud's frame in the world.
    base, direction, length : the segment (34), world, metres; length 0 for a tip.
    safe : d_c, plus r for a whole tool. sight : clearance up to which points are looked at, >= d_0.
    tip, port, axis : p_t, p_c and n_t, (3,) world.
    first : row of `near` to begin with; index, place, distance : (N,) filled with what lies near (sorted order).
    near : (.., 5) filled with a_i = d clearance / d v (4,) and the clearance of each point within sight.
    F_r : (6,) [force; torque about the tip] (37). F_rx : (4,) Z_x F_r. K : (4, 4) sum of V'' a_i a_i^T, the
        Gauss-Newton stiffness in the free coordinates.
    found : (3,) total potential, smallest clearance and its point (sorted order); the first is added to, the others
        are replaced where this cloud is nearer.

    Returns
    -------
    How many points lie within sight; below zero where the query could not be made (see `primitives.voxel_grid`).
    """
    local = np.empty(6)
    for c in range(3):
        x, y, z = cloud[c], cloud[3 + c], cloud[6 + c]
        local[c] = x * (base[0] - cloud[9]) + y * (base[1] - cloud[10]) + z * (base[2] - cloud[11])
        local[3 + c] = x * direction[0] + y * direction[1] + z * direction[2]
    count = near_segment(
        points, start, shape, origin, cell, local[:3], local[3:], length, safe + sight, index, place, distance
    )
    for i in range(count):
        p, s, apart = index[i], place[i], distance[i]
        clearance = apart - safe
        u = local[0] + s * local[3] - points[p, 0]
        v = local[1] + s * local[4] - points[p, 1]
        w = local[2] + s * local[5] - points[p, 2]
        scale = 1.0 / apart if apart > 0.0 else 0.0
        x = (cloud[0] * u + cloud[1] * v + cloud[2] * w) * scale
        y = (cloud[3] * u + cloud[4] * v + cloud[5] * w) * scale
        z = (cloud[6] * u + cloud[7] * v + cloud[8] * w) * scale
        a = base[0] + s * direction[0]
        b = base[1] + s * direction[1]
        g_ = base[2] + s * direction[2]
        row = first + i
        e, f, g = a - port[0], b - port[1], g_ - port[2]
        near[row, 0] = axis[0] * x + axis[1] * y + axis[2] * z
        near[row, 1] = f * z - g * y
        near[row, 2] = g * x - e * z
        near[row, 3] = e * y - f * x
        near[row, 4] = clearance
        if clearance < found[1]:
            found[1] = clearance
            found[2] = p
        if clearance >= d_0 or (clearance <= 0.0 and linear_below <= 0.0):
            continue
        potential, force, stiffness = barrier(clearance, k, d_0, linear_below)
        found[0] += potential
        F_r[0] += force * x
        F_r[1] += force * y
        F_r[2] += force * z
        e, f, g = a - tip[0], b - tip[1], g_ - tip[2]
        F_r[3] += force * (f * z - g * y)
        F_r[4] += force * (g * x - e * z)
        F_r[5] += force * (e * y - f * x)
        for r in range(4):
            F_rx[r] += force * near[row, r]
            for q in range(4):
                K[r, q] += stiffness * near[row, r] * near[row, q]
    return count


class Repulsion(NamedTuple):
    """What one cloud does to one segment of the shaft.

    Attributes
    ----------
    potential : J, the sum of (9). F_r : (6,) [force; torque about the tip] (37), N and Nm, world axes.
    F_rx : (4,) Z_x F_r: force along the shaft and torque about the port. stiffness : (4, 4) sum of V'' a_i a_i^T.
    clearance : smallest, metres; infinite where no point is within sight. point : its index as given, -1 if none.
    rows : (k, 4) a_i, the derivative of each clearance within sight by the free velocity. clearances : (k,).
    """

    potential: float
    F_r: Array
    F_rx: Array
    stiffness: Array
    clearance: float
    point: int
    rows: Array
    clearances: Array


def repulsion(
    grid: VoxelGrid,
    segment: Array,
    *,
    safe: float,
    k: float,
    d_0: float,
    tip: ArrayLike,
    port: ArrayLike,
    axis: ArrayLike,
    sight: float | None = None,
    linear_below: float = 0.0,
) -> Repulsion:
    """Potential and repulsion of a cloud on a segment, without a robot.

    Parameters
    ----------
    grid : the cloud's points, world, metres.
    segment : (8,) geometry of an element: point, direction, length, 0; world.
    safe : d_c, plus r for a whole tool, metres. k : J. d_0 : metres. sight : default d_0.
    tip, port, axis : p_t, p_c and n_t, (3,) world.
    linear_below : see `barrier`.

    Raises
    ------
    InputError : sizes, or a point inside (psi >= 1), with its index and depth.
    """
    geometry = array(segment, (8,), "segment")
    direction = geometry[3:6].copy() if geometry[6] > 0.0 else np.array([0.0, 0.0, 1.0])
    count = len(grid.points)
    near, F_r, F_rx, K = np.zeros((count, 5)), np.zeros(6), np.zeros(4), np.zeros((4, 4))
    found = np.array([0.0, np.inf, -1.0])
    seen = repel(
        grid.points,
        grid.start,
        grid.shape,
        grid.origin,
        grid.cell,
        np.array([1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0, 0, 0, 0]),
        geometry[:3].copy(),
        direction,
        geometry[6],
        number(safe, "safe distance", low=0.0),
        number(d_0 if sight is None else sight, "sight", low=d_0),
        number(k, "k", low=0.0),
        number(d_0, "d_0", positive=True),
        number(linear_below, "linear_below", low=0.0),
        array(tip, (3,), "tip"),
        array(port, (3,), "port"),
        unit(axis, "axis"),
        0,
        np.zeros(count, dtype=np.int64),
        np.zeros(count),
        np.zeros(count),
        near,
        F_r,
        F_rx,
        K,
        found,
    )
    if seen < 0:
        raise InputError("repulsion: the segment is too far from the cloud to be looked for; check their units")
    point = int(grid.order[int(found[2])]) if found[2] >= 0.0 else -1
    if found[1] <= 0.0 and linear_below <= 0.0:
        raise InputError(
            f"repulsion: the tool is {-found[1] * 1e3:.4g} mm inside the sphere of point {point} (psi >= 1); move the "
            "cloud or the tool away"
        )
    return Repulsion(
        float(found[0]), F_r, F_rx, K, float(found[1]), point, near[:seen, :4].copy(), near[:seen, 4].copy()
    )
