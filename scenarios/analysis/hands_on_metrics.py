"""Figures of merit of a hands-on run, from its trace and the anatomy it ran in."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from primitives.checks import Array
from primitives.constraint import Constraint
from primitives.robot import Robot
from scenarios.analysis.boundary_force import FELT, boundary_force, felt_clearance
from scenarios.analysis.jerk import jerk
from scenarios.analysis.metrics import EVENTS
from scenarios.analysis.penetration import penetration_depth, time_inside
from scenarios.analysis.tangential import tangential_freedom
from scenarios.analysis.tool_poses import kept_away, shaft_lines
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, placed_cloud
from scenarios.hands_on.scene import HandsOnScene

BETWEEN = 10
"""Sub-samples between two cycles at which the clearance is measured too."""
GUIDED_SPEED, GUIDED_TURN = 0.06, 0.25
"""Largest speed of the shaft's end, m/s, and turn of the shaft, rad/s, of guided motion; beyond, the tool slips."""
SETTLING = 0.4
"""Seconds after a slip until motion counts as guided again: ten time constants of the port error."""
BENT = 1.5
"""How much farther than from one cycle to the next a point of the tool may move between them, at most."""
SLIP = 0.2
"""Seconds after the end of a contact in which a tool that slips off is far away: with d_0 = 11.5 mm, 58 mm/s."""


def port_offset(port: Array, ends: Array, axes: Array) -> Array:
    """(k,) distances of the port from the shafts' lines, metres."""
    away = port - ends
    out: Array = np.linalg.norm(away - np.sum(away * axes, axis=1)[:, None] * axes, axis=1)
    return out


def clearance_of(constraint: Constraint, robot: Robot, parts: Mapping[str, Part], q: Array) -> Array:
    """(k,) margin of a region, metres: of the tool's surface from the spheres of the part, at joints (k, n)."""
    cloud, (starts, ends) = placed_cloud(constraint, parts), kept_away(constraint, robot, q)
    if constraint.first.kind == "point":
        found = cloud.distance(starts)
    else:
        found = np.array([cloud.segment_distance(a, b) for a, b in zip(starts, ends, strict=True)])
    out: Array = found - constraint.safe_distance
    return out


def clearance(scene: HandsOnScene, robot: Robot, parts: Mapping[str, Part], q: Array) -> Array:
    """(k,) smallest distance of the tool's surface from the spheres of any region, metres; inf without regions."""
    out = np.full(len(q), np.inf)
    for region in scene.regions:
        out = np.minimum(out, clearance_of(region, robot, parts, q))
    return out


def guided(ends: Array, axes: Array, period: float) -> NDArray[np.bool_]:
    """(k,) where the shaft has moved slowly for a while: what the paper's experiments call guided motion."""
    speed = np.linalg.norm(np.diff(ends, axis=0, prepend=ends[:1]), axis=1) / period
    turn = np.linalg.norm(np.diff(axes, axis=0, prepend=axes[:1]), axis=1) / period
    fast = (speed > GUIDED_SPEED) | (turn > GUIDED_TURN)
    window = max(1, round(SETTLING / period))
    recent: NDArray[np.bool_] = np.convolve(fast, np.ones(window), mode="full")[: len(fast)] < 0.5
    return recent


def between(scene: HandsOnScene, robot: Robot, parts: Mapping[str, Part], q: Array) -> Array:
    """(k - 1,) smallest clearance at `BETWEEN` - 1 sub-samples of the joints' way from each cycle to the next, metres.

    Looked at are the cycles which can hold the smallest of all, as the tool is no farther off than it moves in them;
    the others are inf.
    """
    at, moved = clearance(scene, robot, parts, q), np.zeros(len(q) - 1)
    for points in (ends for region in scene.regions for ends in kept_away(region, robot, q)):
        moved = np.maximum(moved, np.linalg.norm(np.diff(points, axis=0), axis=1))
    close = np.flatnonzero(np.minimum(at[:-1], at[1:]) < at.min() + BENT * moved)
    out = np.full(len(moved), np.inf)
    if not len(close):
        return out
    shares = np.arange(1, BETWEEN) / BETWEEN
    ways = (q[close, None] + shares[:, None] * (q[close + 1] - q[close])[:, None]).reshape(-1, q.shape[1])
    found = clearance(scene, robot, parts, ways).reshape(-1, len(shares))
    out[close] = found.min(axis=1)
    return out


def slipped(touching: NDArray[np.bool_], clearances: Array, reach: float, period: float) -> bool:
    """Whether the tool jumped off a region: soon after the repulsion ended it was farther off by more than its range.

    touching (k,) says where the boundary pushes, clearances (k,) how far the tool is from the spheres, metres; reach is
    d_0, metres. Without regions, whose distance is infinite, there is nothing to slip off.
    """
    if not np.isfinite(clearances).all():
        return False
    window = max(1, round(SLIP / period))
    ends = np.flatnonzero(touching[:-1] & ~touching[1:])
    return any(clearances[k : k + window + 1].max() - clearances[k] > reach for k in ends)


