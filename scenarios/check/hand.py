"""Where the hand of a hands-on scene leads, how hard it pulls there, and how fast the arm would have to move.

The way of a pull is followed by the end of the shaft alone: at places along it the configuration within the joint
limits is looked for that comes nearest with the shaft through the port, from the one before.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares

from admittance.hand_file import load_hand
from admittance.parameters import Parameters
from primitives.checks import Array
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.space import Port, Space
from scenarios.hands_on.pull import Pull, handle_for
from scenarios.hands_on.push import Push

CHECK = "hand"
PIECE, MOST_PIECES = 1e-3, 200
"""Metres from one place along the way to the next, and most places between two waypoints."""
STEPS = 3
"""Newton steps from one place to the next."""
PORT_WEIGHT = 100.0
"""Of an error at the port against one at the shaft's end."""
REACHED = 1e-3
"""How near the shaft's end must come to a waypoint, metres."""
_INSIDE = 1e-9


class Led(NamedTuple):
    """The arm where the hand wants the shaft's end.

    Attributes
    ----------
    name, t : of the waypoint, seconds. short : metres by which the arm does not reach it. force : N, of the hand there.
    margins : (p, m) of the constraints along the way to it.
    """

    name: str
    t: float
    short: float
    force: float
    margins: Array


def follow_pull(pull: Pull, space: Space, port: Port, targets: Array, length: float) -> list[Led]:
    """The arm along the way of a pull.

    Parameters
    ----------
    port : of the space. targets : (k, 3) of the shaft's end, world, metres. length : from there to the handle, metres.
    """
    center, x = np.array(port.at), space.first
    last = space.kinematics(x).translation(port.shaft)
    out = []
    for i, (waypoint, target) in enumerate(zip(pull.waypoints, targets, strict=True)):
        margins, pieces = [], int(np.clip(np.linalg.norm(target - last) / PIECE, 2, MOST_PIECES))
        for share in np.linspace(0.0, 1.0, pieces + 1)[1:]:
            x = _towards(space, port, x, last + share * (target - last))
            margins.append(space.at(x).margin)
        x = _nearest(space, port, x, target)
        margins.append(space.at(x).margin)
        last, end = target, space.kinematics(x).translation(port.shaft)
        apart = float(np.linalg.norm(handle_for(target, center, length) - handle_for(end, center, length)))
        force = min(pull.most, pull.stiffness * apart)
        short = float(np.linalg.norm(end - target))
        out.append(Led(f"waypoint {i + 1}", waypoint.t, short, force, np.array(margins)))
    return out


def _error(space: Space, port: Port, x: Array, target: Array) -> tuple[Array, Array]:
    """Of the shaft's end (3,) and at the port (2,), weighted, and the Jacobian (5, d)."""
    kinematics = space.kinematics(x)
    off, row = space.port_at(kinematics)
    away = kinematics.translation(port.shaft) - target
    jacobian = kinematics.jacobian(port.shaft)[:3, space.decided]
    return np.r_[away, PORT_WEIGHT * off], np.vstack([jacobian, PORT_WEIGHT * row])


def _towards(space: Space, port: Port, x: Array, target: Array) -> Array:
    """A configuration (d,) a few Newton steps nearer to ending at a place (3,) through the port."""
    for _ in range(STEPS):
        away, jacobian = _error(space, port, x, target)
        x = np.clip(x - np.linalg.pinv(jacobian) @ away, space.low, space.high)
    return x


def _nearest(space: Space, port: Port, x: Array, target: Array) -> Array:
    """The configuration (d,) whose shaft ends nearest to a place (3,), passing the port."""
    start = np.clip(x, space.low + _INSIDE, space.high - _INSIDE)
    found: Array = least_squares(
        lambda z: _error(space, port, z, target)[0],
        start,
        jac=lambda z: _error(space, port, z, target)[1],
        bounds=(space.low, space.high),
        xtol=1e-12,
    ).x
    return found


def largest_force(hand: Pull | Push) -> float:
    """Of the hand's waypoints, wrenches or record, N, without its tremor."""
    if isinstance(hand, Pull):
        return hand.most
    wrenches = load_hand(hand.file).wrenches if hand.file else np.array(hand.wrenches)
    return float(np.linalg.norm(np.asarray(wrenches)[:, :3], axis=1).max())


