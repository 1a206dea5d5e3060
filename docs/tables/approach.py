"""How a row brakes: a point that wants to go through a wall at 50 mm/s, for several gains."""

import numpy as np

from docs.tables.point import drive, millimetres
from primitives import Constraint, Plane, Point

NAME = "approach"
SPEED, PERIOD = 0.05, 0.004
"""Wanted towards the wall, m/s; T, s."""
GAINS = (0.5, 2.0, 10.0, 50.0, 250.0)
"""1/s; the last is 1 / T."""
HEAD = (
    "$\\eta$, 1/s",
    "$\\eta T$",
    "braking begins at, mm",
    "$v/\\eta$, mm",
    "hardest braking, m/s²",
    "$\\eta v$, m/s²",
    "time to 0.5 mm, s",
    "smallest margin, mm",
)


def rows() -> list[tuple[str, ...]]:
    """One row a gain."""
    wall = Plane.through(point=[0.0, 0.0, 0.0], normal=[0.0, 0.0, 1.0])
    keep = Constraint("wall", Point.at([0.0, 0.0, 0.0], frame="frame3"), wall, "outside", 0.0)
    out = []
    for eta in GAINS:
        first = 1.5 * SPEED / eta + 0.02  # m
        run = drive(
            keep,
            np.array([0.0, 0.0, first]),
            lambda at: np.array([0.0, 0.0, -SPEED]),
            eta=eta,
            period=PERIOD,
            seconds=first / SPEED + 8.0 / eta,
        )
        speed = -run.command[:, 2]
        braking = int(np.argmax(speed < SPEED * (1.0 - 1e-9)))
        near = int(np.argmax(run.margin < 0.0005))
        late = (near - braking) * PERIOD
        out.append(
            (
                f"{eta:g}",
                f"{eta * PERIOD:g}",
                f"{run.margin[braking - 1] * 1e3:.2f}",
                f"{SPEED / eta * 1e3:.2f}",
                f"{np.max(-np.diff(speed)) / PERIOD:.3g}",
                f"{eta * SPEED:.3g}",
                f"{max(late, 0.0):.2f}",
                millimetres(run.margin.min()),
            )
        )
    return out
