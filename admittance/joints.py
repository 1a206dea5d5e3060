"""`JointAdmittance`: a target admittance without a port, in joint coordinates; `step` is one cycle."""

from typing import NamedTuple

from numpy.typing import ArrayLike

from admittance.joint_lowering import lower
from admittance.joint_parameters import JointParameters
from admittance.lowering import INTEGRATORS, Settings
from admittance.memory import Real
from admittance.outcome import Form, State
from admittance.stepping import NOTHING, Stepping
from primitives.checks import Array, known, number
from primitives.constraint import ConstraintSet
from primitives.kinematics import Kinematics
from primitives.robot import Robot

OFFERED = ("semi-implicit", "robust")
"""Integrators, both with the damping at the end of the step."""


class JointMotion(NamedTuple):
    """What a cycle commands and where it leads.

    Attributes
    ----------
    q : (d,) position references of the decided joints for the end of the cycle, rad and m; always finite.
    qdot : (d,) velocities commanded for the cycle, (q - q before) / T.
    state : RUN, DEGRADED, HOLD or FAULT.
    reason : empty in RUN; otherwise what held the motion back or what is wrong, in words.
    margin : (c,) of every constraint in their order, metres or radians.
    """

    q: Array
    qdot: Array
    state: State
    reason: str
    margin: Array


class JointAdmittance(Stepping[JointMotion]):
    """M dv/dt + D v = J^T F - dV/dq with the joint velocities v: the tool yields to a hand in every direction.

    There is no port. The barrier potential V of the enforced constraints pushes all decided joints. Where something
    else keeps the tool where it belongs, as the rows of a controller do, `propose` and `accept` are the two halves of
    a cycle. The metric of the proposal, M + T D + T^2 K with the potential's stiffness K, makes the nearest velocity
    that keeps rows a passive one.

    Parameters
    ----------
    robot, parameters : see `JointParameters`.
    start : (n,) first configuration, within the joint limits.
    frame : where the hand holds the tool; default the robot's tip.
    constraints : what must hold, between elements on robot frames and in the world. Watched ones are only measured.
    period : T, seconds.
    group : joint group that moves; the others stand still.
    integrator : "semi-implicit", or "robust", which does not step across the barrier.
    limit_gain : eta_q of the joint-position limits, 1/s.
    force_ceiling, torque_ceiling : a wrench beyond these is no hand's, N and Nm.
    linear_below : margin below which the potential goes on linearly, metres; 0 for a barrier that has no end. Margins
        in radians have the same share of d_0_angle.
    implicit_stiffness : add T^2 K to the metric of `propose` and of the semi-implicit step.
    ring : records kept until they are drained.

    Raises
    ------
    InputError : a number out of range; a start outside the joint limits, or where an enforced constraint has no margin;
        a constraint on a cloud or on an entity.
    InactiveConstraintError : an enforced constraint whose elements the group does not move against each other.
    UnknownNameError : an unknown frame, group or integrator.
    """

    def __init__(
        self,
        robot: Robot,
        parameters: JointParameters,
        *,
        start: ArrayLike,
        frame: str | None = None,
        constraints: ConstraintSet = NOTHING,
        period: float = 0.004,
        group: str = "all",
        integrator: str = "semi-implicit",
        limit_gain: float = 5.0,
        force_ceiling: float = 200.0,
        torque_ceiling: float = 100.0,
        linear_below: float = 0.0,
        implicit_stiffness: bool = True,
        ring: int = 512,
    ):
        settings = Settings(
            number(period, "period", positive=True),
            Form.REDUCED,
            INTEGRATORS[known("integrator", integrator, OFFERED)],
            number(limit_gain, "limit_gain", positive=True),
            1.0,
            force_ceiling,
            torque_ceiling,
            linear_below,
            0.010 if integrator == "robust" else 0.0,
            implicit_stiffness,
        )
        self.frame = known("frame", frame or robot.tip, robot.frames)
        lowered = lower(robot, self.frame, parameters, constraints, group, settings)
        super().__init__(robot, group, settings.period, lowered, constraints, (), ring)
        self.parameters, self.integrator, self._frames = parameters, integrator, lowered.frames
        self._take_start(start)
        self._begin()

    def _motion(self, state: State, reason: str) -> JointMotion:
        real = self._real
        return JointMotion(self._q[self._decided], real[Real.QDOT].copy(), state, reason, real[Real.MARGIN].copy())

    @property
    def kinematics(self) -> Kinematics:
        """Poses and Jacobians of the frames that matter here, at the present reference."""
        return Kinematics(self.q, self._frames, self._real[Real.POSE].copy(), self._real[Real.JACOBIAN].copy())

    @property
    def twist(self) -> Array:
        """(6,) [linear; angular] velocity of the frame's origin over the last cycle, world axes, m/s and rad/s."""
        out: Array = self._real[Real.J] @ self._real[Real.V]
        return out
