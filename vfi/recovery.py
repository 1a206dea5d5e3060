"""What becomes of an answer: it is verified at the predicted configuration, and recovered from when it fails.

In this order: solve again with the measured defect on the right-hand side or with a cut, let what may yield do so,
scale the command down, stand still.
"""

import numpy as np

from primitives.active_set import OPTIMAL
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.evaluate import evaluate_margins
from primitives.kinematics import forward_kinematics
from primitives.memory import MEMORY, integer_matrix, integers, matrix, vector
from primitives.vectors import copy
from primitives.verification import (
    all_finite,
    bound_excess,
    move_frames,
    row_defects,
    sampled_defects,
    worst_defect,
)
from vfi.basis import change_variables, expand
from vfi.blend import foresee
from vfi.contacts import predict
from vfi.cuts import add_cut, calls_for_cut, evaluate_next
from vfi.memory import Real, Whole
from vfi.outcome import Basis, Guard, Option, Reason, Setting, Slot, State

RESOLVES = 3
"""How often a program is solved again with the measured defect on its right-hand side, before a second solver is."""
HALVINGS = 8
"""How often a command is scaled down before it is given up: to what the failing rows leave of it, then by halves."""
BELOW = 0.99
"""Of that share, so that the curvature of the way there does not bring the command to fail once more."""


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
        vector(f, fl, Real.FREE)[:] = 0.0
        vector(f, fl, Real.MULTIPLIER)[:] = 0.0
    return state


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
    slack, tolerance, rate = (
        vector(f, fl, Real.SLACK),
        vector(f, fl, Real.ROW_TOLERANCE),
        vector(f, fl, Real.RATE),
    )
    cloud, options = integer_matrix(w, wl, Whole.CLOUD), integers(w, wl, Whole.OPTIONS)
    if cloud.shape[0]:
        predict(f, fl, w, wl)
    if options[Option.BLENDING]:
        foresee(f, fl, w, wl)
    row_defects(matrix(f, fl, Real.A), vector(f, fl, Real.DEMAND), slack, v, defect)
    sampled_defects(vector(f, fl, Real.MARGIN), margin_next, rate, slack, period, defect)
    if cloud.shape[0]:
        fixed, points = options[Option.FIXED], options[Option.CONTACTS]
        sampled_defects(
            vector(f, fl, Real.CLEARANCE)[:points],
            vector(f, fl, Real.CLEARANCE_NEXT),
            rate[fixed:],
            slack[fixed:],
            period,
            defect[fixed:],
        )
        for c in range(cloud.shape[0]):
            if np.isnan(margin_next[cloud[c, 0]]):
                defect[cloud[c, 0]] = np.nan
    bounds = bound_excess(v, vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH), vector(f, fl, Real.JOINT_TOLERANCE))
    return max(bounds, worst_defect(defect, tolerance))


@compiled(f"void({MEMORY}, float64[::1], int64)")
def raise_demands(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, v: Array, attempt: int) -> None:
    """Ask more of what failed at v: by a cut, see `vfi.cuts`, or else of its row.

    The row gets the measured defect on its right-hand side, above what it has at v: a row that is not active at v has
    room to spare, which the defect alone would not use up. A defect that shrinks by the same factor from attempt to
    attempt (1, 2, ..) adds up to defect / (1 - factor) in the end, which is added at once.
    """
    A, b, last = matrix(f, fl, Real.A), vector(f, fl, Real.B), vector(f, fl, Real.LAST_DEFECT)
    defect, tolerance = vector(f, fl, Real.DEFECT), vector(f, fl, Real.ROW_TOLERANCE)
    options, constraints = integers(w, wl, Whole.OPTIONS), fl[Real.ROW, 1]
    before = options[Option.CUTS]
    evaluate_next(f, fl, w, wl)
    for i in range(b.shape[0]):
        if defect[i] > tolerance[i]:
            if i < constraints and calls_for_cut(f, fl, w, wl, v, i):
                add_cut(f, fl, w, wl, v, i)
                continue
            value, factor = 0.0, 0.0
            for j in range(v.shape[0]):
                value += A[i, j] * v[j]
            if attempt > 1 and 2.0 * defect[i] < last[i]:
                factor = defect[i] / last[i]
            b[i] = max(b[i], value) + defect[i] / (1.0 - factor)
        last[i] = defect[i]
    if options[Option.CUTS] > before and options[Option.BASIS] != Basis.JOINTS:
        change_variables(f, fl, w, wl)


