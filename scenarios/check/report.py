"""What `vfi check` says of a scene: every concern in turn."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from scenarios.anatomy.parts import Part as Anatomy
from scenarios.anatomy.parts import build_parts
from scenarios.check.approach import check_approach
from scenarios.check.clouds import check_clouds
from scenarios.check.entities import without_entities
from scenarios.check.feasibility import feasible_at_start, program
from scenarios.check.finding import Finding, Part, Severity
from scenarios.check.gains import Gain, check_gains
from scenarios.check.reference import check_reference, follow
from scenarios.check.relations import check_relations
from scenarios.check.search import Search
from scenarios.check.space import Space
from scenarios.check.start import constraints_at_start, joints_at_start
from scenarios.enforcement import InForce
from scenarios.run import build
from scenarios.scene import Scene

Progress = Callable[[str, float], None]


class Report(NamedTuple):
    """What was found in a scene, concern by concern."""

    scene: str
    robot: str
    parts: Sequence[Part]

    @property
    def findings(self) -> list[Finding]:
        """Of all parts, the gravest first."""
        order = list(Severity)
        return sorted((f for p in self.parts for f in p.findings), key=lambda f: order.index(f.severity))

    @property
    def ok(self) -> bool:
        """Whether there is no finding of severity "error"."""
        return all(f.severity != Severity.ERROR for f in self.findings)

    def placed(self, places: Mapping[str, str]) -> "Report":
        """The report with the places, as file:line, of what its findings are about."""
        parts = [
            p._replace(findings=[f._replace(place=places.get(f.where.split(", ")[0], "")) for f in p.findings])
            for p in self.parts
        ]
        return self._replace(parts=parts)

    def data(self) -> dict[str, Any]:
        """Everything as plain data, SI."""
        findings = [{**f._asdict(), "severity": f.severity.value, "numbers": dict(f.numbers)} for f in self.findings]
        return {
            "scene": self.scene,
            "robot": self.robot,
            "ok": self.ok,
            "findings": findings,
            **{p.name: [dict(row) for row in p.rows] for p in self.parts if p.rows},
            "methods": {p.name: p.method for p in self.parts if p.method},
        }


def check_scene(scene: Scene, progress: Progress = lambda label, share: None) -> Report:
    """Check a scene that follows a trajectory; progress is told what is looked at and a share of it.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a constraint names a frame that it has not.
    """
    robot, start, how = scene.build_robot(), np.array(scene.start), scene.in_force
    progress("the anatomy", 0.0)
    try:
        anatomy = build_parts(scene.anatomy)
    except InputError as error:
        return without_anatomy(scene.name, str(scene.robot), error)
    clouds = {name: part.cloud for name, part in anatomy.items()}
    eta = etas(how, scene.constraints)
    fixed, entities = without_entities(scene.kept)
    space = Space(robot, fixed, scene.group, start, clouds)
    gains = check_gains(_gains(scene, eta), scene.period)
    parts = [constraints_at_start(space), joints_at_start(space), gains, entities]
    if clouds:
        parts.append(check_clouds(clouds))
    if not any(f.severity == Severity.ERROR for f in (*gains.findings, *entities.findings)):
        parts.append(_build(scene, anatomy))
    p = program(space, eta, how.limit_eta, scene.period, RECOVERY, how.forms)
    parts.append(feasible_at_start(space, p))
    if fixed:
        parts.append(check_relations(Search(space), progress))
    progress("the reference", 0.0)
    followed = follow(scene, space)
    parts += [check_reference(scene, space, followed), check_approach(space, eta, scene.period, followed)]
    return Report(scene.name, str(scene.robot), parts)


RECOVERY = 0.05, 0.5
"""Fastest way out of a violation that a row asks for, m/s and rad/s: the defaults of `vfi.controller.Controller`."""


def etas(how: InForce, constraints: ConstraintSet) -> dict[str, float]:
    """Gain of each constraint that has one."""
    return {name: float(eta) for name in constraints.names if (eta := how.eta_of(name)) is not None}


def without_anatomy(scene: str, robot: str, error: InputError) -> Report:
    """What is said of a scene whose anatomy cannot be built."""
    advice = "mend the anatomy; nothing else was looked at"
    found = Finding(Severity.ERROR, "clouds", "anatomy", str(error), advice, {})
    return Report(scene, robot, [Part("clouds", [], [found])])


def _gains(scene: Scene, eta: dict[str, float]) -> list[Gain]:
    return [
        *(Gain(name, "eta", value) for name, value in eta.items()),
        Gain("joint limits", "limit_eta", scene.in_force.limit_eta),
        *(Gain(f"task of {t.frame}" if len(scene.tasks) > 1 else "task", "gain", t.gain) for t in scene.tasks),
    ]


def _build(scene: Scene, anatomy: Mapping[str, Anatomy]) -> Part:
    """What the controller itself refuses, and where a hand leads the admittance."""
    try:
        if scene.hand is not None:
            from scenarios.by_hand.run import build as build_by_hand

            build_by_hand(scene, anatomy)
        else:
            build(scene, solver="active-set", parts=anatomy)
    except InputError as error:
        return Part("build", [], [Finding(Severity.ERROR, "build", scene.name, str(error), "mend the scene", {})])
    return Part("build", [])
