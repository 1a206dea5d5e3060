"""The robust integrator: it does not step across the barrier, whatever the hand does.

Linearly implicit in the potential's Gauss-Newton stiffness, (M + h D + h^2 K) v+ = M v + h f, in sub-steps in which
no point and no constraint within sight comes nearer by more than 0.3 of its clearance or margin.
"""

import numpy as np

from admittance.dense import inner
from admittance.energy import book_step
from admittance.margins import RANGE
from admittance.memory import Real, Whole
from admittance.model import apply_hand, propose, to_port
from admittance.outcome import Limited, Setting, Slot, Touch
from admittance.steps import DONE, START, bound, damp, limit, try_velocity
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers, matrix, vector

SHARE = 0.3
"""Of its clearance or margin, by which anything may come nearer in a sub-step, by the linear prediction."""
KEPT = 0.5
"""Of the smallest clearance, and of every margin, that must be found left at the end of a sub-step."""
BENT = 0.1
"""Of a margin within range, by which it may fall short of its linear prediction.

The barrier moves a margin m outwards by about m in a sub-step, whatever its force. Where a wall is concave and the tool
slides along it, a sub-step that loses more than that to the wall's bend would press it in deeper and deeper.
"""
SMALLEST = 1.0 / 4096.0
"""Sub-step in periods, below which the velocity is scaled instead."""
MOST = 64
"""Sub-steps of a cycle; the last of them takes all the time that is left, with a velocity scaled to fit."""

JUDGE = 20
"""Q_TRIAL was evaluated: is the sub-step good?"""
AGAIN = 21
"""Q was evaluated again, after a sub-step that was taken back."""
STAY = 22
"""Q was evaluated again; nothing more is done in this cycle."""

_LEFT, _STEP, _CLEARANCE = 0, 1, 2


@compiled("float64(float64[:,::1], int64, float64, float64[::1])")
def approach(near: Array, count: int, h: float, v: Array) -> float:
    """Largest approach of a point within sight in h seconds, in shares of what it may be; at most 1 is allowed."""
    worst = 0.0
    for i in range(count):
        rate = near[i, 0] * v[0] + near[i, 1] * v[1] + near[i, 2] * v[2] + near[i, 3] * v[3]
        worst = max(worst, -h * rate / (SHARE * near[i, 4]))
    return worst


@compiled("float64(float64[:,::1], float64[::1], float64, float64[::1])")
def approach_of_margins(free: Array, margin: Array, h: float, v: Array) -> float:
    """The same of the constraints, from their rows (c, m) in the free coordinates."""
    worst = 0.0
    for i in range(margin.shape[0]):
        rate = inner(free[i], v)
        if rate < 0.0:
            worst = max(worst, -h * rate / (SHARE * margin[i]))
    return worst


@compiled(f"void({MEMORY}, float64, float64[::1])")
def expect_margins(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, h: float, v: Array) -> None:
    """LEAST (c,) becomes what must be found of each margin after h seconds of a free velocity v (m,)."""
    margin, reach, free = vector(f, fl, Real.MARGIN), matrix(f, fl, Real.REACH), matrix(f, fl, Real.FREE_ROW)
    least = vector(f, fl, Real.LEAST)
    for i in range(margin.shape[0]):
        span = reach[i, RANGE]
        least[i] = KEPT * min(margin[i], span)
        if margin[i] < span:
            predicted = margin[i] + h * inner(free[i], v)
            least[i] = max(least[i], min(predicted, span) - BENT * margin[i])


