"""S1-S5 by hand under each enforcement: what is violated, what the hand does and feels."""

from scenarios.analysis.between import clearance_between
from scenarios.by_hand.metrics import summary
from scenarios.by_hand.run import run_by_hand
from scenarios.scene_file import load_scene

NAME = "hand-matrix"
SCENES, ENFORCEMENTS = ("S1-hand", "S2-hand", "S3-hand", "S4-hand", "S5-hand"), ("admittance", "vfi", "both")
HEAD = (
    "scene",
    "enforcement",
    "C1",
    "C2",
    "C3",
    "C4",
    "excess, J",
    "hand, J",
    "force, N",
    "mean, N",
    "off, mm",
    "turned, deg",
)


def rows() -> list[tuple[str, ...]]:
    """Smallest margins in mm, at and between cycles, bold where violated; one row for each scene and enforcement."""
    out = []
    for name in SCENES:
        scene = load_scene(name)
        for enforcement in ENFORCEMENTS:
            trace = run_by_hand(scene, enforcement=enforcement)
            found, between = summary(trace), clearance_between(trace, scene, {})["min_margin_between_m"]
            smallest = {c: min(m, between[c]) for c, m in found["min_margin_m"].items()}
            cells = [f"**{m * 1e3:.2f}**" if m < 0.0 else f"{m * 1e3:.2f}" for m in smallest.values()]
            excess = found["passivity_excess_J"]
            said = (
                "< 1e-12" if excess < 1e-12 else f"{excess:.1e}",
                f"{found['hand_work_J']:.3f}",
                f"{found['max_force_N']:.1f}",
                f"{found['mean_force_N']:.1f}",
                f"{found['position_error_m']['max'] * 1e3:.2f}",
                f"{found['orientation_error_rad']['max'] * 57.29577951308232:.2f}",
            )
            out.append((f"`{name}`", f"`{enforcement}`", *cells, *said))
    return out
