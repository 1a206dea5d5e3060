"""Dual quaternion Jacobians of a frame, from its pose x (8,) and its geometric Jacobian J (6, n).

J is [linear; angular] in world axes at the frame's origin: m/s and rad/s per rad/s (revolute) or per m/s
(prismatic). All results map joint velocities to the derivative of the named quantity. The symbols are those
of paper V.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.dual_quaternion import (
    hamilton_minus_4,
    hamilton_minus_8,
    hamilton_plus_8,
    rotation,
    rotation_matrix,
    translation,
)


@compiled("float64[:,::1](float64, float64[:,::1], float64[:,::1])")
def _scaled_product(factor: float, H: Array, J: Array) -> Array:
    """factor H J; for these sizes loops beat a call of BLAS."""
    rows, inside = H.shape
    columns = J.shape[1]
    out = np.zeros((rows, columns))
    for i in range(rows):
        for k in range(inside):
            weight = factor * H[i, k]
            for j in range(columns):
                out[i, j] += weight * J[k, j]
    return out


@compiled("void(float64[::1], float64[:,::1], float64[:,::1])")
def fill_pose_jacobian(x: Array, J: Array, out: Array) -> None:
    """Fill out (8, n) with `pose_jacobian`.

    x = r + eps (1/2) t r, hence dr/dt = (1/2) w r and dd/dt = (1/2) (dt/dt) r + (1/2) t dr/dt.
    """
    a, b, c, d = x[0], x[1], x[2], x[3]
    # t = 2 d r*, the vector part of the product.
    tx = 2.0 * (a * x[5] - b * x[4] + c * x[7] - d * x[6])
    ty = 2.0 * (a * x[6] - c * x[4] + d * x[5] - b * x[7])
    tz = 2.0 * (a * x[7] - d * x[4] + b * x[6] - c * x[5])
    for j in range(J.shape[1]):
        vx, vy, vz = 0.5 * J[0, j], 0.5 * J[1, j], 0.5 * J[2, j]
        wx, wy, wz = 0.5 * J[3, j], 0.5 * J[4, j], 0.5 * J[5, j]
        rw = -wx * b - wy * c - wz * d
        rx = wx * a + wy * d - wz * c
        ry = wy * a + wz * b - wx * d
        rz = wz * a + wx * c - wy * b
        out[0, j] = rw
        out[1, j] = rx
        out[2, j] = ry
        out[3, j] = rz
        out[4, j] = -vx * b - vy * c - vz * d - 0.5 * (tx * rx + ty * ry + tz * rz)
        out[5, j] = vx * a + vy * d - vz * c + 0.5 * (tx * rw + ty * rz - tz * ry)
        out[6, j] = vy * a + vz * b - vx * d + 0.5 * (ty * rw + tz * rx - tx * rz)
        out[7, j] = vz * a + vx * c - vy * b + 0.5 * (tz * rw + tx * ry - ty * rx)


@compiled("float64[:,::1](float64[::1], float64[:,::1])")
def pose_jacobian(x: Array, J: Array) -> Array:
    """Jacobian J_x of a pose, (8, n): vec8(dx/dt) = J_x dq/dt."""
    out = np.empty((8, J.shape[1]))
    fill_pose_jacobian(x, J, out)
    return out


@compiled("float64[:,::1](float64[:,::1])")
def translation_jacobian(J: Array) -> Array:
    """Jacobian J_t of a translation, (4, n): vec4(dt/dt) = J_t dq/dt, paper V (4); its first row is zero."""
    n = J.shape[1]
    out = np.zeros((4, n))
    for i in range(3):
        for j in range(n):
            out[i + 1, j] = J[i, j]
    return out


@compiled("float64[:,::1](float64[::1], float64[:,::1])")
def rotation_jacobian(x: Array, J: Array) -> Array:
    """Jacobian J_r of a rotation, (4, n): vec4(dr/dt) = J_r dq/dt with dr/dt = (1/2) w r, paper V (5)."""
    n = J.shape[1]
    angular = np.zeros((4, n))
    for i in range(3):
        for j in range(n):
            angular[i + 1, j] = J[i + 3, j]
    return _scaled_product(0.5, hamilton_minus_4(rotation(x)), angular)


@compiled("float64[:,::1](float64[::1], float64[:,::1])")
def line_jacobian(x: Array, J: Array) -> Array:
    """Jacobian J_lz of the line along a frame's z axis, (8, n), paper V (17)-(20).

    l = R e_z and m = t x l, so dl/dt = w x l and dm/dt = dt/dt x l + t x dl/dt. Erratum: the braces of (19),
    and of the equation after it, must include J_r and J_t.
    """
    t, R = translation(x), rotation_matrix(x)
    n = J.shape[1]
    out = np.zeros((8, n))
    for j in range(n):
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            out[i + 1, j] = J[k + 3, j] * R[m, 2] - J[m + 3, j] * R[k, 2]
            out[i + 5, j] = J[k, j] * R[m, 2] - J[m, j] * R[k, 2]
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            out[i + 5, j] += t[k] * out[m + 1, j] - t[m] * out[k + 1, j]
    return out


@compiled("float64[:,::1](float64[::1], float64[:,::1])")
def plane_jacobian(x: Array, J: Array) -> Array:
    """Jacobian of the plane n + eps d through a frame's origin with the frame's z axis as normal, (8, n).

    n = R e_z and d = <t, n>, so dn/dt = w x n and dd/dt = <dt/dt, n> + <t, dn/dt>. The paper has the static
    plane only.
    """
    t, R = translation(x), rotation_matrix(x)
    n = J.shape[1]
    out = np.zeros((8, n))
    for j in range(n):
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            out[i + 1, j] = J[k + 3, j] * R[m, 2] - J[m + 3, j] * R[k, 2]
            out[4, j] += J[i, j] * R[i, 2] + t[i] * out[i + 1, j]
    return out


@compiled("float64[:,::1](float64[:,::1], float64[::1])")
def inner_product_jacobian(J_line: Array, line: Array) -> Array:
    """Jacobian J_<lz,l> of the inner product of a moving line and a static line (8,), (8, n), paper V (26).

    J_line (8, n) is the moving line's. Rows 0 to 3 are J_P<lz,l>, rows 4 to 7 J_D<lz,l>. Errata: the minus
    before the brace belongs to J_<lz,l>, and so does J_lz, which is printed J_l.
    """
    sum_of_operators = hamilton_plus_8(line)
    minus = hamilton_minus_8(line)
    for i in range(8):
        for j in range(8):
            sum_of_operators[i, j] += minus[i, j]
    return _scaled_product(-0.5, sum_of_operators, J_line)


@compiled("float64[:,::1](float64[:,::1], float64[::1])")
def cross_product_jacobian(J_line: Array, line: Array) -> Array:
    """Jacobian J_lz x l of the cross product of a moving line with a static line (8,), (8, n), paper V (28).

    J_line (8, n) is the moving line's. Rows 0 to 3 are J_P(lz x l), rows 4 to 7 J_D(lz x l). Erratum: the
    brace must include J_lz, which is printed J_l.
    """
    difference = hamilton_minus_8(line)
    plus = hamilton_plus_8(line)
    for i in range(8):
        for j in range(8):
            difference[i, j] -= plus[i, j]
    return _scaled_product(0.5, difference, J_line)
