"""`Controller`: a constraint set, a robot and a task, lowered once; `step` is one cycle."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from time import perf_counter_ns
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, known, number
from primitives.cloud_table import Spheres
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.kinematics import world_first
from primitives.memory import Memory, addresses
from primitives.robot import Robot
from primitives.table import check_influence, used_frames
from vfi import cycle as compiled_cycle
from vfi import recovery
from vfi.backends import Backend, solvers
from vfi.cycle import UNREAD
from vfi.explain import explain
from vfi.forms import PortForm
from vfi.inputs import Inputs, ages
from vfi.latch import LATCH, Keeper, Latch, checked
from vfi.lowering import Settings, gain_of, lower
from vfi.memory import Real, Whole
from vfi.messages import Command, FreeReference, Layout, Measurement, Rows, new_command
from vfi.outcome import Basis, Form, Guard, Option, Reason, Slot, State
from vfi.qp import QP, SolverStatus
from vfi.record import Head, columns, width
from vfi.tasks import ProjectionTask, Task, VelocityTask

EXPIRY_PERIODS = 2.0
_STATES = tuple(State)
_HOLD = int(State.HOLD)


def _count(value: Any, what: str, low: int) -> int:
    out = number(value, what, low=low)
    if out != int(out):
        raise InputError(f"{what}: expected a whole number, got {out:g}")
    return int(out)


def _check_takes(solver: str, memory: Memory) -> None:
    """Refuse what another solver than the kernel cannot take."""
    if len(memory.whole[Whole.CLOUD]) or memory.whole[Whole.OPTIONS][Option.BASIS] != Basis.JOINTS:
        raise InputError(
            f'solver "{solver}": constraints on clouds, equalities and projections are for the solver "active-set" '
            'only, whose program may change its size; take that, or the form "rows" for a port'
        )


class Controller:
    """Vector-field inequalities in a quadratic program, for one robot, one constraint set and one task.

    Parameters
    ----------
    robot, constraints, task : what to control, what must never happen, what to do as far as that allows.
    period : T, seconds.
    group : joint group whose velocities are decided; the other joints count as moving with their measured velocity.
    eta : gain of the inequalities, 1/s; one number, or {constraint: gain} with the key "" for the others.
    limit_eta : gain of the joint-position limits, 1/s.
    recovery_linear, recovery_angular : fastest way out of a violation that a row asks for, m/s and rad/s.
    solver : a name of `vfi.backends.solvers`.
    guard : "act", "watch" (verify and count, but command the solver's answer) or "off".
    user_rows : how many rows of the user's own `step` may get.
    clouds : the points of every cloud that a constraint refers to, by name, e.g. a `PointCloud`.
    reach : up to which margin the points of a cloud get rows, metres; a motion that would bring a farther one nearer
        than that allows is scaled down by the guard.
    forms : how entry ports are kept: {constraint: "rows", "equality" or `Soft`}; see `vfi.forms`.
    latch : from when on HOLD and FAULT stay until `acknowledge`; None for never, where nobody is there to look.
    max_age : {"q", "qdot" or entity: seconds}, how old what has a stamp may be; else 1.5 periods, of entities 0.1 s.
    ring : records kept until they are drained.

    Raises
    ------
    InputError : a number out of range, eta T > 1 for a gain eta, a solver that cannot take clouds or a basis.
    InactiveConstraintError : an enforced constraint that no decided joint can influence.
    UnknownNameError : a frame, group, constraint, cloud or solver that does not exist.
    """

    def __init__(
        self,
        robot: Robot,
        constraints: ConstraintSet,
        task: Task,
        *,
        period: float,
        group: str = "all",
        eta: float | Mapping[str, float] = 0.5,
        limit_eta: float = 5.0,
        recovery_linear: float = 0.05,
        recovery_angular: float = 0.5,
        solver: str = "active-set",
        guard: str = "act",
        user_rows: int = 0,
        clouds: Mapping[str, Spheres] | None = None,
        reach: float = 0.02,
        forms: Mapping[str, PortForm] | None = None,
        latch: Latch | None = LATCH,
        max_age: Mapping[str, float] | None = None,
        ring: int = 512,
    ):
        known("guard", guard, [g.name.lower() for g in Guard])
        entry = solvers[solver]
        if entry.tracks_pose_only and isinstance(task, VelocityTask | ProjectionTask):
            raise InputError(f'solver "{solver}" needs a PoseTask or several, got {type(task).__name__}')
        user_rows, ring = _count(user_rows, "user_rows", 0), _count(ring, "ring", 1)
        recovery = recovery_linear, recovery_angular
        settings = Settings(
            period,
            eta,
            limit_eta,
            *recovery,
            Guard[guard.upper()],
            user_rows,
            second_solver=entry.bind is not None,
            reach=reach,
            forms=forms or {},
        )
        lowered = lower(robot, constraints, task, group, settings, clouds or {})
        if entry.bind is not None:
            _check_takes(solver, lowered.memory)
        self.robot, self.constraints, self.task, self.period = robot, constraints, task, float(period)
        self._tips = lowered.tips
        self.group, self.solver, self.guard = group, solver, guard
        self.joints = tuple(robot.joints[i] for i in robot.group(group))
        self.entities = lowered.entities
        self._keeper = Keeper(checked(latch))
        self.columns = columns(lowered.memory)
        """Where each quantity stands in a record of the ring; see `vfi.record.columns`."""
        self.ring: Array = np.zeros((ring, width(lowered.memory)))
        self.cycles = 0
        """Cycles so far; cycle k writes ring[k % len(ring)]."""
        self._memory = lowered.memory
        self._arguments = lowered.memory.arguments
        real, whole = lowered.memory.real, lowered.memory.whole
        self._inputs = Inputs(
            lowered, ages(max_age or {}, self.period, self.entities), isinstance(task, ProjectionTask)
        )
        self._clock, self._v, self._multiplier = real[Real.CLOCK], real[Real.V], real[Real.MULTIPLIER]
        self._outcome: Any = whole[Whole.OUTCOME]
        self._options: Any = whole[Whole.OPTIONS]
        self._layout = Layout.of(self.columns, constraints.names)
        self._records, self._length, self._cycle_us = list(self.ring), ring, self.ring[:, int(Head.CYCLE_US)]
        self._expiry = EXPIRY_PERIODS * self.period
        cost, bounds, task_rows = (Real.H, Real.G), (Real.LOW, Real.HIGH), (Real.TASK, Real.TARGET)
        without_cuts = len(real[Real.B]) - len(whole[Whole.CUT])
        self.qp = QP(
            *(real[b] for b in cost),
            *(real[b][:without_cuts] for b in (Real.A, Real.B)),
            *(real[b] for b in (*bounds, *task_rows)),
        )
        """The program of the last cycle, as views of the controller's memory; without the cuts of `vfi.cuts`."""
        self._backend: Backend | None = entry.bind(self.qp) if entry.bind else None
        self._where = addresses(lowered.memory, self.ring)
        self._read_and_cycle: Any = compiled_cycle.read_and_cycle
        self._direct = not (entry.bind or self.entities or user_rows or isinstance(task, ProjectionTask))
        """Whether compiled code reads the inputs itself; not so once they came in a form that it cannot read."""

    def step(self, measurement: Measurement, reference: ArrayLike | FreeReference, rows: Rows | None = None) -> Command:
        """One cycle. Never raises and never commands a number that is not finite.

        Parameters
        ----------
        measurement : see `Measurement`.
        reference : (8,) unit dual quaternion for a `PoseTask`, one after the other for several, (d,) joint velocities
            for a `VelocityTask`, a `FreeReference` for a `ProjectionTask`.
        rows : at most `user_rows` rows of the user's own.
        """
        start = perf_counter_ns()
        row, state = self.cycles % self._length, UNREAD
        if self._direct and rows is None:
            try:
                t = measurement.t
                if type(t) is not float:
                    t = number(t, "t")
                if measurement.stamps is None:
                    state = self._read_and_cycle(self._where, t, measurement.q, measurement.qdot, reference, row)
            except Exception:  # the way below says what is wrong, or can read it
                state = UNREAD
        if state == UNREAD:
            try:
                t = self._inputs.take(measurement, reference, rows)
            except Exception as error:
                return self._refuse(measurement, error)
            state, self._direct = self._cycle(t, row), self._direct and measurement.stamps is not None
        self.cycles += 1
        if state >= _HOLD:
            reason = self._stopped(state, t)
        else:
            self._keeper.bad = self._keeper.faulty = 0
            reason = "" if state == 0 else explain(self._memory, self.constraints.names, self.joints)
        command = new_command((self._records[row].copy(), self._layout, _STATES[state], reason, t + self._expiry))
        self._cycle_us[row] = (perf_counter_ns() - start) * 1e-3
        return command

    @property
    def latched(self) -> str:
        """Why HOLD or FAULT stays until `acknowledge`, with its time; empty where it does not."""
        return self._keeper.reason

    def acknowledge(self) -> None:
        """Leave a HOLD or FAULT that stays: somebody has looked. The next cycle begins from rest and judges anew."""
        self._keeper.forget()
        self._options[Option.STOP] = 0

    def _stopped(self, state: int, t: float, reason: str = "") -> str:
        """The reason of a cycle in HOLD or FAULT, which may be the one from which on that stays."""
        keeper, options = self._keeper, self._options
        why = Reason.MEASUREMENT if reason else self._outcome[Slot.REASON]
        if why == Reason.LATCHED:
            keeper.faulty = 0
            return keeper.reason
        if options[Option.WHY] == Reason.STALE:
            options[Option.STOP] = options[Option.WHY] = 0
        if why == Reason.STALE:
            reason = self._inputs.stale
        elif not reason:
            reason = explain(self._memory, self.constraints.names, self.joints)
        if keeper.note(state, reason, t):
            options[Option.STOP], options[Option.WHY] = keeper.state, Reason.LATCHED
            return keeper.reason
        return reason

    def adjust(
        self,
        name: str,
        *,
        enforced: bool | None = None,
        eta: float | None = None,
        safe_distance: float | None = None,
        over: float = 0.5,
    ) -> None:
        """Switch a constraint on or off, or change its gain or safe distance, while the controller runs.

        The numbers go over smoothly, so that the command does not jump (see `vfi.blend`); a further call begins at
        what they are then.

        Parameters
        ----------
        name : of the constraint. enforced, eta, safe_distance : None for as it is; 1/s, metres or radians.
        over : seconds that the change takes.

        Raises
        ------
        UnknownNameError : no such constraint.
        InputError : a number out of range, a port in the form of an equality that is to be switched.
        InactiveConstraintError : a constraint that no decided joint can influence.
        """
        place = self.constraints.names.index(known("constraint", name, self.constraints.names))
        real, whole, old = self._memory.real, self._memory.whole, self.constraints[name]
        gain = real[Real.ETA][place] if eta is None else gain_of(eta, f'eta of constraint "{name}"', self.period)
        new = replace(
            old,
            enforced=old.enforced if enforced is None else enforced,
            safe_distance=old.safe_distance if safe_distance is None else safe_distance,
        )
        if new.enforced != old.enforced and whole[Whole.FORM][place] == Form.EQUALITY:
            raise InputError(f'constraint "{name}": an equality cannot be switched while running; take rows or Soft')
        if new.enforced and not old.enforced:
            frames = world_first((*used_frames(self.constraints), *self._tips))
            check_influence([new], frames, self.robot.flat(frames), self.robot.group(self.group))
        time = number(over, "over", positive=True)
        real[Real.BLEND][place] = [
            0.0,
            min(1.0, self.period / time),
            real[Real.FORCE][place],
            float(new.enforced),
            real[Real.ETA][place],
            gain,
            real[Real.SAFE][place],
            new.safe_distance,
        ]
        whole[Whole.OPTIONS][Option.BLENDING] = 1
        self.constraints = ConstraintSet(new if c.name == name else c for c in self.constraints)

    def _cycle(self, t: float, row: int) -> int:
        """A cycle whose inputs are in the memory; returns the state."""
        if self._backend is None:
            return int(compiled_cycle.cycle(*self._arguments, t, self.ring, row))
        self._with_backend(self._backend, t, row)
        return int(self._outcome[Slot.STATE])

    def _with_backend(self, backend: Backend, t: float, row: int) -> None:
        """As the compiled cycle, with another solver; where re-solving does not help, the kernel begins anew."""
        if compiled_cycle.prepare(*self._arguments) < State.HOLD:
            while recovery.judge(*self._arguments, int(self._ask(backend))):
                if self._outcome[Slot.RESOLVES] > recovery.RESOLVES:
                    self._by_kernel()
                    break
        compiled_cycle.finish(*self._arguments, t, self.ring, row)

    def _ask(self, backend: Backend) -> SolverStatus:
        """The back end's answer, or the kernel's where that is none."""
        status = SolverStatus.NOT_SOLVED
        with suppress(Exception):
            status = SolverStatus(backend.solve(self._v, self._multiplier))
        self._outcome[Slot.SOLVER] = status
        if status == SolverStatus.OPTIMAL and np.isfinite(self._v).all():
            return status
        infeasible = status == SolverStatus.INFEASIBLE
        status = SolverStatus(compiled_cycle.optimise(*self._arguments))
        self._outcome[Slot.INFEASIBLE] = max(self._outcome[Slot.INFEASIBLE], int(infeasible))
        if status == SolverStatus.OPTIMAL:
            recovery.conclude(*self._arguments, State.DEGRADED, Reason.SECOND_SOLVER, -1)
        return status

    def _by_kernel(self) -> None:
        """The same program from the beginning, without what the back end's answers have done to it."""
        resolves = int(self._outcome[Slot.RESOLVES])
        compiled_cycle.prepare(*self._arguments)
        recovery.conclude(*self._arguments, State.DEGRADED, Reason.SECOND_SOLVER, -1)
        while recovery.judge(*self._arguments, compiled_cycle.optimise(*self._arguments)):
            pass
        self._outcome[Slot.RESOLVES] += resolves
        self._outcome[Slot.INTERVENED] = 1

    def _refuse(self, measurement: Any, error: Exception) -> Command:
        """A FAULT command for inputs that could not even be read."""
        self._outcome[:] = 0
        self._outcome[Slot.STATE], self._outcome[Slot.REASON] = State.FAULT, Reason.MEASUREMENT
        self._outcome[Slot.WHERE] = -1
        self._v[:], self._multiplier[:], self._memory.real[Real.SLACK][:] = 0.0, 0.0, 0.0
        row, t = self.cycles % len(self.ring), float(self._clock[0])
        with suppress(Exception):
            t = number(measurement.t, "t")
        compiled_cycle.finish(*self._arguments, t, self.ring, row)
        self.cycles += 1
        reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        reason = self._stopped(State.FAULT, t, reason)
        return Command(self.ring[row].copy(), self._layout, State.FAULT, reason, t + self._expiry)
