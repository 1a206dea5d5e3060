"""The compiled cycle: kinematics, distances, rows, program, solution, verification, recovery, in one call.

`prepare`, `optimise` and `judge` are also called one by one, when another solver than the active-set kernel is to
solve the program in between.
"""

import numpy as np

from primitives.active_set import INFEASIBLE, OPTIMAL, solve
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.dual_quaternion import from_pose
from primitives.evaluate import evaluate_rows
from primitives.intrinsics import floats_at, integers_at
from primitives.kinematics import forward_kinematics, frame_jacobians
from primitives.memory import MEMORY, cube, integer_matrix, integers, matrix, vector
from primitives.vectors import copy
from primitives.verification import all_finite
from vfi.basis import change_variables, eliminate, relax_in_basis, shorten, solve_in_basis
from vfi.blend import advance, ease
from vfi.contacts import fill_contacts, find
from vfi.cuts import drop_cuts
from vfi.energy import account
from vfi.inequality import fill_rows
from vfi.limits import fill_bounds
from vfi.memory import Real, Whole
from vfi.outcome import Basis, Option, Reason, Setting, Slot, State
from vfi.port import fill_ports
from vfi.record import note_multipliers, write_record
from vfi.recovery import brake, conclude, judge
from vfi.relaxation import relax
from vfi.tasks import PROJECTION, VELOCITY, fill_cost, fill_pose_task, fill_velocity_task, unit_defect

VIOLATED = 1e-5
"""A margin below minus this, or a joint farther out of its range, is a violation that is said; metres or radians."""
UNIT = 1e-6
"""How far a reference pose may be from a unit dual quaternion."""
UNREAD = -1
"""Instead of a state: the inputs have not the form that compiled code can read."""


@compiled("int64(float64[::1], int64[:,::1])")
def given_finite(f: Array, fl: np.ndarray) -> int:
    """1 where the basis, offset and metric that came with the reference are finite, else 0."""
    basis, metric = matrix(f, fl, Real.BASIS).reshape(-1), matrix(f, fl, Real.METRIC).reshape(-1)
    return int(all_finite(basis) and all_finite(metric) and all_finite(vector(f, fl, Real.OFFSET)))


