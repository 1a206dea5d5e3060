"""The compiled cycle: kinematics, distances, rows, program, solution, verification, recovery, in one call.

`prepare`, `optimise` and `judge` are also called one by one, when another solver than the active-set kernel is to
solve the program in between.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.evaluate import evaluate_margins, evaluate_rows
from primitives.kinematics import forward_kinematics, frame_jacobians
from primitives.verification import (
    all_finite,
    bound_excess,
    move_frames,
    row_defects,
    sampled_defects,
    worst_defect,
)
from vfi.active_set import INFEASIBLE, OPTIMAL, solve
from vfi.inequality import fill_rows
from vfi.limits import fill_bounds
from vfi.memory import MEMORY, Real, Whole, cube, integer_matrix, integers, matrix, vector
from vfi.outcome import Guard, Option, Reason, Setting, Slot, State
from vfi.record import write_record
from vfi.relaxation import relax
from vfi.tasks import POSE, fill_cost, fill_pose_task, fill_velocity_task, pose_of_frame, unit_defect

RESOLVES = 3
"""How often a program is solved again with the measured defect on its right-hand side, and again by a second solver."""
HALVINGS = 8
"""How often a command is halved before it is given up."""
VIOLATED = 1e-5
"""A margin below minus this, or a joint farther out of its range, is a violation that is said; metres or radians."""
UNIT = 1e-6
"""How far a reference pose may be from a unit dual quaternion."""


@compiled(f"int64({MEMORY}, int64, int64, int64)")
def conclude(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, state: int, reason: int, where: int) -> int:
    """Write down state and reason unless a graver one stands there; HOLD and FAULT command zero. Returns the state.

    Of equal states slack is the gravest reason, and where the cycle began the least.
    """
    outcome = integers(w, wl, Whole.OUTCOME)
    began = outcome[Slot.REASON] == Reason.RECOVERING or outcome[Slot.REASON] == Reason.OUT_OF_RANGE
    graver = reason == Reason.SLACK or began
    if state > outcome[Slot.STATE] or (state == outcome[Slot.STATE] and graver):
        outcome[Slot.STATE] = state
        outcome[Slot.REASON] = reason
        outcome[Slot.WHERE] = where
    if state >= State.HOLD:
        vector(f, fl, Real.V)[:] = 0.0
        vector(f, fl, Real.MULTIPLIER)[:] = 0.0
    return state


@compiled(f"int64({MEMORY})")
def prepare(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """From q, qdot, reference and entities to the program of this cycle. Returns the state, RUN or FAULT."""
    outcome, options = integers(w, wl, Whole.OUTCOME), integers(w, wl, Whole.OPTIONS)
    outcome[:] = 0
    outcome[Slot.WHERE] = -1
    vector(f, fl, Real.SHORTFALL)[0] = 0.0
    q, reference = vector(f, fl, Real.Q), vector(f, fl, Real.REFERENCE)
    pose, twist, given = matrix(f, fl, Real.POSE), matrix(f, fl, Real.TWIST), vector(f, fl, Real.GIVEN)
    entities = options[Option.ROBOT_FRAMES]
    given[:] = vector(f, fl, Real.QDOT)
    finite = all_finite(q) and all_finite(given) and all_finite(reference)
    finite = finite and all_finite(pose[entities:].reshape(-1)) and all_finite(twist.reshape(-1))
    if not finite:
        return conclude(f, fl, w, wl, State.FAULT, Reason.NOT_FINITE, -1)
    if options[Option.TASK] == POSE and unit_defect(reference) > UNIT:
        return conclude(f, fl, w, wl, State.FAULT, Reason.REFERENCE, -1)
    decided = integers(w, wl, Whole.DECIDED)
    for j in decided:
        given[j] = 0.0
    settings = vector(f, fl, Real.SETTINGS)

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

    weight, error, task = vector(f, fl, Real.WEIGHT), vector(f, fl, Real.ERROR), matrix(f, fl, Real.TASK)
    target = vector(f, fl, Real.TARGET)
    if options[Option.TASK] == POSE:
        tip, x = options[Option.TIP], vector(f, fl, Real.TIP)
        pose_of_frame(pose, tip, x)
        gain = settings[Setting.GAIN]
        fill_pose_task(x, jacobian[tip], reference, weight, given, decided, gain, error, task, target)
    else:
        fill_velocity_task(reference, weight, task, target)
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
    slack[:] = 0.0
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
    b[:] = demand
    enforced = integers(w, wl, Whole.ENFORCED)
    for i in range(margin.shape[0]):
        if enforced[i] and margin[i] < -VIOLATED:
            conclude(f, fl, w, wl, State.DEGRADED, Reason.RECOVERING, i)
    return State.RUN


@compiled(f"int64({MEMORY})")
def solve_active_set(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Solve the program as it stands; returns the solver's status."""
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
        relaxed = relax(
            matrix(f, fl, Real.A),
            vector(f, fl, Real.DEMAND),
            low,
            high,
            integers(w, wl, Whole.SAFETY_CLASS),
            vector(f, fl, Real.B),
            slack,
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
        if relaxed == OPTIMAL:
            status = solve_active_set(f, fl, w, wl)
        if status == OPTIMAL:
            conclude(f, fl, w, wl, State.DEGRADED, Reason.SLACK, -1)
        else:
            slack[:] = before
    outcome[Slot.SOLVER] = status
    return status


@compiled(f"float64({MEMORY})")
def violation(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> float:
    """By how many tolerances V fails verification; at most 1 when it passes. Fills the defects (r,)."""
    v, defect = vector(f, fl, Real.V), vector(f, fl, Real.DEFECT)
    q, given, decided = vector(f, fl, Real.Q), vector(f, fl, Real.GIVEN), integers(w, wl, Whole.DECIDED)
    q_next, period = vector(f, fl, Real.Q_NEXT), vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    for j in range(q.shape[0]):
        q_next[j] = q[j] + period * given[j]
    for j in range(v.shape[0]):
        q_next[decided[j]] = q[decided[j]] + period * v[j]
    pose_next, frames = matrix(f, fl, Real.POSE_NEXT), integers(w, wl, Whole.OPTIONS)[Option.ROBOT_FRAMES]
    forward_kinematics(
        integers(w, wl, Whole.PARENT),
        integers(w, wl, Whole.PRISMATIC),
        matrix(f, fl, Real.PLACEMENT),
        integers(w, wl, Whole.FRAME_JOINT),
        matrix(f, fl, Real.FRAME_PLACEMENT),
        q_next,
        matrix(f, fl, Real.JOINT_POSE_NEXT),
        pose_next,
    )
    move_frames(matrix(f, fl, Real.POSE), matrix(f, fl, Real.TWIST), frames, period, pose_next)
    margin_next = vector(f, fl, Real.MARGIN_NEXT)
    evaluate_margins(
        integers(w, wl, Whole.ADDRESS),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.GEOMETRY),
        vector(f, fl, Real.SIDE),
        vector(f, fl, Real.SAFE),
        pose_next,
        vector(f, fl, Real.DISTANCE_NEXT),
        margin_next,
        integers(w, wl, Whole.STATUS_NEXT),
    )
    slack, tolerance = vector(f, fl, Real.SLACK), vector(f, fl, Real.TOLERANCE)
    row_defects(matrix(f, fl, Real.A), vector(f, fl, Real.DEMAND), slack, v, defect)
    sampled_defects(vector(f, fl, Real.MARGIN), margin_next, vector(f, fl, Real.RATE), slack, period, defect)
    rows = defect.shape[0]
    bounds = bound_excess(v, vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH), tolerance[rows:])
    return max(bounds, worst_defect(defect, tolerance[:rows]))


