"""Who keeps the declared constraints of a hands-on scene: nobody, the potentials, the inequalities, or both.

In "vfi" the admittance without potentials gives the reference, and a controller projects it, in the free-motion
coordinates and the metric of its own inertia and damping, onto the inequalities of all constraints. In "both" the
potentials push as well: the hand feels them before the rows act, and the rows hold where a potential alone would be
jumped in sampled time. The guard of the controller verifies what is carried out, as in every other scene.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from admittance import Admittance, Motion, Proposal
from admittance.outcome import State as AdmittanceState
from primitives.checks import Array, known
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.hands_on.parts import Part
from scenarios.hands_on.scene import HandsOnScene
from vfi.controller import Controller
from vfi.messages import Command, FreeReference, Measurement
from vfi.outcome import State
from vfi.tasks import ProjectionTask, VelocityTask

ENFORCEMENTS = ("none", "admittance", "vfi", "both")
METRICS = ("free", "joints")
"""In which the reference is projected: that of the admittance's inertia and damping, or the joints' (not passive)."""
FORM, INTEGRATOR = "reduced", "semi-implicit"
"""Of the step that the projection belongs to."""
ETA_T = 0.25
"""eta T of the rows: a period may use up a quarter of a clearance."""
ROUNDING = 2e-6
"""Metres that "vfi" keeps beyond the spheres: what the rows' linearisation and rounding may cost stays above zero."""
SHARE = 0.05
"""What "both" keeps beyond the spheres, as a share of d_0; nearer than that the potential goes on linearly."""
REACH = 0.005
"""How far beyond d_0 points get a row, metres."""
ALIKE = 1e-9
"""Free velocities, m/s and rad/s, nearer than this are the same."""


GUARDS = ("off", "watch", "act")


class Measured:
    """An admittance as it is; a controller that enforces nothing measures the margins beside it.

    Parameters
    ----------
    controller : of the same joints, with a `VelocityTask` and watched constraints only.
    """

    def __init__(self, admittance: Admittance, controller: Controller):
        self._admittance, self.controller = admittance, controller
        self._still, self._none = np.zeros(admittance.robot.n), np.zeros(len(controller.joints))

    def step(self, t: float, wrench: Array) -> Motion:
        """One cycle; see `Admittance.step`."""
        self.controller.step(Measurement(t, self._admittance.q, self._still), self._none)
        return self._admittance.step(t, wrench)

    intervened = 0.0
    """1 where the guard changed the last command, or would have."""


class Projected:
    """An admittance whose velocities a controller projects onto the inequalities of its constraints.

    Parameters
    ----------
    controller : of the same joints, with a `ProjectionTask`.
    metric : one of `METRICS`.
    """

    def __init__(self, admittance: Admittance, controller: Controller, metric: str = "free"):
        if controller.joints != admittance.joints:
            raise InputError(
                f"the controller decides {', '.join(controller.joints)}, the admittance "
                f"{', '.join(admittance.joints)}; give both the same joint group, in the robot's order"
            )
        self._admittance, self.controller = admittance, controller
        self._joints = metric == "joints"
        self._still = np.zeros(admittance.robot.n)
        self.intervened = 0.0
        """1 where the guard changed the last command, or would have."""

    def step(self, t: float, wrench: Array) -> Motion:
        """One cycle; see `Admittance.step`. Where no velocity keeps all rows the state is HOLD."""
        proposal = self._admittance.propose(t, wrench)
        q = self._admittance.q
        if proposal.state >= AdmittanceState.HOLD:
            return self._admittance.accept(np.zeros_like(proposal.v_ref))
        command = self.controller.step(Measurement(t, q, self._still), self._reference(proposal))
        return self._decide(proposal, command)

    def _decide(self, proposal: Proposal, command: Command) -> Motion:
        self.intervened = command.record[self.controller.columns["intervened"]][0]
        return self._admittance.accept(command.free if command.state < State.HOLD else None)

    def _reference(self, p: Proposal) -> FreeReference:
        metric = p.basis.T @ p.basis if self._joints else p.metric
        return FreeReference(p.v_ref, metric, np.ascontiguousarray(p.basis), p.offset)


class Guarded(Projected):
    """An admittance as it is, whose velocities are verified: none may lead beyond a boundary within its period.

    The weakest rows that keep a margin, eta = 1 / T, are solved beside it. Where they ask for another velocity the
    guard has found something: it counts, and puts theirs in the place of the admittance's where it acts.
    """

    def __init__(self, admittance: Admittance, controller: Controller, acts: bool):
        super().__init__(admittance, controller)
        self._acts = acts

    def _decide(self, proposal: Proposal, command: Command) -> Motion:
        kept = command.state < State.HOLD and np.abs(command.free - proposal.v_ref).max() <= ALIKE
        self.intervened = float(not kept)
        if self._acts and not kept:
            return self._admittance.accept(command.free if command.state < State.HOLD else None)
        return self._admittance.accept(proposal.v_ref)


Method = Measured | Projected


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
        return admittance, Measured(admittance, _controller(scene, robot, parts, watched, VelocityTask(), "off", 1.0))
    task = ProjectionTask(len(admittance.joints) - 2)
    if by_rows:
        controller = _controller(scene, robot, parts, kept_farther(scene, enforcement == "both"), task, mode, ETA_T)
        return admittance, Projected(admittance, controller, metric)
    controller = _controller(scene, robot, parts, kept_farther(scene, False), task, "act", 1.0)
    return admittance, Guarded(admittance, controller, mode == "act")


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


def kept_farther(scene: HandsOnScene, share: bool) -> ConstraintSet:
    """The scene's constraints, each kept a little before it is due: a share of the potential's range, or `ROUNDING`.

    Where potentials act too, a margin of zero is where they are infinite; clouds are kept off for rounding alone.
    """
    out = []
    for c in scene.constraints:
        range_ = scene.parameters.d_0_angle if c.definition.unit == "rad" else scene.parameters.d_0
        margin = SHARE * range_ if share else ROUNDING if c.is_cloud else 0.0
        farther = c.safe_distance + (margin if c.keep == "outside" else -margin)
        out.append(replace(c, safe_distance=max(farther, 0.0)) if c.enforced else c)
    return ConstraintSet(out)
