"""Who keeps the constraints of a scene by hand: nobody, potentials in joint coordinates, inequalities, or both.

As in hands-on scenes, but there is no port, the rows have the gains that the scene gives them, and the admittance's
metric is M + T D + T^2 K in the joints.
"""

from collections.abc import Mapping
from typing import Any

from admittance.joint_parameters import JointParameters
from admittance.joints import JointAdmittance, JointMotion
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from scenarios.anatomy.parts import Part
from scenarios.joined import SHARE, Guarded, Measured, Projected, kept_farther
from scenarios.scene import Scene
from vfi.controller import Controller
from vfi.tasks import ProjectionTask, VelocityTask

INTEGRATOR = "semi-implicit"
"""Of the step that the projection belongs to."""

Method = Measured[JointMotion]


def enforce(
    scene: Scene, parameters: JointParameters, anatomy: Mapping[str, Part], integrator: str = INTEGRATOR
) -> tuple[JointAdmittance, Method]:
    """The admittance of a scene and what is to be stepped.

    Under "admittance" potentials act alone, under "vfi" rows, under "both" potentials, and rows that keep `SHARE` of
    the potential's range beyond a margin of zero.

    Parameters
    ----------
    parameters : of the admittance. anatomy : see `scenarios.anatomy.parts.build_parts`.
    integrator : of potentials without a guard; see `JointAdmittance`.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a name or number is wrong.
    """
    in_force = scene.in_force
    method, mode = in_force.method, in_force.guard
    alone = method == "admittance" and mode == "off"
    if integrator != INTEGRATOR and not alone:
        raise InputError(
            f'enforcement "{method}" with guard "{mode}": its steps are those of the {INTEGRATOR} integrator, got '
            f"{integrator}"
        )
    robot, T = scene.build_robot(), scene.period
    frame = scene.tasks[0].frame or robot.tip
    admittance = JointAdmittance(
        robot,
        parameters,
        start=scene.start,
        frame=frame,
        constraints=_pushed(scene, method),
        period=T,
        group=scene.group,
        integrator=integrator,
        limit_gain=in_force.limit_eta,
        linear_below=SHARE * parameters.d_0 if method == "both" else 0.0,
    )
    if (decided := tuple(robot.joints[i] for i in robot.group(scene.group))) != admittance.joints:
        raise InputError(f'joint group "{scene.group}": expected joints in the robot\'s order, got {decided}')

    def controller(constraints: ConstraintSet, task: VelocityTask | ProjectionTask, **how: Any) -> Controller:
        usual = {
            "limit_eta": in_force.limit_eta,
            "eta": in_force.eta,
            "guard": mode,
            "clouds": {name: part.cloud for name, part in anatomy.items()},
            "reach": in_force.reach,
            "forms": in_force.forms,
            "latch": None,
        }
        return Controller(robot, constraints, task, period=T, group=scene.group, **(usual | how))

    watched, task = scene.constraints.enforcing([]), ProjectionTask(len(admittance.joints))
    if alone:
        return admittance, Measured(admittance, controller(watched, VelocityTask()), scene.constraints)
    if method == "admittance":
        beside = controller(scene.constraints, task, eta=1.0 / T, guard="act")
        return admittance, Guarded(admittance, beside, scene.constraints, mode == "act")
    kept = kept_farther(scene.kept, parameters.d_0, parameters.d_0_angle) if method == "both" else scene.kept
    return admittance, Projected(admittance, controller(kept, task), scene.constraints, in_force.metric)


def _pushed(scene: Scene, method: str) -> ConstraintSet:
    """The constraints that potentials act on; raises InputError where they cannot."""
    if method not in ("admittance", "both"):
        return ConstraintSet()
    clouds = [c.name for c in scene.constraints if c.is_cloud and c.enforced]
    if clouds:
        raise InputError(
            f'enforcement "{method}": potentials without a port do not act on clouds, got {", ".join(clouds)}; take '
            '"vfi", watch them, or have the tool led through a port, as hands-on scenes do'
        )
    return ConstraintSet(c for c in scene.constraints if not c.is_cloud)
