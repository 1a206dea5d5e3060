"""Who keeps the constraints of a scene by hand: nobody, potentials in joint coordinates, inequalities, or both.

As in hands-on scenes, but there is no port, the rows have the gains that the scene gives them, and the admittance's
metric is M + T D + T^2 K in the joints.
"""

from typing import Any

from admittance.joint_parameters import JointParameters
from admittance.joints import JointAdmittance, JointMotion
from primitives.checks import known
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from scenarios.joined import ENFORCEMENTS, GUARDS, SHARE, Guarded, Measured, Projected, kept_farther
from scenarios.scene import Scene
from vfi.controller import Controller
from vfi.tasks import ProjectionTask, VelocityTask

INTEGRATOR = "semi-implicit"
"""Of the step that the projection belongs to."""

Method = Measured[JointMotion]


def guard_of(enforcement: str, guard: str | None) -> str:
    """The guard's mode: the one that is asked for, else "off" where potentials alone act, and "act" otherwise."""
    return guard or ("off" if enforcement == "admittance" else "act")


def enforce(
    scene: Scene,
    parameters: JointParameters,
    enforcement: str,
    *,
    period: float | None,
    guard: str | None,
    integrator: str = INTEGRATOR,
) -> tuple[JointAdmittance, Method]:
    """The admittance of a scene and what is to be stepped.

    Parameters
    ----------
    parameters : of the admittance.
    enforcement : one of `ENFORCEMENTS`. "admittance": potentials alone; "vfi": rows alone; "both": potentials, and rows
        that keep `SHARE` of the potential's range beyond a margin of zero.
    period : T in seconds, where it differs from the scene's. guard : see `guard_of`.
    integrator : of potentials without a guard; see `JointAdmittance`.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a name or number is wrong.
    """
    known("enforcement", enforcement, ENFORCEMENTS)
    mode = known("guard", guard_of(enforcement, guard), GUARDS)
    alone = enforcement == "admittance" and mode == "off"
    if integrator != INTEGRATOR and not alone:
        raise InputError(
            f'enforcement "{enforcement}" with guard "{mode}": its steps are those of the {INTEGRATOR} integrator, got '
            f"{integrator}"
        )
    robot, T = scene.build_robot(), scene.period if period is None else period
    frame = scene.tasks[0].frame or robot.tip
    pushed = scene.constraints if enforcement in ("admittance", "both") else ConstraintSet()
    admittance = JointAdmittance(
        robot,
        parameters,
        start=scene.start,
        frame=frame,
        constraints=pushed,
        period=T,
        group=scene.group,
        integrator=integrator,
        linear_below=SHARE * parameters.d_0 if enforcement == "both" else 0.0,
    )
    if (decided := tuple(robot.joints[i] for i in robot.group(scene.group))) != admittance.joints:
        raise InputError(f'joint group "{scene.group}": expected joints in the robot\'s order, got {decided}')

    def controller(constraints: ConstraintSet, task: VelocityTask | ProjectionTask, **how: Any) -> Controller:
        gains = {"eta": scene.eta, "guard": mode, "latch": None, **how}
        return Controller(robot, constraints, task, period=T, group=scene.group, limit_eta=scene.limit_eta, **gains)

    watched, task = scene.constraints.enforcing([]), ProjectionTask(len(admittance.joints))
    if alone:
        return admittance, Measured(admittance, controller(watched, VelocityTask()), scene.constraints)
    if enforcement == "admittance":
        beside = controller(scene.constraints, task, eta=1.0 / T, guard="act")
        return admittance, Guarded(admittance, beside, scene.constraints, mode == "act")
    kept = {"none": watched, "vfi": scene.constraints}.get(enforcement)
    if kept is None:
        kept = kept_farther(scene.constraints, parameters.d_0, parameters.d_0_angle)
    return admittance, Projected(admittance, controller(kept, task), scene.constraints)