@compiled(f"int64({MEMORY})")
def concede(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Count as slack what a row falls short of that may yield; 1 when V passes verification with that.

    Such a row has a demand > 0: standing still would not keep it either. It may lose as much as standing still would.
    """
    v, demand, slack = vector(f, fl, Real.V), vector(f, fl, Real.DEMAND), vector(f, fl, Real.SLACK)
    defect, tolerance, joints = (
        vector(f, fl, Real.DEFECT),
        vector(f, fl, Real.ROW_TOLERANCE),
        vector(f, fl, Real.JOINT_TOLERANCE),
    )
    rows = defect.shape[0]
    if not bound_excess(v, vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH), joints) <= 1.0:
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
    """Row with the largest defect in tolerances, the first NaN before all; -1 where a joint limit is what fails."""
    defect, tolerance = vector(f, fl, Real.DEFECT), vector(f, fl, Real.ROW_TOLERANCE)
    place, worst = -1, 1.0
    for i in range(defect.shape[0]):
        if np.isnan(defect[i]):
            return i
        if defect[i] / tolerance[i] > worst:
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


@compiled("float64(float64[::1], int64[:,::1])")
def share_left(f: Array, fl: np.ndarray) -> float:
    """Share of the command that the margins which fail leave, by a straight line from standing still; else a half.

    Of a margin that is kept inside of something a straight line is a lower bound, so that the share is kept.
    """
    defect, rate, slack = vector(f, fl, Real.DEFECT), vector(f, fl, Real.RATE), vector(f, fl, Real.SLACK)
    tolerance, share = vector(f, fl, Real.ROW_TOLERANCE), 1.0
    for i in range(defect.shape[0]):
        wanted = rate[i] - slack[i]
        if defect[i] > tolerance[i] and -np.inf < wanted <= 0.0:
            share = min(share, wanted / (wanted - defect[i]))
    return BELOW * share if share < 1.0 else 0.5


@compiled(f"void({MEMORY}, float64)")
def scale_down(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, share: float) -> None:
    """Leave a share of the command; in a basis of what is free of it, so that the way back to the port goes on."""
    v, free = vector(f, fl, Real.V), vector(f, fl, Real.FREE)
    if integers(w, wl, Whole.OPTIONS)[Option.BASIS] == Basis.JOINTS:
        for j in range(v.shape[0]):
            v[j] *= share
        return
    for j in range(free.shape[0]):
        free[j] *= share
    expand(f, fl, w, wl)


@compiled(f"void({MEMORY})")
def brake(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Come to rest within the acceleration limits, where there are any and verification passes that; else at once.

    In a basis the command is zero at once: slowing down joint by joint would leave the port.
    """
    v, last, limits = vector(f, fl, Real.V), vector(f, fl, Real.LAST), matrix(f, fl, Real.LIMITS)
    if integers(w, wl, Whole.OPTIONS)[Option.BASIS] != Basis.JOINTS or np.min(limits[3]) == np.inf:
        return
    period = vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    for j in range(v.shape[0]):
        change = period * limits[3, j]
        v[j] = max(last[j] - change, 0.0) if last[j] > 0.0 else min(last[j] + change, 0.0)
    if not violation(f, fl, w, wl) <= 1.0:
        v[:] = 0.0


@compiled(f"int64({MEMORY}, int64)")
def judge(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, solver: int) -> int:
    """Verify V and decide what becomes of it; returns 1 when the program, now raised, is to be solved again."""
    outcome, v, candidate = integers(w, wl, Whole.OUTCOME), vector(f, fl, Real.V), vector(f, fl, Real.CANDIDATE)
    options, free = integers(w, wl, Whole.OPTIONS), vector(f, fl, Real.FREE)
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
        copy(free, vector(f, fl, Real.FREE_CANDIDATE))
        if outcome[Slot.RESOLVES] < RESOLVES + options[Option.SECOND_SOLVER]:
            outcome[Slot.RESOLVES] += 1
            raise_demands(f, fl, w, wl, v, outcome[Slot.RESOLVES])
            return 1
    v[:] = candidate
    copy(vector(f, fl, Real.FREE_CANDIDATE), free)
    for halvings in range(HALVINGS + 1):
        outcome[Slot.HALVINGS] = halvings
        if violation(f, fl, w, wl) <= 1.0 or concede(f, fl, w, wl):
            conclude(f, fl, w, wl, State.DEGRADED, Reason.HALVED if halvings else Reason.SLACK, -1)
            return 0
        scale_down(f, fl, w, wl, share_left(f, fl) if halvings == 0 else 0.5)
    conclude(f, fl, w, wl, State.HOLD, Reason.NOT_KEPT, worst_row(f, fl, w, wl))
    return 0
