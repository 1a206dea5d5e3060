"""Who keeps the declared constraints of a hands-on scene: nobody, the potentials, the inequalities, or both.

In "vfi" the admittance without potentials gives the reference, and a controller projects it, in the free-motion
coordinates and the metric of its own inertia and damping, onto the inequalities of all constraints. In "both" the
potentials push as well: the hand feels them before the rows act, and the rows hold where a potential alone would be
jumped in sampled time. The guard of the controller verifies what is carried out, as in every other scene.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from admittance import Admittance, Motion
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.anatomy.parts import Part
from scenarios.enforcement import Gains
from scenarios.hands_on.scene import HandsOnScene
from scenarios.joined import SHARE, Guarded, Measured, Projected, kept_farther
from vfi.controller import Controller
from vfi.tasks import ProjectionTask, VelocityTask

FORM, INTEGRATOR = "reduced", "semi-implicit"
"""Of the step that the projection belongs to."""
ROUNDING = 2e-6
"""Metres that "vfi" keeps beyond the spheres: what the rows' linearisation and rounding may cost stays above zero."""

Method = Measured[Motion]


def enforce(scene: HandsOnScene, robot: Robot, parts: Mapping[str, Part]) -> tuple[Admittance, Method]:
    """The admittance of a scene, whose records are the run's, and what is to be stepped.

    Raises
    ------
    InputError : a form or integrator that a proposed step has not. Others as `HandsOnScene.build`.
    """
    how, at_once = scene.in_force, 1.0 / scene.period
    if (how.by_rows or how.guard != "off") and (scene.form, scene.integrator) != (FORM, INTEGRATOR):
        raise InputError(
            f'enforcement "{how.method}" with guard "{how.guard}": its steps are those of the {FORM} form and the '
            f"{INTEGRATOR} integrator, got {scene.form} and {scene.integrator}"
        )
    admittance = scene.build(robot, parts, limit_gain=how.limit_eta, **_changes(how.method, scene))
    if not how.by_rows and how.guard == "off":
        watched = scene.constraints.enforcing([])
        controller = _controller(scene, robot, parts, watched, VelocityTask(), "off", at_once)
        return admittance, Measured(admittance, controller, scene.constraints)
    task = ProjectionTask(len(admittance.joints) - 2)
    if how.by_rows:
        kept = _kept(scene, how.method == "both")
        controller = _controller(scene, robot, parts, kept, task, how.guard, how.eta)
        return admittance, Projected(admittance, controller, scene.constraints, how.metric)
    controller = _controller(scene, robot, parts, _kept(scene, False), task, "act", at_once)
    return admittance, Guarded(admittance, controller, scene.constraints, how.guard == "act")


def damps_implicitly(enforcement: str, scene: HandsOnScene) -> bool:
    """Whether a step takes the damping at the velocity after it: as the scene says, always where that is projected."""
    return scene.parameters.implicit_damping or enforcement in ("vfi", "both")


def _changes(enforcement: str, scene: HandsOnScene) -> dict[str, Any]:
    """What an enforcement changes of the scene's admittance."""
    implicit = damps_implicitly(enforcement, scene)
    if enforcement == "admittance":
        return {}
    if enforcement == "both":
        return {
            "parameters": replace(scene.parameters, implicit_damping=implicit),
            "linear_below": SHARE * scene.parameters.d_0,
            "implicit_stiffness": True,
        }
    alone = {"regions": (), "constraints": ConstraintSet()}
    return {"parameters": replace(scene.parameters, k=0.0, implicit_damping=implicit), **alone}


def _controller(
    scene: HandsOnScene,
    robot: Robot,
    parts: Mapping[str, Part],
    constraints: ConstraintSet,
    task: VelocityTask | ProjectionTask,
    guard: str,
    eta: Gains,
) -> Controller:
    """The controller beside an admittance."""
    how = scene.in_force
    return Controller(
        robot,
        constraints,
        task,
        period=scene.period,
        group=scene.group,
        eta=eta,
        limit_eta=how.limit_eta,
        clouds={name: part.cloud for name, part in parts.items()},
        reach=how.reach,
        forms=how.forms,
        guard=guard,
        latch=None,
    )


def _kept(scene: HandsOnScene, share: bool) -> ConstraintSet:
    """The scene's constraints as the rows keep them; clouds are kept off for rounding where no potential acts too."""
    if share:
        return kept_farther(scene.constraints, scene.parameters.d_0, scene.parameters.d_0_angle)
    return kept_farther(scene.constraints, 0.0, 0.0, ROUNDING)
