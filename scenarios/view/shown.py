"""What of a run is shown, for each kind of scene: which joints move, what stands around, what the text says."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from primitives.checks import Array
from primitives.constraint import ConstraintSet
from primitives.elements import Cloud as CloudElement
from primitives.robot import Robot
from scenarios.analysis.metrics import VIOLATED
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import Part, build_parts
from scenarios.plants.build import TOUCHED
from scenarios.plants.obstacles import Cloud, Port
from scenarios.resolved import resolved_scene
from scenarios.scene import Scene

FORBIDDEN, ALLOWED = (0.78, 0.2, 0.17, 1.0), (0.55, 0.68, 0.45, 1.0)
"""Colours of parts of the anatomy that the tool is kept out of, and of the others."""

Rows = Callable[[int], list[tuple[str, str]]]


class Shown(NamedTuple):
    """What a film needs to know of a run.

    Attributes
    ----------
    q : (cycles, n) joints to show. frames : whose paths are drawn.
    tool_end : frame beyond which the arm is no part of the run, or None; that is drawn faintly.
    constraints : whose fixed elements are drawn, enforced where the run enforced them. port, clouds : the anatomy.
    rows : from a cycle to (what, how much) of the text. method : what did it.
    """

    q: Array
    frames: tuple[str, ...]
    tool_end: str | None
    constraints: ConstraintSet
    port: Port | None
    clouds: Sequence[Cloud]
    rows: Rows
    method: str


def shown(trace: Trace, robot: Robot, port: Port | None, clouds: Sequence[Cloud]) -> Shown:
    """What of a trace is shown, beside a port and clouds given by hand.

    Raises
    ------
    FileError : the scene in the trace names files that are gone.
    """
    scene = resolved_scene(trace)
    if isinstance(scene, Scene):
        frames = tuple(task.frame or robot.tip for task in scene.tasks)
        constraints = scene.constraints.enforcing(trace.header["enforced"])
        around = [*_anatomy(build_parts(scene.anatomy), constraints), *clouds]
        return Shown(trace["q"], frames, None, constraints, port, around, _margins(trace), trace.header["solver"])
    axis = robot.kinematics(scene.start).rotation(scene.shaft)[:, 2]
    anatomy = _anatomy(build_parts(scene.anatomy, scene.port), scene.constraints)
    own = Port(scene.port, scene.port_radius, axis=axis)
    method = trace.header["enforcement"]
    return Shown(
        trace["plant_q"],
        (scene.shaft,),
        scene.shaft,
        ConstraintSet(),
        port or own,
        [*anatomy, *clouds],
        _forces(trace),
        method,
    )


def _anatomy(parts: Mapping[str, Part], constraints: ConstraintSet) -> list[Cloud]:
    """What can be touched of each part, in the colour of those that an enforced constraint is about."""
    about = {c.second.name for c in constraints if c.enforced and isinstance(c.second, CloudElement)}
    return [
        Cloud(name, part.cloud.world_points, part.cloud.radius * TOUCHED, FORBIDDEN if name in about else ALLOWED)
        for name, part in parts.items()
    ]


def _margins(trace: Trace) -> Rows:
    enforced = trace.header["enforced"]

    def rows(k: int) -> list[tuple[str, str]]:
        out = []
        for name, unit in trace.header["constraints"].items():
            value = trace.margin(name)[k]
            text = f"{1e3 * value:.2f} mm" if unit == "m" else f"{np.degrees(value):.2f} deg"
            out.append((name, text + (" violated" if value < VIOLATED else "" if name in enforced else " (watched)")))
        return out

    return rows


def _forces(trace: Trace) -> Rows:
    hand = np.linalg.norm(trace["hand_wrench"][:, :3], axis=1)
    push = np.linalg.norm(trace["repulsion"][:, :3], axis=1)
    sight = float(trace["clearance"].max())

    def rows(k: int) -> list[tuple[str, str]]:
        near = trace["clearance"][k]
        # Farther off than the regions are looked at, no distance is known.
        distance = f"{1e3 * near:.2f} mm" if near < sight else f"over {1e3 * sight:.0f} mm"
        return [("clearance", distance), ("hand", f"{hand[k]:.1f} N"), ("repulsion", f"{push[k]:.1f} N")]

    return rows
