"""The tool and the forbidden regions at one configuration: all clouds, wherever each of them is, in one call."""

import numpy as np

from admittance.memory import CLOUDS, Real, Whole
from admittance.outcome import Reason, Setting, Slot, Touch
from admittance.potential import repel
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integer_matrix, integers, matrix, vector
from primitives.voxel_grid import nearest_to_segment

SHAFT = 1
"""Place of the shaft frame among the frames of the memory; 0 is the world."""
FARTHEST = 10.0
"""Metres up to which a cloud is searched for the nearest point where none is within sight."""


@compiled(f"void({MEMORY}, int64)")
def place_segment(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, region: int) -> None:
    """The region's tool element in the world: base and direction in SEGMENT (6,)."""
    pose, table, segment = matrix(f, fl, Real.POSE)[SHAFT], matrix(f, fl, Real.REGION), vector(f, fl, Real.SEGMENT)
    for r in range(3):
        a, b, c = pose[3 * r], pose[3 * r + 1], pose[3 * r + 2]
        x, y, z = table[region, 0], table[region, 1], table[region, 2]
        segment[r] = pose[9 + r] + a * x + b * y + c * z
        x, y, z = table[region, 3], table[region, 4], table[region, 5]
        segment[3 + r] = a * x + b * y + c * z


@compiled(f"int64({MEMORY}, {CLOUDS})")
def evaluate_regions(
    f: Array,
    fl: np.ndarray,
    w: np.ndarray,
    wl: np.ndarray,
    points: Array,
    order: np.ndarray,
    start: np.ndarray,
    index: np.ndarray,
    place: Array,
    distance: Array,
    near: Array,
) -> int:
    """Potential, repulsion, stiffness and clearance of all regions at the present POSE. Returns a `Reason`, or 0."""
    outcome, settings, touch = integers(w, wl, Whole.OUTCOME), vector(f, fl, Real.SETTINGS), vector(f, fl, Real.TOUCH)
    F_r, F_rx, K = vector(f, fl, Real.F_R), vector(f, fl, Real.F_RX), matrix(f, fl, Real.STIFFNESS)
    F_r[:] = 0.0
    F_rx[:] = 0.0
    K[:, :] = 0.0
    outcome[Slot.NEARBY] = 0
    outcome[Slot.REGION] = -1
    outcome[Slot.POINT] = -1
    table, whole, clouds = (
        matrix(f, fl, Real.REGION),
        integer_matrix(w, wl, Whole.REGION),
        matrix(f, fl, Real.REGION_POSE),
    )
    pose, segment = matrix(f, fl, Real.POSE)[SHAFT], vector(f, fl, Real.SEGMENT)
    axis, found, local = vector(f, fl, Real.AXIS), vector(f, fl, Real.FOUND), vector(f, fl, Real.LOCAL)
    for r in range(3):
        axis[r] = pose[3 * r + 2]
    sight, nearest = settings[Setting.SIGHT], FARTHEST
    touch[Touch.POTENTIAL] = 0.0
    seen = 0
    for region in range(table.shape[0]):
        place_segment(f, fl, w, wl, region)
        first, count = whole[region, 0], whole[region, 1]
        cells, many = whole[region, 2], whole[region, 3]
        found[0] = 0.0
        found[1] = nearest
        found[2] = -1.0
        many_near = repel(
            points[first : first + count],
            start[cells : cells + many],
            whole[region, 4:7],
            table[region, 9:12],
            table[region, 8],
            clouds[region],
            segment[:3],
            segment[3:6],
            table[region, 6],
            table[region, 7],
            sight,
            settings[Setting.STIFFNESS],
            settings[Setting.RANGE],
            settings[Setting.LINEAR_BELOW],
            pose[9:12],
            vector(f, fl, Real.PORT),
            axis,
            seen,
            index,
            place,
            distance,
            near,
            F_r,
            F_rx,
            K,
            found,
        )
        if many_near < 0:
            return Reason.NOT_FINITE
        if many_near == 0 and nearest > sight:
            for c in range(3):
                x, y, z = clouds[region, c], clouds[region, 3 + c], clouds[region, 6 + c]
                a, b, e = (
                    segment[0] - clouds[region, 9],
                    segment[1] - clouds[region, 10],
                    segment[2] - clouds[region, 11],
                )
                local[c] = x * a + y * b + z * e
                local[3 + c] = x * segment[3] + y * segment[4] + z * segment[5]
            far = nearest_to_segment(
                points[first : first + count],
                start[cells : cells + many],
                whole[region, 4:7],
                table[region, 9:12],
                table[region, 8],
                local[:3],
                local[3:6],
                table[region, 6],
                table[region, 7] + nearest,
                index,
                place,
                distance,
            )
            if far == 1 and distance[0] - table[region, 7] < nearest:
                found[1] = distance[0] - table[region, 7]
                found[2] = index[0]
        seen += many_near
        touch[Touch.POTENTIAL] += found[0]
        if found[2] >= 0.0:
            nearest = found[1]
            outcome[Slot.REGION] = region
            outcome[Slot.POINT] = order[first + int(found[2])]
    outcome[Slot.NEARBY] = seen
    touch[Touch.CLEARANCE] = nearest
    return Reason.INSIDE if nearest <= 0.0 else Reason.NONE
