"""The plant in MuJoCo: position servos that yield, a hand that pushes, a port and anatomy that push back."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, known, number
from primitives.errors import InputError, ModelError
from scenarios.plants import PlantError, VelocityCommand
from scenarios.plants.assembly import assemble, bodies_beyond, named
from scenarios.plants.obstacles import PORT, Cloud, Port
from scenarios.plants.wrench_sensor import WrenchSensor
from scenarios.robots import RobotEntry
from vfi.messages import Measurement

COARSEST = 1e-3
"""Physics runs at 1 kHz or finer, s."""

HandModel = Callable[[float, Array, Array], ArrayLike]
"""(t, position (3,), velocity (3,) of the handle) -> wrench (6,), all in world axes at the handle."""

_TROUBLE = {
    mujoco.mjtWarning.mjWARN_BADQACC: "an acceleration beyond bounds or not finite",
    mujoco.mjtWarning.mjWARN_BADQVEL: "a velocity beyond bounds or not finite",
    mujoco.mjtWarning.mjWARN_BADQPOS: "a position beyond bounds or not finite",
    mujoco.mjtWarning.mjWARN_BADCTRL: "a servo reference that is not finite",
    mujoco.mjtWarning.mjWARN_INERTIA: "a singular inertia matrix",
    mujoco.mjtWarning.mjWARN_CONTACTFULL: "more contacts than its memory holds",
    mujoco.mjtWarning.mjWARN_CNSTRFULL: "more contact constraints than its memory holds",
}
"""MuJoCo's warnings, a cause before its consequences."""


class Noise(NamedTuple):
    """Standard deviations of what is measured: joints (rad and m), force (N), torque (Nm)."""

    joints: float = 0.0
    force: float = 0.0
    torque: float = 0.0


NO_NOISE = Noise()


