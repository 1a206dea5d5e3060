"""Does the arm follow its reference when nothing is enforced, and which constraints would it leave on its way?

The scene's own controller, with all constraints watched, on ideal joints.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.constraint import ConstraintSet
from primitives.kinematics import snapshot, world_first
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.space import Space
from scenarios.plants.kinematic import KinematicPlant
from scenarios.scene import Scene
from scenarios.trajectory import Station
from vfi.controller import Controller

CHECK = "reference"
CYCLES = 4000
"""Most cycles that are followed; a longer scene is followed with a longer period."""
REACHED_LINEAR, REACHED_ANGULAR = 1e-3, 0.0175
"""How near the tip must come to a waypoint, m and rad."""
_BINDING = 1.0 - 1e-6


class Due(NamedTuple):
    """A waypoint: what findings call it, when it is due and the time of a segment, seconds, and if it is the last."""

    name: str
    t: float
    segment: float
    last: bool


class Followed(NamedTuple):
    """The motion without constraints, k cycles of d decided joints and m constraints.

    Attributes
    ----------
    period : seconds. x, v : (k, d) positions and commanded velocities. margins : (k, m).
    due : w waypoints of all tasks. linear, angular : (w, k) of the task's frame from each, metres and rad.
    off : for each task, m and rad at the first cycle between its frame and where its reference begins.
    at_velocity, at_position : (k, d) whether a joint is held back by its velocity limit, or by its position limits.
    """

    period: float
    x: Array
    v: Array
    margins: Array
    due: tuple[Due, ...]
    linear: Array
    angular: Array
    off: tuple[tuple[float, float], ...]
    at_velocity: np.ndarray
    at_position: np.ndarray


def follow(scene: Scene, space: Space) -> Followed:
    """Follow the reference from the start, with nothing enforced."""
    period = max(scene.period, scene.duration / CYCLES)
    tasks = [replace(task, gain=min(task.gain, 1.0 / period)) for task in scene.tasks]
    limit_eta = min(scene.in_force.limit_eta, 1.0 / period)
    robot, start = space.robot, np.array(scene.start)
    controller = Controller(
        robot, ConstraintSet(), tasks, period=period, group=scene.group, limit_eta=limit_eta, guard="off", latch=None
    )
    on, cycles = [task.frame or robot.tip for task in tasks], max(1, round(scene.duration / period))
    first = [robot.kinematics(start).pose(frame) for frame in on]
    pairs = list(zip(scene.references, first, strict=True))
    reference = np.hstack([r.sample(x[:4], period, cycles) for r, x in pairs])
    stations = [r.stations(x[:4]) for r, x in pairs]
    waypoints = [(frame, station.pose) for frame, these in zip(on, stations, strict=True) for station in these]
    plant = KinematicPlant(start, space.decided, period, seed=0)
    measurement = plant.reset()
    d = len(space.decided)
    x, v, margins = np.empty((cycles, d)), np.empty((cycles, d)), np.empty((cycles, len(space.constraints)))
    linear, angular = np.empty((len(waypoints), cycles)), np.empty((len(waypoints), cycles))
    frames = world_first(tuple(on))
    tip = robot.flat(frames)
    for k in range(cycles):
        x[k] = measurement.q[space.decided]
        margins[k] = space.at(x[k]).margin
        at = snapshot(tip, frames, measurement.q)
        for i, (frame, waypoint) in enumerate(waypoints):
            linear[i, k], angular[i, k] = _apart(at.pose(frame), waypoint)
        command = controller.step(measurement, reference[k])
        v[k] = command.qdot
        measurement = plant.step(command)
    limits = [limit[space.decided] for limit in robot.limits[:3]]
    held = v > _BINDING * limit_eta * (limits[1] - x)
    held |= -v > _BINDING * limit_eta * (x - limits[0])
    fast = np.abs(v) > _BINDING * limits[2]
    off = tuple(_apart(pose, reference[0, 8 * i : 8 * i + 8]) for i, pose in enumerate(first))
    return Followed(period, x, v, margins, _due(on, stations), linear, angular, off, fast, held & ~fast)


def _due(on: list[str], stations: list[list[Station]]) -> tuple[Due, ...]:
    out = []
    for frame, these in zip(on, stations, strict=True):
        of, times = f" of {frame}" if len(on) > 1 else "", [station.t for station in these]
        apart = np.diff(times, append=2.0 * times[-1] - times[-2] if len(times) > 1 else times[-1] + 1.0)
        for i, station in enumerate(these):
            out.append(Due(f"{station.name}{of}", station.t, float(apart[i]), i == len(these) - 1))
    return tuple(out)


def _apart(a: Array, b: Array) -> tuple[float, float]:
    """Metres and radians between two poses (8,)."""
    turn = dq.quaternion_product(dq.conjugate(np.r_[a[:4], np.zeros(4)])[:4], np.ascontiguousarray(b[:4]))
    angle = 2.0 * np.arctan2(np.linalg.norm(turn[1:4]), abs(float(turn[0])))
    return float(np.linalg.norm(dq.translation(a) - dq.translation(b))), float(angle)


def check_reference(scene: Scene, space: Space, followed: Followed) -> Part:
    """Waypoints that are reached, limits that bind and constraints that are left on the way."""
    rows, findings = _waypoints(scene, followed)
    findings += _limits(space, followed) + _left(space, followed)
    begin = [due.name for i, due in enumerate(followed.due) if not i or followed.due[i - 1].last]
    for name, off in zip(begin, followed.off, strict=True):
        if off[0] > REACHED_LINEAR or off[1] > REACHED_ANGULAR:
            apart = f"{amount(off[0], 'm')} and {amount(off[1], 'rad')}"
            what = f"begins {apart} from the tip's first pose: the arm jumps there as fast as its limits allow"
            advice = "let the reference begin where the tip starts, or start there"
            findings.append(Finding(Severity.WARNING, CHECK, name, what, advice, {"position_m": off[0]}))
    method = f"followed on ideal joints with nothing enforced, T = {followed.period * 1e3:g} ms"
    return Part(CHECK, rows, findings, method)


def _waypoints(scene: Scene, f: Followed) -> tuple[list[dict[str, object]], list[Finding]]:
    rows: list[dict[str, object]] = []
    findings = []
    cycles = f.linear.shape[1]
    for i, (name, t, segment, last) in enumerate(f.due):
        a, b = (round((t + share * segment) / f.period) for share in (-0.25, 0.25))
        window = slice(max(a, 0), cycles if last else min(max(b, 1), cycles))
        if t >= scene.duration or window.start >= cycles:
            what = f"is due at {t:g} s, after the scene's end at {scene.duration:g} s"
            advice = "make the scene longer or its segments shorter"
            findings.append(Finding(Severity.WARNING, CHECK, name, what, advice, {"due_s": t}))
            rows.append({"name": name, "due_s": t, "position_m": None, "rotation_rad": None, "reached": False})
            continue
        k = window.start + int(np.argmin(f.linear[i, window] / REACHED_LINEAR + f.angular[i, window] / REACHED_ANGULAR))
        away, turned = float(f.linear[i, k]), float(f.angular[i, k])
        reached = away <= REACHED_LINEAR and turned <= REACHED_ANGULAR
        rows.append({"name": name, "due_s": t, "position_m": away, "rotation_rad": turned, "reached": reached})
        if not reached:
            apart = f"{amount(away, 'm')} and {amount(turned, 'rad')}"
            what = f"is not reached even without constraints: the tip stays {apart} away"
            advice = "see which limits bind; move it, start otherwise, take longer segments or a higher task gain"
            numbers = {"position_m": away, "rotation_rad": turned}
            findings.append(Finding(Severity.WARNING, CHECK, name, what, advice, numbers))
    return rows, findings


def _limits(space: Space, f: Followed) -> list[Finding]:
    findings = []
    for words, bound in (("velocity limit", f.at_velocity), ("position limits", f.at_position)):
        for j, joint in enumerate(space.joints):
            cycles = np.flatnonzero(bound[:, j])
            if not len(cycles):
                continue
            first, long = float(cycles[0]) * f.period, len(cycles) * f.period
            what = f"its {words} hold it back for {long:.2f} s, first at {first:.2f} s"
            advice = "slow the reference down there, or lead it elsewhere"
            findings.append(Finding(Severity.NOTE, CHECK, joint, what, advice, {"bound_s": long, "first_s": first}))
    return findings


def _left(space: Space, f: Followed) -> list[Finding]:
    findings = []
    for i, c in enumerate(space.constraints):
        margin, unit = f.margins[:, i], c.definition.unit
        outside = np.flatnonzero(margin < 0.0)
        if not len(outside):
            continue
        k, first = int(np.argmin(margin)), float(outside[0]) * f.period
        deep = float(-margin[k])
        what = f"the reference leaves it by {amount(deep, unit)} at {k * f.period:.2f} s, first at {first:.2f} s"
        advice = "the constraint will act" if c.enforced else "it is only watched: the run will violate it"
        numbers = {f"margin_{unit}": -deep, "first_s": first, "deepest_s": k * f.period}
        findings.append(Finding(Severity.NOTE, CHECK, c.name, what, advice, numbers))
    return findings
