"""`Admittance`: a robot, a port, what must hold, and parameters, lowered once; `step` is one cycle."""

from collections.abc import Sequence
from time import perf_counter_ns
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from admittance import cycle as compiled_cycle
from admittance.energy import open_books
from admittance.lowering import FORMS, INTEGRATORS, Settings, lower
from admittance.memory import Real, Whole
from admittance.messages import WORDS, Motion, Proposal
from admittance.model import evaluate, settle
from admittance.nullspace import first_null_basis
from admittance.outcome import Book, Option, Reason, Setting, Slot, State, Touch
from admittance.parameters import TABLE_1, Parameters
from admittance.record import columns, width
from admittance.regions import Cloud, Region, lay_out
from primitives.checks import Array, array, known, number
from primitives.constraint import ConstraintSet
from primitives.elements import Point
from primitives.errors import InputError
from primitives.robot import Robot
from primitives.vectors import CONTACT

NOTHING = ConstraintSet()
"""No constraint but what the regions are."""


class Admittance:
    """The target admittance of a hand-guided shaft through a port, which it integrates to joint references.

    Parameters
    ----------
    robot : at least six joints that move the shaft.
    port : (3,) p_c in the world, metres.
    shaft : frame whose z axis is the shaft and whose origin is p_t.
    parameters : see `Parameters`; `TABLE_1` for the LWR4+, `NEURO8` for the neurosurgical arm.
    period : T, seconds.
    start : (n,) first configuration, whose shaft runs through the port (within 5 mm).
    regions : forbidden regions, each with a name of its own.
    constraints : what else must hold, between elements on robot frames and in the world. Those on frames of joints
        outside the group count these joints as standing where `start` has them. Watched ones are only measured.
    sensor : point on a robot frame where the wrench is measured and the hand holds on; default the point
        `parameters.shaft_length` back along the shaft.
    form : "reduced", "full" with analytic derivatives, or "printed" with the paper's backward differences.
    integrator : "semi-implicit", "euler", "rk4", or "robust" (which needs the reduced form).
    group : joint group that moves; it must hold every joint that moves the shaft. Joints are in the robot's order.
    limit_gain : eta_q of the joint-position limits, 1/s.
    condition_limit : largest condition of J_t (SI units: m/s and rad/s per joint velocity) that motions may lead to.
    force_ceiling, torque_ceiling : a wrench beyond these is no hand's, N and Nm.
    linear_below : clearance below which the potential goes on linearly, metres; 0 for the paper's barrier.
    sight : how far beyond d_0 cloud points are looked at, metres; `propose` gives their rows. Default 0.010 for the
        robust integrator, which needs it, else 0. Margins in radians have the same shares of d_0_angle for both.
    implicit_stiffness : add T^2 K_GN to the metric of `propose` and of the semi-implicit step.
    ring : records kept until they are drained.

    Raises
    ------
    InputError : a number out of range, a start that is not usable (port, limits, singularity), a combination of form
        and integrator that does not exist, a start inside a region, with the point's index and depth, or where an
        enforced constraint has no margin; a constraint on a cloud or on an entity.
    InactiveConstraintError : an enforced constraint whose elements the group does not move against each other.
    UnknownNameError : an unknown frame, group, form or integrator.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        port: ArrayLike,
        start: ArrayLike,
        shaft: str = "tip",
        parameters: Parameters = TABLE_1,
        period: float = 0.004,
        regions: Sequence[Region] = (),
        constraints: ConstraintSet = NOTHING,
        sensor: Point | None = None,
        form: str = "reduced",
        integrator: str = "semi-implicit",
        group: str = "all",
        limit_gain: float = 5.0,
        condition_limit: float = 1000.0,
        force_ceiling: float = 200.0,
        torque_ceiling: float = 100.0,
        linear_below: float = 0.0,
        sight: float | None = None,
        implicit_stiffness: bool = False,
        ring: int = 512,
    ):
        settings = Settings(
            number(period, "period", positive=True),
            FORMS[known("form", form, FORMS)],
            INTEGRATORS[known("integrator", integrator, INTEGRATORS)],
            limit_gain,
            condition_limit,
            force_ceiling,
            torque_ceiling,
            linear_below,
            (0.010 if integrator == "robust" else 0.0) if sight is None else sight,
            implicit_stiffness,
        )
        handle = sensor or Point.at([0.0, 0.0, -parameters.shaft_length], frame=shaft)
        place, kept_out = array(port, (3,), "port"), tuple(regions)
        lowered = lower(robot, place, shaft, parameters, kept_out, constraints, handle, group, settings)
        size = number(ring, "ring", low=1)
        self.robot, self.parameters, self.period, self.shaft = robot, parameters, settings.period, shaft
        self.form, self.integrator, self.group = form, integrator, group
        self.joints = tuple(robot.joints[i] for i in lowered.decided)
        self.regions = {region.name: region for region in kept_out}
        self.constraints = constraints
        self.columns = columns(lowered.memory)
        """Where each quantity stands in a record of the ring; see `admittance.record.columns`."""
        self.ring: Array = np.zeros((int(size), width(lowered.memory)))
        self.cycles = 0
        """Cycles so far; cycle k writes ring[k % len(ring)]."""
        self._memory, self._decided, self._points = lowered.memory, lowered.decided, lowered.points
        self._real, self._outcome = lowered.memory.real, lowered.memory.whole[Whole.OUTCOME]
        self._options = lowered.memory.whole[Whole.OPTIONS]
        self._wrench, self._q = self._real[Real.WRENCH], self._real[Real.Q]
        self._t, self._open = -np.inf, False
        self._begin_at(start)

    def _begin_at(self, start: ArrayLike) -> None:
        lower_, upper = self.robot.limits.lower, self.robot.limits.upper
        q = array(start, (self.robot.n,), "start")
        outside = [j for j, x, a, b in zip(self.robot.joints, q, lower_, upper, strict=True) if not a <= x <= b]
        if outside:
            raise InputError(f"start: out of range at {', '.join(outside)}; see the robot's limits")
        self._q[:] = q
        real = self._real
        # The first evaluation has no G to hand on; it fills J and P, from which the first G is made.
        evaluate(*self._memory.arguments, *self._points, q)
        if not np.all(np.diag(real[Real.FACTOR]) > 0.0) or not np.isfinite(real[Real.P]).all():
            raise InputError("start: the shaft's Jacobian has lost rank; choose another configuration")
        first_null_basis(real[Real.J], real[Real.P], real[Real.G_LAST])
        blocked = Reason(evaluate(*self._memory.arguments, *self._points, q))
        if blocked == Reason.INSIDE:
            raise InputError(self._depth())
        if blocked == Reason.VIOLATED:
            raise InputError(f"start: {self._violated()}, expected more than zero")
        if blocked != Reason.NONE:
            raise InputError(f"start: {WORDS[blocked]}")
        settle(*self._memory.arguments)
        open_books(*self._memory.arguments)
        offset, condition = float(np.linalg.norm(real[Real.X_C])), float(real[Real.SINGULAR][2])
        limit = float(self._memory.real[Real.SETTINGS][Setting.CONDITION_LIMIT])
        if offset > 5e-3:
            raise InputError(f"start: the shaft passes the port at {offset * 1e3:.3g} mm, expected at most 5 mm")
        if condition > limit:
            raise InputError(
                f"start: the shaft's Jacobian has the condition {condition:.4g}, expected at most {limit:g}"
            )

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

    def step(self, t: float, wrench: ArrayLike) -> Motion:
        """One cycle. Never raises and never commands a number that is not finite.

        Parameters
        ----------
        t : seconds; must grow from cycle to cycle.
        wrench : (6,) [force; torque] of the hand at the sensor, world axes, N and Nm.
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
        real, seen = self._real, self._outcome[Slot.NEARBY]
        rows = np.zeros((seen, len(real[Real.V])))
        rows[:, :4] = self._points[6][:seen, :4]
        return Proposal(
            real[Real.V_REF].copy(),
            real[Real.Z].T.copy(),
            real[Real.OFFSET].copy(),
            real[Real.METRIC].copy(),
            real[Real.LOW][1].copy(),
            real[Real.HIGH][1].copy(),
            rows,
            self._points[6][:seen, 4].copy(),
            State(self._outcome[Slot.STATE]),
            self._reason(),
        )

    def accept(self, v: ArrayLike | None) -> Motion:
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

    def _finish(self, row: int, begun: int) -> Motion:
        self.cycles += 1
        real, state = self._real, self._outcome[Slot.STATE]
        handle = real[Real.HANDLE][9:].copy()
        motion = Motion(
            self._q[self._decided],
            real[Real.QDOT].copy(),
            real[Real.V].copy(),
            State.RUN if state == 0 else State(state),
            "" if state == 0 else self._reason(),
            real[Real.X_C].copy(),
            float(real[Real.TOUCH][Touch.CLEARANCE]),
            real[Real.MARGIN].copy(),
            handle,
            (handle - real[Real.HANDLE_LAST][9:]) / self.period,
        )
        self.ring[row, 1] = (perf_counter_ns() - begun) * 1e-3
        return motion

    @property
    def ledger(self) -> dict[str, float]:
        """The ledger so far, J by name; see `energy`."""
        return {entry.name.lower(): float(self._real[Real.LEDGER][entry]) for entry in Book}

    @property
    def handle(self) -> Array:
        """(3,) position of the handle, world, metres."""
        return self._real[Real.HANDLE][9:].copy()

    @property
    def q(self) -> Array:
        """(n,) present reference of all joints, rad and m."""
        return self._q.copy()

    def replace(self, region: str, cloud: Cloud) -> None:
        """Put another cloud in the place of a region's. Never raises for what the cloud does to the tool.

        A cloud that swallows the tool puts the admittance in HOLD until it is moved or replaced. What it does to the
        potential is entered in the ledger as work of whoever did it.

        Raises
        ------
        UnknownNameError : no such region.
        """
        self._change(self.regions[known("region", region, self.regions)].with_cloud(cloud))

    def move(self, region: str, pose: ArrayLike) -> None:
        """Put a region's cloud at a pose (8,), a unit dual quaternion in the world; otherwise as `replace`.

        Raises
        ------
        UnknownNameError : no such region.
        InputError : no unit dual quaternion.
        """
        self._change(self.regions[known("region", region, self.regions)].with_pose(pose))

    def _change(self, region: Region) -> None:
        laid_out = region.cloud is not self.regions[region.name].cloud
        self.regions[region.name] = region
        place, real = list(self.regions).index(region.name), self._real
        if laid_out:
            self._points, self._memory.whole[Whole.REGION][:] = lay_out(list(self.regions.values()))
        real[Real.REGION][place], real[Real.REGION_POSE][place] = region.row(), region.twelve()
        blocked = evaluate(*self._memory.arguments, *self._points, self._q)
        book, potential = real[Real.LEDGER], real[Real.TOUCH][Touch.POTENTIAL]
        book[Book.CLOUDS] += potential - book[Book.POTENTIAL]
        book[Book.STORAGE] += potential - book[Book.POTENTIAL]
        book[Book.POTENTIAL] = potential
        self._options[Option.EVALUATED] = blocked
