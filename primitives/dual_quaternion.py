"""Dual quaternion algebra on (8,) float64 arrays: [w x y z of the primary part, w x y z of the dual part].

A pose is x = r + eps (1/2) t r: r (unit) rotates from the frame to the world, t is the frame's origin in
metres. A line is l + eps m with the moment m = p x l, a plane n + eps d (paper V, section III and (1)).
Compiled functions trust their arguments and allocate their result; values from outside come in through
`primitives.conversions`, which checks them.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.vectors import dot

_TINY = 1e-150
"""Below this length the square underflows and a vector has no direction left."""

_NEAR_MINUS_ONE = 1e-8
"""Nearer to -1 than this, a logarithm's moment keeps fewer digits than leaving out the rotation costs."""


@compiled("void(float64[::1], int64, float64[::1], int64, float64[::1], int64)")
def _add_product(out: Array, k: int, a: Array, i: int, b: Array, j: int) -> None:
    """Add the quaternion product a[i:i+4] b[j:j+4] to out[k:k+4]."""
    out[k] += a[i] * b[j] - a[i + 1] * b[j + 1] - a[i + 2] * b[j + 2] - a[i + 3] * b[j + 3]
    out[k + 1] += a[i] * b[j + 1] + a[i + 1] * b[j] + a[i + 2] * b[j + 3] - a[i + 3] * b[j + 2]
    out[k + 2] += a[i] * b[j + 2] + a[i + 2] * b[j] + a[i + 3] * b[j + 1] - a[i + 1] * b[j + 3]
    out[k + 3] += a[i] * b[j + 3] + a[i + 3] * b[j] + a[i + 1] * b[j + 2] - a[i + 2] * b[j + 1]


@compiled("void(float64[:,::1], int64, int64, float64[::1], int64, float64)")
def _put_hamilton(out: Array, row: int, column: int, h: Array, i: int, side: float) -> None:
    """Write the Hamilton operator of h[i:i+4] as a 4 x 4 block; side is +1 for H+ and -1 for H-."""
    w, x, y, z = h[i], h[i + 1], h[i + 2], h[i + 3]
    for k in range(4):
        out[row + k, column + k] = w
        out[row, column + k] = -h[i + k] if k else w
        out[row + k, column] = h[i + k]
    out[row + 1, column + 2], out[row + 2, column + 1] = -side * z, side * z
    out[row + 1, column + 3], out[row + 3, column + 1] = side * y, -side * y
    out[row + 2, column + 3], out[row + 3, column + 2] = -side * x, side * x


@compiled("float64[::1](float64[::1], float64[::1])")
def quaternion_product(a: Array, b: Array) -> Array:
    """Product a b of two quaternions, (4,)."""
    out = np.zeros(4)
    _add_product(out, 0, a, 0, b, 0)
    return out


@compiled("float64[::1](float64[::1], float64[::1])")
def product(a: Array, b: Array) -> Array:
    """Product a b of two dual quaternions, (8,)."""
    out = np.zeros(8)
    _add_product(out, 0, a, 0, b, 0)
    _add_product(out, 4, a, 0, b, 4)
    _add_product(out, 4, a, 4, b, 0)
    return out


@compiled("float64[::1](float64[::1])")
def conjugate(a: Array) -> Array:
    """Conjugate a* = Re(a) - Im(a), (8,); the inverse of a pose."""
    out = np.empty(8)
    for i in range(8):
        out[i] = -a[i]
    out[0], out[4] = a[0], a[4]
    return out


@compiled("float64[::1](float64[::1])")
def norm(a: Array) -> Array:
    """Norm of a dual quaternion, sqrt(a a*), as the dual number [primary, dual], (2,).

    Where the primary part is zero, so is a a*, and both numbers are 0.
    """
    out = np.zeros(2)
    out[0] = np.sqrt(a[0] * a[0] + dot(a, 1, a, 1))
    if out[0] > 0.0:
        out[1] = (a[0] * a[4] + dot(a, 1, a, 5)) / out[0]
    return out


@compiled("float64[::1](float64[::1])")
def normalized(a: Array) -> Array:
    """a divided by its norm, (8,): its primary part gets length 1 and its dual part becomes orthogonal to it.

    The primary part must not be zero: not finite otherwise.
    """
    size = norm(a)
    out = np.empty(8)
    for i in range(4):
        out[i] = a[i] / size[0]
        out[i + 4] = (a[i + 4] - out[i] * size[1]) / size[0]
    return out


@compiled("float64[::1](float64[::1], float64[::1])")
def inner(a: Array, b: Array) -> Array:
    """Inner product -(a b + b a)/2 of two pure dual quaternions, (8,), paper V (2).

    Only [0] and [4] differ from zero. For two lines they are cos(phi) and -d sin(phi), (25).
    """
    ab, ba = product(a, b), product(b, a)
    for i in range(8):
        ab[i] = -0.5 * (ab[i] + ba[i])
    return ab


@compiled("float64[::1](float64[::1], float64[::1])")
def cross(a: Array, b: Array) -> Array:
    """Cross product (a b - b a)/2 of two pure dual quaternions, (8,), paper V (2)."""
    ab, ba = product(a, b), product(b, a)
    for i in range(8):
        ab[i] = 0.5 * (ab[i] - ba[i])
    return ab


