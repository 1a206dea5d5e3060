"""S5 by hand: a hand pushes the tip at each constraint with a step of force; what each enforcement keeps."""

from docs.tables.hand_led import SCENE, lead, towards
from docs.tables.point import millimetres
from scenarios.by_hand.hand import Guide

NAME = "hand-push"
FORCES, PERIODS = (10.0, 20.0, 30.0), (0.004, 0.008)
"""N and s."""
HOW = (
    {"enforcement": "admittance"},
    {"enforcement": "admittance", "guard": "act"},
    {"enforcement": "admittance", "integrator": "robust"},
    {"enforcement": "vfi"},
    {"enforcement": "both"},
)
HEAD = ("at", "$T$", "force", "`admittance`", "guard act", "`robust`", "`vfi`", "`both`")


def rows() -> list[tuple[str, ...]]:
    """Smallest margin of all constraints, mm, at and between cycles; bold below zero; excess in J behind it."""
    out = []
    for name in SCENE.constraints.names:
        direction = towards(name)
        for period in PERIODS:
            for newtons in FORCES:
                cells = []
                for how in HOW:
                    found = lead(direction, Guide(most=newtons), period=period, seconds=1.5, **how)
                    smallest = found.margin.min()
                    text = millimetres(smallest, 3)
                    text = f"**{text}**" if smallest < -1e-8 else text
                    cells.append(text + (f" ({found.excess:.1g})" if found.excess >= 1e-4 else ""))
                out.append((name, f"{period * 1e3:g} ms", f"{newtons:g} N", *cells))
    return out
