"""One run: a scene, a solver, a guard and a seed, to a trace."""

import gc
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from primitives.checks import known
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from scenarios.analysis.kinds import TRAJECTORY
from scenarios.analysis.recorder import Recorder
from scenarios.analysis.trace import Trace
from scenarios.coordination import SeparateControllers
from scenarios.plants.kinematic import KinematicPlant
from scenarios.scene import Scene
from scenarios.scene_file import dump_scene
from vfi.controller import Controller
from vfi.tasks import PoseTask

ENFORCEMENTS = ("none", "vfi")
"""All constraints are watched; or the inequalities keep those that the scene enforces."""
_PACKAGES = ("active-constraints", "numpy", "numba", "pin", "highspy")


def versions() -> dict[str, str]:
    """Versions that a run depends on."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}


def build(
    scene: Scene, *, solver: str, guard: str, period: float | None, enforcement: str = "vfi", ring: int = 512
) -> Controller | SeparateControllers:
    """The controller of a scene, or those of its arms.

    Arguments see `run`; ring: records kept until they are drained.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a name or number is wrong.
    """
    known("enforcement", enforcement, ENFORCEMENTS)
    robot = scene.build_robot()
    declared = scene.constraints if enforcement == "vfi" else scene.constraints.enforcing([])

    def controller(constraints: ConstraintSet, task: PoseTask | tuple[PoseTask, ...], group: str) -> Controller:
        return Controller(
            robot,
            constraints,
            task,
            period=scene.period if period is None else period,
            group=group,
            eta=scene.eta,
            limit_eta=scene.limit_eta,
            solver=solver,
            guard=guard,
            latch=None,  # nobody is there to acknowledge, and a run shows what comes after
            ring=ring,
        )

    if scene.coordination == "central":
        return controller(declared, scene.task, scene.group)
    know = scene.coordination == "velocity"
    return SeparateControllers(
        robot,
        declared,
        scene.group,
        scene.arms,
        know,
        lambda constraints, i, arm: controller(constraints, scene.tasks[i], arm),
        ring,
    )


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep the cyclic garbage collector out of the loop; what a cycle allocates is freed by reference counting."""
    was = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def header(scene: Scene, controller: Controller | SeparateControllers, seed: int) -> Mapping[str, Any]:
    """Facts on a run, for its trace."""
    return {
        "kind": TRAJECTORY,
        "scene": scene.name,
        "robot": str(scene.robot),
        "solver": controller.solver,
        "guard": controller.guard,
        "period_s": controller.period,
        "seed": seed,
        "joints": list(controller.robot.joints),
        "decided": list(controller.joints),
        "tasks": [task.frame or controller.robot.tip for task in scene.tasks],
        "coordination": scene.coordination if scene.arms else "",
        "constraints": {c.name: c.definition.unit for c in scene.constraints},
        "enforced": [c.name for c in controller.constraints if c.enforced],
        "versions": versions(),
        "resolved_scene": dump_scene(scene.located(Path.cwd())),
    }


def run(
    scene: Scene,
    *,
    solver: str = "active-set",
    period: float | None = None,
    guard: str = "act",
    enforcement: str = "vfi",
    seed: int = 0,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene on the kinematic plant.

    Parameters
    ----------
    solver, guard : see `vfi.controller.Controller`. enforcement : one of `ENFORCEMENTS`.
    period : T in seconds, where it differs from the scene's.
    seed : of everything random; the same seed gives the same commands to the bit.
    out : file that the trace is written to while the run goes on.
    progress : called about ten times a second with the share that is done.

    Raises
    ------
    InputError, UnknownNameError : see `build`.
    """
    controller = build(scene, solver=solver, guard=guard, period=period, enforcement=enforcement)
    cycles = round(scene.duration / controller.period)
    if cycles < 1:
        raise InputError(f"period: expected at most the scene's {scene.duration:g} s, got {controller.period:g} s")
    robot, start = controller.robot, np.array(scene.start)
    plant = KinematicPlant(start, robot.group(scene.group), controller.period, seed=seed)
    kinematics = robot.kinematics(start)
    first = [kinematics.pose(task.frame or robot.tip)[:4] for task in scene.tasks]
    reference = np.hstack(
        [r.sample(turn, controller.period, cycles) for r, turn in zip(scene.references, first, strict=True)]
    )
    facts = {**header(scene, controller, seed), "enforcement": enforcement}
    recorder = Recorder(controller, controller.columns, facts, out, cycles, progress=progress)
    with recorder, no_collection():
        measurement = plant.reset()
        for k in range(cycles):
            command = controller.step(measurement, reference[k])
            recorder.after_cycle(measurement.t, command.state, command.reason)
            measurement = plant.step(command)
    return recorder.trace