@compiled("void(float64[::1], int64[:,::1], float64[::1], int64)")
def raise_demands(f: Array, fl: np.ndarray, v: Array, attempt: int) -> None:
    """Put the measured defect on the right-hand side of each row that failed, above what the row has at v.

    A row that is not active at v has room to spare, which the defect alone would not use up. A defect that shrinks
    by the same factor from attempt to attempt (1, 2, ..) adds up to defect / (1 - factor) in the end, which is added
    at once.
    """
    A, b, last = matrix(f, fl, Real.A), vector(f, fl, Real.B), vector(f, fl, Real.LAST_DEFECT)
    defect, tolerance = vector(f, fl, Real.DEFECT), vector(f, fl, Real.TOLERANCE)
    for i in range(b.shape[0]):
        if defect[i] > tolerance[i]:
            value, factor = 0.0, 0.0
            for j in range(v.shape[0]):
                value += A[i, j] * v[j]
            if attempt > 1 and 2.0 * defect[i] < last[i]:
                factor = defect[i] / last[i]
            b[i] = max(b[i], value) + defect[i] / (1.0 - factor)
        last[i] = defect[i]


@compiled(f"int64({MEMORY})")
def concede(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Count as slack what a row falls short of that may yield; 1 when V passes verification with that.

    Such a row has a demand > 0: standing still would not keep it either. It may lose as much as standing still would.
    """
    v, demand, slack = vector(f, fl, Real.V), vector(f, fl, Real.DEMAND), vector(f, fl, Real.SLACK)
    defect, tolerance = vector(f, fl, Real.DEFECT), vector(f, fl, Real.TOLERANCE)
    rows = defect.shape[0]
    if not bound_excess(v, vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH), tolerance[rows:]) <= 1.0:
        return 0
    for i in range(rows):
        if not defect[i] <= tolerance[i] and not (demand[i] > 0.0 and slack[i] + defect[i] <= demand[i]):
            return 0
    for i in range(rows):
        if defect[i] > tolerance[i]:
            slack[i] += defect[i]
            defect[i] = 0.0
    return 1


@compiled(f"int64({MEMORY})")
def worst_row(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Row with the largest defect in tolerances, -1 where every row is kept and a joint limit is what fails."""
    defect, tolerance = vector(f, fl, Real.DEFECT), vector(f, fl, Real.TOLERANCE)
    place, worst = -1, 1.0
    for i in range(defect.shape[0]):
        if not defect[i] / tolerance[i] <= worst:
            place, worst = i, defect[i] / tolerance[i]
    return place


@compiled("void(float64[::1], int64[:,::1], float64[::1])")
def note_shortfall(f: Array, fl: np.ndarray, v: Array) -> None:
    """Write down by how much v falls short of its rows at most, per second."""
    defect = vector(f, fl, Real.DEFECT)
    row_defects(matrix(f, fl, Real.A), vector(f, fl, Real.DEMAND), vector(f, fl, Real.SLACK), v, defect)
    worst = 0.0
    for i in range(defect.shape[0]):
        worst = max(worst, defect[i])
    vector(f, fl, Real.SHORTFALL)[0] = worst


@compiled(f"int64({MEMORY}, int64)")
def judge(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, solver: int) -> int:
    """Verify V and decide what becomes of it; returns 1 when the program, now raised, is to be solved again."""
    outcome, v, candidate = integers(w, wl, Whole.OUTCOME), vector(f, fl, Real.V), vector(f, fl, Real.CANDIDATE)
    options = integers(w, wl, Whole.OPTIONS)
    guard = options[Option.GUARD]
    found = solver == OPTIMAL and all_finite(v) == 1
    if not found and outcome[Slot.RESOLVES] == 0:
        reason = Reason.INFEASIBLE if outcome[Slot.INFEASIBLE] else Reason.SOLVER
        conclude(f, fl, w, wl, State.HOLD, reason, -1)
        return 0
    if found and outcome[Slot.RESOLVES] == 0:
        note_shortfall(f, fl, v)
    if guard == Guard.OFF:
        return 0
    if found:
        if violation(f, fl, w, wl) <= 1.0:
            return 0
        outcome[Slot.INTERVENED] = 1
        if guard == Guard.WATCH:
            return 0
        candidate[:] = v
        if outcome[Slot.RESOLVES] < RESOLVES + options[Option.SECOND_SOLVER] * (1 + RESOLVES):
            outcome[Slot.RESOLVES] += 1
            attempt = outcome[Slot.RESOLVES]
            if attempt == RESOLVES + 1:
                # The second solver begins with the program as it was: what the first one answered proves nothing.
                b, demand, slack = vector(f, fl, Real.B), vector(f, fl, Real.DEMAND), vector(f, fl, Real.SLACK)
                for i in range(b.shape[0]):
                    b[i] = demand[i] - slack[i]
            else:
                raise_demands(f, fl, v, attempt if attempt <= RESOLVES else attempt - RESOLVES - 1)
            return 1
    v[:] = candidate
    for halvings in range(HALVINGS + 1):
        outcome[Slot.HALVINGS] = halvings
        if violation(f, fl, w, wl) <= 1.0 or concede(f, fl, w, wl):
            conclude(f, fl, w, wl, State.DEGRADED, Reason.HALVED if halvings else Reason.SLACK, -1)
            return 0
        v *= 0.5
    conclude(f, fl, w, wl, State.HOLD, Reason.NOT_KEPT, worst_row(f, fl, w, wl))
    return 0


@compiled(f"void({MEMORY}, float64, float64[:,::1], int64)")
def finish(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, t: float, ring: Array, row: int) -> None:
    """Remember the command for the next cycle and write the record of this one."""
    vector(f, fl, Real.LAST)[:] = vector(f, fl, Real.V)
    write_record(f, fl, w, wl, t, ring, row)


@compiled(f"void({MEMORY}, float64, float64[:,::1], int64)")
def cycle(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, t: float, ring: Array, row: int) -> None:
    """One cycle with the active-set kernel: fills V, margins, multipliers, slacks, the outcome and ring[row]."""
    if prepare(f, fl, w, wl) < State.HOLD:
        while judge(f, fl, w, wl, optimise(f, fl, w, wl)):
            pass
    finish(f, fl, w, wl, t, ring, row)
