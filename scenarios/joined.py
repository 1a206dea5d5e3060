"""An admittance and a controller in one cycle: one measures beside the other, projects its velocity, or guards it."""

from dataclasses import replace
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from admittance import Proposal
from admittance.outcome import State as AdmittanceState
from primitives.checks import Array
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from vfi.controller import Controller
from vfi.messages import Command, FreeReference, Measurement
from vfi.outcome import State, Work

SHARE = 0.05
"""What rows keep beyond a margin of zero where potentials act too, as a share of the potential's range; nearer than
that the potential goes on linearly."""
ALIKE = 1e-9
"""Free velocities, m/s and rad/s, nearer than this are the same."""
M = TypeVar("M", covariant=True)
"""What a cycle of the admittance gives."""


class Yielding(Protocol[M]):
    """What is asked of an admittance, with a port or without."""

    @property
    def robot(self) -> Robot:
        """The arm."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Those that it decides."""

    @property
    def q(self) -> Array:
        """(n,) present reference of all joints."""

    def step(self, t: float, wrench: ArrayLike) -> M:
        """A cycle."""

    def propose(self, t: float, wrench: ArrayLike) -> Proposal:
        """Its first half."""

    def within_limits(self) -> Array:
        """What was proposed, within the joint limits."""

    def accept(self, v: ArrayLike | None) -> M:
        """Its second half."""


class Measured(Generic[M]):
    """An admittance as it is; a controller that enforces nothing measures the margins beside it.

    Parameters
    ----------
    controller : of the same joints, with a `VelocityTask` and watched constraints only.
    declared : the constraints that were declared, of which the controller's may be kept farther.
    """

    intervened = 0.0
    """1 where the guard changed the last command, or would have."""
    carried: Command | None = None
    """The command of the controller that the last cycle carried out, None where it was not the controller's."""

    def __init__(self, admittance: Yielding[M], controller: Controller, declared: ConstraintSet):
        self._admittance, self.controller = admittance, controller
        pairs = zip(declared, controller.constraints, strict=True)
        self._farther = np.array([abs(kept.safe_distance - c.safe_distance) for c, kept in pairs])
        self._still, self._none = np.zeros(admittance.robot.n), np.zeros(len(controller.joints))

    def step(self, t: float, wrench: Array) -> M:
        """One cycle; see `Admittance.step`."""
        self.controller.step(Measurement(t, self._admittance.q, self._still), self._none)
        return self._admittance.step(t, wrench)

    @property
    def margin(self) -> Array:
        """(m,) of the declared constraints at the beginning of the last cycle, metres or radians."""
        controller = self.controller
        record = controller.ring[(controller.cycles - 1) % len(controller.ring)]
        margin: Array = record[controller.columns["margin"]] + self._farther
        return margin

    @property
    def work(self) -> Array:
        """What the parts of the controller's program did in the last cycle, J; see `vfi.outcome.Work`."""
        if self.carried is None:
            return np.zeros(len(Work))
        work: Array = self.carried.record[self.controller.columns["work"]]
        return work


class Projected(Measured[M]):
    """An admittance whose velocities a controller projects onto the inequalities of its constraints.

    Parameters
    ----------
    controller : of the same joints, with a `ProjectionTask`. declared : see `Measured`.
    metric : one of `scenarios.enforcement.METRICS`.
    """

    def __init__(self, admittance: Yielding[M], controller: Controller, declared: ConstraintSet, metric: str = "free"):
        if controller.joints != admittance.joints:
            raise InputError(
                f"the controller decides {', '.join(controller.joints)}, the admittance "
                f"{', '.join(admittance.joints)}; give both the same joint group, in the robot's order"
            )
        super().__init__(admittance, controller, declared)
        self._joints = metric == "joints"

    def step(self, t: float, wrench: Array) -> M:
        """One cycle; see `Admittance.step`. Where no velocity keeps all rows the state is HOLD."""
        proposal = self._admittance.propose(t, wrench)
        stands = proposal.state >= AdmittanceState.HOLD
        wanted = np.zeros_like(proposal.v_ref) if stands else self._wanted(proposal)
        reference = self._reference(proposal._replace(v_ref=wanted))
        command = self.controller.step(Measurement(t, self._admittance.q, self._still), reference)
        if stands:
            self.intervened, self.carried = 0.0, None
            return self._admittance.accept(wanted)
        return self._decide(wanted, command)

    def _wanted(self, proposal: Proposal) -> Array:
        """The velocity that the controller is to keep to. Joint limits are in its program."""
        return proposal.v_ref

    def _decide(self, wanted: Array, command: Command) -> M:
        self.intervened, self.carried = command.record[self.controller.columns["intervened"]][0], command
        return self._admittance.accept(command.free if command.state < State.HOLD else None)

    def _reference(self, p: Proposal) -> FreeReference:
        metric = p.basis.T @ p.basis if self._joints else p.metric
        return FreeReference(p.v_ref, metric, np.ascontiguousarray(p.basis), p.offset)


class Guarded(Projected[M]):
    """An admittance as it is, whose velocities are verified: none may lead beyond a boundary within its period.

    The weakest rows that keep a margin, eta = 1 / T, are solved beside it. Where they ask for another velocity the
    guard has found something: it counts, and puts theirs in the place of the admittance's where it acts.
    """

    def __init__(self, admittance: Yielding[M], controller: Controller, declared: ConstraintSet, acts: bool):
        super().__init__(admittance, controller, declared)
        self._acts = acts

    def _wanted(self, proposal: Proposal) -> Array:
        return self._admittance.within_limits()

    def _decide(self, wanted: Array, command: Command) -> M:
        kept = command.state < State.HOLD and np.abs(command.free - wanted).max() <= ALIKE
        self.intervened = float(not kept)
        if self._acts and not kept:
            self.carried = command
            return self._admittance.accept(command.free if command.state < State.HOLD else None)
        self.carried = None
        return self._admittance.accept(wanted)


def kept_farther(constraints: ConstraintSet, d_0: float, d_0_angle: float, rounding: float = 0.0) -> ConstraintSet:
    """Constraints whose enforced ones are kept `SHARE` of the potential's range before they are due.

    Where potentials act too, a margin of zero is where they are infinite.

    rounding : with d_0 = d_0_angle = 0, what clouds alone are kept farther, metres.
    """
    out = []
    for c in constraints:
        margin = SHARE * (d_0_angle if c.definition.unit == "rad" else d_0) + (rounding if c.is_cloud else 0.0)
        farther = c.safe_distance + (margin if c.keep == "outside" else -margin)
        out.append(replace(c, safe_distance=max(farther, 0.0)) if c.enforced else c)
    return ConstraintSet(out)
