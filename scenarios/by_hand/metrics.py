"""Figures of merit of a run by hand: those of a trajectory, and what the hand did."""

from typing import Any

import numpy as np

from scenarios.analysis.metrics import summary as summary_of_trajectory
from scenarios.analysis.trace import Trace


def summary(trace: Trace) -> dict[str, Any]:
    """What `vfi run --json` prints of a run by hand; the keys are documented in docs/by_hand.md."""
    force, torque = (np.linalg.norm(part, axis=1) for part in np.hsplit(trace["hand_wrench"], 2))
    return {
        **summary_of_trajectory(trace),
        "metric": trace.header["metric"],
        "hand_work_J": float(trace["hand"][-1]),
        "dissipated_J": float(trace["dissipated"][-1]),
        "constraint_work_J": float(trace["ports"][-1].sum()),
        "ports_J": dict(zip(trace.header["ports"], trace["ports"][-1].tolist(), strict=True)),
        "passivity_excess_J": float(trace["excess"][-1]),
        "max_force_N": float(force.max()),
        "mean_force_N": float(force.mean()),
        "max_torque_Nm": float(torque.max()),
        "mean_torque_Nm": float(torque.mean()),
    }