@compiled("float64[:,::1](float64[::1])")
def hamilton_plus_4(h: Array) -> Array:
    """Hamilton operator H+ of a quaternion, (4, 4): vec4(h a) = H+(h) vec4(a)."""
    out = np.empty((4, 4))
    _put_hamilton(out, 0, 0, h, 0, 1.0)
    return out


@compiled("float64[:,::1](float64[::1])")
def hamilton_minus_4(h: Array) -> Array:
    """Hamilton operator H- of a quaternion, (4, 4): vec4(a h) = H-(h) vec4(a)."""
    out = np.empty((4, 4))
    _put_hamilton(out, 0, 0, h, 0, -1.0)
    return out


@compiled("float64[:,::1](float64[::1], float64)")
def _hamilton_8(h: Array, side: float) -> Array:
    out = np.zeros((8, 8))
    _put_hamilton(out, 0, 0, h, 0, side)
    _put_hamilton(out, 4, 4, h, 0, side)
    _put_hamilton(out, 4, 0, h, 4, side)
    return out


@compiled("float64[:,::1](float64[::1])")
def hamilton_plus_8(h: Array) -> Array:
    """Hamilton operator H+ of a dual quaternion, (8, 8): vec8(h a) = H+(h) vec8(a)."""
    return _hamilton_8(h, 1.0)


@compiled("float64[:,::1](float64[::1])")
def hamilton_minus_8(h: Array) -> Array:
    """Hamilton operator H- of a dual quaternion, (8, 8): vec8(a h) = H-(h) vec8(a)."""
    return _hamilton_8(h, -1.0)


@compiled("float64[::1](float64[::1], float64[::1])")
def from_rotation_translation(r: Array, t: Array) -> Array:
    """Pose r + eps (1/2) t r, (8,), of a unit quaternion r (4,) and a translation t (3,) in metres."""
    out, half = np.zeros(8), np.zeros(4)
    for i in range(4):
        out[i] = r[i]
    for i in range(3):
        half[i + 1] = 0.5 * t[i]
    _add_product(out, 4, half, 0, r, 0)
    return out


@compiled("float64[::1](float64[::1])")
def rotation(x: Array) -> Array:
    """Rotation r of a pose, a unit quaternion (4,), frame to world."""
    out = np.empty(4)
    for i in range(4):
        out[i] = x[i]
    return out


@compiled("float64[::1](float64[::1])")
def translation(x: Array) -> Array:
    """Translation t = 2 D(x) P(x)* of a pose, (3,), in metres: the frame's origin in the world."""
    doubled = np.zeros(4)
    _add_product(doubled, 0, x, 4, conjugate(x), 0)
    out = np.empty(3)
    for i in range(3):
        out[i] = 2.0 * doubled[i + 1]
    return out


@compiled("float64[:,::1](float64[::1])")
def rotation_matrix(x: Array) -> Array:
    """Rotation matrix R of a pose, (3, 3); its columns are the frame's axes in the world."""
    w, i, j, k = x[0], x[1], x[2], x[3]
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = 0.5 - (j * j + k * k), i * j - w * k, i * k + w * j
    R[1, 0], R[1, 1], R[1, 2] = i * j + w * k, 0.5 - (i * i + k * k), j * k - w * i
    R[2, 0], R[2, 1], R[2, 2] = i * k - w * j, j * k + w * i, 0.5 - (i * i + j * j)
    for row in range(3):
        for column in range(3):
            R[row, column] *= 2.0
    return R


@compiled("void(float64[:,::1], int64, float64[::1])")
def from_pose(pose: Array, row: int, out: Array) -> None:
    """Unit dual quaternion (8,), w >= 0, of pose[row] (12,): a rotation matrix row by row and a translation in metres.

    Every row of 4 r r^T is r up to a factor. Shepperd's choice is the row with the largest diagonal, which keeps all
    digits at every angle, pi included. The dual part is (1/2) t r.
    """
    trace = pose[row, 0] + pose[row, 4] + pose[row, 8]
    best, largest = 0, 1.0 + trace
    for i in range(3):
        diagonal = 1.0 + 2.0 * pose[row, 4 * i] - trace
        if diagonal > largest:
            best, largest = i + 1, diagonal
    out[best] = largest
    if best == 0:
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            out[i + 1] = pose[row, 3 * k + j] - pose[row, 3 * j + k]
    else:
        i = best - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        out[0] = pose[row, 3 * k + j] - pose[row, 3 * j + k]
        out[j + 1] = pose[row, 3 * i + j] + pose[row, 3 * j + i]
        out[k + 1] = pose[row, 3 * i + k] + pose[row, 3 * k + i]
    length = np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3])
    scale = np.copysign(1.0 / length, out[0])
    a, b, c, d = out[0] * scale, out[1] * scale, out[2] * scale, out[3] * scale
    x, y, z = 0.5 * pose[row, 9], 0.5 * pose[row, 10], 0.5 * pose[row, 11]
    out[0], out[1], out[2], out[3] = a, b, c, d
    out[4] = -x * b - y * c - z * d
    out[5] = x * a + y * d - z * c
    out[6] = y * a + z * b - x * d
    out[7] = z * a + x * c - y * b


