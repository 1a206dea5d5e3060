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
from primitives.checks import known
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.hands_on.parts import Part
from scenarios.hands_on.scene import HandsOnScene
from scenarios.joined import ENFORCEMENTS, GUARDS, METRICS, SHARE, Guarded, Measured, Projected, kept_farther
from vfi.controller import Controller
from vfi.tasks import ProjectionTask, VelocityTask

FORM, INTEGRATOR = "reduced", "semi-implicit"
"""Of the step that the projection belongs to."""
ETA_T = 0.25
"""eta T of the rows: a period may use up a quarter of a clearance."""
ROUNDING = 2e-6
"""Metres that "vfi" keeps beyond the spheres: what the rows' linearisation and rounding may cost stays above zero."""
REACH = 0.005
"""How far beyond d_0 points get a row, metres."""

Method = Measured[Motion]


def enforce(
    enforcement: str,
    scene: HandsOnScene,
    robot: Robot,
    parts: Mapping[str, Part],
    *,
    guard: str | None = None,
    metric: str = "free",
) -> tuple[Admittance, Method]:
    """The admittance of a scene, whose records are the run's, and what is to be stepped.

    Parameters
    ----------
    guard : "act" on what verification finds, only "watch", or "off"; None for "act" where inequalities enforce the
        constraints, else "off".
    metric : one of `METRICS`.

    Raises
    ------
    UnknownNameError : no such enforcement, guard or metric.
    InputError : a form or integrator that a proposed step has not. Others as `HandsOnScene.build`.
    """
    known("enforcement", enforcement, ENFORCEMENTS)
    known("metric", metric, METRICS)
    by_rows = enforcement in ("vfi", "both")
    mode = known("guard", guard, GUARDS) if guard is not None else "act" if by_rows else "off"
    if (by_rows or mode != "off") and (scene.form, scene.integrator) != (FORM, INTEGRATOR):
        raise InputError(
            f'enforcement "{enforcement}" with guard "{mode}": its steps are those of the {FORM} form and the '
            f"{INTEGRATOR} integrator, got {scene.form} and {scene.integrator}"
        )
    admittance = scene.build(robot, parts, **_changes(enforcement, scene))
    if not by_rows and mode == "off":
        watched = scene.constraints.enforcing([])
        controller = _controller(scene, robot, parts, watched, VelocityTask(), "off", 1.0)
        return admittance, Measured(admittance, controller, scene.constraints)
    task = ProjectionTask(len(admittance.joints) - 2)
    if by_rows:
        controller = _controller(scene, robot, parts, _kept(scene, enforcement == "both"), task, mode, ETA_T)
        return admittance, Projected(admittance, controller, scene.constraints, metric)
    controller = _controller(scene, robot, parts, _kept(scene, False), task, "act", 1.0)
    return admittance, Guarded(admittance, controller, scene.constraints, mode == "act")


def _changes(enforcement: str, scene: HandsOnScene) -> dict[str, Any]:
    """What an enforcement changes of the scene's admittance."""
    if enforcement == "admittance":
        return {}
    if enforcement == "both":
        return {
            "parameters": replace(scene.parameters, implicit_damping=True),
            "linear_below": SHARE * scene.parameters.d_0,
            "implicit_stiffness": True,
        }
    implicit = scene.parameters.implicit_damping or enforcement == "vfi"
    alone = {"regions": (), "constraints": ConstraintSet()}
    return {"parameters": replace(scene.parameters, k=0.0, implicit_damping=implicit), **alone}


def _controller(
    scene: HandsOnScene,
    robot: Robot,
    parts: Mapping[str, Part],
    constraints: ConstraintSet,
    task: VelocityTask | ProjectionTask,
    guard: str,
    eta_t: float,
) -> Controller:
    """The controller beside an admittance."""
    return Controller(
        robot,
        constraints,
        task,
        period=scene.period,
        group=scene.group,
        eta=eta_t / scene.period,
        clouds={name: part.cloud for name, part in parts.items()},
        reach=scene.parameters.d_0 + REACH,
        guard=guard,
        latch=None,
    )


def _kept(scene: HandsOnScene, share: bool) -> ConstraintSet:
    """The scene's constraints as the rows keep them; clouds are kept off for rounding where no potential acts too."""
    if share:
        return kept_farther(scene.constraints, scene.parameters.d_0, scene.parameters.d_0_angle)
    return kept_farther(scene.constraints, 0.0, 0.0, ROUNDING)
