"""C1..C4 as a user of a kinematics library writes them: closest points, normals, and the Jacobians of two frames."""

import numpy as np

from tests.bench import problem


def point_row(normal, arm, J):
    """Row (n,) of a point's velocity along a normal; the point lies `arm` (3,) from the frame of J (6, n), [v; w]."""
    return normal @ J[:3] + np.cross(arm, normal) @ J[3:]


def constraint_rows(
    t_shaft,
    z_shaft,
    J_shaft,
    t_tip,
    J_tip,
    point=problem.PARKED_POINT,
    direction=problem.PARKED_DIRECTION,
    J_parked=None,
):
    """Rows (4, n) and margins (4,): A q̇ >= -eta margins.

    t (3,) origins and z_shaft (3,) the shaft's axis, world, metres; J (6, n) [linear; angular] in the world's axes. The
    parked shaft is a line of the world, or has a Jacobian of its own.
    """
    p = problem
    apart = point - t_shaft
    cross = np.cross(z_shaft, direction)
    length = np.linalg.norm(cross)
    normal = cross / length
    signed = -(apart @ normal)
    normal = normal if signed >= 0.0 else -normal
    along = np.cross(apart, direction) @ cross / length**2
    c1 = point_row(normal, along * z_shaft, J_shaft)
    if J_parked is not None:
        along = np.cross(apart, z_shaft) @ cross / length**2
        c1 = c1 - point_row(normal, along * direction, J_parked)

    to_entry = p.ENTRY - t_shaft
    nearest = (to_entry @ z_shaft) * z_shaft
    offset = nearest - to_entry
    to_line = np.linalg.norm(offset)
    c2 = -point_row(offset / to_line, nearest, J_shaft)

    from_axis = t_shaft - p.AXIS_POINT
    radial = from_axis - (from_axis @ p.AXIS) * p.AXIS
    radius = np.linalg.norm(radial)
    c3 = -(radial / radius) @ J_shaft[:3]

    c4 = p.NORMAL @ J_tip[:3]
    margins = np.array([abs(signed) - p.APART, p.OPENING - to_line, p.RADIUS - radius, p.NORMAL @ (t_tip - p.FLOOR)])
    return np.vstack([c1, c2, c3, c4]), margins
