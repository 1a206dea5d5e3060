"""`JointAdmittance`: a target admittance without a port, in joint coordinates; `step` is one cycle."""

from math import hypot
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from admittance.joint_parameters import JointParameters
from admittance.joint_steps import JointBook, enter, limit, propose
from admittance.limits import fill_limits
from admittance.messages import WORDS, Proposal
from admittance.outcome import Limited, Reason, State
from primitives.checks import Array, array, known, number
from primitives.errors import InputError
from primitives.kinematics import Kinematics, snapshot, world_first
from primitives.robot import Robot


class JointMotion(NamedTuple):
    """What a cycle commands and where it leads.

    Attributes
    ----------
    q : (d,) position references of the decided joints for the end of the cycle, rad and m; always finite.
    qdot : (d,) velocities commanded for the cycle, (q - q before) / T.
    state : RUN, DEGRADED, HOLD or FAULT.
    reason : empty in RUN; otherwise what held the motion back or what is wrong, in words.
    """

    q: Array
    qdot: Array
    state: State
    reason: str


class JointAdmittance:
    """M dv/dt + D v = J^T F with the joint velocities v: the tool yields to a hand in every direction, and no port.

    Where something else keeps the tool where it belongs, as the rows of a controller do, `propose` and `accept` are
    the two halves of a cycle. The metric of the proposal, M + T D, makes the nearest velocity that keeps rows a
    passive one.

    Parameters
    ----------
    robot, parameters : see `JointParameters`.
    start : (n,) first configuration, within the joint limits.
    frame : where the hand holds the tool; default the robot's tip.
    period : T, seconds.
    group : joint group that moves; the others stand still.
    limit_gain : eta_q of the joint-position limits of `step`, 1/s.
    force_ceiling, torque_ceiling : a wrench beyond these is no hand's, N and Nm.

    Raises
    ------
    InputError : a number out of range, or a start outside the joint limits.
    UnknownNameError : an unknown frame or group.
    """

    def __init__(
        self,
        robot: Robot,
        parameters: JointParameters,
        *,
        start: ArrayLike,
        frame: str | None = None,
        period: float = 0.004,
        group: str = "all",
        limit_gain: float = 5.0,
        force_ceiling: float = 200.0,
        torque_ceiling: float = 100.0,
    ):
        self.robot, self.parameters, self.group = robot, parameters, group
        self.frame = known("frame", frame or robot.tip, robot.frames)
        self.period = number(period, "period", positive=True)
        self._gain = number(limit_gain, "limit_gain", positive=True)
        if self._gain * self.period > 1.0:
            raise InputError(f"limit_gain: expected limit_gain T <= 1, got {limit_gain:g} 1/s and T = {period:g} s")
        self._most_force = number(force_ceiling, "force_ceiling", low=0.0)
        self._most_torque = number(torque_ceiling, "torque_ceiling", low=0.0)
        self._decided = np.sort(robot.group(group))
        d = len(self._decided)
        self.joints = tuple(robot.joints[i] for i in self._decided)
        self._M, self._D = parameters.masses(d), parameters.dampings(d)
        self._limits = np.array(robot.limits[:3])[:, self._decided].copy()
        self._low, self._high = np.zeros((2, d)), np.zeros((2, d))
        self._frames = world_first((self.frame,))
        self._flat = robot.flat(self._frames)
        self._v, self._v_ref, self._torque, self._book = (np.zeros(k) for k in (d, d, d, len(JointBook)))
        self._q = array(start, (robot.n,), "start")
        out = [
            joint
            for joint, x, low, high in zip(robot.joints, self._q, robot.limits.lower, robot.limits.upper, strict=True)
            if not low <= x <= high
        ]
        if out:
            raise InputError(f"start: out of range at {', '.join(out)}; see the robot's limits")
        self._now = snapshot(self._flat, self._frames, self._q)
        self._t, self._open, self._refused = -np.inf, False, Reason.NONE

    def step(self, t: float, wrench: ArrayLike) -> JointMotion:
        """One cycle, within the joint limits. Never raises and never commands a number that is not finite.

        Parameters
        ----------
        t : seconds; must grow from cycle to cycle.
        wrench : (6,) [force; torque] of the hand at the frame's origin, world axes, N and Nm.
        """
        v = self.propose(t, wrench).v_ref
        limited = limit(v, self._low, self._high)
        motion = self.accept(v)
        if motion.state != State.RUN or limited == Limited.NONE:
            return motion
        reason = Reason.VELOCITY if limited & Limited.VELOCITY else Reason.POSITION
        return motion._replace(state=State.DEGRADED, reason=WORDS[reason])

    def propose(self, t: float, wrench: ArrayLike) -> Proposal:
        """The first half of a cycle whose velocity something else decides on; `accept` is the second. Never raises.

        The velocity proposed, (M + T D)^-1 (M v + T J^T F), knows no limits; its bounds stand beside it.
        """
        force = np.zeros(6)
        self._refused = self._take_in(t, wrench, force)
        jacobian, d = self._now.jacobian(self.frame), len(self._decided)
        propose(jacobian, self._decided, force, self._M, self._D, self.period, self._v, self._torque, self._v_ref)
        fill_limits(self._q, self._decided, self._limits, self._gain, self._low, self._high)
        self._open = True
        return Proposal(
            self._v_ref.copy(),
            np.eye(d),
            np.zeros(d),
            np.diag(self._M + self.period * self._D),
            self._low[1].copy(),
            self._high[1].copy(),
            np.zeros((0, d)),
            np.zeros(0),
            State.FAULT if self._refused else State.RUN,
            WORDS[self._refused],
        )

    def _take_in(self, t: Any, wrench: Any, force: Array) -> Reason:
        """Copy the wrench to force (6,) and keep the time; the reason why not, where it cannot be used."""
        try:
            if type(t) is not float:
                t = number(t, "t")
            if not self._t < t < np.inf:
                return Reason.TIME
            given = array(wrench, (6,), "wrench", finite=False)
        except Exception:
            return Reason.INPUT
        self._t = t
        if not np.isfinite(given).all():
            return Reason.WRENCH
        if hypot(*given[:3]) > self._most_force or hypot(*given[3:]) > self._most_torque:
            return Reason.CEILING
        force[:] = given
        return Reason.NONE

    def accept(self, v: ArrayLike | None) -> JointMotion:
        """Carry out the velocity (d,) that was decided on after `propose`, and keep it as the state. Never raises.

        None says that none was found: the state is HOLD, and the arm stands still. A velocity that is not (d,) finite
        numbers, or that comes without a usable proposal, is a FAULT and stands still.
        """
        was_open, self._open = self._open, False
        if self._refused or not was_open:
            return self._rest(State.FAULT, self._refused or Reason.INPUT)
        if v is None:
            return self._rest(State.HOLD, Reason.UNDECIDED)
        try:
            new = array(v, self._v.shape, "velocity")
        except Exception:
            return self._rest(State.FAULT, Reason.INPUT)
        q = self._q.copy()
        q[self._decided] += self.period * new
        with np.errstate(over="ignore"):
            energy = new @ (self._M * new)
        after = snapshot(self._flat, self._frames, q)
        if not (np.isfinite(energy) and np.isfinite(after.poses).all() and np.isfinite(after.jacobians).all()):
            return self._rest(State.HOLD, Reason.NOT_FINITE)
        enter(self._M, self._D, self.period, self._torque, self._v, self._v_ref, new, self._book)
        self._q, self._now, self._v = q, after, new
        return self._motion(State.RUN, Reason.NONE)

    def _rest(self, state: State, reason: Reason) -> JointMotion:
        """No motion in this cycle, and none left over; the energy that was in it is entered as taken by the limits."""
        self._book[JointBook.LIMITED] -= self._book[JointBook.STORAGE]
        self._book[JointBook.STORAGE] = 0.0
        self._v[:] = 0.0
        return self._motion(state, reason)

    def _motion(self, state: State, reason: Reason) -> JointMotion:
        return JointMotion(self._q[self._decided], self._v.copy(), state, WORDS[reason])

    @property
    def ledger(self) -> dict[str, float]:
        """The ledger so far, J by name; see `joint_steps`."""
        return {entry.name.lower(): float(self._book[entry]) for entry in JointBook}

    @property
    def kinematics(self) -> Kinematics:
        """Pose and Jacobian of the frame at the present reference."""
        return self._now

    @property
    def twist(self) -> Array:
        """(6,) [linear; angular] velocity of the frame's origin over the last cycle, world axes, m/s and rad/s."""
        out: Array = self._now.jacobian(self.frame)[:, self._decided] @ self._v
        return out

    @property
    def q(self) -> Array:
        """(n,) present reference of all joints, rad and m."""
        return self._q.copy()