class MujocoPlant:
    """An arm on position servos that follow q_ref, the integral of the commanded velocities.

    Within a period the reference moves evenly, and the servo torque is kp (q_ref - q) + kv (q̇_ref - q̇) with the
    stiffness and damping of the MJCF, so that an even motion has no lag. The arm's own controller
    compensates gravity. Joints that are not commanded are held at the start. A run is the same to the bit for the same
    seed.

    Parameters
    ----------
    entry : the robot; its entry names the MJCF files.
    start : (n,) rad and m. decided : (d,) indices of the commanded joints. period : T, seconds.
    port : the entry port, or None. clouds : the anatomy.
    physics_step : seconds, at most 1 ms, of which the period is a multiple.
    arm : prefix of the arm that the hand holds, for a robot of several; default the first.
    tool_end : frame at the end of what can touch things; what hangs on joints beyond it cannot. None: everything can.
    noise : see `Noise`. seed : of the noise.

    Attributes
    ----------
    model, data : the `mujoco.MjModel` and `mujoco.MjData`, to look at.

    Raises
    ------
    InputError : a value out of range, a period that is no multiple of the physics step.
    ModelError, FileError : the robot has no MJCF, or one that does not fit.
    UnknownNameError : no such arm. PlantError : MuJoCo cannot begin there.
    """

    def __init__(
        self,
        entry: RobotEntry,
        start: ArrayLike,
        decided: ArrayLike,
        period: float,
        *,
        port: Port | None = None,
        clouds: Sequence[Cloud] = (),
        physics_step: float = COARSEST,
        arm: str | None = None,
        tool_end: str | None = None,
        noise: Noise = NO_NOISE,
        seed: int = 0,
    ):
        robot = entry.build()
        self._start = array(start, (robot.n,), f'start of robot "{entry.name}"')
        self._decided = _indices(decided, robot.n)
        self._period = number(period, "period of the plant", positive=True)
        self._substeps = _substeps(self._period, number(physics_step, "physics step of the plant", positive=True))
        self._noise = Noise(*(number(v, f"noise of {n}", low=0.0) for n, v in zip(Noise._fields, noise, strict=True)))
        self._seed = seed
        self.model = assemble(entry, robot, port=port, clouds=clouds, physics_step=self._period / self._substeps)
        if tool_end is not None:
            # What hangs on joints beyond the tool's end goes through everything.
            self.model.geom_contype[np.isin(self.model.geom_bodyid, bodies_beyond(self.model, tool_end))] = 0
        self.data = mujoco.MjData(self.model)
        prefix = _prefix(entry, arm)
        self._sensor = WrenchSensor(self.model, prefix)
        self._handle = _handle(self.model, prefix + "handle")
        places = [named(self.model, mujoco.mjtObj.mjOBJ_JOINT, joint) for joint in robot.joints]
        self._q, self._v = self.model.jnt_qposadr[places].copy(), self.model.jnt_dofadr[places].copy()
        self._servos = np.array([_servo(self.model, joint) for joint in places])
        self._lead = -self.model.actuator_biasprm[self._servos, 2] / self.model.actuator_gainprm[self._servos, 0]
        names = [*([PORT] if port is not None else []), *(cloud.name for cloud in clouds)]
        self._obstacles = {named(self.model, mujoco.mjtObj.mjOBJ_BODY, name): name for name in names}
        self.reset()

    def reset(self) -> Measurement:
        """See `scenarios.plants.Plant`."""
        mujoco.mj_resetData(self.model, self.data)
        self._random = np.random.default_rng(self._seed)
        self._cycle = 0
        self._hand: HandModel | None = None
        self._reference, self._speed = self._start.copy(), np.zeros_like(self._start)
        self.data.qpos[self._q] = self._start
        self.data.ctrl[self._servos] = self._start
        with _warnings_counted_only():
            mujoco.mj_step1(self.model, self.data)
        return self._measure()

    def step(self, command: VelocityCommand) -> Measurement:
        """See `scenarios.plants.Plant`."""
        self._speed[self._decided] = array(command.qdot, self._decided.shape, "velocities of the command")
        advance = self._period / self._substeps * self._speed
        lead = self._lead * self._speed
        with _warnings_counted_only():
            for i in range(self._substeps):
                self.data.ctrl[self._servos] = self._reference + i * advance + lead
                mujoco.mj_step2(self.model, self.data)
                mujoco.mj_step1(self.model, self.data)
                self._ask_hand()
        self._reference += self._period * self._speed
        self.data.ctrl[self._servos] = self._reference + lead
        self._cycle += 1
        return self._measure()

    def push(self, wrench: ArrayLike) -> Array:
        """See `scenarios.plants.Plant`."""
        self._hand = None
        self.data.xfrc_applied[self._handle] = array(wrench, (6,), "wrench of the hand")
        self._accelerate()
        return self._read()

    def hold(self, hand: HandModel) -> Array:
        """Let a model of the hand push the handle until the next push: asked now, and after each physics step.

        Returns the wrench as the sensor reads it now, as `push` does. Wherever the model gives something else than six
        finite numbers, here or in `step`, InputError is raised; after one in `step`, `reset` the plant.
        """
        self._hand = hand
        self._ask_hand()
        self._accelerate()
        return self._read()

    @property
    def handle(self) -> tuple[Array, Array]:
        """Position (3,) and velocity (3,) of the handle, m and m/s, world axes."""
        twist = np.empty(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_XBODY, self._handle, twist, 0)
        return np.array(self.data.xpos[self._handle]), twist[3:]

    @property
    def reference(self) -> Array:
        """(n,) what the servos are asked to hold, rad and m."""
        return self._reference.copy()

    @property
    def contact_forces(self) -> Mapping[str, Array]:
        """See `scenarios.plants.Plant`: of the port and of each cloud by name."""
        forces = {name: np.zeros(3) for name in self._obstacles.values()}
        local = np.empty(6)
        for i, contact in enumerate(self.data.contact):
            first, second = self.model.geom_bodyid[contact.geom]
            mujoco.mj_contactForce(self.model, self.data, i, local)
            # MuJoCo's contact force acts on the second geom.
            on_second = local[:3] @ contact.frame.reshape(3, 3)
            if first in self._obstacles:
                forces[self._obstacles[first]] += on_second
            else:
                forces[self._obstacles[second]] -= on_second
        return forces

    def _ask_hand(self) -> None:
        if self._hand is not None:
            wrench = self._hand(float(self.data.time), *self.handle)
            self.data.xfrc_applied[self._handle] = array(wrench, (6,), "wrench of the hand")

    def _accelerate(self) -> None:
        """Accelerations, contact forces and sensors of the present state; positions and velocities are up to date."""
        with _warnings_counted_only():
            mujoco.mj_forwardSkip(self.model, self.data, mujoco.mjtStage.mjSTAGE_VEL, 0)

    def _read(self) -> Array:
        wrench = self._sensor.read(self.data)
        if self._noise.force > 0.0 or self._noise.torque > 0.0:
            wrench += np.repeat(self._noise[1:], 3) * self._random.standard_normal(6)
        return wrench

    def _measure(self) -> Measurement:
        self._accelerate()
        self._check()
        q = self.data.qpos[self._q].copy()
        if self._noise.joints > 0.0:
            q += self._noise.joints * self._random.standard_normal(len(q))
        return Measurement(self._cycle * self._period, q, self.data.qvel[self._v].copy(), self._read())

    def _check(self) -> None:
        counts = self.data.warning.number
        if counts.any():
            words = next(words for kind, words in _TROUBLE.items() if counts[kind])
            raise PlantError(
                f"MuJoCo met {words} in the period that ends at {self.data.time:g} s: the simulation is unusable until "
                f"the plant is reset. Try a physics step below {self.model.opt.timestep:g} s, a weaker hand, or a "
                "start where nothing touches"
            )


