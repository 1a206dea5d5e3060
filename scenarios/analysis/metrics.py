"""Figures of merit of a run, from its trace."""

from typing import Any

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array
from scenarios.analysis.trace import Trace

VIOLATED = -1e-5
"""A margin below this counts as violated, metres or radians."""
EVENTS = 20
"""Changes of state that a summary lists; the trace holds all."""
SETTLED = 2.0
"""Seconds at the end over which the acceleration is judged."""


def acceleration_rms(trace: Trace, seconds: float = SETTLED) -> float:
    """Root mean square over the last seconds of the norm over the joints of (q̇_k - q̇_{k-1}) / T."""
    period = float(trace.header["period_s"])
    acceleration = np.diff(trace["qdot"], axis=0) / period
    last = acceleration[-max(1, round(seconds / period)) :]
    return float(np.sqrt(np.mean(np.sum(last**2, axis=1)))) if len(last) else 0.0


def task_error(error: Array) -> dict[str, float]:
    """Largest and root mean square norm of errors (cycles, k)."""
    norm = np.linalg.norm(error, axis=1)
    return {"max": float(norm.max()), "rms": float(np.sqrt(np.mean(norm**2)))}


def position_error(trace: Trace, tool: int = 0) -> Array:
    """(k,) metres from where a tool is to where it is wanted, at the beginning of each cycle."""
    place = slice(8 * tool, 8 * tool + 8)
    apart = positions(trace["pose"][:, place]) - positions(trace["reference"][:, place])
    out: Array = np.linalg.norm(apart, axis=1)
    return out


def orientation_error(trace: Trace, tool: int = 0) -> Array:
    """(k,) rad from how a tool is turned to how it is wanted, at the beginning of each cycle."""
    place = slice(8 * tool, 8 * tool + 4)
    r, wanted = trace["pose"][:, place], trace["reference"][:, place]
    # Unit quaternions of a turn by an angle lie 2 sin(angle / 4) apart.
    chord = np.minimum(np.linalg.norm(r - wanted, axis=1), np.linalg.norm(r + wanted, axis=1))
    out: Array = 4.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    return out


def largest_and_rms(values: Array) -> dict[str, float]:
    """{"max", "rms"} of values (k,)."""
    return {"max": float(values.max()), "rms": float(np.sqrt(np.mean(values**2)))}


def _errors(trace: Trace) -> dict[str, Any]:
    """How far the tool is from where it is wanted; of several tools also the error of each task."""
    frames = trace.header.get("tasks", ())
    if len(frames) < 2:
        return {
            "position_error_m": largest_and_rms(position_error(trace)),
            "orientation_error_rad": largest_and_rms(orientation_error(trace)),
        }
    errors, distances = {}, {}
    for k, frame in enumerate(frames):
        place = slice(8 * k, 8 * k + 8)
        errors[frame] = task_error(trace["error"][:, place])
        distances[frame] = largest_and_rms(position_error(trace, k))
    return {"task_error_of": errors, "tip_distance_m": distances}


def positions(poses: Array) -> Array:
    """Positions (k, 3) of unit dual quaternions (k, 8), metres."""
    return np.array([dq.translation(np.ascontiguousarray(pose)) for pose in poses])


def summary(trace: Trace) -> dict[str, Any]:
    """What `vfi run --json` prints of a run; the keys are documented in docs/metrics.md."""
    header, names = trace.header, trace.header["constraints"]
    smallest = {name: float(trace.margin(name).min()) for name in names}
    times = trace["cycle_us"]
    p5, median, p99 = (float(p) for p in np.percentile(times, [5, 50, 99]))
    states = trace["state"]
    return {
        "kind": header["kind"],
        "scene": header["scene"],
        "robot": header["robot"],
        "solver": header["solver"],
        "enforcement": header["enforcement"],
        "plant": header["plant"],
        **({"coordination": header["coordination"]} if header.get("coordination") else {}),
        "guard": header["guard"],
        "period_s": header["period_s"],
        "cycles": len(trace.records),
        "violated": [name for name in names if smallest[name] < VIOLATED],
        "min_margin_m": {n: smallest[n] for n, unit in names.items() if unit == "m"},
        "min_margin_rad": {n: smallest[n] for n, unit in names.items() if unit == "rad"},
        "row_shortfall": float(trace["shortfall"].max()),
        "infeasible_cycles": int(trace["infeasible"].sum()),
        "guard_interventions": int(trace["intervened"].sum()),
        "halved_cycles": int(np.count_nonzero(trace["halvings"])),
        "degraded_cycles": int(np.count_nonzero(states == 1.0)),
        "stopped_cycles": int(np.count_nonzero(states > 1.0)),
        "events": [event._asdict() for event in trace.events[:EVENTS]],
        "task_error": task_error(trace["error"]),
        **_errors(trace),
        "acceleration_rms": acceleration_rms(trace, len(trace.records) * float(header["period_s"])),
        "acceleration_rms_last_2s": acceleration_rms(trace),
        "cycle_us": {"p5": p5, "median": median, "p99": p99, "max": float(times.max())},
        "seed": header["seed"],
        "versions": header["versions"],
    }
