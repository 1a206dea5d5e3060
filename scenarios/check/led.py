"""What `vfi check` says of a scene that a hand leads."""

from collections.abc import Callable, Mapping

import numpy as np

from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.anatomy.parts import Part as Anatomy
from scenarios.anatomy.parts import build_parts
from scenarios.check.approach import check_approach
from scenarios.check.clouds import check_clouds
from scenarios.check.cue import check_cue
from scenarios.check.entities import without_entities
from scenarios.check.feasibility import feasible_at_start, program
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.gains import Gain, check_gains
from scenarios.check.hand import check_hand, follow_pull, largest_force, steady_speeds
from scenarios.check.relations import check_relations
from scenarios.check.report import RECOVERY, Report, etas, without_anatomy
from scenarios.check.search import Search
from scenarios.check.space import Port, Space
from scenarios.check.start import constraints_at_start, joints_at_start
from scenarios.enforcement import METHODS, chosen
from scenarios.hands_on.enforcement import enforce
from scenarios.hands_on.pull import Pull
from scenarios.hands_on.scene import HandsOnScene

OFF_PORT = 1e-4
"""Metres by which the shaft may miss the port at the start before that is said."""


def check_led(scene: HandsOnScene, progress: Callable[[str, float], None] = lambda label, share: None) -> Report:
    """Check a scene that a hand leads; progress is told what is looked at and a share of it.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot.
    """
    robot = scene.build_robot()
    progress("the anatomy", 0.0)
    try:
        parts = build_parts(scene.anatomy, scene.port)
    except InputError as error:
        return without_anatomy(scene.name, str(scene.robot), error)
    clouds = {name: part.cloud for name, part in parts.items()}
    port = Port(scene.shaft, scene.port)
    fixed, entities = without_entities(scene.constraints)
    space = Space(robot, fixed, scene.group, np.array(scene.start), clouds, port)
    how = scene.in_force
    eta = etas(how, scene.constraints)
    gains = [Gain(name, "eta", value) for name, value in eta.items()]
    gains += [Gain("joint limits", "limit_eta", how.limit_eta), *_port_gains(scene)]
    found = [constraints_at_start(space), joints_at_start(space), _port(space), check_clouds(clouds), entities]
    found.append(check_gains(gains, scene.period))
    if not entities.findings:
        found.append(_build(scene, robot, parts))
    found.append(feasible_at_start(space, program(space, eta, how.limit_eta, scene.period, RECOVERY, how.forms)))
    found.append(check_relations(Search(space), progress))
    progress("the hand", 0.0)
    force, led = largest_force(scene.hand), []
    if isinstance(scene.hand, Pull):
        targets = scene.hand.targets(np.array(scene.port), scene.first_end(robot), clouds)
        led = follow_pull(scene.hand, space, port, targets, scene.parameters.shaft_length)
    speeds = steady_speeds(space, port, scene.parameters, force)
    found.append(check_hand(space, speeds, scene.hand, led))
    found.append(check_cue(space, scene.parameters, scene.integrator, scene.period, force, speeds))
    found.append(check_approach(space, eta, scene.period, None))
    return Report(scene.name, str(scene.robot), found)


def _error(check: str, where: str, what: str, advice: str) -> Finding:
    return Finding(Severity.ERROR, check, where, what, advice, {})


def _port_gains(scene: HandsOnScene) -> list[Gain]:
    if scene.form == "reduced":
        return [Gain("port", "port_gain", scene.parameters.port_gain)]
    return [Gain("port", name, getattr(scene.parameters, name)) for name in ("alpha", "beta")]


def _port(space: Space) -> Part:
    """How far the shaft is from the port at the start."""
    off = float(np.linalg.norm(space.at(space.first).port))
    rows = [{"name": "port", "off_m": off}]
    if off <= OFF_PORT:
        return Part("port", rows)
    what = f"the shaft misses it by {amount(off, 'm')} at the start"
    advice = "solve the start so that the shaft runs through the port; it is drawn there in the first cycles"
    return Part("port", rows, [Finding(Severity.WARNING, "port", "port", what, advice, {"off_m": off})])


def _build(scene: HandsOnScene, robot: Robot, parts: Mapping[str, Anatomy]) -> Part:
    """What the admittance and the controllers themselves refuse, each text once."""
    said: dict[str, list[str]] = {}
    for enforcement in METHODS:
        try:
            enforce(chosen(scene, enforcement=enforcement), robot, parts)
        except InputError as error:
            said.setdefault(str(error), []).append(enforcement)
    advice = "mend the scene, or choose another enforcement"
    return Part("build", [], [_error("build", ", ".join(names), text, advice) for text, names in said.items()])
