"""`Stepping`: what the admittances with and without a port have in common, a cycle's input, halves and outcome."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from time import perf_counter_ns
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from admittance import cycle as compiled_cycle
from admittance.energy import open_books
from admittance.lowering import Lowered
from admittance.memory import Real, Whole
from admittance.messages import WORDS, Proposal
from admittance.model import evaluate, settle
from admittance.outcome import Book, Reason, Slot, State, Touch
from admittance.record import columns, width
from admittance.regions import Region
from admittance.steps import limit
from primitives.checks import Array, array, number
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from primitives.vectors import CONTACT

NOTHING = ConstraintSet()
"""No constraint."""
M = TypeVar("M")
"""What a cycle gives."""


class Stepping(ABC, Generic[M]):
    """A target admittance whose memory is laid out: `step`, or `propose` and `accept`, is one cycle.

    Attributes
    ----------
    robot, group, joints : the arm, its joint group and the joints in it, in the robot's order.
    period : T, seconds.
    constraints : what the barrier keeps. regions : those there are, by name.
    ring : records of the last cycles.
    """

    def __init__(
        self,
        robot: Robot,
        group: str,
        period: float,
        lowered: Lowered,
        constraints: ConstraintSet,
        regions: Sequence[Region],
        ring: int,
    ):
        self.robot, self.group, self.period = robot, group, period
        self.joints = tuple(robot.joints[i] for i in lowered.decided)
        self.constraints, self.regions = constraints, {region.name: region for region in regions}
        self.columns = columns(lowered.memory)
        """Where each quantity stands in a record of the ring; see `admittance.record.columns`."""
        self.ring: Array = np.zeros((int(number(ring, "ring", low=1)), width(lowered.memory)))
        self.cycles = 0
        """Cycles so far; cycle k writes ring[k % len(ring)]."""
        self._memory, self._decided, self._points = lowered.memory, lowered.decided, lowered.points
        self._real, self._outcome = lowered.memory.real, lowered.memory.whole[Whole.OUTCOME]
        self._options = lowered.memory.whole[Whole.OPTIONS]
        self._wrench, self._q = self._real[Real.WRENCH], self._real[Real.Q]
        self._t, self._open = -np.inf, False

    @abstractmethod
    def _motion(self, state: State, reason: str) -> M:
        """What the cycle that has just ended gives."""

    def _take_start(self, start: ArrayLike) -> None:
        """Copy the first configuration (n,) to the memory; raises InputError where a joint is out of its range."""
        lower_, upper = self.robot.limits.lower, self.robot.limits.upper
        q = array(start, (self.robot.n,), "start")
        outside = [j for j, x, a, b in zip(self.robot.joints, q, lower_, upper, strict=True) if not a <= x <= b]
        if outside:
            raise InputError(f"start: out of range at {', '.join(outside)}; see the robot's limits")
        self._q[:] = q

    def _begin(self) -> None:
        """Evaluate the start and open the books; raises InputError where no motion is possible from there."""
        blocked = Reason(evaluate(*self._memory.arguments, *self._points, self._q))
        if blocked == Reason.INSIDE:
            raise InputError(self._depth())
        if blocked == Reason.VIOLATED:
            raise InputError(f"start: {self._violated()}, expected more than zero")
        if blocked != Reason.NONE:
            raise InputError(f"start: {WORDS[blocked]}")
        settle(*self._memory.arguments)
        open_books(*self._memory.arguments)

    def _depth(self) -> str:
        """Where the tool is inside a region, in words."""
        name = list(self.regions)[self._outcome[Slot.REGION]]
        depth, point = -self._real[Real.TOUCH][Touch.CLEARANCE], self._outcome[Slot.POINT]
        return f'the tool is {depth * 1e3:.4g} mm inside the sphere of point {point} of region "{name}"'

    def _violated(self) -> str:
        """Which enforced constraints have no margin left, in words."""
        found = zip(self.constraints, self._real[Real.MARGIN], strict=True)
        scale = {"m": (1e3, "mm"), "rad": (1.0, "rad")}
        said = []
        for c, margin in found:
            if c.enforced and not margin > CONTACT:
                times, unit = scale[c.definition.unit]
                said.append(f'"{c.name}" is {margin * times:.4g} {unit}')
        return f"the margin of constraint {', of '.join(said)}"

    def step(self, t: float, wrench: ArrayLike) -> M:
        """One cycle. Never raises and never commands a number that is not finite.

        Parameters
        ----------
        t : seconds; must grow from cycle to cycle.
        wrench : (6,) [force; torque] of the hand where it is measured, world axes, N and Nm.
        """
        begun = perf_counter_ns()
        problem = self._take_in(t, wrench)
        row = self.cycles % len(self.ring)
        if problem is not None:
            compiled_cycle.refuse(*self._memory.arguments, State.FAULT, *problem, self.ring, row)
        else:
            compiled_cycle.cycle(*self._memory.arguments, *self._points, 0, self._t, self.ring, row)
        self._open = False
        return self._finish(row, begun)

    def propose(self, t: float, wrench: ArrayLike) -> Proposal:
        """The first half of a cycle whose velocity something else decides on; `accept` is the second. Never raises.

        The velocity proposed is that of the semi-implicit step of the reduced form, without limits.
        """
        problem = self._take_in(t, wrench)
        if problem is not None:
            self._wrench[:] = np.nan if problem[0] == Reason.INPUT else 0.0
        compiled_cycle.begin_reference(*self._memory.arguments)
        if problem is not None:
            self._outcome[Slot.STATE], self._outcome[Slot.REASON] = State.FAULT, problem[0]
        self._open = True
        real, near = self._real, self._points[6][: self._outcome[Slot.NEARBY]]
        rows = np.zeros((len(near), len(real[Real.V])))
        if len(near):
            rows[:, :4] = near[:, :4]
        return Proposal(
            real[Real.V_REF].copy(),
            real[Real.Z].T.copy(),
            real[Real.OFFSET].copy(),
            real[Real.METRIC].copy(),
            real[Real.LOW][1].copy(),
            real[Real.HIGH][1].copy(),
            rows,
            near[:, 4].copy(),
            State(self._outcome[Slot.STATE]),
            self._reason(),
        )

    def within_limits(self) -> Array:
        """(m,) the velocity just proposed within the joint limits, as a semi-implicit `step` would carry it out."""
        new: Array = self._real[Real.V_NEXT]
        new[:] = self._real[Real.V_REF]
        limit(*self._memory.arguments, new)
        return new.copy()

    def accept(self, v: ArrayLike | None) -> M:
        """Carry out the free velocity (m,) that was decided on after `propose`, and keep it as the state. Never raises.

        None says that none was found: the state is HOLD, and the arm stands still.

        A velocity that is not (m,) finite numbers, or that comes without a proposal, is a FAULT and stands still.
        """
        begun, row = perf_counter_ns(), self.cycles % len(self.ring)
        try:
            if not self._open:
                raise InputError("accept: there is no proposal")
            if v is None:
                how = State.HOLD, int(Reason.UNDECIDED), self._finite_t
                compiled_cycle.refuse(*self._memory.arguments, *how, self.ring, row)
            else:
                self._real[Real.V_NEXT][:] = array(v, self._real[Real.V].shape, "free velocity")
                compiled_cycle.cycle(*self._memory.arguments, *self._points, 1, self._t, self.ring, row)
        except Exception:
            how = State.FAULT, int(Reason.INPUT), self._finite_t
            compiled_cycle.refuse(*self._memory.arguments, *how, self.ring, row)
        self._open = False
        return self._finish(row, begun)

    @property
    def _finite_t(self) -> float:
        return self._t if np.isfinite(self._t) else 0.0

    def _take_in(self, t: Any, wrench: Any) -> tuple[int, float] | None:
        """Copy the input to the memory; where its form is wrong, the reason and the last good time."""
        try:
            if type(t) is not float:
                t = number(t, "t")
            if not self._t < t < np.inf:
                return int(Reason.TIME), self._finite_t
            if type(wrench) is np.ndarray and wrench.shape == (6,) and wrench.dtype == np.float64:
                self._wrench[:] = wrench
            else:
                self._wrench[:] = array(wrench, (6,), "wrench", finite=False)
        except Exception:
            return int(Reason.INPUT), self._finite_t
        self._t = t
        return None

    def _reason(self) -> str:
        reason = Reason(self._outcome[Slot.REASON])
        if reason == Reason.INSIDE:
            return f"{self._depth()}; {WORDS[reason]}"
        if reason == Reason.VIOLATED:
            return f"{self._violated()}; {WORDS[reason]}"
        return WORDS[reason]

    def _finish(self, row: int, begun: int) -> M:
        self.cycles += 1
        state = self._outcome[Slot.STATE]
        motion = self._motion(State.RUN if state == 0 else State(state), "" if state == 0 else self._reason())
        self.ring[row, 1] = (perf_counter_ns() - begun) * 1e-3
        return motion

    @property
    def ledger(self) -> dict[str, float]:
        """The ledger so far, J by name; see `energy`."""
        return {entry.name.lower(): float(self._real[Real.LEDGER][entry]) for entry in Book}

    @property
    def q(self) -> Array:
        """(n,) present reference of all joints, rad and m."""
        return self._q.copy()
