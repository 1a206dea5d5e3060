"""Constraints on moving entities, which a scene cannot move."""

from primitives.constraint import ConstraintSet
from scenarios.check.finding import Finding, Part, Severity

CHECK = "entities"


def without_entities(constraints: ConstraintSet) -> tuple[ConstraintSet, Part]:
    """The constraints that need no entity, and what is to be said of the others."""
    fixed, findings = [], []
    for c in constraints:
        names = [e.entity for e in (c.first, c.second) if e.entity is not None]
        if not names:
            fixed.append(c)
            continue
        what = f'refers to the moving entity "{names[0]}", which a scene cannot move: its run would stop in FAULT'
        advice = "attach the element to a frame or the world, or run it from Python with measurements of the entity"
        findings.append(Finding(Severity.ERROR, CHECK, c.name, what, advice, {}))
    return ConstraintSet(fixed), Part(CHECK, [], findings)