@contextmanager
def _warnings_counted_only() -> Iterator[None]:
    """Keep MuJoCo from printing warnings and writing them to a file in the working folder; it counts them as well."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _substeps(period: float, physics_step: float) -> int:
    if physics_step > COARSEST * (1.0 + 1e-9):
        raise InputError(f"physics step of the plant: expected at most {COARSEST:g} s, got {physics_step:g} s")
    count = round(period / physics_step)
    if count < 1 or abs(count * physics_step - period) > 1e-9 * period:
        raise InputError(
            f"period of the plant: expected a multiple of its physics step, {physics_step:g} s, got {period:g} s; "
            f"the nearest is {max(count, 1) * physics_step:g} s"
        )
    return count


def _indices(decided: ArrayLike, n: int) -> np.ndarray:
    indices = np.asarray(decided)
    if indices.ndim != 1 or indices.dtype.kind not in "iu" or not ((indices >= 0) & (indices < n)).all():
        raise InputError(f"decided joints: expected indices from 0 to {n - 1}, got {decided!r}")
    return indices.astype(np.int64)


def _prefix(entry: RobotEntry, arm: str | None) -> str:
    chosen = next(iter(entry.mjcf)) if arm is None else known("arm", arm, entry.mjcf)
    return f"{chosen}/" if chosen else ""


def _handle(model: Any, name: str) -> int:
    """The body of that name; MuJoCo applies a force at a body's centre of mass, which has to be its origin here."""
    body = named(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if model.body_ipos[body].any():
        raise ModelError(f'body "{name}" of the MJCF: expected its centre of mass at its origin, give it an <inertial>')
    return body


def _servo(model: Any, joint: int) -> int:
    """The one position servo of a joint."""
    moved = (model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT) & (model.actuator_trnid[:, 0] == joint)
    found = [int(i) for i in np.flatnonzero(moved)]
    if len(found) != 1 or not 0.0 < model.actuator_gainprm[found[0], 0] == -model.actuator_biasprm[found[0], 1]:
        raise ModelError(f'joint "{model.joint(joint).name}": expected one position servo with kp > 0 in the MJCF')
    return found[0]
