"""The target admittance at one configuration: everything that paper A's dynamics (22), (23), (27) are made of.

Full form (22): qddot = Z^T M^-1 (Z J_t^T (F_th + F_r) - D_f v) - Z^T d(Z^+T)/dt qdot
- A^+ (dA/dt qdot + 2 alpha dx_c/dt + beta^2 x_c), with v = Z^+T qdot. The inertia M is the identity in the paper.

Reduced form: M dv/dt + D_f v = Z J_t^T (F_th + F_r) (27) and qdot = Z^T v - k_c A^+ x_c. It integrates the coordinates
in which the dynamics are simple, so it needs no derivative of A or Z^+T, and x_c decays at k_c as x_c of (25) does.

Without a port it is the same with Z = I: the free coordinates are the joints, and x_c, A and their terms are zero.
"""

import numpy as np

from admittance.contact import SHAFT, evaluate_regions
from admittance.dense import cholesky, inner, multiply, substitute, transform, transform_transposed
from admittance.margins import measure_margins, push_off
from admittance.memory import CLOUDS, Real, Whole
from admittance.nullspace import (
    free_basis,
    free_inverse,
    range_inverse,
    singular_values,
    stack,
    transport,
    weighted_inverse,
)
from admittance.outcome import Form, Option, Reason, Setting
from admittance.rates import free_rate, free_velocity_rate, jacobian_rate
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.kinematics import forward_kinematics, frame_jacobians
from primitives.memory import MEMORY, cube, integers, matrix, vector
from primitives.rcm import constraint_jacobian, constraint_jacobian_rate, port_error

HANDLE = 2
"""Place of the frame that the sensor is on."""
NEAR = 4.0
"""Times the smallest singular value that the condition's limit allows, below which its rate is bounded."""


@compiled(f"int64({MEMORY}, {CLOUDS}, float64[::1])")
def evaluate(
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
    q: Array,
) -> int:
    """All that the dynamics need at q (n,): kinematics, port, bases, regions and constraints.

    Returns why no motion is possible there, a `Reason`; 0 where it is.
    """
    for j in range(q.shape[0]):
        if not np.isfinite(q[j]):
            return Reason.NOT_FINITE
    pose, jacobian = matrix(f, fl, Real.POSE), cube(f, fl, Real.JACOBIAN)
    parent, prismatic = integers(w, wl, Whole.PARENT), integers(w, wl, Whole.PRISMATIC)
    frame_joint, joint_pose = integers(w, wl, Whole.FRAME_JOINT), matrix(f, fl, Real.JOINT_POSE)
    placement, frame_placement = matrix(f, fl, Real.PLACEMENT), matrix(f, fl, Real.FRAME_PLACEMENT)
    forward_kinematics(parent, prismatic, placement, frame_joint, frame_placement, q, joint_pose, pose)
    frame_jacobians(parent, prismatic, frame_joint, joint_pose, pose, jacobian)
    decided, J = integers(w, wl, Whole.DECIDED), matrix(f, fl, Real.J)
    for i in range(6):
        for j in range(decided.shape[0]):
            J[i, j] = jacobian[SHAFT, i, decided[j]]
    sensor, handle, on = vector(f, fl, Real.SENSOR), vector(f, fl, Real.HANDLE), pose[HANDLE]
    for r in range(3):
        for c in range(3):
            handle[3 * r + c] = on[3 * r + c]
        handle[9 + r] = on[9 + r] + inner(on[3 * r : 3 * r + 3], sensor)
    blocked = evaluate_regions(f, fl, w, wl, points, order, start, index, place, distance, near)
    blocked = measure_margins(f, fl, w, wl, blocked)
    if not integers(w, wl, Whole.OPTIONS)[Option.PORT]:
        if not push_off(f, fl, w, wl):
            return Reason.NOT_FINITE
        return blocked

    port, A_x, Z_x = vector(f, fl, Real.PORT), matrix(f, fl, Real.A_X), matrix(f, fl, Real.Z_X)
    P, G, Z, A = matrix(f, fl, Real.P), matrix(f, fl, Real.G), matrix(f, fl, Real.Z), matrix(f, fl, Real.A)
    port_error(pose[SHAFT], port, vector(f, fl, Real.X_C))
    constraint_jacobian(pose[SHAFT], port, A_x)
    free_basis(pose[SHAFT], port, Z_x)
    multiply(A_x, J, A)
    gram, factor, scratch = matrix(f, fl, Real.GRAM), matrix(f, fl, Real.FACTOR), matrix(f, fl, Real.SCRATCH)
    if not range_inverse(J, gram, factor, scratch, P) or not transport(J, P, matrix(f, fl, Real.G_LAST), G):
        return Reason.SINGULAR
    stack(Z_x, P, G, Z)
    if not push_off(f, fl, w, wl):
        return Reason.NOT_FINITE
    weight = vector(f, fl, Real.WEIGHT)
    if not weighted_inverse(A, weight, matrix(f, fl, Real.A_PLUS)):
        return Reason.SINGULAR
    if integers(w, wl, Whole.OPTIONS)[Option.FORM] != Form.REDUCED and not free_inverse(
        Z, weight, matrix(f, fl, Real.Z_WORK), matrix(f, fl, Real.Z_FACTOR), matrix(f, fl, Real.Z_PLUS_T)
    ):
        return Reason.SINGULAR
    return blocked


