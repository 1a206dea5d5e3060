"""Where a scene starts: the margin of every constraint and the room of every joint."""

import numpy as np

from primitives.vectors import DEGENERATE, IN_BAND
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.space import Space

CHECK = "start"
TIGHT = 0.02
"""A joint that starts within this share of its range from a limit is named."""


def constraints_at_start(space: Space) -> Part:
    """Margins of the constraints at the start, and those that are violated or have no gradient there."""
    sight = space.at(space.first)
    rows, findings = [], []
    for i, c in enumerate(space.constraints):
        margin, unit = float(sight.margin[i]), c.definition.unit
        rows.append(
            {
                "name": c.name,
                "keep": c.keep,
                "safe_distance": c.safe_distance,
                "margin": margin,
                "unit": unit,
                "enforced": c.enforced,
                "violated": bool(margin < 0.0),
            }
        )
        if margin < 0.0:
            severity = Severity.WARNING if c.enforced else Severity.NOTE
            what = f"is violated at the start by {amount(-margin, unit)}"
            advice = (
                "start elsewhere; enforced, it is left at the recovery speed" if c.enforced else "it is only watched"
            )
            findings.append(Finding(severity, CHECK, c.name, what, advice, {f"margin_{unit}": margin}))
        if sight.status[i] == DEGENERATE and c.enforced and (c.keep == "outside" or margin < 0.0):
            what = "has no gradient at the start, so no row can be written there"
            advice = "start where its two elements do not touch"
            findings.append(Finding(Severity.ERROR, CHECK, c.name, what, advice, {f"margin_{unit}": margin}))
        if sight.status[i] == IN_BAND:
            what = "starts with its two lines nearly parallel, where the distance between infinite lines jumps"
            advice = "take segments, which have a continuous distance"
            findings.append(Finding(Severity.WARNING, CHECK, c.name, what, advice, {f"margin_{unit}": margin}))
    return Part("constraints", rows, findings)


def joints_at_start(space: Space) -> Part:
    """Room of every joint to its limits at the start, those that are not decided included."""
    robot, q = space.robot, space.all_joints(space.first)
    slides = robot.flat(robot.frames).prismatic == 1
    rows, findings = [], []
    for j, name in enumerate(robot.joints):
        unit = "m" if slides[j] else "rad"
        low, high, speed = (float(limit[j]) for limit in robot.limits[:3])
        room = min(float(q[j]) - low, high - float(q[j]))
        finite = bool(np.isfinite(room))
        rows.append(
            {
                "name": name,
                "decided": name in space.joints,
                "position": float(q[j]),
                "lower": low if np.isfinite(low) else None,
                "upper": high if np.isfinite(high) else None,
                "room": room if finite else None,
                "velocity": speed if np.isfinite(speed) else None,
                "unit": unit,
            }
        )
        limits = f"its range is from {amount(low, unit)} to {amount(high, unit)}"
        if room < 0.0:
            severity = Severity.ERROR if name in space.joints else Severity.WARNING
            what = f"starts {amount(-room, unit)} outside its limits; {limits}"
            findings.append(Finding(severity, CHECK, name, what, "start within them", {f"room_{unit}": room}))
        elif finite and name in space.joints and room < TIGHT * (high - low):
            what = f"starts {amount(room, unit)} from a limit; {limits}"
            advice = "start nearer to the middle if the motion needs it"
            findings.append(Finding(Severity.NOTE, CHECK, name, what, advice, {f"room_{unit}": room}))
        if name in space.joints and not np.isfinite(speed):
            what = "has no velocity limit, so nothing bounds the speed of approach"
            advice = "give the robot's file a velocity limit"
            findings.append(Finding(Severity.WARNING, CHECK, name, what, advice, {}))
    return Part("joints", rows, findings)
