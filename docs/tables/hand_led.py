"""S5-hand's arm from its start, led or pushed by a hand at its tip: for the tables on scenes by hand."""

from typing import NamedTuple

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.evaluate import evaluate
from scenarios.analysis.between import PARTS, margins_at
from scenarios.by_hand.enforcement import INTEGRATOR, enforce
from scenarios.by_hand.hand import Guide, GuidingHand
from scenarios.enforcement import chosen
from scenarios.scene_file import load_scene

SCENE = load_scene("S5-hand")


class Led(NamedTuple):
    """What came of it: q (k, n), force (k,) of the hand in N, margin (k, m) at and between cycles, excess in J."""

    q: Array
    force: Array
    margin: Array
    excess: float
    stopped: bool


def towards(constraint: str) -> Array:
    """(3,) the direction in which a force at the tip at the start moves it fastest against a constraint."""
    admittance, _ = enforce(chosen(SCENE, enforcement="none"), SCENE.admittance, {})
    at, d = evaluate(admittance.robot, SCENE.constraints, admittance.q), len(admittance.joints)
    row = at.jacobian[at.names.index(constraint)][:d]
    J = admittance.kinematics.jacobian(admittance.frame)[:3, :d]
    out: Array = -J @ (row / SCENE.admittance.dampings(d))
    return out / np.linalg.norm(out)


def lead(
    direction: Array,
    guide: Guide,
    *,
    enforcement: str,
    period: float,
    seconds: float,
    speed: float = np.inf,
    farthest: float = 0.1,
    guard: str | None = None,
    integrator: str = INTEGRATOR,
) -> Led:
    """The hand wants the tip `farthest` metres away in a direction (3,), at once or at a speed, m/s."""
    scene = chosen(SCENE, enforcement=enforcement, period=period, guard=guard)
    admittance, method = enforce(scene, SCENE.admittance, {}, integrator)
    frame, cycles = admittance.frame, round(seconds / period)
    start = admittance.kinematics.pose(frame)
    turned, at = np.ascontiguousarray(start[:4]), dq.translation(start)
    far = (
        np.full(cycles + 1, farthest)
        if np.isinf(speed)
        else np.minimum(speed * period * np.arange(cycles + 1), farthest)
    )
    hand = GuidingHand(guide, np.array([dq.from_rotation_translation(turned, at + s * direction) for s in far]), period)
    q, force, stopped = [admittance.q], [], False
    for k in range(1, cycles + 1):
        wrench = hand.wrench(k * period, admittance.kinematics.pose(frame), admittance.twist)
        stopped = stopped or method.step(k * period, wrench).state >= 2
        force.append(float(np.linalg.norm(wrench[:3])))
        q.append(admittance.q)
    way = np.array(q)
    parts = np.arange(PARTS)[:, None, None] / PARTS
    between = (way[:-1] + parts * np.diff(way, axis=0)).reshape(-1, way.shape[1])
    margin = margins_at(admittance.robot, SCENE.constraints, between).reshape(PARTS, cycles, -1).min(axis=0)
    last = margins_at(admittance.robot, SCENE.constraints, way[1:])
    return Led(way, np.array(force), np.minimum(margin, last), admittance.ledger["excess"], stopped)
