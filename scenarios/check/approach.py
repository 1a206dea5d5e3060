"""How fast each constraint may be approached, and how early its row begins to act.

The row lets a margin h shrink by at most eta h a second. An approach at speed v is therefore slowed down from
h = v / eta on, and h fades with the time constant 1 / eta. Inside a wall of radius R the explicit step drifts out by
v^2 T / (2 R eta) at most while it follows the wall at speed v.
"""

from collections.abc import Mapping
from typing import cast

import numpy as np

from primitives.checks import Array
from primitives.constraint import Constraint
from primitives.evaluate import to_world
from primitives.kinematics import Kinematics
from primitives.pair import Kernel
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.reference import Followed
from scenarios.check.space import Space

CHECK = "approach"
DRIFT = 1e-4
"""A drift out of a wall, metres, that is worth a sentence."""


def check_approach(space: Space, eta: Mapping[str, float], period: float, followed: Followed | None) -> Part:
    """Speeds of approach and where the rows of the enforced constraints begin to act.

    Parameters
    ----------
    eta : {constraint: 1/s}. period : T, seconds. followed : the motion without constraints, None where unknown.
    """
    sight, speeds = space.at(space.first), space.robot.limits.velocity[space.decided]
    rows, findings = [], []
    for i, c in enumerate(space.constraints):
        if c.name not in eta:
            continue
        unit, gain = c.definition.unit, eta[c.name]
        with np.errstate(invalid="ignore"):
            top = float(np.where(sight.row[i] == 0.0, 0.0, np.abs(sight.row[i]) * speeds).sum())
        row: dict[str, object] = {
            "name": c.name,
            "unit": unit,
            "eta_per_s": gain,
            "top_speed": top if np.isfinite(top) else None,
            "acts_from_at_top_speed": top / gain if np.isfinite(top) else None,
            "time_constant_s": 1.0 / gain,
        }
        if followed is not None and len(followed.margins) > 1:
            closing = max(0.0, float(np.max(-np.diff(followed.margins[:, i])) / followed.period))
            row |= {"reference_speed": closing, "acts_from": closing / gain}
            if c.enforced and _curved(c):
                drift = _drift(space, c, gain, period, followed)
                row["drift_m"] = drift
                if drift > DRIFT:
                    findings.append(_drifts(c, drift, gain))
        rows.append(row)
    return Part(CHECK, rows, findings)


def _curved(c: Constraint) -> bool:
    """Whether the constraint keeps something inside a sphere or a cylinder."""
    return c.keep == "inside" and c.definition.unit == "m" and c.second.kind != "plane" and c.safe_distance > 0.0


def _drift(space: Space, c: Constraint, eta: float, period: float, followed: Followed) -> float:
    """v^2 T / (2 R eta), metres, v being the reference's largest speed of the closest points against each other."""
    apart = np.array([_difference(space, c, space.kinematics(x)) for x in followed.x])
    speed = float(np.linalg.norm(np.diff(apart, axis=0), axis=1).max() / followed.period)
    return speed * speed * period / (2.0 * c.safe_distance * eta)


def _difference(space: Space, c: Constraint, kinematics: Kinematics) -> Array:
    """(3,) from the closest point of the second element to that of the first, metres, world."""
    shapes = []
    for element in (c.first, c.second):
        out = np.empty(8)
        to_world(kinematics.poses, kinematics.place(element.frame), element.geometry[None, :].copy(), 0, out)
        shapes.append(out)
    gradient, kernel = np.zeros(12), cast(Kernel, c.definition.kernel)
    distance, _ = kernel(shapes[0], shapes[1], gradient)
    out3: Array = distance * gradient[:3]
    return out3


def _drifts(c: Constraint, drift: float, eta: float) -> Finding:
    what = f"along its wall the plain row drifts out by up to {amount(drift, 'm')} at the reference's speed"
    advice = f"raise eta ({eta:g} 1/s) or shorten the period; the guard re-solves such cycles"
    return Finding(Severity.NOTE, CHECK, c.name, what, advice, {"drift_m": drift})
