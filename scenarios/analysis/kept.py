"""How far a run along a trajectory stayed from the boundaries of the constraints that it is to keep."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from scenarios.analysis.between import clearance_between
from scenarios.analysis.metrics import VIOLATED
from scenarios.analysis.penetration import penetration_depth
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part
from scenarios.scene import Scene


def to_keep(scene: Scene) -> list[str]:
    """Names of the constraints that the scene enforces, whether or not a run does; of all where it enforces none."""
    return [c.name for c in scene.constraints if c.enforced] or list(scene.constraints.names)


def kept_summary(trace: Trace, scene: Scene, parts: Mapping[str, Part]) -> dict[str, Any]:
    """What a summary says of the constraints that the scene enforces, under the keys of hands-on scenes where they fit.

    parts : the scene's anatomy. A run is inside while a margin in metres is below `metrics.VIOLATED`.
    """
    names, between = to_keep(scene), clearance_between(trace, scene, parts)
    metric = [name for name in names if trace.header["constraints"][name] == "m"]
    margins = np.array([trace.margin(name) for name in metric])
    at = float(margins.min()) if metric else None
    smallest = min((between["min_margin_between_m"][n] for n in metric), default=None) if between else None
    below = margins.min(axis=0) < VIOLATED if metric else np.zeros(0)
    return {
        **between,
        "to_keep": names,
        "clearance_m": {"at_samples": at, "between_samples": smallest},
        "penetration_depth_m": penetration_depth(at if smallest is None else smallest),
        "time_inside_s": float(np.count_nonzero(below) * trace.header["period_s"]),
    }
