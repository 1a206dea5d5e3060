"""Bases of the motions that leave the port alone, and the map between them and joint velocities (paper A, (15)-(21)).

The free-motion velocity is xdot_f = [speed along the shaft (m/s); angular velocity about the port (rad/s), world axes;
d - 6 coordinates of motions that leave the shaft alone]. qdot = A^+ xdot_c + Z^T xdot_f (19).

Paper A leaves G, a basis of the null space of J_t, open. Here its rows are orthonormal in joint space, and from one
configuration to the next they are *transported*: the last rows are projected onto the new null space and made
orthonormal again. So they are continuous along every motion, d G/dt lies in the row space of J_t, and where the null
space stands still (joints beyond the shaft) so does G. The first G is the projection of the joint axes onto the null
space, those that lie in it most first: for the 8-dof arm [0 I_2].

Conditions are those of J_t in SI units: rows in m/s and rad/s, columns as the joints are, no length scales a rotation.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from admittance.dense import cholesky, eigen, inner, multiply, substitute_columns
from primitives.checks import Array, array
from primitives.compiled import compiled
from primitives.errors import InputError
from primitives.kinematics import Kinematics
from primitives.rcm import constraint_jacobian

LARGEST_CONDITION = 1e5
"""Condition of J_t (SI units) up to which the identities hold to 1e-10; beyond it is refused. A controller's own limit
is far lower."""


@compiled("void(float64[::1], float64[::1], float64[:,::1])")
def free_basis(pose: Array, port: Array, Z_x: Array) -> None:
    """Z_x = [n_t^T 0; (p_t - p_c)^ I] (15), (4, 6), from a pose (12,) and the port (3,)."""
    a, b, c = pose[9] - port[0], pose[10] - port[1], pose[11] - port[2]
    Z_x[:, :] = 0.0
    for i in range(3):
        Z_x[0, i] = pose[3 * i + 2]
        Z_x[1 + i, 3 + i] = 1.0
    Z_x[1, 1], Z_x[1, 2] = -c, b
    Z_x[2, 0], Z_x[2, 2] = c, -a
    Z_x[3, 0], Z_x[3, 1] = -b, a


@compiled("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1])")
def range_inverse(J: Array, gram: Array, factor: Array, residual: Array, P: Array) -> int:
    """P = (J_t J_t^T)^-1 J_t (6, d), gram = J_t J_t^T and its Cholesky factor; returns 0 where J_t loses rank.

    One Newton step on P J_t^T = I takes the error from the square of the condition to the condition itself;
    residual (6, 6) is its scratch.
    """
    d = J.shape[1]
    for i in range(6):
        for j in range(i + 1):
            value = 0.0
            for k in range(d):
                value += J[i, k] * J[j, k]
            gram[i, j] = value
            gram[j, i] = value
    if not cholesky(gram, factor):
        return 0
    P[:, :] = J
    substitute_columns(factor, P)
    for i in range(6):
        for j in range(6):
            value = 1.0 if i == j else 0.0
            for k in range(d):
                value -= P[i, k] * J[j, k]
            residual[i, j] = value
    for k in range(d):
        a, b, c, e, f, g = P[0, k], P[1, k], P[2, k], P[3, k], P[4, k], P[5, k]
        for i in range(6):
            row = residual[i]
            P[i, k] += row[0] * a + row[1] * b + row[2] * c + row[3] * e + row[4] * f + row[5] * g
    return 1


@compiled("void(float64[:,::1], float64[:,::1], float64[::1])")
def to_null_space(J: Array, P: Array, g: Array) -> None:
    """Remove from g (d,) what lies in the row space of J_t; twice, so that nothing of it remains but rounding."""
    for _ in range(2):
        for i in range(6):
            along = 0.0
            for k in range(g.shape[0]):
                along += J[i, k] * g[k]
            # P J^T = I: taking this row's part away changes the inner product with no other row of J.
            for k in range(g.shape[0]):
                g[k] -= along * P[i, k]


@compiled("float64(float64[:,::1], int64)")
def orthonormalise(G: Array, row: int) -> float:
    """Make one row of unit length and orthogonal to those before it; returns the length it had (no unit below 1e-3)."""
    for i in range(row):
        along = inner(G[i], G[row])
        for k in range(G.shape[1]):
            G[row, k] -= along * G[i, k]
    length = np.sqrt(inner(G[row], G[row]))
    if length > 1e-3:
        for k in range(G.shape[1]):
            G[row, k] /= length
    return float(length)


@compiled("void(float64[:,::1], float64[:,::1], float64[:,::1])")
def first_null_basis(J: Array, P: Array, G: Array) -> None:
    """Rows of G (d - 6, d): projections of the joint axes onto the null space of J_t, the longest remainder first."""
    d = J.shape[1]
    for row in range(G.shape[0]):
        best, longest = 0, -1.0
        for axis in range(d):
            remainder = 1.0
            for i in range(6):
                remainder -= J[i, axis] * P[i, axis]
            for i in range(row):
                remainder -= G[i, axis] * G[i, axis]
            if remainder > longest + 1e-9:
                best, longest = axis, remainder
        for k in range(d):
            G[row, k] = 1.0 if k == best else 0.0
        to_null_space(J, P, G[row])
        orthonormalise(G, row)


@compiled("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1])")
def transport(J: Array, P: Array, last: Array, G: Array) -> int:
    """G (d - 6, d) nearest to the last one, in the null space of J_t; 0 where that turned too far to be followed."""
    for row in range(G.shape[0]):
        for k in range(G.shape[1]):
            G[row, k] = last[row, k]
        to_null_space(J, P, G[row])
        if not orthonormalise(G, row) > 1e-3:
            return 0
    return 1


@compiled("void(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1])")
def stack(Z_x: Array, P: Array, G: Array, Z: Array) -> None:
    """Z = [Z_x (J_t J_t^T)^-1 J_t; G] (17), (d - 2, d)."""
    for k in range(P.shape[1]):
        for i in range(4):
            value = 0.0
            for j in range(6):
                value += Z_x[i, j] * P[j, k]
            Z[i, k] = value
        for i in range(G.shape[0]):
            Z[4 + i, k] = G[i, k]


@compiled("int64(float64[:,::1], float64[::1], float64[:,::1])")
def weighted_inverse(A: Array, W: Array, A_plus: Array) -> int:
    """A^+ = W^-1 A^T (A W^-1 A^T)^-1, (d, 2), of (18), with diagonal weights W (d,); 0 where A loses rank."""
    a, b, c = 0.0, 0.0, 0.0
    for k in range(W.shape[0]):
        a += A[0, k] * A[0, k] / W[k]
        b += A[0, k] * A[1, k] / W[k]
        c += A[1, k] * A[1, k] / W[k]
    determinant = a * c - b * b
    if not determinant > 1e-14 * a * c:
        return 0
    for k in range(W.shape[0]):
        A_plus[k, 0] = (c * A[0, k] - b * A[1, k]) / (determinant * W[k])
        A_plus[k, 1] = (a * A[1, k] - b * A[0, k]) / (determinant * W[k])
    return 1


@compiled("int64(float64[:,::1], float64[::1], float64[:,::1], float64[:,::1], float64[:,::1])")
def free_inverse(Z: Array, W: Array, work: Array, factor: Array, Z_plus_T: Array) -> int:
    """Z^+T = (Z W Z^T)^-1 Z W, (m, d), after (19), m = d - 2, and the Cholesky factor; 0 where Z loses rank.

    One Newton step on Z^+T Z^T = I, as for P; work (m, m) is scratch.
    """
    m, d = Z.shape
    for i in range(m):
        for j in range(i + 1):
            value = 0.0
            for k in range(d):
                value += Z[i, k] * W[k] * Z[j, k]
            work[i, j] = value
            work[j, i] = value
    if not cholesky(work, factor):
        return 0
    for i in range(m):
        for k in range(d):
            Z_plus_T[i, k] = Z[i, k] * W[k]
    substitute_columns(factor, Z_plus_T)
    for i in range(m):
        for j in range(m):
            value = 1.0 if i == j else 0.0
            for k in range(d):
                value -= Z_plus_T[i, k] * Z[j, k]
            work[i, j] = value
    # The residual's square is below rounding, so that the columns may be corrected in place, row by row.
    for k in range(d):
        for i in range(m):
            value = Z_plus_T[i, k]
            for j in range(m):
                value += work[i, j] * Z_plus_T[j, k]
            Z_plus_T[i, k] = value
    return 1


@compiled("Tuple((float64, float64, int64, int64))(float64[:,::1], float64[:,::1], float64[:,::1])")
def singular_values(gram: Array, work: Array, vectors: Array) -> tuple[float, float, int, int]:
    """Smallest and largest singular value of J_t from its gram matrix, and the columns of `vectors` they belong to."""
    work[:, :] = gram
    eigen(work, vectors)
    smallest, largest = 0, 0
    for i in range(1, work.shape[0]):
        if work[i, i] < work[smallest, smallest]:
            smallest = i
        if work[i, i] > work[largest, largest]:
            largest = i
    low, high = work[smallest, smallest], work[largest, largest]
    return np.sqrt(max(low, 0.0)), np.sqrt(max(high, 0.0)), smallest, largest


class FreeMotion(NamedTuple):
    """The free motions of a shaft at one configuration; d joints, m = d - 2.

    Attributes
    ----------
    Z_x : (4, 6) free twists of the shaft frame's origin (15). G : (d - 6, d). Z : (m, d) (17).
    A : (2, d) (7). A_plus : (d, 2). Z_plus : (d, m), after (19). condition : of J_t, SI units.
    """

    Z_x: Array
    G: Array
    Z: Array
    A: Array
    A_plus: Array
    Z_plus: Array
    condition: float

    @property
    def S(self) -> Array:
        """(d, d) [A^+ Z^T] (19): joint velocities from [xdot_c; xdot_f]."""
        return np.hstack([self.A_plus, self.Z.T])

    @property
    def S_inverse(self) -> Array:
        """(d, d) [A; Z^+T] (20), (21): [xdot_c; xdot_f] from joint velocities."""
        return np.vstack([self.A, self.Z_plus.T])


def free_motion(
    kinematics: Kinematics,
    frame: str,
    port: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    last: FreeMotion | None = None,
) -> FreeMotion:
    """The free motions of a shaft frame about a port.

    Parameters
    ----------
    kinematics : of the robot, all of whose joints take part.
    frame : shaft frame, whose z axis is the shaft.
    port : (3,) metres, world.
    weights : (d,) diagonal of W; default the identity.
    last : the free motions a moment before, so that G continues from there.

    Raises
    ------
    InputError : fewer than six joints, weights not positive, or J_t's condition (SI units) above 1e5.
    UnknownNameError : no such frame.
    """
    place = kinematics.place(frame)
    J, pose = np.ascontiguousarray(kinematics.jacobians[place]), kinematics.poses[place]
    d, center = J.shape[1], array(port, (3,), "port")
    W = np.ones(d) if weights is None else array(weights, (d,), "weights W")
    if d < 6 or not np.all(W > 0.0):
        raise InputError(f"free motions: expected at least 6 joints and weights > 0, got {d} joints, weights {W}")
    m = d - 2
    A_x, Z_x, P = np.empty((2, 6)), np.empty((4, 6)), np.empty((6, d))
    gram, factor, work = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6))
    constraint_jacobian(pose, center, A_x)
    free_basis(pose, center, Z_x)
    G, Z, Z_plus_T = np.zeros((d - 6, d)), np.empty((m, d)), np.empty((m, d))
    A, A_plus = np.empty((2, d)), np.empty((d, 2))
    multiply(A_x, J, A)
    usable = range_inverse(J, gram, factor, work, P)
    smallest, largest, _, _ = singular_values(gram, work, np.empty((6, 6)))
    condition = largest / smallest if smallest > 0.0 else np.inf
    if usable and condition <= LARGEST_CONDITION:
        if last is None:
            first_null_basis(J, P, G)
        else:
            usable = transport(J, P, last.G, G)
        stack(Z_x, P, G, Z)
        usable = usable and weighted_inverse(A, W, A_plus)
        usable = usable and free_inverse(Z, W, np.empty((m, m)), np.zeros((m, m)), Z_plus_T)
    if not usable or condition > LARGEST_CONDITION:
        raise InputError(
            f'frame "{frame}": its Jacobian has the condition {condition:.3g} (SI units), expected at most '
            f"{LARGEST_CONDITION:g}; choose a configuration away from the singularity"
        )
    return FreeMotion(Z_x, G, Z, A, A_plus, Z_plus_T.T.copy(), float(condition))
