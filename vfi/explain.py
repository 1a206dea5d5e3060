"""Why a command is not plain RUN, in words: which constraints conflict, how far they yield, what to do."""

import numpy as np

from primitives.memory import Memory
from vfi.memory import Real, Whole
from vfi.outcome import Guard, Option, Reason, Slot

_TEXT = {
    Reason.SOLVER: "the solver found no answer that is finite",
    Reason.HALVED: "re-solving did not keep all margins for a period; the command was scaled down",
    Reason.ACCELERATION: "the acceleration limits yielded to position or velocity limits, or to a constraint",
    Reason.SINGULAR: "a port cannot be kept: no joint velocity moves the shaft across it; standing still",
    Reason.SECOND_SOLVER: "the chosen solver found no answer that is verified; the active-set kernel did",
}


def conflict(memory: Memory, names: tuple[str, ...], joints: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the rows that contradict each other: constraints, "row k" for the user's, limits of joints."""
    active, rows, d = memory.whole[Whole.ACTIVE], rows_of(memory), len(joints)
    out = []
    for k in active[1 : 1 + active[0]]:
        if k < rows:
            out.append(label(memory, names, int(k)))
        else:
            out.append(f"{'lower' if k < rows + d else 'upper'} limit of {joints[(k - rows) % d]}")
    return tuple(dict.fromkeys(out))


def rows_of(memory: Memory) -> int:
    """How many rows there were in the last cycle."""
    return int(memory.float_layout[Real.B, 1])


def label(memory: Memory, names: tuple[str, ...], row: int) -> str:
    """What people call a row: its constraint, also for cuts and the points of a cloud, or "row k" for the user's."""
    whole = memory.whole
    fixed, uncut = int(whole[Whole.OPTIONS][Option.FIXED]), rows_of(memory) - int(whole[Whole.OPTIONS][Option.CUTS])
    if row >= uncut:
        row = int(whole[Whole.CUT][row - uncut])
    elif row >= fixed:
        row = int(whole[Whole.CLOUD][whole[Whole.OWNER][row - fixed], 0])
    return names[row] if row < len(names) else f"row {row - len(names)}"


def slacks(memory: Memory, names: tuple[str, ...]) -> dict[str, float]:
    """By how much each row that yielded falls short of its demand, per second."""
    rows, v = rows_of(memory), memory.real[Real.V]
    A, demand, slack = (memory.real[block][:rows] for block in (Real.A, Real.DEMAND, Real.SLACK))
    short = np.where(np.isfinite(demand), demand - A @ v, 0.0)
    if memory.whole[Whole.OPTIONS][Option.GUARD] != Guard.OFF:
        short = np.maximum(short, memory.real[Real.DEFECT][:rows] + slack)
    short[slack == 0.0] = 0.0
    out: dict[str, float] = {}
    for i in np.flatnonzero(short > 1e-9):
        name = label(memory, names, int(i))
        out[name] = max(out.get(name, 0.0), float(short[i]))
    return out


def _not_finite(memory: Memory) -> str:
    """Which number of the measurement or the reference is NaN or infinite."""
    given = ("metric", Real.METRIC), ("basis", Real.BASIS), ("offset", Real.OFFSET)
    for what, block in (("q", Real.Q), ("qdot", Real.QDOT), ("reference", Real.REFERENCE), *given):
        values = memory.real[block]
        if not np.isfinite(values).all():
            return f"{what}: expected finite numbers, got {values.tolist()}"
    return "an entity: expected finite numbers"


def explain(memory: Memory, names: tuple[str, ...], joints: tuple[str, ...]) -> str:
    """The reason of the last cycle's outcome, in one line."""
    outcome, angular = memory.whole[Whole.OUTCOME], memory.whole[Whole.ANGULAR]
    reason, where = Reason(int(outcome[Slot.REASON])), int(outcome[Slot.WHERE])

    def unit(name: str) -> str:
        return "rad" if name in names and angular[names.index(name)] else "m"

    if reason == Reason.NO_ROW:
        distance = memory.real[Real.DISTANCE][where]
        return (
            f'constraint "{names[where]}": its elements are at {distance:.3g} {unit(names[where])}, where the distance '
            "has no gradient and no row can be written"
        )
    if reason == Reason.NOT_FINITE:
        return _not_finite(memory)
    if reason == Reason.REFERENCE:
        x = memory.real[Real.REFERENCE][8 * where : 8 * where + 8]
        tips = len(memory.whole[Whole.TIPS])
        which = f"reference of task {where + 1} of {tips}" if tips > 1 else "reference"
        return (
            f"{which}: expected a unit dual quaternion r + eps (1/2) t r, got {x.tolist()}, with |r| = "
            f"{np.linalg.norm(x[:4]):.9g} and <r, dual part> = {x[:4] @ x[4:]:.3g}"
        )
    if reason == Reason.RECOVERING:
        margin = memory.real[Real.MARGIN][where]
        return f'constraint "{names[where]}" is violated by {-margin:.3g} {unit(names[where])} and is being left'
    if reason == Reason.OUT_OF_RANGE:
        position, limits = memory.real[Real.Q][memory.whole[Whole.DECIDED][where]], memory.real[Real.LIMITS][:2, where]
        return (
            f"{joints[where]} is at {position:.4g}, outside its range from {limits[0]:.4g} to {limits[1]:.4g}, and is "
            "being driven back"
        )
    if reason == Reason.NOT_KEPT:
        what = "a joint limit"
        if where >= 0:
            name = label(memory, names, where)
            what = f'constraint "{name}"' if name in names else name
        return f"{what} would not be kept for a period, neither re-solved nor scaled down; standing still"
    if reason == Reason.SLACK:
        parts = [f"{name} by {value:.3g} {unit(name)}/s" for name, value in slacks(memory, names).items()]
        return "constraints in conflict; these yield: " + (", ".join(parts) or "none measurably")
    if reason == Reason.INFEASIBLE:
        rows = ", ".join(conflict(memory, names, joints)) or "unknown"
        return f"no velocity within the joint limits satisfies all rows; in conflict: {rows}; standing still"
    return _TEXT.get(reason, "")