@compiled(f"int64({MEMORY})")
def in_basis(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Go over to the variables y; 0 where the ports that must always be kept cannot be."""
    low, high, offset = vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH), vector(f, fl, Real.OFFSET)
    if integers(w, wl, Whole.OPTIONS)[Option.BASIS] == Basis.PORTS:
        E, e, Q = matrix(f, fl, Real.EQUALITY), vector(f, fl, Real.EQUALITY_RATE), matrix(f, fl, Real.ORTHOGONAL)
        if not eliminate(E, e, Q, matrix(f, fl, Real.TRIANGLE), matrix(f, fl, Real.BASIS), offset):
            return 0
        shorten(offset, low, high)
    change_variables(f, fl, w, wl)
    return 1


@compiled(f"int64({MEMORY})")
def prepare(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """From q, qdot, reference and entities to the program of this cycle. Returns the state, RUN or FAULT."""
    outcome, options = integers(w, wl, Whole.OUTCOME), integers(w, wl, Whole.OPTIONS)
    for i in range(outcome.shape[0]):
        outcome[i] = 0
    outcome[Slot.WHERE] = -1
    drop_cuts(f, fl, w, wl)
    vector(f, fl, Real.SHORTFALL)[0] = 0.0
    q, reference = vector(f, fl, Real.Q), vector(f, fl, Real.REFERENCE)
    pose, twist, given = matrix(f, fl, Real.POSE), matrix(f, fl, Real.TWIST), vector(f, fl, Real.GIVEN)
    entities = options[Option.ROBOT_FRAMES]
    copy(vector(f, fl, Real.QDOT), given)
    finite = all_finite(q) and all_finite(given) and all_finite(reference)
    finite = finite and all_finite(pose[entities:].reshape(-1)) and all_finite(twist.reshape(-1))
    if not finite:
        return conclude(f, fl, w, wl, State.FAULT, Reason.NOT_FINITE, -1)
    tips = integers(w, wl, Whole.TIPS)
    for k in range(tips.shape[0]):
        if unit_defect(reference[8 * k : 8 * k + 8]) > UNIT:
            return conclude(f, fl, w, wl, State.FAULT, Reason.REFERENCE, k)
    if options[Option.BASIS] == Basis.GIVEN and not given_finite(f, fl):
        return conclude(f, fl, w, wl, State.FAULT, Reason.NOT_FINITE, -1)
    decided = integers(w, wl, Whole.DECIDED)
    for j in decided:
        given[j] = 0.0
    settings = vector(f, fl, Real.SETTINGS)
    if options[Option.BLENDING]:
        advance(f, fl, w, wl)

    parent, prismatic = integers(w, wl, Whole.PARENT), integers(w, wl, Whole.PRISMATIC)
    frame_joint, joint_pose = integers(w, wl, Whole.FRAME_JOINT), matrix(f, fl, Real.JOINT_POSE)
    placement, frame_placement = matrix(f, fl, Real.PLACEMENT), matrix(f, fl, Real.FRAME_PLACEMENT)
    jacobian = cube(f, fl, Real.JACOBIAN)
    forward_kinematics(parent, prismatic, placement, frame_joint, frame_placement, q, joint_pose, pose)
    frame_jacobians(parent, prismatic, frame_joint, joint_pose, pose, jacobian)

    margin, residual, status = vector(f, fl, Real.MARGIN), vector(f, fl, Real.RESIDUAL), integers(w, wl, Whole.STATUS)
    side, row = vector(f, fl, Real.SIDE), matrix(f, fl, Real.ROW)
    evaluate_rows(
        integers(w, wl, Whole.ADDRESS),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.GEOMETRY),
        side,
        vector(f, fl, Real.SAFE),
        pose,
        jacobian,
        twist,
        given,
        vector(f, fl, Real.DISTANCE),
        margin,
        row,
        residual,
        status,
    )
    if options[Option.BLENDING]:
        safe_rate = vector(f, fl, Real.SAFE_RATE)
        for i in range(margin.shape[0]):
            residual[i] -= side[i] * safe_rate[i]
    clouds = integer_matrix(w, wl, Whole.CLOUD).shape[0] > 0
    if clouds and find(f, fl, w, wl) < 0:
        return conclude(f, fl, w, wl, State.FAULT, Reason.NOT_FINITE, -1)

    weight, task, target = vector(f, fl, Real.WEIGHT), matrix(f, fl, Real.TASK), vector(f, fl, Real.TARGET)
    x, error, J = vector(f, fl, Real.TIP), vector(f, fl, Real.ERROR), matrix(f, fl, Real.POSE_JACOBIAN)
    for k in range(tips.shape[0]):
        at, end = 8 * k, 8 * k + 8
        from_pose(pose, tips[k], x[at:end])
        fill_pose_task(
            x[at:end],
            jacobian[tips[k]],
            reference[at:end],
            weight[at:end],
            given,
            decided,
            vector(f, fl, Real.GAIN)[k],
            J,
            error[at:end],
            task[at:end],
            target[at:end],
        )
    if options[Option.TASK] == VELOCITY:
        fill_velocity_task(reference, weight, task, target)
    if options[Option.TASK] != PROJECTION:
        fill_cost(task, target, settings[Setting.DAMPING], matrix(f, fl, Real.H), vector(f, fl, Real.G))

    low, high = vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH)
    limits, last = matrix(f, fl, Real.LIMITS), vector(f, fl, Real.LAST)
    for i in range(decided.shape[0]):
        position = q[decided[i]]
        if position < limits[0, i] - VIOLATED or position > limits[1, i] + VIOLATED:
            conclude(f, fl, w, wl, State.DEGRADED, Reason.OUT_OF_RANGE, i)
    if fill_bounds(q, decided, limits, last, settings[Setting.LIMIT_GAIN], settings[Setting.PERIOD], 1, low, high):
        conclude(f, fl, w, wl, State.DEGRADED, Reason.ACCELERATION, -1)

    demand, slack, b = vector(f, fl, Real.DEMAND), vector(f, fl, Real.SLACK), vector(f, fl, Real.B)
    for i in range(slack.shape[0]):
        slack[i] = 0.0
    without = fill_rows(
        margin,
        row,
        residual,
        status,
        integers(w, wl, Whole.ENFORCED),
        integers(w, wl, Whole.ANGULAR),
        side,
        vector(f, fl, Real.ETA),
        settings[Setting.RECOVERY_LINEAR],
        settings[Setting.RECOVERY_ANGULAR],
        decided,
        matrix(f, fl, Real.A),
        demand,
        vector(f, fl, Real.RATE),
    )
    if without >= 0:
        return conclude(f, fl, w, wl, State.FAULT, Reason.NO_ROW, without)
    if options[Option.BLENDING]:
        ease(f, fl, w, wl)
    if clouds:
        fill_contacts(f, fl, w, wl)
    if options[Option.PORTS]:
        fill_ports(f, fl, w, wl)
    copy(demand, b)
    if options[Option.BASIS] != Basis.JOINTS and not in_basis(f, fl, w, wl):
        return conclude(f, fl, w, wl, State.HOLD, Reason.SINGULAR, -1)
    if options[Option.STOP]:
        return conclude(f, fl, w, wl, options[Option.STOP], options[Option.WHY], -1)
    enforced = integers(w, wl, Whole.ENFORCED)
    for i in range(margin.shape[0]):
        if enforced[i] and margin[i] < -VIOLATED:
            conclude(f, fl, w, wl, State.DEGRADED, Reason.RECOVERING, i)
    return State.RUN


@compiled(f"int64({MEMORY})")
def solve_active_set(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Solve the program as it stands; returns the solver's status."""
    if integers(w, wl, Whole.OPTIONS)[Option.BASIS] != Basis.JOINTS:
        return solve_in_basis(f, fl, w, wl)
    return solve(
        matrix(f, fl, Real.H),
        vector(f, fl, Real.G),
        matrix(f, fl, Real.A),
        vector(f, fl, Real.B),
        vector(f, fl, Real.LOW),
        vector(f, fl, Real.HIGH),
        vector(f, fl, Real.V),
        vector(f, fl, Real.MULTIPLIER),
        integers(w, wl, Whole.ACTIVE),
        integers(w, wl, Whole.MASK),
        vector(f, fl, Real.SCALE),
        matrix(f, fl, Real.WORK),
    )


@compiled(f"int64({MEMORY})")
def relax_rows(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Lower B where the rows contradict each other; returns the solver's status."""
    if integers(w, wl, Whole.OPTIONS)[Option.BASIS] != Basis.JOINTS:
        return relax_in_basis(f, fl, w, wl)
    return relax(
        matrix(f, fl, Real.A),
        vector(f, fl, Real.DEMAND),
        vector(f, fl, Real.LOW),
        vector(f, fl, Real.HIGH),
        integers(w, wl, Whole.SAFETY_CLASS),
        vector(f, fl, Real.B),
        vector(f, fl, Real.SLACK),
        matrix(f, fl, Real.RELAXED_H),
        vector(f, fl, Real.RELAXED_G),
        matrix(f, fl, Real.RELAXED_A),
        vector(f, fl, Real.RELAXED_B),
        vector(f, fl, Real.RELAXED_LOW),
        vector(f, fl, Real.RELAXED_HIGH),
        vector(f, fl, Real.RELAXED_V),
        vector(f, fl, Real.RELAXED_MULTIPLIER),
        integers(w, wl, Whole.RELAXED_ACTIVE),
        integers(w, wl, Whole.RELAXED_MASK),
        vector(f, fl, Real.RELAXED_SCALE),
        matrix(f, fl, Real.RELAXED_WORK),
    )


@compiled(f"int64({MEMORY})")
def optimise(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Solve; where that fails let acceleration limits yield, then the rows that may. Returns the solver's status."""
    outcome = integers(w, wl, Whole.OUTCOME)
    status = solve_active_set(f, fl, w, wl)
    if status == OPTIMAL:
        outcome[Slot.SOLVER] = status
        return status
    if outcome[Slot.RESOLVES] == 0:
        outcome[Slot.INFEASIBLE] = int(status == INFEASIBLE)
    settings, low, high = vector(f, fl, Real.SETTINGS), vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH)
    limits = matrix(f, fl, Real.LIMITS)
    if np.min(limits[3]) < np.inf:
        q, decided, last = vector(f, fl, Real.Q), integers(w, wl, Whole.DECIDED), vector(f, fl, Real.LAST)
        fill_bounds(q, decided, limits, last, settings[Setting.LIMIT_GAIN], settings[Setting.PERIOD], 0, low, high)
        status = solve_active_set(f, fl, w, wl)
        if status == OPTIMAL:
            conclude(f, fl, w, wl, State.DEGRADED, Reason.ACCELERATION, -1)
    if status != OPTIMAL:
        slack = vector(f, fl, Real.SLACK)
        before = slack.copy()
        relaxed = relax_rows(f, fl, w, wl)
        if relaxed == OPTIMAL:
            status = solve_active_set(f, fl, w, wl)
        if status == OPTIMAL:
            conclude(f, fl, w, wl, State.DEGRADED, Reason.SLACK, -1)
        else:
            slack[:] = before
    outcome[Slot.SOLVER] = status
    return status


@compiled(f"void({MEMORY}, float64, float64[:,::1], int64)")
def finish(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, t: float, ring: Array, row: int) -> None:
    """Slow down in HOLD, remember the command for the next cycle and write the record of this one."""
    if integers(w, wl, Whole.OUTCOME)[Slot.STATE] == State.HOLD:
        brake(f, fl, w, wl)
    if integers(w, wl, Whole.OPTIONS)[Option.TASK] == PROJECTION:
        account(f, fl, w, wl)
    note_multipliers(f, fl, w, wl)
    copy(vector(f, fl, Real.V), vector(f, fl, Real.LAST))
    write_record(f, fl, w, wl, t, ring, row)


@compiled(f"int64({MEMORY}, float64, float64[:,::1], int64)")
def cycle(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, t: float, ring: Array, row: int) -> int:
    """One cycle with the active-set kernel: fills V, margins, multipliers, slacks, the outcome and ring[row].

    Returns the state.
    """
    if prepare(f, fl, w, wl) < State.HOLD:
        while judge(f, fl, w, wl, optimise(f, fl, w, wl)):
            pass
    finish(f, fl, w, wl, t, ring, row)
    return int(integers(w, wl, Whole.OUTCOME)[Slot.STATE])


@compiled("int64(int64[:,::1], float64, float64[::1], float64[::1], float64[::1], int64)")
def read_and_cycle(where: np.ndarray, t: float, q: Array, qdot: Array, reference: Array, row: int) -> int:
    """Copy the inputs to the memory, then one `cycle`; UNREAD where the time or a shape is not as it must be.

    where is what `primitives.memory.addresses` gives.
    """
    f, fl = floats_at(where[0, 0], (where[0, 1],)), integers_at(where[1, 0], (where[1, 1], where[1, 2]))
    w, wl = integers_at(where[2, 0], (where[2, 1],)), integers_at(where[3, 0], (where[3, 1], where[3, 2]))
    ring = floats_at(where[4, 0], (where[4, 1], where[4, 2]))
    clock, positions, velocities = vector(f, fl, Real.CLOCK), vector(f, fl, Real.Q), vector(f, fl, Real.QDOT)
    wanted, n = vector(f, fl, Real.REFERENCE), q.shape[0]
    if not clock[0] < t < np.inf or n != positions.shape[0] or n != qdot.shape[0]:
        return UNREAD
    if reference.shape[0] != wanted.shape[0]:
        return UNREAD
    copy(q, positions)
    copy(qdot, velocities)
    copy(reference, wanted)
    clock[0] = t
    return int(cycle(f, fl, w, wl, t, ring, row))
