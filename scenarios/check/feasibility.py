"""Is there a velocity at the start that keeps every row within the joint limits, and if not, which rows conflict?

A linear program, apart from the solver that the run will use: the largest shortfall of the rows is minimised over the
bounds. Where it is not zero, rows and limits are left out one after the other as long as the rest still conflicts;
what is left conflicts, and no part of it does.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from primitives.checks import Array
from primitives.vectors import DEGENERATE
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.space import Space
from vfi.forms import EQUALITY, ROWS, PortForm
from vfi.inequality import demanded_rate
from vfi.limits import fill_bounds

CHECK = "feasibility"
KEPT = 1e-9
"""Shortfall that rounding may leave, 1/s of the margin's unit."""


class Program(NamedTuple):
    """Rows A v >= b with their names and units, and the bounds of the d decided velocities."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    A: Array
    b: Array
    low: Array
    high: Array


def program(
    space: Space,
    eta: Mapping[str, float],
    limit_eta: float,
    period: float,
    recovery: tuple[float, float],
    forms: Mapping[str, PortForm] | None = None,
) -> Program:
    """The rows and bounds at the start.

    Parameters
    ----------
    eta : {constraint: 1/s}; one that has none is left out. limit_eta : 1/s. period : T, seconds.
    recovery : fastest way out of a violation that is asked for, m/s and rad/s.

    forms : of entry ports; a soft one asks for nothing here.

    A port, that of a hands-on scene or one of the form "equality", is two equalities, each as two rows: the shaft may
    not move across it. How fast an error at the port fades is no part of it, as that is slowed down to what the limits
    leave.
    """
    given = forms or {}
    sight, x = space.at(space.first), space.first
    limits = np.ascontiguousarray([limit[space.decided] for limit in space.robot.limits])
    low, high = np.empty(len(x)), np.empty(len(x))
    fill_bounds(space.all_joints(x), space.decided, limits, np.zeros(len(x)), limit_eta, period, 0, low, high)
    kept = [
        i
        for i, c in enumerate(space.constraints)
        if c.enforced and c.name in eta and given.get(c.name, ROWS) == ROWS
        if np.isfinite(sight.margin[i]) and sight.status[i] != DEGENERATE
    ]
    items = [list(space.constraints)[i] for i in kept]
    b = [
        demanded_rate(float(sight.margin[i]), eta[c.name], recovery[c.definition.unit == "rad"])
        for i, c in zip(kept, items, strict=True)
    ]
    ports = {c.name: space.port_rows(c) for c in space.constraints if c.enforced and given.get(c.name) == EQUALITY}
    if len(sight.port):
        ports["port"] = sight.port_row
    across = np.vstack([*(rows for rows in ports.values()), np.zeros((0, len(x)))])
    named = [name for name, rows in ports.items() for _ in rows]
    names = [*(c.name for c in items), *named, *named]
    units = [*(c.definition.unit for c in items), *["m"] * 2 * len(named)]
    A = np.vstack([sight.row[kept], across, -across])
    b += [0.0] * 2 * len(named)
    return Program(tuple(names), tuple(units), A, np.array(b), low, high)


def shortfall(p: Program, rows: list[int], lower: list[int], upper: list[int]) -> float:
    """Smallest possible largest shortfall of some rows within some of the bounds; 0 where all can be kept."""
    d = len(p.low)
    if not rows:
        return 0.0
    bounds = [(float(p.low[j]) if j in lower else None, float(p.high[j]) if j in upper else None) for j in range(d)]
    out = linprog(
        np.r_[np.zeros(d), 1.0],
        A_ub=np.c_[-p.A[rows], -np.ones(len(rows))],
        b_ub=-p.b[rows],
        bounds=[*bounds, (0.0, None)],
        method="highs",
    )
    return float(out.fun) if out.status == 0 else np.inf


def conflict(p: Program) -> tuple[list[int], list[int], list[int]]:
    """Rows, lower and upper bounds of a conflict that no part of still is."""
    d = len(p.low)
    sets = [list(range(len(p.b))), list(range(d)), list(range(d))]
    for k in (1, 2, 0):
        for item in list(sets[k]):
            fewer = [[i for i in s if i != item] if n == k else s for n, s in enumerate(sets)]
            if shortfall(p, *fewer) > KEPT:
                sets = fewer
    return sets[0], sets[1], sets[2]


def feasible_at_start(space: Space, p: Program) -> Part:
    """Whether the rows of `program` can be kept, and the names of those that cannot."""
    d = len(p.low)
    everything = list(range(len(p.b))), list(range(d)), list(range(d))
    short = shortfall(p, *everything)
    rows = [{"rows": len(p.b), "joints": d, "feasible": bool(short <= KEPT), "shortfall_per_s": short}]
    if short <= KEPT:
        return Part(CHECK, rows)
    which, lower, upper = conflict(p)
    names = [
        *dict.fromkeys(p.names[i] for i in which),
        *(f"lower limit of {space.joints[j]}" for j in lower),
        *(f"upper limit of {space.joints[j]}" for j in upper),
    ]
    unit = f"{p.units[which[0]]}/s"
    what = (
        f"no velocity at the start keeps these together: {', '.join(names)}; they fall short by {amount(short, unit)}"
    )
    advice = "start where fewer of them are violated, lower their eta, or watch one of them"
    return Part(CHECK, rows, [Finding(Severity.ERROR, CHECK, names[0], what, advice, {"shortfall_per_s": short})])