class Speeds(NamedTuple):
    """What the hand's largest force comes to, once the damping balances it.

    Attributes
    ----------
    along, about : m/s along the shaft, rad/s about the port.
    share : of the velocity limit that this asks of a joint, the largest of all; joint : its name.
    reachable : m/s along the shaft that the limits leave.
    """

    along: float
    about: float
    share: float
    joint: str
    reachable: float


def steady_speeds(space: Space, port: Port, parameters: Parameters, force: float) -> Speeds:
    """Speeds at the start under a force on the handle, N, along the shaft and across it."""
    kinematics = space.kinematics(space.first)
    arm = kinematics.translation(port.shaft) - np.array(port.at)
    rotation, jacobian = kinematics.rotation(port.shaft), kinematics.jacobian(port.shaft)[:, space.decided]
    lever = abs(parameters.shaft_length - float(np.linalg.norm(arm)))
    along, about = _balanced(parameters, 0, force), _balanced(parameters, 1, force * lever)
    twists = [np.r_[along * rotation[:, 2], np.zeros(3)]]
    twists += [np.r_[np.cross(about * axis, arm), about * axis] for axis in rotation[:, :2].T]
    limits = space.robot.limits.velocity[space.decided]
    shares = np.array([np.abs(np.linalg.pinv(jacobian) @ twist) / limits for twist in twists])
    worst = int(np.argmax(shares.max(axis=0)))
    first = float(shares[0].max())
    return Speeds(along, about, float(shares.max()), space.joints[worst], along / max(first, 1.0))


def _balanced(parameters: Parameters, coordinate: int, effort: float) -> float:
    """The speed at which (D_c + Q exp(-M s)) s is the effort, away from any repulsion."""
    steady, slow, fade = (getattr(parameters, name)[coordinate] for name in ("D_c", "Q", "M"))
    excess = lambda s: (steady + slow * np.exp(-fade * s)) * s - effort  # noqa: E731
    return float(brentq(excess, 0.0, effort / steady)) if effort > 0.0 else 0.0


def check_hand(space: Space, speeds: Speeds, hand: Pull | Push, led: list[Led]) -> Part:
    """Waypoints out of reach, constraints that the hand leads into, and joints that are too slow for it."""
    force = largest_force(hand)
    rows, findings = [], []
    for w in led:
        rows.append({"name": w.name, "due_s": w.t, "short_m": w.short, "force_N": w.force})
        if w.short > REACHED:
            short = amount(w.short, "m")
            what = f"lies {short} beyond the arm's reach through the port; the hand pulls there with {w.force:.3g} N"
            advice = "meant as a push, it is one; else move it or the port"
            numbers = {"short_m": w.short, "force_N": w.force}
            findings.append(Finding(Severity.NOTE, CHECK, w.name, what, advice, numbers))
    findings += _entered(space, led)
    if speeds.share > 1.0:
        what = (
            f"the hand's {force:.3g} N would move it at {speeds.share:.3g} times its velocity limit "
            f"({amount(speeds.along, 'm/s')} along the shaft, {amount(speeds.about, 'rad/s')} about the port)"
        )
        advice = "the limits hold such a motion back; raise the damping D_c or let the hand be weaker"
        numbers = {"share": speeds.share, "along_m_per_s": speeds.along, "about_rad_per_s": speeds.about}
        findings.append(Finding(Severity.NOTE, CHECK, speeds.joint, what, advice, numbers))
    kind = f"the hand's largest force is {force:.3g} N"
    return Part(CHECK, rows, findings, kind if led else f"{kind}; a push has no way that could be followed")


def _entered(space: Space, led: list[Led]) -> list[Finding]:
    """Constraints that the hand leads into: on the way to which waypoint first, and how deep anywhere."""
    findings = []
    for i, c in enumerate(space.constraints):
        first = next((w for w in led if w.margins[:, i].min() < 0.0), None)
        if first is None:
            continue
        deep, unit = -min(float(w.margins[:, i].min()) for w in led), c.definition.unit
        way = f"first on the way to {first.name}, due at {first.t:g} s"
        what = f"the hand leads into it, {way}, up to {amount(deep, unit)} deep"
        advice = "the constraint will act" if c.enforced else "it is only watched"
        findings.append(Finding(Severity.NOTE, CHECK, c.name, what, advice, {f"margin_{unit}": -deep}))
    return findings
