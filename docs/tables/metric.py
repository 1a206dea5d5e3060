"""What the metric of the projection does to the energy: a hand leads the tool along the wall of a bowl, rows alone."""

import numpy as np

from scenarios.analysis.hands_on_metrics import summary
from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any

NAME = "metric"
HEAD = ("scene", "arm", "metric", "excess, J", "work of the hand, J", "smallest clearance, mm")


def rows() -> list[tuple[str, ...]]:
    """The passive metric and that of the joints, for both bowls and both arms."""
    out = []
    for name in ("bowl-tip", "bowl-tool"):
        for robot in ("lwr4plus", "neuro8"):
            scene = load_any(name, robot)
            parts = build_parts(scene.anatomy, np.array(scene.port))
            for metric, words in (("free", "$M + TD$"), ("joints", "$Z Z^T$")):
                trace = run_hands_on(scene, parts=parts, enforcement="vfi", metric=metric)
                found = summary(trace, scene, parts)
                excess = found["passivity_excess_J"]
                out.append(
                    (
                        f"`{name}`",
                        f"`{robot}`",
                        words,
                        f"{excess:.3f}" if excess > 1e-9 else "< 1e-9",
                        f"{found['hand_work_J']:.3f}",
                        f"{min(found['clearance_m'].values()) * 1e3:.3f}",
                    )
                )
    return out
