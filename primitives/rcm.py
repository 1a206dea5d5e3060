"""The remote center of motion: how far a shaft is from the entry port, and how that changes (paper A, (1)-(7)).

The shaft is the z axis of a frame, its *shaft frame*; the port is a point p_c of the world. With the frame's rotation
R_t = [a_t o_t n_t] and origin p_t, x_c is the part of p_t - p_c across the shaft. Both methods use it: as the
constraint of the target admittance, and as a row of the program.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array
from primitives.compiled import compiled
from primitives.kinematics import Kinematics


class RCM(NamedTuple):
    """The port as seen from a shaft frame.

    Attributes
    ----------
    x_c : (2,) metres, along a_t and o_t; zero where the shaft runs through the port (1).
    A_x : (2, 6) x_c's rate per twist [linear; angular] of the frame's origin, world axes (4); always of rank 2.
    A : (2, n) x_c's rate per joint velocity (7).
    """

    x_c: Array
    A_x: Array
    A: Array


@compiled("void(float64[::1], float64[::1], float64[::1])")
def port_error(pose: Array, port: Array, x_c: Array) -> None:
    """x_c = B_c^T (p_t - p_c) (1), metres, from a pose (12,) and the port (3,)."""
    a, b, c = pose[9] - port[0], pose[10] - port[1], pose[11] - port[2]
    x_c[0] = pose[0] * a + pose[3] * b + pose[6] * c
    x_c[1] = pose[1] * a + pose[4] * b + pose[7] * c


@compiled("void(float64[::1], float64[::1], float64[:,::1])")
def constraint_jacobian(pose: Array, port: Array, A_x: Array) -> None:
    """A_x = B_c^T [I (p_t - p_c)^] (4), (2, 6), from a pose (12,) and the port (3,)."""
    a, b, c = pose[9] - port[0], pose[10] - port[1], pose[11] - port[2]
    for i in range(2):
        x, y, z = pose[i], pose[3 + i], pose[6 + i]
        A_x[i, 0] = x
        A_x[i, 1] = y
        A_x[i, 2] = z
        A_x[i, 3] = y * c - z * b
        A_x[i, 4] = z * a - x * c
        A_x[i, 5] = x * b - y * a


@compiled("void(float64[::1], float64[::1], float64[::1], float64[:,::1])")
def constraint_jacobian_rate(pose: Array, twist: Array, port: Array, rate: Array) -> None:
    """dA_x/dt (2, 6) of a frame that moves with a twist (6,) of its origin.

    dB_c/dt = w x B_c (paper A, between (2) and (3)), so dA_x/dt = (w x B_c)^T [I (p_t - p_c)^] + B_c^T [0 dp_t/dt ^].
    """
    a, b, c = pose[9] - port[0], pose[10] - port[1], pose[11] - port[2]
    u, v, w, p, q, r = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    for i in range(2):
        x, y, z = pose[i], pose[3 + i], pose[6 + i]
        dx, dy, dz = q * z - r * y, r * x - p * z, p * y - q * x
        rate[i, 0] = dx
        rate[i, 1] = dy
        rate[i, 2] = dz
        rate[i, 3] = dy * c - dz * b + y * w - z * v
        rate[i, 4] = dz * a - dx * c + z * u - x * w
        rate[i, 5] = dx * b - dy * a + x * v - y * u


def rcm(kinematics: Kinematics, frame: str, port: ArrayLike) -> RCM:
    """Where a shaft frame stands with respect to a port.

    Parameters
    ----------
    kinematics : of the robot, at any configuration.
    frame : whose z axis is the shaft.
    port : (3,) p_c in the world, metres.

    Raises
    ------
    InputError : port not three finite numbers.
    UnknownNameError : no such frame.
    """
    pose, center = kinematics.poses[kinematics.place(frame)], array(port, (3,), "port")
    x_c, A_x = np.empty(2), np.empty((2, 6))
    port_error(pose, center, x_c)
    constraint_jacobian(pose, center, A_x)
    return RCM(x_c, A_x, A_x @ kinematics.jacobian(frame))
