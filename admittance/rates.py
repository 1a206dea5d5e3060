"""Rates of change of J_t, A, Z and Z^+T along a joint velocity, in closed form.

Paper A takes the rate of A from backward differences; these are exact, and need nothing of the last cycle. For the
transported G (see `nullspace`) d G/dt = -G (d J_t/dt)^T (J_t J_t^T)^-1 J_t.
"""

from admittance.dense import substitute, substitute_columns
from primitives.checks import Array
from primitives.compiled import compiled


@compiled("void(float64[:,::1], float64[::1], float64[:,::1])")
def jacobian_rate(J: Array, qdot: Array, rate: Array) -> None:
    """d J/dt (6, d) of a frame's Jacobian, columns in the order of the joints from the base on, along qdot (d,).

    A joint's axis and the arm from it to the frame turn with all joints before it; the arm's far end also moves with
    those behind it. For column i: w_i x [J_v; J_w] with w_i the angular velocity of joint i's own link, plus for J_v
    the axis (J_w, zero for a slide) crossed with the origin's velocity due to the joints behind i.
    """
    x, y, z = 0.0, 0.0, 0.0
    a, b, c = 0.0, 0.0, 0.0
    for i in range(qdot.shape[0]):
        a += J[0, i] * qdot[i]
        b += J[1, i] * qdot[i]
        c += J[2, i] * qdot[i]
    for i in range(qdot.shape[0]):
        x += J[3, i] * qdot[i]
        y += J[4, i] * qdot[i]
        z += J[5, i] * qdot[i]
        a -= J[0, i] * qdot[i]
        b -= J[1, i] * qdot[i]
        c -= J[2, i] * qdot[i]
        for r in range(0, 6, 3):
            u, v, w = J[r, i], J[r + 1, i], J[r + 2, i]
            rate[r, i] = y * w - z * v
            rate[r + 1, i] = z * u - x * w
            rate[r + 2, i] = x * v - y * u
        u, v, w = J[3, i], J[4, i], J[5, i]
        rate[0, i] += v * c - w * b
        rate[1, i] += w * a - u * c
        rate[2, i] += u * b - v * a


@compiled(
    "void(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1],"
    "float64[::1], float64[::1], float64[:,::1], float64[:,::1])"
)
def free_rate(
    J: Array,
    J_rate: Array,
    factor: Array,
    P: Array,
    Z_x: Array,
    G: Array,
    pose: Array,
    twist: Array,
    P_rate: Array,
    Z_rate: Array,
) -> None:
    """d Z/dt (d - 2, d) for a shaft frame that moves with a twist (6,) of its origin.

    d Z_x/dt P + Z_x dP/dt, over dG/dt, with dP/dt = (J J^T)^-1 [dJ/dt - (dJ/dt J^T + J dJ/dt^T) P]. factor is the
    Cholesky factor of J J^T; P_rate (6, d) is filled.
    """
    d = J.shape[1]
    P_rate[:, :] = J_rate
    for i in range(6):
        for j in range(6):
            both = 0.0
            for k in range(d):
                both += J_rate[i, k] * J[j, k] + J[i, k] * J_rate[j, k]
            for k in range(d):
                P_rate[i, k] -= both * P[j, k]
    substitute_columns(factor, P_rate)
    a, b, c = twist[0], twist[1], twist[2]
    x, y, z = pose[2], pose[5], pose[8]
    dx, dy, dz = twist[4] * z - twist[5] * y, twist[5] * x - twist[3] * z, twist[3] * y - twist[4] * x
    for k in range(d):
        Z_rate[0, k] = dx * P[0, k] + dy * P[1, k] + dz * P[2, k]
        Z_rate[1, k] = b * P[2, k] - c * P[1, k]
        Z_rate[2, k] = c * P[0, k] - a * P[2, k]
        Z_rate[3, k] = a * P[1, k] - b * P[0, k]
        for i in range(4):
            for j in range(6):
                Z_rate[i, k] += Z_x[i, j] * P_rate[j, k]
    for i in range(G.shape[0]):
        Z_rate[4 + i, :] = 0.0
        for j in range(6):
            along = 0.0
            for k in range(d):
                along += G[i, k] * J_rate[j, k]
            for k in range(d):
                Z_rate[4 + i, k] -= along * P[j, k]


@compiled(
    "void(float64[:,::1], float64[:,::1], float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1])"
)
def free_velocity_rate(Z: Array, Z_rate: Array, W: Array, factor: Array, qdot: Array, v: Array, out: Array) -> None:
    """out = d(Z^+T)/dt qdot (d - 2,), the second term of u in (23).

    d(Z^+T)/dt = (Z W Z^T)^-1 [dZ/dt W - (dZ/dt W Z^T + Z W dZ/dt^T) Z^+T]; v = Z^+T qdot, and factor is the Cholesky
    factor of Z W Z^T.
    """
    m, d = Z.shape
    for i in range(m):
        value = 0.0
        for k in range(d):
            value += Z_rate[i, k] * W[k] * qdot[k]
        for j in range(m):
            both = 0.0
            for k in range(d):
                both += W[k] * (Z_rate[i, k] * Z[j, k] + Z[i, k] * Z_rate[j, k])
            value -= both * v[j]
        out[i] = value
    substitute(factor, out)
