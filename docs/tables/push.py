"""A hand pushes with a step of force along the tool, into a bowl: what each enforcement keeps."""

from dataclasses import replace

import numpy as np

from scenarios.analysis.hands_on_metrics import summary
from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.push import Push
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any

NAME = "push"
GAPS, FORCES, ENFORCEMENTS = (0.0, 0.002, 0.004, 0.006), (10.0, 20.0, 30.0), ("admittance", "vfi", "both")
"""By how much the bowl's bottom is lower than in the scene, m; N."""
HEAD = ("part", "bottom lower by", "force", "admittance", "vfi", "both")


def rows() -> list[tuple[str, ...]]:
    """Smallest clearance in mm, at and between cycles; in bold where it is below zero."""
    out = []
    for part in ("tip", "tool"):
        for gap in GAPS:
            scene = load_any(f"bowl-{part}")
            scene = scene.with_changes(anatomy=replace(scene.anatomy, at=(0.0, 0.0, -0.126 - gap)), duration=1.5)
            parts = build_parts(scene.anatomy, np.array(scene.port))
            for newtons in FORCES:
                pushed = scene.with_changes(hand=Push(times=(0.05,), wrenches=((0.0, 0.0, -newtons, 0.0, 0.0, 0.0),)))
                cells = []
                for enforcement in ENFORCEMENTS:
                    found = summary(run_hands_on(pushed, parts=parts, enforcement=enforcement), pushed, parts)
                    smallest = min(found["clearance_m"].values())
                    text = f"{smallest * 1e3:.3f}"
                    cells.append(f"**{text}**" if smallest < 0.0 else text)
                out.append((part, f"{gap * 1e3:g} mm", f"{newtons:g} N", *cells))
    return out
