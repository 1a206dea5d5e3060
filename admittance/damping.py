"""Variable damping of the free motions (paper A, (43)-(45))."""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled


@compiled("void(float64[:,::1], float64, float64[::1], float64[::1], float64[::1])")
def fill_damping(gains: Array, redundant: float, v: Array, F_rx: Array, D: Array) -> None:
    """Diagonal of D_f (m,) at a free velocity v (m,) and a repulsion F_rx (m,), of which the first four count.

    D_c + Q exp(-M s) + G (1 - exp(-C z^2)) with the rows of gains (5, 4) in that order; s is the speed along the shaft
    and the angular speed about the port (44). Erratum to (45): F_rx = Z_x F_r, as the printed transpose has the wrong
    size; z is the force along the shaft, N, and the norm of the torque about the port, Nm.
    """
    turning = v[1] * v[1] + v[2] * v[2] + v[3] * v[3]
    torque = F_rx[1] * F_rx[1] + F_rx[2] * F_rx[2] + F_rx[3] * F_rx[3]
    for i in range(4):
        speed = np.sqrt(turning) if i else abs(v[0])
        square = torque if i else F_rx[0] * F_rx[0]
        slow = gains[1, i] * np.exp(-gains[2, i] * speed)
        D[i] = gains[0, i] + slow + gains[3, i] * (1.0 - np.exp(-gains[4, i] * square))
    for i in range(4, D.shape[0]):
        D[i] = redundant
