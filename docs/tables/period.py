"""S5 at several control periods: what the guard has to do, and what sampling costs."""

import numpy as np

from scenarios.analysis.metrics import summary
from scenarios.run import run
from scenarios.scene_file import load_scene

NAME = "period"
PERIODS = (0.001, 0.002, 0.004, 0.008, 0.016)
"""s; the task's gain of 50 1/s allows at most 20 ms."""
HEAD = (
    "$T$, ms",
    "guard acted, cycles",
    "of",
    "smallest margin, mm",
    "the same without the guard, mm",
    "largest pose error",
)


def rows() -> list[tuple[str, ...]]:
    """One row a period."""
    scene, out = load_scene("S5"), []
    for period in PERIODS:
        trace = run(scene, period=period)
        on, off = summary(trace), summary(run(scene, period=period, guard="off"))
        out.append(
            (
                f"{period * 1e3:g}",
                str(on["guard_interventions"]),
                str(on["cycles"]),
                *(f"{min(found['min_margin_m'].values()) * 1e3:.4f}" for found in (on, off)),
                f"{np.linalg.norm(trace['error'], axis=1).max():.2e}",
            )
        )
    return out
