"""One run: a scene, a solver, a guard and a seed, to a trace."""

import gc
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from primitives.errors import InputError
from scenarios.analysis.recorder import Recorder
from scenarios.analysis.trace import Trace
from scenarios.plants.kinematic import KinematicPlant
from scenarios.scene import Scene
from scenarios.scene_file import dump_scene
from vfi.controller import Controller

_PACKAGES = ("active-constraints", "numpy", "numba", "pin", "highspy")


def versions() -> dict[str, str]:
    """Versions that a run depends on."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}


def build(scene: Scene, *, solver: str, guard: str, period: float | None, ring: int = 512) -> Controller:
    """The controller of a scene.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a name or number is wrong.
    """
    return Controller(
        scene.build_robot(),
        scene.constraints,
        scene.task,
        period=scene.period if period is None else period,
        group=scene.group,
        eta=scene.eta,
        limit_eta=scene.limit_eta,
        solver=solver,
        guard=guard,
        ring=ring,
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


def header(scene: Scene, controller: Controller, seed: int) -> Mapping[str, Any]:
    """Facts on a run, for its trace."""
    return {
        "scene": scene.name,
        "robot": str(scene.robot),
        "solver": controller.solver,
        "guard": controller.guard,
        "period_s": controller.period,
        "seed": seed,
        "joints": list(controller.robot.joints),
        "decided": list(controller.joints),
        "constraints": {c.name: c.definition.unit for c in scene.constraints},
        "enforced": [c.name for c in scene.constraints if c.enforced],
        "versions": versions(),
        "resolved_scene": dump_scene(scene.located(Path.cwd())),
    }


def run(
    scene: Scene,
    *,
    solver: str = "active-set",
    period: float | None = None,
    guard: str = "act",
    seed: int = 0,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """Run a scene on the kinematic plant.

    Parameters
    ----------
    solver, guard : see `vfi.controller.Controller`.
    period : T in seconds, where it differs from the scene's.
    seed : of everything random; the same seed gives the same commands to the bit.
    out : file that the trace is written to while the run goes on.
    progress : called about ten times a second with the share that is done.

    Raises
    ------
    InputError, UnknownNameError : see `build`.
    """
    controller = build(scene, solver=solver, guard=guard, period=period)
    cycles = round(scene.duration / controller.period)
    if cycles < 1:
        raise InputError(f"period: expected at most the scene's {scene.duration:g} s, got {controller.period:g} s")
    robot, start = controller.robot, np.array(scene.start)
    plant = KinematicPlant(start, robot.group(scene.group), controller.period, seed=seed)
    tip = robot.kinematics(start).pose(scene.task.frame or robot.tip)
    reference = scene.reference.sample(tip[:4], controller.period, cycles)
    facts = header(scene, controller, seed)
    recorder = Recorder(controller, controller.columns, facts, out, cycles, progress=progress)
    with recorder, no_collection():
        measurement = plant.reset()
        for k in range(cycles):
            command = controller.step(measurement, reference[k])
            recorder.after_cycle(measurement.t, command.state, command.reason)
            measurement = plant.step(command)
    return recorder.trace
