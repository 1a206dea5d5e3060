"""S5 by hand: the tip is led slowly down at the plane of C4; from where the hand feels it."""

import numpy as np

from docs.tables.hand_led import SCENE, Led, lead
from docs.tables.point import millimetres
from scenarios.by_hand.hand import Guide

NAME = "hand-feel"
PERIOD, SPEED, SECONDS = 0.004, 0.005, 6.0
"""s, m/s and s."""
HEAD = ("enforcement", "1 N more at", "3 N more at", "9 N more at", "smallest margin")


def _felt(found: Led, free: Led, newtons: float) -> str:
    """The margin of C4 at which the hand's force exceeds that without constraints by so much, mm."""
    more = found.force - free.force >= newtons
    place = SCENE.constraints.names.index("C4")
    return f"{millimetres(found.margin[int(np.argmax(more)), place], 2)} mm" if more.any() else "never"


def rows() -> list[tuple[str, ...]]:
    """One row for each enforcement."""
    runs = {
        enforcement: lead(
            np.array([0.0, 0.0, -1.0]), Guide(), enforcement=enforcement, period=PERIOD, seconds=SECONDS, speed=SPEED
        )
        for enforcement in ("none", "admittance", "vfi", "both")
    }
    free = runs.pop("none")
    return [
        (f"`{e}`", *(_felt(run, free, n) for n in (1.0, 3.0, 9.0)), f"{millimetres(run.margin.min(), 2)} mm")
        for e, run in runs.items()
    ]