@compiled(f"void({MEMORY}, int64, float64, float64)")
def add_singular_slope(
    f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, place: int, value: float, factor: float
) -> None:
    """Add to SINGULAR_ROW (m,) factor times the derivative of a singular value by v.

    With J_t x = value u its derivative by q_k is u^T (dJ_t/dq_k) x, and that by v follows along Z; u is a column of
    EIGEN.
    """
    J, Z, rate, vectors = (
        matrix(f, fl, Real.J),
        matrix(f, fl, Real.Z),
        matrix(f, fl, Real.J_RATE),
        matrix(f, fl, Real.EIGEN),
    )
    row, right, along = (
        vector(f, fl, Real.SINGULAR_ROW),
        vector(f, fl, Real.ACCELERATION),
        vector(f, fl, Real.DIRECTION),
    )
    d = J.shape[1]
    along[:] = 0.0
    for k in range(d):
        right[k] = 0.0
        for i in range(6):
            right[k] += J[i, k] * vectors[i, place] / value
    for k in range(d):
        along[k] = 1.0
        jacobian_rate(J, along, rate)
        along[k] = 0.0
        slope = 0.0
        for i in range(6):
            slope += vectors[i, place] * inner(rate[i], right)
        for j in range(row.shape[0]):
            row[j] += factor * Z[j, k] * slope


