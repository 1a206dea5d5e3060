"""What a run is shown on: its arms, port and anatomy in MuJoCo, and the fixed elements of its constraints."""

from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np

from primitives.checks import Array
from primitives.constraint import Constraint
from primitives.elements import WORLD, Element
from primitives.robot import Robot
from scenarios.plants.assembly import robot_spec
from scenarios.plants.obstacles import Cloud, Port, ring
from scenarios.robots import RobotEntry

KEPT, WATCHED, VIOLATED = (0.15, 0.65, 0.6), (0.6, 0.62, 0.66), (0.9, 0.15, 0.1)
"""Colours of an enforced constraint that is kept, of one that is only watched, and of one that is violated."""
OPACITY = {"plane": 0.35, "line": 0.16, "point": 0.9, "segment": 0.2}
"""Of the fixed element of a constraint, by its kind; what would hide the tool is shown faintly."""
RING_THICKNESS, SHEET = 0.0004, 0.0002
"""Radius of the ring that stands for a point, half the thickness of a plane, metres."""


def is_fixed(element: Element) -> bool:
    """Whether an element stands still in the world."""
    return element.frame == WORLD and element.entity is None


def build_stage(
    entry: RobotEntry,
    robot: Robot,
    *,
    constraints: Iterable[Constraint],
    centre: Array,
    reach: float,
    port: Port | None,
    clouds: Sequence[Cloud],
    size: tuple[int, int],
) -> tuple[Any, dict[str, list[int]]]:
    """The `mujoco.MjModel` to draw, and which of its geoms stand for which constraint.

    Parameters
    ----------
    constraints : of these, those whose second element stands still in the world are drawn: a plane as a sheet, a line
        as the cylinder of its safe distance, a point as the ring or the sphere of it, a segment as the capsule.
    centre, reach : ball around everything of interest, metres; what has no end is drawn as far as that.
    size : width and height of the pictures, pixels.
    """
    spec = robot_spec(entry, robot)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = size
    # Near and far planes in units of the model's extent: tools are drawn from centimetres away.
    spec.stat.extent, spec.stat.center = 1.0, centre
    spec.visual.map.znear, spec.visual.map.zfar = 0.005, 20.0
    spec.visual.quality.offsamples = 4
    spec.visual.headlight.ambient = (0.32, 0.32, 0.34)
    spec.visual.headlight.diffuse = (0.25, 0.25, 0.25)
    spec.visual.headlight.specular = (0.1, 0.1, 0.1)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.93, 0.95, 0.98),
        rgb2=(0.55, 0.6, 0.68),
        width=256,
        height=1536,
    )
    # Without shadows: there is no ground to fall on, translucent elements would darken what they hold, and they cost
    # more than all the rest.
    for place, strength in (((1.0, -1.2, 2.0), 0.55), ((-1.5, 0.8, 1.0), 0.25)):
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=centre + np.array(place),
            dir=-np.array(place),
            diffuse=[strength] * 3,
            specular=[0.3] * 3,
            castshadow=False,
        )
    if port is not None:
        port.add_to(spec)
    for cloud in clouds:
        cloud.add_to(spec)
    shown = []
    for constraint in constraints:
        if is_fixed(constraint.second):
            body = spec.worldbody.add_body(name=f"constraint {constraint.name}")
            _add_element(body, constraint, centre, reach)
            shown.append(constraint.name)
    model = spec.compile()
    geoms = {}
    for name in shown:
        body = model.body(f"constraint {name}")
        geoms[name] = list(range(int(body.geomadr[0]), int(body.geomadr[0] + body.geomnum[0])))
    return model, geoms


def _add_element(body: Any, constraint: Constraint, centre: Array, reach: float) -> None:
    element, away = constraint.second, constraint.safe_distance
    point, direction, length = element.geometry[:3], element.geometry[3:6], element.geometry[6]
    look = {"contype": 0, "conaffinity": 0, "rgba": (*KEPT, OPACITY[element.kind])}
    if element.kind == "plane":
        middle = centre - ((centre - point) @ direction - (away if constraint.keep == "outside" else -away)) * direction
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, pos=middle, size=[reach, reach, SHEET], quat=_turn(direction), **look
        )
    elif element.kind == "point" and constraint.first.kind in ("line", "segment") and constraint.keep == "inside":
        for ends in ring(np.array([0.0, 0.0, 1.0]), away):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=ends + np.tile(point, 2),
                size=[RING_THICKNESS, 0.0, 0.0],
                **look,
            )
    elif element.kind == "point":
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=point, size=[away, 0.0, 0.0], **look)
    elif element.kind == "line":
        middle = point + ((centre - point) @ direction) * direction
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            fromto=[*(middle - reach * direction), *(middle + reach * direction)],
            size=[max(away, SHEET), 0.0, 0.0],
            **look,
        )
    else:
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[*point, *(point + length * direction)],
            size=[max(away, SHEET), 0.0, 0.0],
            **look,
        )


def _turn(direction: Array) -> Array:
    """Quaternion (4,) that turns z onto a direction."""
    quaternion = np.empty(4)
    mujoco.mju_quatZ2Vec(quaternion, np.array(direction))
    return quaternion
