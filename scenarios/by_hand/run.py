"""One run by hand: hand, joint admittance, controller and plant in a loop, to a trace."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np

from admittance.hand import Hand
from admittance.joints import JointAdmittance, JointMotion
from admittance.outcome import Book
from primitives.checks import Array
from primitives.errors import InputError
from scenarios.analysis.recorder import Recorder
from scenarios.analysis.trace import Trace
from scenarios.by_hand.enforcement import INTEGRATOR, Method, enforce, guard_of
from scenarios.by_hand.hand import offset, turn
from scenarios.plants.kinematic import KinematicPlant
from scenarios.run import header, no_collection
from scenarios.scene import Scene
from vfi.outcome import Work

KIND = "by-hand"
"""What `kind` in the header of a trace says."""


class Parts(NamedTuple):
    """What steps in a run: the admittance, the method that enforces, the hand, its way, and the guard's mode."""

    admittance: JointAdmittance
    method: Method
    hand: Hand
    reference: Array
    guard: str


def build(
    scene: Scene,
    *,
    enforcement: str,
    period: float | None,
    guard: str | None,
    seed: int,
    integrator: str = INTEGRATOR,
) -> Parts:
    """Everything that a run of a scene by hand consists of.

    Raises
    ------
    InputError, UnknownNameError : the scene has no hand, does not fit its robot, or a name or number is wrong.
    """
    if scene.hand is None or scene.admittance is None:
        raise InputError(f'scene "{scene.name}" follows a trajectory without a hand; give it the keys hand, admittance')
    admittance, method = enforce(
        scene, scene.admittance, enforcement, period=period, guard=guard, integrator=integrator
    )
    T = admittance.period
    cycles = round(scene.duration / T)
    if cycles < 1:
        raise InputError(f"period: expected at most the scene's {scene.duration:g} s, got {T:g} s")
    reference = scene.references[0].sample(admittance.kinematics.pose(admittance.frame)[:4], T, cycles)
    return Parts(admittance, method, scene.hand.hand(reference, T, seed), reference, guard_of(enforcement, guard))


class Extras:
    """What the controller does not know, or knows otherwise, beside its records.

    cycle_us, of admittance and controller together; state, the graver one of both; qdot (d,) that was carried out;
    margin (m,) of the declared constraints; intervened, 1 where the guard changed the velocity or would have; reference
    and pose (8,) of the tool at the beginning of the cycle, error (8,) their difference as vec8; position_error,
    metres, and orientation_error, rad; hand_wrench (6,) at the tool's origin, world axes, N and Nm; the admittance's
    ledger after the cycle, J (`admittance.energy`); ports, what the parts of the projection have done so far, J
    (`vfi.outcome.Work`).
    """

    def __init__(self, parts: Parts):
        first = at = parts.method.controller.ring.shape[1]
        self.columns, self._parts, self._ports = dict[str, slice](), parts, np.zeros(len(Work))
        for name, size in (
            ("cycle_us", 1),
            ("state", 1),
            ("qdot", len(parts.admittance.joints)),
            ("margin", len(parts.method.controller.constraints)),
            ("intervened", 1),
            *(("reference", 8), ("pose", 8), ("error", 8)),
            ("position_error", 1),
            ("orientation_error", 1),
            ("hand_wrench", 6),
            *((_column(entry), 1) for entry in Book),
            ("ports", len(Work)),
        ):
            self.columns[name] = slice(at, at + size)
            at += size
        self.values: Array = np.zeros((len(parts.reference), at - first))

    def put(self, k: int, pose: Array, wrench: Array, motion: JointMotion, state: int, us: float) -> None:
        """Write those of cycle k."""
        wanted, method = self._parts.reference[k], self._parts.method
        if wanted @ pose < 0.0:
            wanted = -wanted
        self._ports += method.work
        done = [us, state], motion.qdot, method.margin, [method.intervened]
        apart = np.linalg.norm(offset(pose, wanted)), np.linalg.norm(turn(pose, wanted))
        ledger = list(self._parts.admittance.ledger.values())
        self.values[k] = np.concatenate([*done, wanted, pose, pose - wanted, apart, wrench, ledger, self._ports])


def _column(entry: Book) -> str:
    return "limited_work" if entry == Book.LIMITED else entry.name.lower()


def run_by_hand(
    scene: Scene,
    *,
    enforcement: str = "vfi",
    period: float | None = None,
    guard: str | None = None,
    seed: int = 0,
    integrator: str = INTEGRATOR,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene by hand on the kinematic plant.

    Parameters
    ----------
    enforcement, guard, integrator : see `scenarios.by_hand.enforcement.enforce`.
    period, out, progress : see `scenarios.run.run`.
    seed : of the hand's tremor; the same seed gives the same run to the bit.

    Raises
    ------
    InputError, UnknownNameError : see `build`.
    """
    parts = build(scene, enforcement=enforcement, period=period, guard=guard, seed=seed, integrator=integrator)
    admittance, method, controller = parts.admittance, parts.method, parts.method.controller
    plant = KinematicPlant(np.array(scene.start), admittance.robot.group(scene.group), controller.period, seed=seed)
    extras = Extras(parts)
    facts = {
        **header(scene, controller, seed),
        "kind": KIND,
        "solver": integrator if enforcement == "admittance" else controller.solver,
        "enforcement": enforcement,
        "guard": parts.guard,
        "enforced": [c.name for c in scene.constraints if c.enforced and enforcement != "none"],
        "ports": [port.name.lower() for port in Work],
    }
    columns, cycles = {**controller.columns, **extras.columns}, len(parts.reference)
    recorder = Recorder(controller, columns, facts, out, cycles, more=extras.values, progress=progress)
    with recorder, no_collection():
        measurement = plant.reset()
        for k in range(cycles):
            pose = admittance.kinematics.pose(admittance.frame)
            wrench = parts.hand.wrench(measurement.t, pose, admittance.twist)
            begun = perf_counter_ns()
            motion = method.step(measurement.t, wrench)
            spent = (perf_counter_ns() - begun) * 1e-3
            carried = method.carried
            worse = carried if carried is not None and carried.state >= motion.state else motion
            extras.put(k, pose, wrench, motion, worse.state, spent)
            recorder.after_cycle(measurement.t, worse.state, worse.reason)
            measurement = plant.step(motion)
    return recorder.trace
