"""One run: a scene, a solver, a guard and a seed, to a trace."""

import gc
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from primitives.checks import Array
from primitives.errors import InputError
from scenarios.analysis.trace import Event, Trace, TraceWriter
from scenarios.plants.kinematic import KinematicPlant
from scenarios.scene import Scene
from scenarios.scene_file import dump_scene
from vfi.controller import Controller
from vfi.outcome import State

DRAIN_SECONDS = 0.05
"""At most this much time passes before records reach the trace file."""
PROGRESS_SECONDS = 0.1
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


def _header(scene: Scene, controller: Controller, seed: int) -> Mapping[str, Any]:
    return {
        "scene": scene.name,
        "robot": scene.robot,
        "solver": controller.solver,
        "guard": controller.guard,
        "period_s": controller.period,
        "seed": seed,
        "joints": list(controller.robot.joints),
        "decided": list(controller.joints),
        "constraints": {c.name: c.definition.unit for c in scene.constraints},
        "enforced": [c.name for c in scene.constraints if c.enforced],
        "versions": versions(),
        "resolved_scene": dump_scene(scene),
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
    header, drained, half = _header(scene, controller, seed), 0, len(controller.ring) // 2
    blocks: list[Array] = []
    events: list[Event] = []
    with TraceWriter(out, controller.columns, header) if out else nullcontext() as writer, no_collection():
        measurement, wrote, told, state = plant.reset(), perf_counter(), 0.0, State.RUN
        for k in range(cycles):
            command = controller.step(measurement, reference[k])
            if command.state is not state:
                state = command.state
                events.append(Event(measurement.t, state.name, command.reason))
                if writer is not None:
                    writer.note(events[-1])
            measurement = plant.step(command)
            now = perf_counter()
            if controller.cycles - drained >= half or now - wrote > DRAIN_SECONDS or k == cycles - 1:
                block = controller.ring[np.arange(drained, controller.cycles) % len(controller.ring)]
                blocks.append(block)
                if writer is not None:
                    writer.write(block)
                drained, wrote = controller.cycles, now
            if progress is not None and now - told > PROGRESS_SECONDS:
                progress((k + 1) / cycles)
                told = now
    if progress is not None:
        progress(1.0)
    return Trace(header, controller.columns, np.concatenate(blocks), tuple(events))