def summary(trace: Trace, scene: HandsOnScene, parts: Mapping[str, Part]) -> dict[str, Any]:
    """What `vfi run --json` prints of a hands-on run; the keys are documented in docs/metrics.md."""
    header, robot, period = trace.header, scene.build_robot(), float(trace.header["period_s"])
    port = np.array(scene.port)
    ends, axes = shaft_lines(scene, robot, trace)
    offset = port_offset(port, ends, axes)
    at = clearance(scene, robot, parts, trace["plant_q"])
    inner = between(scene, robot, parts, trace["plant_q"])
    force = np.linalg.norm(trace["hand_wrench"][:, :3], axis=1)
    times, states, limited = trace["cycle_us"], trace["state"], trace["limited"].astype(int)
    p5, median, p99 = (float(p) for p in np.percentile(times, [5, 50, 99]))
    travel = float(np.linalg.norm(np.diff(ends, axis=0), axis=1).sum())
    smallest = _smallest(np.append(inner, at))
    push, jerks = np.linalg.norm(boundary_force(trace, scene), axis=1), jerk(ends, period)
    touching = (np.linalg.norm(trace["repulsion"], axis=1) > 0.0) | (push > FELT)
    return {
        "kind": header["kind"],
        "scene": header["scene"],
        "robot": header["robot"],
        "plant": header["plant"],
        "enforcement": header["enforcement"],
        "integrator": header["solver"],
        "form": header["form"],
        "guard": header["guard"],
        "period_s": period,
        "cycles": len(trace.records),
        "port_error_m": {"max": float(offset.max()), "rms": float(np.sqrt(np.mean(offset**2)))},
        "reference_port_error_m": _norms(trace["x_c"]),
        "guided_reference_port_error_m": _largest_where(trace["x_c"], guided(ends, axes, period)),
        "clearance_m": {"at_samples": _smallest(at), "between_samples": smallest},
        "penetration_depth_m": penetration_depth(smallest),
        "time_inside_s": time_inside(at, period),
        "felt_clearance_m": felt_clearance(push, at),
        "passivity_excess_J": float(trace["excess"][-1]),
        "passivity_excess_chord_J": float(trace["excess_chord"][-1]),
        "hand_work_J": float(trace["hand"][-1]),
        "constraint_work_J": float(trace["ports"][-1].sum()),
        "ports_J": dict(zip(trace.header["ports"], trace["ports"][-1].tolist(), strict=True)),
        "guard_interventions": int(trace["intervened"].sum()),
        "dissipated_J": float(trace["dissipated"][-1]),
        "contact_fraction": float(touching.mean()),
        "slipped": slipped(touching, at, scene.parameters.d_0, period),
        "max_force_N": float(force.max()),
        "mean_force_N": float(force.mean()),
        "max_boundary_force_N": float(push.max()),
        "max_repulsion_N": float(np.linalg.norm(trace["repulsion"][:, :3], axis=1).max()),
        "contact_force_N": {
            name.removeprefix("contact_"): float(np.linalg.norm(trace[name], axis=1).max())
            for name in trace.columns
            if name.startswith("contact_")
        },
        "travel_m": travel,
        "tangential_freedom": tangential_freedom(trace, scene, parts),
        "jerk_m_s3": {
            "max": float(jerks.max(initial=0.0)),
            "rms": float(np.sqrt(np.sum(jerks**2) / max(len(jerks), 1))),
        },
        "speed_m_s": {"max": float(np.linalg.norm(np.diff(ends, axis=0), axis=1).max() / period)},
        "substeps": {"mean": float(trace["substeps"].mean()), "max": int(trace["substeps"].max())},
        "limited_cycles": {
            word: int(np.count_nonzero(limited & bit))
            for word, bit in (("velocity", 1), ("position", 2), ("singularity", 4), ("port", 8), ("substeps", 16))
        },
        "degraded_cycles": int(np.count_nonzero(states == 1.0)),
        "stopped_cycles": int(np.count_nonzero(states > 1.0)),
        "events": [event._asdict() for event in trace.events[:EVENTS]],
        "cycle_us": {"p5": p5, "median": median, "p99": p99, "max": float(times.max())},
        "seed": header["seed"],
        "versions": header["versions"],
    }


def _smallest(distances: Array) -> float | None:
    """None where there is no region to be near."""
    return float(distances.min()) if np.isfinite(distances.min()) else None


def _largest_where(values: Array, chosen: NDArray[np.bool_]) -> float:
    return float(np.linalg.norm(values, axis=1)[chosen].max(initial=0.0))


def _norms(values: Array) -> dict[str, float]:
    norms = np.linalg.norm(values, axis=1)
    return {"max": float(norms.max()), "rms": float(np.sqrt(np.mean(norms**2)))}
