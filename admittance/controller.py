"""`Admittance`: a robot, a port, what must hold, and parameters, lowered once; `step` is one cycle."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from admittance.lowering import FORMS, INTEGRATORS, Settings
from admittance.memory import Real, Whole
from admittance.messages import Motion
from admittance.model import evaluate
from admittance.nullspace import first_null_basis
from admittance.outcome import Book, Option, Setting, State, Touch
from admittance.parameters import TABLE_1, Parameters
from admittance.port_lowering import lower
from admittance.regions import Cloud, Region, lay_out
from admittance.stepping import NOTHING, Stepping
from primitives.checks import Array, array, known, number
from primitives.constraint import ConstraintSet
from primitives.elements import Point
from primitives.errors import InputError
from primitives.robot import Robot


class Admittance(Stepping[Motion]):
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
        super().__init__(robot, group, settings.period, lowered, constraints, kept_out, ring)
        self.parameters, self.shaft, self.form, self.integrator = parameters, shaft, form, integrator
        self._begin_at(start)

    def _begin_at(self, start: ArrayLike) -> None:
        self._take_start(start)
        real = self._real
        # The first evaluation has no G to hand on; it fills J and P, from which the first G is made.
        evaluate(*self._memory.arguments, *self._points, self._q)
        if not np.all(np.diag(real[Real.FACTOR]) > 0.0) or not np.isfinite(real[Real.P]).all():
            raise InputError("start: the shaft's Jacobian has lost rank; choose another configuration")
        first_null_basis(real[Real.J], real[Real.P], real[Real.G_LAST])
        self._begin()
        offset, condition = float(np.linalg.norm(real[Real.X_C])), float(real[Real.SINGULAR][2])
        limit = float(real[Real.SETTINGS][Setting.CONDITION_LIMIT])
        if offset > 5e-3:
            raise InputError(f"start: the shaft passes the port at {offset * 1e3:.3g} mm, expected at most 5 mm")
        if condition > limit:
            raise InputError(
                f"start: the shaft's Jacobian has the condition {condition:.4g}, expected at most {limit:g}"
            )

    def _motion(self, state: State, reason: str) -> Motion:
        real = self._real
        handle = real[Real.HANDLE][9:].copy()
        return Motion(
            self._q[self._decided],
            real[Real.QDOT].copy(),
            real[Real.V].copy(),
            state,
            reason,
            real[Real.X_C].copy(),
            float(real[Real.TOUCH][Touch.CLEARANCE]),
            real[Real.MARGIN].copy(),
            handle,
            (handle - real[Real.HANDLE_LAST][9:]) / self.period,
        )

    @property
    def handle(self) -> Array:
        """(3,) position of the handle, world, metres."""
        return self._real[Real.HANDLE][9:].copy()

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
