"""Old measurements and slow joints: how far a point overshoots a wall that it approaches at 50 mm/s."""

import numpy as np

from docs.tables.point import drive, millimetres
from primitives import Constraint, Plane, Point

NAME = "delay"
SPEED, PERIOD, GAIN = 0.05, 0.004, 10.0
"""Wanted towards the wall, m/s; T, s; eta, 1/s."""
DELAYS = (0, 5, 9, 12, 20, 30)
"""Cycles."""
LAGS = (0.010, 0.025, 0.050, 0.100, 0.200)
"""Seconds."""
HEAD = ("what is late", "$\\tau$, ms", "$\\eta \\tau$", "smallest margin, mm", "$v \\tau$, mm")


def rows() -> list[tuple[str, ...]]:
    """Delays of the measurement first, then lags of the joints."""
    wall = Plane.through(point=[0.0, 0.0, 0.0], normal=[0.0, 0.0, 1.0])
    keep = Constraint("wall", Point.at([0.0, 0.0, 0.0], frame="frame3"), wall, "outside", 0.0)
    cases = [("measurement", n * PERIOD, {"delay": n}) for n in DELAYS]
    cases += [("joints", lag, {"lag": lag}) for lag in LAGS]
    out = []
    for what, late, arguments in cases:
        run = drive(
            keep,
            np.array([0.0, 0.0, 0.05]),
            lambda at: np.array([0.0, 0.0, -SPEED]),
            eta=GAIN,
            period=PERIOD,
            seconds=4.0,
            **arguments,
        )
        smallest = millimetres(run.margin.min())
        out.append((what, f"{late * 1e3:g}", f"{GAIN * late:g}", smallest, f"{SPEED * late * 1e3:.2f}"))
    return out
