"""One run by hand: hand, joint admittance, controller and plant in a loop, to a trace."""

from collections.abc import Callable, Mapping
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
from scenarios.anatomy.parts import Part, build_parts
from scenarios.by_hand.enforcement import INTEGRATOR, Method, enforce
from scenarios.by_hand.hand import offset, turn
from scenarios.enforcement import chosen
from scenarios.run import header, no_collection, plant_of
from scenarios.scene import Scene
from vfi.outcome import Work

KIND = "by-hand"
"""What `kind` in the header of a trace says."""


class Parts(NamedTuple):
    """What steps in a run: the admittance, the method that enforces, the hand and its way."""

    admittance: JointAdmittance
    method: Method
    hand: Hand
    reference: Array


def build(scene: Scene, anatomy: Mapping[str, Part], integrator: str = INTEGRATOR) -> Parts:
    """Everything that a run of a scene by hand consists of.

    anatomy, integrator : see `scenarios.by_hand.enforcement.enforce`.

    Raises
    ------
    InputError, UnknownNameError : the scene has no hand, does not fit its robot, or a name or number is wrong.
    """
    if scene.hand is None or scene.admittance is None:
        raise InputError(f'scene "{scene.name}" follows a trajectory without a hand; give it the keys hand, admittance')
    admittance, method = enforce(scene, scene.admittance, anatomy, integrator)
    T = admittance.period
    cycles = round(scene.duration / T)
    if cycles < 1:
        raise InputError(f"period: expected at most the scene's {scene.duration:g} s, got {T:g} s")
    reference = scene.references[0].sample(admittance.kinematics.pose(admittance.frame)[:4], T, cycles)
    return Parts(admittance, method, scene.hand.hand(reference, T, scene.seed), reference)


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
    enforcement: str | None = None,
    period: float | None = None,
    guard: str | None = None,
    metric: str | None = None,
    seed: int | None = None,
    integrator: str = INTEGRATOR,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
    parts: Mapping[str, Part] | None = None,
) -> Trace:
    """Run a scene by hand on the kinematic plant.

    Parameters
    ----------
    enforcement, guard, metric, period : where they differ from the scene's.
    seed : of the hand's tremor, likewise; the same seed gives the same run to the bit.
    integrator : see `scenarios.by_hand.enforcement.enforce`.
    out, progress, parts : see `scenarios.run.run`.

    Raises
    ------
    InputError, UnknownNameError : see `build`.
    """
    scene = chosen(scene, enforcement=enforcement, guard=guard, metric=metric, period=period, seed=seed)
    anatomy, how = build_parts(scene.anatomy) if parts is None else parts, scene.in_force
    run = build(scene, anatomy, integrator)
    admittance, method, controller = run.admittance, run.method, run.method.controller
    plant = plant_of(scene, admittance.robot, anatomy)
    extras = Extras(run)
    facts = {
        **header(scene, controller),
        "kind": KIND,
        "solver": integrator if how.method == "admittance" else controller.solver,
        "guard": how.guard,
        "metric": how.metric,
        "enforced": [c.name for c in scene.constraints if c.enforced and how.method != "none"],
        "ports": [port.name.lower() for port in Work],
    }
    columns, cycles = {**controller.columns, **extras.columns}, len(run.reference)
    recorder = Recorder(controller, columns, facts, out, cycles, more=extras.values, progress=progress)
    with recorder, no_collection():
        measurement = plant.reset()
        for k in range(cycles):
            pose = admittance.kinematics.pose(admittance.frame)
            wrench = run.hand.wrench(measurement.t, pose, admittance.twist)
            begun = perf_counter_ns()
            motion = method.step(measurement.t, wrench)
            spent = (perf_counter_ns() - begun) * 1e-3
            carried = method.carried
            worse = carried if carried is not None and carried.state >= motion.state else motion
            extras.put(k, pose, wrench, motion, worse.state, spent)
            recorder.after_cycle(measurement.t, worse.state, worse.reason)
            measurement = plant.step(motion)
    return recorder.trace
