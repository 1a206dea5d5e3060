"""Sampled time in a cylinder: a point that runs along the inner wall, without the guard and with it."""

import numpy as np

from docs.tables.point import drive
from primitives import Constraint, Line, Point
from primitives.checks import Array

NAME = "drift"
RADIUS, SPEED = 0.014, 0.05
"""Of the cylinder, m; along the wall, m/s."""
CASES = ((0.001, 0.5), (0.004, 0.5), (0.008, 0.5), (0.008, 5.0), (0.008, 50.0))
"""T in s, eta in 1/s."""
HEAD = (
    "$T$, ms",
    "$\\eta$, 1/s",
    "$v^2 T / (2 R \\eta)$, mm",
    "deepest, guard off, mm",
    "deepest, guard on, mm",
    "speed kept, guard on",
)


def _along(at: Array) -> Array:
    """The wanted velocity: round the z axis, and a little outwards."""
    away = np.array([at[0], at[1], 0.0]) / np.hypot(at[0], at[1])
    return SPEED * np.array([-away[1], away[0], 0.0]) + 0.2 * SPEED * away


def rows() -> list[tuple[str, ...]]:
    """One row for each pair of T and eta."""
    axis = Line.through(point=[0.0, 0.0, 0.0], direction=[0.0, 0.0, 1.0])
    keep = Constraint("cylinder", Point.at([0.0, 0.0, 0.0], frame="frame3"), axis, "inside", RADIUS)
    start, out = np.array([RADIUS - 1e-4, 0.0, 0.0]), []
    for period, eta in CASES:
        off, on = (
            drive(keep, start, _along, eta=eta, period=period, seconds=8.0 / eta, guard=guard)
            for guard in ("off", "act")
        )
        last = np.linalg.norm(on.command[len(on.command) // 2 :], axis=1)
        out.append(
            (
                f"{period * 1e3:g}",
                f"{eta:g}",
                f"{SPEED**2 * period / (2.0 * RADIUS * eta) * 1e3:.4f}",
                f"{-off.margin.min() * 1e3:.4f}",
                f"{max(-on.margin.min() * 1e3, 0.0):.4f}",
                f"{np.median(last) / SPEED:.3f}",
            )
        )
    return out
