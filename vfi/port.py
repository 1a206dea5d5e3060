"""Entry ports kept in other ways than by the row of an entry sphere: as an equality, or as far as all rows allow.

All are the same declared constraint, a shaft line that stays within a distance of a point. Paper V, C2 makes it a row;
here x_c (2,), the offset of the shaft from the port (paper A, (1)), follows A v = -eta x_c (7): always (two rows that
are eliminated from the program, `vfi.basis`), or as a term weight |A v + eta x_c|^2 of the cost.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.evaluate import to_world
from primitives.intrinsics import scratch
from primitives.memory import MEMORY, cube, integer_matrix, integers, matrix, vector
from primitives.rcm import constraint_jacobian, port_error
from vfi.memory import Real, Whole
from vfi.outcome import Form


@compiled(f"void({MEMORY}, int64, float64[:,::1])")
def fill_port(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, i: int, A_x: Array) -> None:
    """PORT and PORT_ERROR of constraint i: A for all joints, and x_c with what other motions do to it, per second.

    PORT_ERROR holds eta x_c + (rate of x_c by the given joint velocities and by the port's own motion).
    """
    frame, pose = integer_matrix(w, wl, Whole.FRAME), matrix(f, fl, Real.POSE)
    jacobian, twist, given = cube(f, fl, Real.JACOBIAN), matrix(f, fl, Real.TWIST), vector(f, fl, Real.GIVEN)
    A, error, eta = matrix(f, fl, Real.PORT), vector(f, fl, Real.PORT_ERROR), vector(f, fl, Real.ETA)[i]
    shaft, at, world = frame[i, 0], frame[i, 1], scratch(8)
    to_world(pose, at, matrix(f, fl, Real.GEOMETRY), 2 * i + 1, world)
    port, x_c = world[:3], error[2 * i : 2 * i + 2]
    port_error(pose[shaft], port, x_c)
    constraint_jacobian(pose[shaft], port, A_x)
    J, t = jacobian[shaft], twist[at]
    a, b, c = port[0] - pose[at, 9], port[1] - pose[at, 10], port[2] - pose[at, 11]
    u, v, s = t[0] + t[4] * c - t[5] * b, t[1] + t[5] * a - t[3] * c, t[2] + t[3] * b - t[4] * a
    for k in range(2):
        x_c[k] = eta * x_c[k] - A_x[k, 0] * u - A_x[k, 1] * v - A_x[k, 2] * s
        for j in range(given.shape[0]):
            value = 0.0
            for r in range(6):
                value += A_x[k, r] * J[r, j]
            A[2 * i + k, j] = value
            x_c[k] += value * given[j]


@compiled(f"void({MEMORY})")
def fill_ports(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """The ports' equalities E v = e, and the soft ones' share of the cost; their own rows become void."""
    form, A_x, decided = integers(w, wl, Whole.FORM), np.empty((2, 6)), integers(w, wl, Whole.DECIDED)
    A, error = matrix(f, fl, Real.PORT), vector(f, fl, Real.PORT_ERROR)
    E, e = matrix(f, fl, Real.EQUALITY), vector(f, fl, Real.EQUALITY_RATE)
    H, g, weight = matrix(f, fl, Real.H), vector(f, fl, Real.G), vector(f, fl, Real.PORT_WEIGHT)
    demand, rate, force = vector(f, fl, Real.DEMAND), vector(f, fl, Real.RATE), vector(f, fl, Real.FORCE)
    safe, filled = vector(f, fl, Real.SAFE), 0
    for i in range(form.shape[0]):
        if form[i] == Form.ROWS or force[i] == 0.0:
            continue
        fill_port(f, fl, w, wl, i, A_x)
        demand[i] = -np.inf
        if form[i] == Form.SOFT or safe[i] == 0.0:
            rate[i] = -np.inf
        for k in range(2):
            row = A[2 * i + k]
            if form[i] == Form.EQUALITY:
                e[filled] = -error[2 * i + k]
                for j in range(decided.shape[0]):
                    E[filled, j] = row[decided[j]]
                filled += 1
                continue
            for j in range(decided.shape[0]):
                scaled = force[i] * weight[i] * row[decided[j]]
                g[j] += scaled * error[2 * i + k]
                for n in range(decided.shape[0]):
                    H[j, n] += scaled * row[decided[n]]
