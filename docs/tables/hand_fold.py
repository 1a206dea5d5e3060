"""S5 by hand: how far the light wrist turns when the tip is pushed at a constraint, 20 N for 1.5 s."""

import numpy as np

from docs.tables.hand_led import SCENE, lead, towards
from scenarios.by_hand.hand import Guide

NAME = "hand-fold"
HANDS = {"holds it": Guide(most=20.0), "lets it turn": Guide(most=20.0, turning_stiffness=0.0, turning_damping=0.0)}
HEAD = ("the tool's direction", "at", "`none`", "`admittance`", "`vfi`", "`both`")
PLAIN, ROBUST = "semi-implicit", "robust"


def rows() -> list[tuple[str, ...]]:
    """Largest turn of joint 7 or 8 from the start, deg; the potentials alone by the robust integrator."""
    out = []
    for hand, guide in HANDS.items():
        for name in SCENE.constraints.names:
            cells = []
            for enforcement in ("none", "admittance", "vfi", "both"):
                integrator = ROBUST if enforcement == "admittance" else PLAIN
                how = {"enforcement": enforcement, "integrator": integrator}
                q = lead(towards(name), guide, period=0.004, seconds=1.5, **how).q
                cells.append(f"{np.degrees(np.abs(q - q[0])[:, 6:8].max()):.0f}")
            out.append((hand, name, *cells))
    return out
