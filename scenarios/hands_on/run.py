"""One hands-on run: hand, admittance and plant in a loop, to a trace."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from admittance import Admittance
from primitives.checks import Array
from primitives.elements import Cloud
from primitives.errors import InputError
from scenarios.analysis.recorder import Recorder
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, build_parts
from scenarios.enforcement import chosen
from scenarios.hands_on.enforcement import Method, enforce
from scenarios.hands_on.plant import plant_of
from scenarios.hands_on.scene import HandsOnScene
from scenarios.hands_on.scene_file import dump_hands_on
from scenarios.run import no_collection, versions
from vfi.outcome import Work

KIND = "hands-on"
"""What `kind` in the header of a trace says."""


class Extras:
    """What the admittance does not know, beside its records: what the rows and the hand did and the plant measured.

    margin (m,) of the declared constraints, metres or radians; intervened, 1 where the guard changed the command or
    would have; ports, what the parts of the projection have done so far, J (`vfi.outcome.Work`); plant_q (n,) measured
    joints, rad and m; hand_wrench (6,) of the hand on the handle, world axes, N and Nm; contact_NAME (3,) the force on
    the tool of the port and each part, N.
    """

    def __init__(self, first: int, method: Method, robot_n: int, touched: tuple[str, ...], cycles: int):
        self.columns, at, self._method = {}, first, method
        self._ports = np.zeros(len(Work))
        for name, size in (
            ("margin", len(method.controller.constraints)),
            ("intervened", 1),
            ("ports", len(Work)),
            ("plant_q", robot_n),
            ("hand_wrench", 6),
            *((f"contact_{name}", 3) for name in touched),
        ):
            self.columns[name] = slice(at, at + size)
            at += size
        self._first, self._touched = first, touched
        self.values: Array = np.zeros((cycles, at - first))

    def put(self, k: int, q: Array, hand: Array, forces: Mapping[str, Array]) -> None:
        """Write those of cycle k."""
        self._ports += self._method.work
        own = self._method.margin, [self._method.intervened], self._ports
        self.values[k] = np.concatenate([*own, q, hand, *(forces[name] for name in self._touched)])


def _header(scene: HandsOnScene, admittance: Admittance, parts: Mapping[str, Part]) -> Mapping[str, Any]:
    how = scene.in_force
    return {
        "kind": KIND,
        "scene": scene.name,
        "robot": str(scene.robot),
        "solver": admittance.integrator,
        "form": admittance.form,
        "enforcement": how.method,
        "guard": how.guard,
        "metric": how.metric,
        "plant": scene.plant,
        "seed": scene.seed,
        "period_s": scene.period,
        "joints": list(admittance.robot.joints),
        "decided": list(admittance.joints),
        "port": list(scene.port),
        "shaft": scene.shaft,
        "constraints": {c.name: c.definition.unit for c in scene.constraints},
        "ports": [port.name.lower() for port in Work],
        "enforced": [c.name for c in scene.constraints if c.enforced],
        "range_m": scene.parameters.d_0,
        "regions": {
            c.name: {
                "keeps_out": c.first.kind,
                "part": cloud.name,
                "tool_radius": c.safe_distance,
                "radius": parts[cloud.name].cloud.radius + c.safe_distance,
            }
            for c in scene.regions
            if isinstance(cloud := c.second, Cloud)
        },
        "versions": versions(),
        "resolved_scene": dump_hands_on(scene.located(Path.cwd())),
    }


def run_hands_on(
    scene: HandsOnScene,
    *,
    plant: str | None = None,
    enforcement: str | None = None,
    guard: str | None = None,
    metric: str | None = None,
    seed: int | None = None,
    out: Path | None = None,
    progress: Callable[[float], None] | None = None,
    parts: Mapping[str, Part] | None = None,
) -> Trace:
    """Run a hands-on scene.

    Parameters
    ----------
    plant, enforcement, guard, metric, seed : where they differ from the scene's; the same seed gives the same run to
        the bit.
    out : file that the trace is written to while the run goes on.
    progress : called about ten times a second with the share that is done.
    parts : the anatomy, where it has been built already.

    Raises
    ------
    InputError, UnknownNameError : the scene does not fit its robot, or a name or number is wrong.
    PlantError : the simulation broke down.
    """
    scene = chosen(scene, enforcement=enforcement, guard=guard, metric=metric, plant=plant, seed=seed)
    robot = scene.build_robot()
    anatomy = build_parts(scene.anatomy, scene.port) if parts is None else parts
    admittance, method = enforce(scene, robot, anatomy)
    cycles = round(scene.duration / scene.period)
    if cycles < 1:
        raise InputError(f"duration: expected at least the period, {scene.period:g} s, got {scene.duration:g} s")
    clouds = {name: part.cloud for name, part in anatomy.items()}
    body = plant_of(scene, robot, clouds)
    hand = scene.hand.hand(
        np.array(scene.port), scene.first_end(robot), scene.parameters.shaft_length, clouds, scene.seed
    )
    width = admittance.ring.shape[1]
    extras = Extras(width, method, robot.n, tuple(body.contact_forces), cycles)
    columns, header = {**admittance.columns, **extras.columns}, _header(scene, admittance, anatomy)
    recorder = Recorder(admittance, columns, header, out, cycles, more=extras.values, progress=progress)
    with recorder, no_collection():
        measurement, handle = body.reset(), (admittance.handle, np.zeros(3))
        for k in range(cycles):
            t = measurement.t
            wrench = hand.wrench(t, *(body.handle or handle))
            motion = method.step(t, body.push(wrench))
            handle = motion.handle, motion.handle_velocity
            measurement = body.step(motion)
            extras.put(k, measurement.q, wrench, body.contact_forces)
            recorder.after_cycle(t, motion.state, motion.reason)
    return recorder.trace
