"""The points of declared clouds that are within reach of the tool, and how their margins change; paper A, (8).

A cloud is a union of spheres, so a constraint on it is one row a sphere: as many as are within reach. The spheres lie
in the coordinates of the cloud, which stands in the world, on a robot frame, or on a moving entity.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.evaluate import to_world
from primitives.intrinsics import scratch
from primitives.vectors import CONTACT, DEGENERATE, OK
from primitives.voxel_grid import near_segment, nearest_to_segment

FARTHEST = 10.0
"""Metres up to which a cloud is searched for its nearest point; a margin beyond is given as this."""
WIDTH = 6
"""Columns of what is known of a point within reach, a contact: the unit vector from it to the tool, and the tool's
nearest place, world."""

TABLE = "int64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1]"
"""Constraints on clouds in the signature of a compiled function: `at`, `frame`, `geometry`, `sphere`, `placement`.

at (C, 8) : constraint, first point, points, first cell, cells + 1, and the grid's shape; frame (m, 2) and geometry
(2m, 8) of all constraints; sphere (C, 6) : d_c, safe distance, edge of a cell, origin of the grid; placement (C, 12)
of the cloud in the coordinates of what it is attached to.
"""
POINTS = "float64[:,::1], int64[::1], int64[::1], float64[::1], float64[::1]"
"""All grids one after the other, `points` (N, 3) and `cells`; and room for what a search finds, as many as the largest
cloud has points: `found`, `along`, `apart`."""


@compiled("void(float64[:,::1], int64, float64[:,::1], int64, float64[::1])")
def place_cloud(pose: Array, frame: int, placement: Array, c: int, out: Array) -> None:
    """Pose (12,) in the world of cloud c, from that of what it is attached to."""
    for i in range(3):
        x, y, z = pose[frame, 3 * i], pose[frame, 3 * i + 1], pose[frame, 3 * i + 2]
        for j in range(3):
            out[3 * i + j] = x * placement[c, j] + y * placement[c, 3 + j] + z * placement[c, 6 + j]
        out[9 + i] = pose[frame, 9 + i] + x * placement[c, 9] + y * placement[c, 10] + z * placement[c, 11]


@compiled(f"int64({TABLE}, float64[:,::1], int64, float64, boolean, {POINTS}, float64[::1], float64[::1])")
def search(
    at: np.ndarray,
    frame: np.ndarray,
    geometry: Array,
    sphere: Array,
    placement: Array,
    pose: Array,
    c: int,
    reach: float,
    nearest: bool,
    points: Array,
    cells: np.ndarray,
    found: np.ndarray,
    along: Array,
    apart: Array,
    element: Array,
    cloud: Array,
) -> int:
    """Points of cloud c whose margin is at most reach, or the nearest of them; how many, or < 0 as `near_segment`.

    Fills element (8,), the tool's element in the world, and cloud (12,), the cloud's pose there.
    """
    i, first, count, corner, many = at[c, 0], at[c, 1], at[c, 2], at[c, 3], at[c, 4]
    to_world(pose, frame[i, 0], geometry, 2 * i, element)
    place_cloud(pose, frame[i, 1], placement, c, cloud)
    base, direction = scratch(3), scratch(3)
    still = element[6] == 0.0
    for a in range(3):
        base[a], direction[a] = 0.0, 0.0
        for b in range(3):
            base[a] += cloud[3 * b + a] * (element[b] - cloud[9 + b])
            # A point has no direction, but the search wants a unit vector.
            direction[a] += cloud[3 * b + a] * ((1.0 if b == 2 else 0.0) if still else element[3 + b])
    within = max(reach + sphere[c, 0] + sphere[c, 1], 0.0)
    grid, corners, shape = points[first : first + count], cells[corner : corner + many], at[c, 5:8]
    if nearest:
        return nearest_to_segment(
            grid, corners, shape, sphere[c, 3:6], sphere[c, 2], base, direction, element[6], within, found, along, apart
        )
    return near_segment(
        grid, corners, shape, sphere[c, 3:6], sphere[c, 2], base, direction, element[6], within, found, along, apart
    )


@compiled("void(float64[:,::1], int64, float64[::1], float64[::1])")
def point_in_world(points: Array, k: int, cloud: Array, out: Array) -> None:
    """Point k (3,) of a cloud whose pose in the world is given."""
    x, y, z = points[k, 0], points[k, 1], points[k, 2]
    for a in range(3):
        out[a] = cloud[9 + a] + cloud[3 * a] * x + cloud[3 * a + 1] * y + cloud[3 * a + 2] * z


@compiled(
    f"int64({TABLE}, float64[:,::1], float64, {POINTS}, int64[::1], float64[::1], float64[::1], int64[::1],"
    "float64[:,::1], float64[::1], int64[::1], int64[::1])"
)
def find_contacts(
    at: np.ndarray,
    frame: np.ndarray,
    geometry: Array,
    sphere: Array,
    placement: Array,
    pose: Array,
    reach: float,
    points: Array,
    cells: np.ndarray,
    found: np.ndarray,
    along: Array,
    apart: Array,
    enforced: np.ndarray,
    distance: Array,
    margin: Array,
    status: np.ndarray,
    contact: Array,
    clearance: Array,
    owner: np.ndarray,
    point: np.ndarray,
) -> int:
    """Every point within reach of its constraint, and distance, margin and status (m,) of the constraints on clouds.

    Fills contact (P, WIDTH), clearance (P,), the point's own margin, owner (P,), its constraint among the C, and point
    (P,), its place among all points. A constraint that is not enforced (m,) has its margin measured, and no contacts.

    Returns
    -------
    How many there are; < 0 where a number is not finite.
    """
    seen, element, cloud, p = 0, scratch(8), scratch(12), scratch(3)
    for c in range(at.shape[0]):
        i, safe, close = at[c, 0], sphere[c, 0] + sphere[c, 1], 0
        if enforced[i]:
            close = search(
                at, frame, geometry, sphere, placement, pose, c, reach, False, points, cells, found, along, apart,
                element, cloud,
            )  # fmt: skip
        least, status[i] = FARTHEST, OK
        for k in range(close):
            point[seen], owner[seen] = at[c, 1] + found[k], c
            point_in_world(points, point[seen], cloud, p)
            far = 0.0
            for a in range(3):
                contact[seen, 3 + a] = element[a] + along[k] * element[3 + a]
                contact[seen, a] = contact[seen, 3 + a] - p[a]
                far += contact[seen, a] * contact[seen, a]
            far = np.sqrt(far)
            if far < CONTACT:
                status[i] = DEGENERATE
            for a in range(3):
                contact[seen, a] /= max(far, CONTACT)
            clearance[seen] = far - safe
            least = min(least, clearance[seen])
            seen += 1
        if close == 0:
            close = search(
                at, frame, geometry, sphere, placement, pose, c, FARTHEST, True, points, cells, found, along, apart,
                element, cloud,
            )  # fmt: skip
            if close > 0:
                least = apart[0] - safe
        if close < 0:
            return close
        margin[i] = least
        distance[i] = least + sphere[c, 1]
    return seen


@compiled(f"float64({TABLE}, float64[:,::1], int64, float64, {POINTS}, int64, int64[::1], int64[::1], float64[::1])")
def follow_contacts(
    at: np.ndarray,
    frame: np.ndarray,
    geometry: Array,
    sphere: Array,
    placement: Array,
    pose: Array,
    c: int,
    reach: float,
    points: Array,
    cells: np.ndarray,
    found: np.ndarray,
    along: Array,
    apart: Array,
    seen: int,
    owner: np.ndarray,
    point: np.ndarray,
    margin: Array,
) -> float:
    """Margins (P,) at another pose of those contacts that belong to cloud c, of `seen` in all.

    Returns
    -------
    The smallest margin of the cloud there, at most reach; NaN where a point is within reach that is none of the
    contacts, or a number is not finite.
    """
    element, cloud, p = scratch(8), scratch(12), scratch(3)
    close = search(
        at, frame, geometry, sphere, placement, pose, c, reach, False, points, cells, found, along, apart, element,
        cloud,
    )  # fmt: skip
    safe, least, known = sphere[c, 0] + sphere[c, 1], reach, 0
    for k in range(seen):
        if owner[k] != c:
            continue
        point_in_world(points, point[k], cloud, p)
        x, y, z = p[0] - element[0], p[1] - element[1], p[2] - element[2]
        s = min(max(x * element[3] + y * element[4] + z * element[5], 0.0), element[6])
        x -= s * element[3]
        y -= s * element[4]
        z -= s * element[5]
        margin[k] = np.sqrt(x * x + y * y + z * z) - safe
        known += margin[k] <= reach + CONTACT
        least = min(least, margin[k])
    return least if 0 <= close <= known else np.nan