@compiled("float64[::1](float64[:,::1], float64[::1])")
def from_matrix(R: Array, t: Array) -> Array:
    """Pose, (8,), of a rotation matrix R (3, 3) and a translation t (3,) in metres; see `from_pose`."""
    pose, out = np.empty((1, 12)), np.empty(8)
    for i in range(3):
        pose[0, 9 + i] = t[i]
        for j in range(3):
            pose[0, 3 * i + j] = R[i, j]
    from_pose(pose, 0, out)
    return out


@compiled("float64[::1](float64[::1])")
def logarithm(x: Array) -> Array:
    """Logarithm of a pose: the pure dual quaternion v, (8,), with exponential(v) = x, the sign of x included.

    v = (phi/2) l + eps (1/2)(d l + phi m) for a turn by phi (rad) about, and a shift by d (m) along, the
    screw axis l + eps m. phi is in [0, 2 pi], above pi where w < 0. This is the logarithm of the group, so v
    is half the world twist [w, v] that leads to x in one unit of time. It is not the one of DQ Robotics,
    whose dual part is t/2.

    Accurate at identity and at phi = pi. Toward phi = 2 pi (x near -1) a shift across the axis is a turn
    about an axis far away, the moment grows like t / sin(phi/2) and loses as many digits: choose the sign
    with w >= 0 first where only the pose counts. Within 1e-8 of -1 the axis is taken along the shift (along x
    where there is none).
    """
    w, s = x[0], np.sqrt(dot(x, 1, x, 1))
    out = np.zeros(8)
    if w < 0.0 and s < _NEAR_MINUS_ONE:
        shift = np.sqrt(dot(x, 5, x, 5))
        out[1] = np.pi
        for i in range(1, 4):
            out[i + 4] = -x[i + 4]
            if shift > _TINY:
                out[i] = -np.pi * x[i + 4] / shift
        return out
    a, inverse = 1.0, 0.0
    if s > _TINY:
        a, inverse = np.arctan2(s, w) / s, 1.0 / s
    along = dot(x, 1, x, 5) * inverse * inverse
    for i in range(1, 4):
        out[i] = a * x[i]
        out[i + 4] = a * x[i + 4] + ((w - a) * along - x[4]) * x[i]
    return out


@compiled("float64[::1](float64[::1])")
def exponential(v: Array) -> Array:
    """Exponential of a pure dual quaternion, (8,): the pose that the world twist 2 v reaches in unit time."""
    phi = np.sqrt(dot(v, 1, v, 1))
    c, s, inverse = np.cos(phi), 1.0, 0.0
    if phi > _TINY:
        s, inverse = np.sin(phi) / phi, 1.0 / phi
    along = dot(v, 1, v, 5) * inverse
    out = np.empty(8)
    out[0], out[4] = c, -s * along * phi
    for i in range(1, 4):
        out[i] = s * v[i]
        out[i + 4] = s * v[i + 4] + (c - s) * along * inverse * v[i]
    return out


@compiled("float64[::1](float64[::1], float64)")
def power(x: Array, tau: float) -> Array:
    """Power x^tau = exponential(tau logarithm(x)) of a pose, (8,); it goes the long way round where w < 0."""
    v = logarithm(x)
    for i in range(8):
        v[i] *= tau
    return exponential(v)


@compiled("float64[::1](float64[::1], float64[::1], float64)")
def sclerp(x0: Array, x1: Array, tau: float) -> Array:
    """Screw linear interpolation (ScLERP) x0 (x0* x1)^tau between two poses, (8,), the short way.

    One screw motion of constant speed from x0 at tau = 0 to x1 at tau = 1. The sign of x0* x1 is chosen with
    w >= 0, so the turn is at most pi and the end is x1 or -x1, whichever continues x0. At exactly pi both
    ways are short and the sign that was given decides.
    """
    between = product(conjugate(x0), x1)
    if between[0] < 0.0:
        for i in range(8):
            between[i] = -between[i]
    return product(x0, power(between, tau))


@compiled("float64(float64[::1], float64[::1])")
def sign_towards(x_d: Array, x: Array) -> float:
    """1 or -1: the sign that `nearest_sign` gives x_d."""
    total = 0.0
    for i in range(8):
        total += x[i] * x_d[i]
    return 1.0 if total >= 0.0 else -1.0


@compiled("float64[::1](float64[::1], float64[::1])")
def nearest_sign(x_d: Array, x: Array) -> Array:
    """x_d or -x_d, (8,), whichever has <x, x_d> >= 0; x_d when it is 0.

    The inner product is that of all eight numbers, so of the two signs this is the one with the smaller vec8
    error x - x_d. It can differ from the sign of the rotations alone where these are nearly half a turn apart
    or translations are metres long.
    """
    sign, out = sign_towards(x_d, x), np.empty(8)
    for i in range(8):
        out[i] = sign * x_d[i]
    return out