@compiled(f"int64({MEMORY})")
def margins_are_left(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """1 where every enforced constraint has the margin that was expected."""
    margin, least, enforced = vector(f, fl, Real.MARGIN), vector(f, fl, Real.LEAST), integers(w, wl, Whole.ENFORCED)
    for i in range(margin.shape[0]):
        if enforced[i] and not margin[i] >= least[i]:
            return 0
    return 1


@compiled(f"int64({MEMORY}, float64[:,::1])")
def substep(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, near: Array) -> int:
    """From the evaluated Q to the Q_TRIAL of the largest sub-step that the linear prediction allows."""
    progress, outcome = vector(f, fl, Real.PROGRESS), integers(w, wl, Whole.OUTCOME)
    new, least = vector(f, fl, Real.V_NEXT), SMALLEST * vector(f, fl, Real.SETTINGS)[Setting.PERIOD]
    last = outcome[Slot.SUBSTEPS] >= MOST - 1
    progress[_CLEARANCE] = vector(f, fl, Real.TOUCH)[Touch.CLEARANCE]
    apply_hand(f, fl, w, wl)
    damp(f, fl, w, wl)
    while True:
        h = progress[_STEP]
        to_port(f, fl, w, wl)
        bound(f, fl, w, wl)
        new[:] = 0.0
        if propose(f, fl, w, wl, h, 1, 1):
            new[:] = vector(f, fl, Real.V_REF)
        limit(f, fl, w, wl, new)
        share = approach(near, outcome[Slot.NEARBY], h, new)
        share = max(share, approach_of_margins(matrix(f, fl, Real.FREE_ROW), vector(f, fl, Real.MARGIN), h, new))
        if share <= 1.0:
            break
        if last or h <= least:
            new /= share
            outcome[Slot.LIMITED] |= Limited.SUBSTEPS
            break
        progress[_STEP] = max(0.5 * h, least)
    vector(f, fl, Real.LEDGER_LAST)[:] = vector(f, fl, Real.LEDGER)
    expect_margins(f, fl, w, wl, h, new)
    book_step(f, fl, w, wl, h, 1)
    try_velocity(f, fl, w, wl, h, new)
    return JUDGE


@compiled(f"int64({MEMORY}, float64[:,::1], int64, int64)")
def robust(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, near: Array, phase: int, blocked: int) -> int:
    """Go on from a phase to the next configuration that is to be evaluated; see `integrators`."""
    settings, outcome = vector(f, fl, Real.SETTINGS), integers(w, wl, Whole.OUTCOME)
    q, trial, v, new = (
        vector(f, fl, Real.Q),
        vector(f, fl, Real.Q_TRIAL),
        vector(f, fl, Real.V),
        vector(f, fl, Real.V_NEXT),
    )
    progress, period = vector(f, fl, Real.PROGRESS), settings[Setting.PERIOD]
    least = SMALLEST * period
    if phase == START:
        progress[_LEFT] = period
        progress[_STEP] = period
        outcome[Slot.SUBSTEPS] = 0
        return substep(f, fl, w, wl, near)
    if phase == STAY:
        return DONE
    if phase == AGAIN:
        return substep(f, fl, w, wl, near)
    clearance = vector(f, fl, Real.TOUCH)[Touch.CLEARANCE]
    left = clearance >= KEPT * min(progress[_CLEARANCE], settings[Setting.SIGHT]) and margins_are_left(f, fl, w, wl)
    if blocked == 0 and left:
        q[:] = trial
        v[:] = new
        progress[_LEFT] -= progress[_STEP]
        outcome[Slot.SUBSTEPS] += 1
        if progress[_LEFT] <= 0.5 * least:
            return DONE
        progress[_STEP] = progress[_LEFT]
        return substep(f, fl, w, wl, near)
    outcome[Slot.REJECTED] += 1
    vector(f, fl, Real.LEDGER)[:] = vector(f, fl, Real.LEDGER_LAST)
    trial[:] = q
    if progress[_STEP] > least and outcome[Slot.SUBSTEPS] < MOST - 1:
        progress[_STEP] = max(0.5 * progress[_STEP], least)
        return AGAIN
    outcome[Slot.LIMITED] |= Limited.SUBSTEPS
    new[:] = 0.0
    book_step(f, fl, w, wl, progress[_LEFT], 1)
    v[:] = 0.0
    return STAY
