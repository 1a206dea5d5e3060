"""One run: a scene, a solver, a guard and a seed, to a trace."""

import gc
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.robot import Robot
from scenarios.analysis.kinds import TRAJECTORY
from scenarios.analysis.recorder import Recorder
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, build_parts
from scenarios.coordination import SeparateControllers
from scenarios.enforcement import chosen
from scenarios.plants import Plant
from scenarios.plants.build import build_plant
from scenarios.scene import Scene
from scenarios.scene_file import dump_scene
from vfi.controller import Controller
from vfi.tasks import PoseTask

_PACKAGES = ("active-constraints", "numpy", "numba", "pin", "highspy")


def versions() -> dict[str, str]:
    """Versions that a run depends on."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}


def build(
    scene: Scene, *, solver: str, parts: Mapping[str, Part] | None = None, ring: int = 512
) -> Controller | SeparateControllers:
    """The controller of a scene, or those of its arms.

    parts : the anatomy, where it has been built already.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a name or number is wrong.
    """
    robot, how = scene.build_robot(), scene.in_force
    anatomy = build_parts(scene.anatomy) if parts is None else parts

    def controller(constraints: ConstraintSet, task: PoseTask | tuple[PoseTask, ...], group: str) -> Controller:
        return Controller(
            robot,
            constraints,
            task,
            period=scene.period,
            group=group,
            eta=how.eta,
            limit_eta=how.limit_eta,
            solver=solver,
            guard=how.guard,
            clouds={name: part.cloud for name, part in anatomy.items()},
            reach=how.reach,
            forms=how.forms,
            latch=None,  # nobody is there to acknowledge, and a run shows what comes after
            ring=ring,
        )

    if scene.coordination == "central":
        return controller(scene.kept, scene.task, scene.group)
    know = scene.coordination == "velocity"
    return SeparateControllers(
        robot,
        scene.kept,
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


def header(scene: Scene, controller: Controller | SeparateControllers) -> Mapping[str, Any]:
    """Facts on a run, for its trace."""
    return {
        "kind": TRAJECTORY,
        "scene": scene.name,
        "robot": str(scene.robot),
        "solver": controller.solver,
        "enforcement": scene.in_force.method,
        "guard": controller.guard,
        "plant": scene.plant,
        "period_s": controller.period,
        "seed": scene.seed,
        "joints": list(controller.robot.joints),
        "decided": list(controller.joints),
        "tasks": [task.frame or controller.robot.tip for task in scene.tasks],
        "coordination": scene.coordination if scene.arms else "",
        "constraints": {c.name: c.definition.unit for c in scene.constraints},
        "enforced": [c.name for c in controller.constraints if c.enforced],
        "versions": versions(),
        "resolved_scene": dump_scene(scene.located(Path.cwd())),
    }


def plant_of(scene: Scene, robot: Robot, parts: Mapping[str, Part]) -> Plant:
    """The scene's plant at its start; raises as `scenarios.plants.build.build_plant`."""
    start, decided = np.array(scene.start), robot.group(scene.group)
    clouds = {name: part.cloud for name, part in parts.items()}
    return build_plant(scene.plant, scene.robot, start, decided, scene.period, clouds=clouds, seed=scene.seed)


def run(
    scene: Scene,
    *,
    solver: str = "active-set",
    period: float | None = None,
    enforcement: str | None = None,
    guard: str | None = None,
    plant: str | None = None,
    seed: int | None = None,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
    parts: Mapping[str, Part] | None = None,
) -> Trace:
    """Run a scene that follows a trajectory.

    Parameters
    ----------
    solver : see `vfi.controller.Controller`.
    period, enforcement, guard, plant, seed : where they differ from the scene's; the same seed gives the same commands
        to the bit.
    out : file that the trace is written to while the run goes on.
    progress : called about ten times a second with the share that is done.
    parts : the anatomy, where it has been built already.

    Raises
    ------
    InputError, UnknownNameError : see `build` and `scenarios.plants.build.build_plant`.
    PlantError : the simulation broke down.
    """
    scene = chosen(scene, enforcement=enforcement, guard=guard, period=period, plant=plant, seed=seed)
    anatomy = build_parts(scene.anatomy) if parts is None else parts
    controller = build(scene, solver=solver, parts=anatomy)
    cycles = round(scene.duration / controller.period)
    if cycles < 1:
        raise InputError(f"period: expected at most the scene's {scene.duration:g} s, got {controller.period:g} s")
    robot, start = controller.robot, np.array(scene.start)
    body = plant_of(scene, robot, anatomy)
    kinematics = robot.kinematics(start)
    first = [kinematics.pose(task.frame or robot.tip)[:4] for task in scene.tasks]
    reference = np.hstack(
        [r.sample(turn, controller.period, cycles) for r, turn in zip(scene.references, first, strict=True)]
    )
    facts = header(scene, controller)
    recorder = Recorder(controller, controller.columns, facts, out, cycles, progress=progress)
    with recorder, no_collection():
        measurement = body.reset()
        for k in range(cycles):
            command = controller.step(measurement, reference[k])
            recorder.after_cycle(measurement.t, command.state, command.reason)
            measurement = body.step(command)
    return recorder.trace
