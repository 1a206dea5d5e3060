"""One run by hand: hand, joint admittance, controller and plant in a loop, to a trace."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np

from admittance.hand import Hand
from admittance.joint_steps import JointBook
from admittance.joints import JointAdmittance, JointMotion
from primitives.checks import Array, known
from primitives.errors import InputError
from scenarios.analysis.recorder import Recorder
from scenarios.analysis.trace import Trace
from scenarios.by_hand.hand import offset, turn
from scenarios.plants.kinematic import KinematicPlant
from scenarios.run import header, no_collection
from scenarios.scene import Scene
from vfi.controller import Controller
from vfi.messages import Command, FreeReference, Measurement
from vfi.outcome import State, Work
from vfi.tasks import ProjectionTask

ENFORCEMENTS = ("none", "vfi")
"""Nobody keeps the constraints, all are watched; or the inequalities keep those that the scene enforces."""
KIND = "by-hand"
"""What `kind` in the header of a trace says."""


class Parts(NamedTuple):
    """What steps in a run: the admittance, the controller that decides on what it proposes, the hand, its way."""

    admittance: JointAdmittance
    controller: Controller
    hand: Hand
    reference: Array

    def step(self, measurement: Measurement, wrench: Array) -> tuple[Command, JointMotion]:
        """One cycle from the hand's wrench to the motion of the arm."""
        proposal = self.admittance.propose(measurement.t, wrench)
        wanted = FreeReference(proposal.v_ref, proposal.metric, proposal.basis, proposal.offset)
        command = self.controller.step(measurement, wanted)
        return command, self.admittance.accept(command.free if command.state < State.HOLD else None)


def build(scene: Scene, *, enforcement: str, period: float | None, guard: str, seed: int) -> Parts:
    """Everything that a run of a scene by hand consists of.

    Raises
    ------
    InputError, UnknownNameError : the scene has no hand, does not fit its robot, or a name or number is wrong.
    """
    known("enforcement", enforcement, ENFORCEMENTS)
    if scene.hand is None or scene.admittance is None:
        raise InputError(f'scene "{scene.name}" follows a trajectory without a hand; give it the keys hand, admittance')
    robot, T = scene.build_robot(), scene.period if period is None else period
    controller = Controller(
        robot,
        scene.constraints if enforcement == "vfi" else scene.constraints.enforcing([]),
        ProjectionTask(len(robot.group(scene.group))),
        period=T,
        group=scene.group,
        eta=scene.eta,
        limit_eta=scene.limit_eta,
        guard=guard,
        latch=None,
    )
    frame = scene.tasks[0].frame or robot.tip
    admittance = JointAdmittance(
        robot, scene.admittance, start=scene.start, frame=frame, period=controller.period, group=scene.group
    )
    if controller.joints != admittance.joints:
        raise InputError(f'joint group "{scene.group}": expected joints in the robot\'s order, got {controller.joints}')
    cycles = round(scene.duration / controller.period)
    if cycles < 1:
        raise InputError(f"period: expected at most the scene's {scene.duration:g} s, got {controller.period:g} s")
    reference = scene.references[0].sample(admittance.kinematics.pose(frame)[:4], controller.period, cycles)
    return Parts(admittance, controller, scene.hand.hand(reference, controller.period, seed), reference)


class Extras:
    """What the controller does not know, beside its records.

    cycle_us, of admittance and controller together; state, the graver one of both; reference and pose (8,) of the
    tool at the beginning of the cycle, error (8,) their difference as vec8; position_error, metres, and
    orientation_error, rad; hand_wrench (6,) at the tool's origin, world axes, N and Nm; the admittance's ledger after
    the cycle, J; ports, what the parts of the projection have done so far, J (`vfi.outcome.Work`).
    """

    def __init__(self, parts: Parts):
        first = at = parts.controller.ring.shape[1]
        self.columns, self._parts, self._ports = dict[str, slice](), parts, np.zeros(len(Work))
        ledger = [(_column(entry), 1) for entry in JointBook]
        for name, size in (
            ("cycle_us", 1),
            ("state", 1),
            *(("reference", 8), ("pose", 8), ("error", 8)),
            ("position_error", 1),
            ("orientation_error", 1),
            ("hand_wrench", 6),
            *ledger,
            ("ports", len(Work)),
        ):
            self.columns[name] = slice(at, at + size)
            at += size
        self.values: Array = np.zeros((len(parts.reference), at - first))

    def put(self, k: int, pose: Array, wrench: Array, command: Command, motion: JointMotion, us: float) -> None:
        """Write those of cycle k."""
        wanted = self._parts.reference[k]
        if wanted @ pose < 0.0:
            wanted = -wanted
        self._ports += command.record[self._parts.controller.columns["work"]]
        apart = np.linalg.norm(offset(pose, wanted)), np.linalg.norm(turn(pose, wanted))
        states = [us, max(command.state, motion.state)]
        ledger = list(self._parts.admittance.ledger.values())
        self.values[k] = np.concatenate([states, wanted, pose, pose - wanted, apart, wrench, ledger, self._ports])


def _column(entry: JointBook) -> str:
    return "limited_work" if entry == JointBook.LIMITED else entry.name.lower()


def run_by_hand(
    scene: Scene,
    *,
    enforcement: str = "vfi",
    period: float | None = None,
    guard: str = "act",
    seed: int = 0,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene by hand on the kinematic plant.

    Parameters
    ----------
    enforcement : one of `ENFORCEMENTS`. guard, period, out, progress : see `scenarios.run.run`.
    seed : of the hand's tremor; the same seed gives the same run to the bit.

    Raises
    ------
    InputError, UnknownNameError : see `build`.
    """
    parts = build(scene, enforcement=enforcement, period=period, guard=guard, seed=seed)
    admittance, controller = parts.admittance, parts.controller
    plant = KinematicPlant(np.array(scene.start), admittance.robot.group(scene.group), controller.period, seed=seed)
    extras = Extras(parts)
    facts = {
        **header(scene, controller, seed),
        "kind": KIND,
        "enforcement": enforcement,
        "enforced": [c.name for c in controller.constraints if c.enforced],
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
            command, motion = parts.step(measurement, wrench)
            extras.put(k, pose, wrench, command, motion, (perf_counter_ns() - begun) * 1e-3)
            worse = command if command.state >= motion.state else motion
            recorder.after_cycle(measurement.t, worse.state, worse.reason)
            measurement = plant.step(motion)
    return recorder.trace
