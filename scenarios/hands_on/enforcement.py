"""Who keeps the tool out of a forbidden region: nobody, the potentials, the inequalities, or both.

In "vfi" the admittance without potentials gives the reference, and the passive projection of `vfi.projection` keeps
every cloud point's clearance from shrinking faster than eta times itself. In "both" the potentials push as well: the
hand feels them before the rows act, and the rows hold where a potential alone would be jumped in sampled time.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from admittance import Admittance, Motion
from admittance.outcome import State as AdmittanceState
from primitives.checks import Array, known
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.hands_on.parts import Part
from scenarios.hands_on.scene import HandsOnScene
from vfi.projection import Projection
from vfi.qp import SolverStatus

ENFORCEMENTS = ("none", "admittance", "vfi", "both")
FORM, INTEGRATOR = "reduced", "semi-implicit"
"""Of the step that the projection belongs to."""
ETA_T = 0.25
"""eta T of the rows: a period may use up a quarter of a clearance."""
ROUNDING = 2e-6
"""Metres that "vfi" keeps beyond the spheres: what the rows' linearisation and rounding may cost stays above zero."""
SHARE = 0.05
"""What "both" keeps beyond the spheres, as a share of d_0; nearer than that the potential goes on linearly."""
SIGHT = 0.005
"""How far beyond d_0 points get a row, metres."""


class Projected:
    """An admittance whose velocities are projected onto one row a cloud point.

    Parameters
    ----------
    admittance : with rows in its proposals.
    margin : metres beyond the spheres that the rows keep.
    """

    def __init__(self, admittance: Admittance, margin: float):
        self._admittance, self._margin = admittance, margin
        self._eta = ETA_T / admittance.period
        joints = len(admittance.joints)
        self._projection = Projection(joints - 2, joints)
        self.constraint_work = 0.0
        """What the rows and the joint limits have done so far, J; <= 0 as long as nothing moves or is violated."""

    def step(self, t: float, wrench: Array) -> Motion:
        """One cycle; see `Admittance.step`. Where no velocity keeps all rows the state is HOLD."""
        p = self._admittance.propose(t, wrench)
        if p.state >= AdmittanceState.HOLD:
            return self._admittance.accept(np.zeros_like(p.v_ref))
        demand = -self._eta * (p.clearances - self._margin)
        found = self._projection.solve(
            p.v_ref, p.metric, p.rows, demand, np.ascontiguousarray(p.basis), p.offset, p.low, p.high
        )
        self.constraint_work += found.constraint_work
        return self._admittance.accept(found.v if found.status == SolverStatus.OPTIMAL else None)


class Plain:
    """An admittance as it is."""

    constraint_work = 0.0

    def __init__(self, admittance: Admittance):
        self.step = admittance.step


Method = Plain | Projected


def enforce(
    enforcement: str, scene: HandsOnScene, robot: Robot, parts: Mapping[str, Part]
) -> tuple[Admittance, Method]:
    """The admittance of a scene, whose records are the run's, and what is to be stepped.

    Raises
    ------
    UnknownNameError : no such enforcement.
    InputError : a form or integrator that a projected step has not. Others as `HandsOnScene.build`.
    """
    known("enforcement", enforcement, ENFORCEMENTS)
    if enforcement == "admittance":
        admittance = scene.build(robot, parts)
        return admittance, Plain(admittance)
    quiet = replace(scene.parameters, k=0.0)
    if enforcement == "none":
        admittance = scene.build(robot, parts, parameters=quiet, regions=())
        return admittance, Plain(admittance)
    if (scene.form, scene.integrator) != (FORM, INTEGRATOR):
        raise InputError(
            f'enforcement "{enforcement}": its steps are those of the {FORM} form and the {INTEGRATOR} integrator, got '
            f"{scene.form} and {scene.integrator}"
        )
    both = enforcement == "both"
    margin = SHARE * scene.parameters.d_0 if both else ROUNDING
    changes: dict[str, Any] = {
        "parameters": replace(scene.parameters if both else quiet, implicit_damping=True),
        "sight": SIGHT,
        "linear_below": margin if both else 0.0,
        "implicit_stiffness": both,
    }
    admittance = scene.build(robot, parts, **changes)
    return admittance, Projected(admittance, margin)