@compiled(f"void({MEMORY})")
def settle(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """What is done once for a configuration that is kept: G is handed on, and the condition of J_t is measured.

    SINGULAR (4,) becomes [smallest, largest singular value, condition, bound]; near the limit SINGULAR_ROW (m,) is
    the derivative by v of the smallest minus the largest over the limit, which the bound is for; else zero. Without a
    port there is neither.
    """
    if not integers(w, wl, Whole.OPTIONS)[Option.PORT]:
        return
    matrix(f, fl, Real.G_LAST)[:, :] = matrix(f, fl, Real.G)
    singular, settings = vector(f, fl, Real.SINGULAR), vector(f, fl, Real.SETTINGS)
    gram, vectors = matrix(f, fl, Real.GRAM), matrix(f, fl, Real.EIGEN)
    low, high, smallest, largest = singular_values(gram, matrix(f, fl, Real.SCRATCH), vectors)
    share = 1.0 / settings[Setting.CONDITION_LIMIT]
    singular[0] = low
    singular[1] = high
    singular[2] = high / max(low, 1e-300)
    singular[3] = -np.inf
    vector(f, fl, Real.SINGULAR_ROW)[:] = 0.0
    if low > 0.0 and low < NEAR * high * share:
        singular[3] = -settings[Setting.LIMIT_GAIN] * max(0.0, low - high * share)
        add_singular_slope(f, fl, w, wl, smallest, low, 1.0)
        add_singular_slope(f, fl, w, wl, largest, high, -share)


@compiled(f"void({MEMORY})")
def apply_hand(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """F_th = T_te F_h, the measured wrench moved to the shaft frame's origin, and Z J_t^T F_th = [Z_x F_th; 0].

    Without a port J_t^T F_th.
    """
    pose, handle, wrench = matrix(f, fl, Real.POSE)[SHAFT], vector(f, fl, Real.HANDLE), vector(f, fl, Real.WRENCH)
    F_th, F_hand = vector(f, fl, Real.F_TH), vector(f, fl, Real.F_HAND)
    a, b, c = handle[9] - pose[9], handle[10] - pose[10], handle[11] - pose[11]
    x, y, z = wrench[0], wrench[1], wrench[2]
    F_th[:] = wrench
    F_th[3] += b * z - c * y
    F_th[4] += c * x - a * z
    F_th[5] += a * y - b * x
    if not integers(w, wl, Whole.OPTIONS)[Option.PORT]:
        transform_transposed(matrix(f, fl, Real.J), F_th, F_hand)
        return
    F_hand[:] = 0.0
    Z_x = matrix(f, fl, Real.Z_X)
    for i in range(4):
        F_hand[i] = inner(Z_x[i], F_th)


@compiled(f"int64({MEMORY}, float64, int64, int64)")
def propose(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float, damping: int, stiffness: int) -> int:
    """Free velocity after h seconds without limits, V_REF = X^-1 r, and the metric X; 0 where X is not positive.

    X = M (+ h D where the damping is implicit) (+ h^2 K with the stiffness K of the potential), and
    r = M v + h (Z J_t^T (F_th + F_r) - D v), the last term where the damping is explicit.
    """
    v, v_ref, D, M = (
        vector(f, fl, Real.V),
        vector(f, fl, Real.V_REF),
        vector(f, fl, Real.D),
        vector(f, fl, Real.INERTIA),
    )
    X, K = matrix(f, fl, Real.METRIC), matrix(f, fl, Real.STIFFNESS)
    hand, F_rx = vector(f, fl, Real.F_HAND), vector(f, fl, Real.F_RX)
    X[:, :] = 0.0
    for i in range(v.shape[0]):
        force = hand[i] + F_rx[i]
        X[i, i] = M[i]
        if damping:
            X[i, i] += h * D[i]
        else:
            force -= D[i] * v[i]
        v_ref[i] = M[i] * v[i] + h * force
    if stiffness:
        for i in range(v.shape[0]):
            for j in range(v.shape[0]):
                X[i, j] += h * h * K[i, j]
    factor = matrix(f, fl, Real.METRIC_FACTOR)
    if not cholesky(X, factor):
        return 0
    substitute(factor, v_ref)
    return 1


@compiled(f"void({MEMORY})")
def to_port(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """OFFSET = -k_c A^+ x_c, the joint velocity back to the port of the reduced form."""
    offset, x_c, A_plus = vector(f, fl, Real.OFFSET), vector(f, fl, Real.X_C), matrix(f, fl, Real.A_PLUS)
    transform(A_plus, x_c, offset)
    offset *= -vector(f, fl, Real.SETTINGS)[Setting.PORT_GAIN]


@compiled(f"void({MEMORY}, float64[::1])")
def accelerate(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, qdot: Array) -> None:
    """ACCELERATION = qddot of the full form (22), (23) at the evaluated configuration and qdot (d,).

    The printed form takes dA/dt and d(Z^+T)/dt from the differences to A_LAST and Z_PLUS_T_LAST, zero in the first
    cycle, which paper A leaves open; the analytic form takes them from `rates`.
    """
    settings, options = vector(f, fl, Real.SETTINGS), integers(w, wl, Whole.OPTIONS)
    J, J_rate, pose = matrix(f, fl, Real.J), matrix(f, fl, Real.J_RATE), matrix(f, fl, Real.POSE)[SHAFT]
    A, A_x, x_c, twist = (
        matrix(f, fl, Real.A),
        matrix(f, fl, Real.A_X),
        vector(f, fl, Real.X_C),
        vector(f, fl, Real.TWIST),
    )
    Z, Z_plus_T, v = matrix(f, fl, Real.Z), matrix(f, fl, Real.Z_PLUS_T), vector(f, fl, Real.FREE)
    rate, port_rate, out = (
        vector(f, fl, Real.FREE_RATE),
        vector(f, fl, Real.PORT_RATE),
        vector(f, fl, Real.ACCELERATION),
    )
    D, M = vector(f, fl, Real.D), vector(f, fl, Real.INERTIA)
    transform(Z_plus_T, qdot, v)
    rate[:] = 0.0
    port_rate[:] = 0.0
    if options[Option.FORM] == Form.ANALYTIC:
        A_x_rate = matrix(f, fl, Real.A_X_RATE)
        transform(J, qdot, twist)
        jacobian_rate(J, qdot, J_rate)
        constraint_jacobian_rate(pose, twist, vector(f, fl, Real.PORT), A_x_rate)
        for i in range(2):
            for k in range(6):
                port_rate[i] += A_x_rate[i, k] * twist[k] + A_x[i, k] * inner(J_rate[k], qdot)
        Z_rate = matrix(f, fl, Real.Z_RATE)
        free_rate(
            J,
            J_rate,
            matrix(f, fl, Real.FACTOR),
            matrix(f, fl, Real.P),
            matrix(f, fl, Real.Z_X),
            matrix(f, fl, Real.G),
            pose,
            twist,
            matrix(f, fl, Real.P_RATE),
            Z_rate,
        )
        free_velocity_rate(Z, Z_rate, vector(f, fl, Real.WEIGHT), matrix(f, fl, Real.Z_FACTOR), qdot, v, rate)
    elif options[Option.STARTED]:
        A_last, Z_plus_T_last = matrix(f, fl, Real.A_LAST), matrix(f, fl, Real.Z_PLUS_T_LAST)
        for k in range(qdot.shape[0]):
            per_second = qdot[k] / settings[Setting.PERIOD]
            for i in range(2):
                port_rate[i] += (A[i, k] - A_last[i, k]) * per_second
            for i in range(v.shape[0]):
                rate[i] += (Z_plus_T[i, k] - Z_plus_T_last[i, k]) * per_second
    hand, F_rx = vector(f, fl, Real.F_HAND), vector(f, fl, Real.F_RX)
    for i in range(v.shape[0]):
        force = hand[i] - D[i] * v[i] + F_rx[i]
        rate[i] = force / M[i] - rate[i]
    alpha, beta = settings[Setting.ALPHA], settings[Setting.BETA]
    for i in range(2):
        port_rate[i] += 2.0 * alpha * inner(A[i], qdot) + beta * beta * x_c[i]
    transform_transposed(Z, rate, out)
    A_plus = matrix(f, fl, Real.A_PLUS)
    for k in range(out.shape[0]):
        out[k] -= A_plus[k, 0] * port_rate[0] + A_plus[k, 1] * port_rate[1]
