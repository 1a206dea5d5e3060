"""What a tool can touch in MuJoCo: the entry port, a ring on springs, and surfaces covered by fixed spheres.

Tools are the geoms with contype 1; what is added here has conaffinity 1, so that nothing else collides. Contacts take
the obstacle's own softness and friction (its priority is higher than the tool's).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, number, unit
from primitives.errors import InputError

PORT = "port"
CHORDS = 24
"""Capsules that the ring is made of; its clear radius grows by 1 / cos(pi / 24), 0.9 %, towards their ends."""
THICKNESS = 0.002
"""Radius of these capsules, metres."""
FRICTION = (0.1, 0.0, 0.0)
"""Sliding friction of steel on what is wet; chosen. A contact turns and rolls freely."""
SOFTNESS = {"solref": (0.004, 1.0), "solimp": (0.98, 0.99, 1e-4, 0.5, 2.0)}
"""A contact comes to rest in about 4 ms, critically damped, which steps of 1 ms resolve, and gives way some 5 um under
15 N: the tool stops at the surface, and the arm behind it yields."""


@dataclass(frozen=True)
class Port:
    """The entry port: a ring around the tool, softly attached, that the tool can touch from inside.

    The ring moves in three directions against springs and does not tilt; its weight is carried.

    Attributes
    ----------
    centre : (3,) at rest, world, metres.
    radius : of the opening, metres.
    axis : (3,) of the opening, world.
    stiffness : of the attachment, N/m, in every direction. damping : Ns/m. mass : kg. All three were chosen, for a soft
        abdominal wall; no measurement stands behind them.
    """

    centre: ArrayLike
    radius: float
    axis: ArrayLike = (0.0, 0.0, 1.0)
    stiffness: float = 2000.0
    damping: float = 20.0
    mass: float = 0.02

    def __post_init__(self) -> None:
        array(self.centre, (3,), "centre of the port")
        unit(self.axis, "axis of the port")
        for name in ("radius", "stiffness", "damping", "mass"):
            number(getattr(self, name), f"{name} of the port", positive=True)

    def add_to(self, spec: Any) -> None:
        """Add the ring to a `mujoco.MjSpec`, as the body "port"."""
        body = spec.worldbody.add_body(name=PORT, pos=np.array(self.centre, dtype=float), gravcomp=1.0)
        for axis in np.eye(3):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, stiffness=self.stiffness, damping=self.damping)
        for ends in ring(unit(self.axis, "axis of the port"), self.radius + THICKNESS):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=ends,
                size=[THICKNESS, 0.0, 0.0],
                mass=self.mass / CHORDS,
                rgba=(0.95, 0.75, 0.2, 1.0),
                **_touchable(),
            )


@dataclass(frozen=True)
class Cloud:
    """A surface of the anatomy, covered by fixed spheres around the points of a cloud.

    Attributes
    ----------
    name : by which forces are told apart, e.g. "vessels".
    points : (N, 3) world, metres.
    radius : of the spheres, metres.
    rgba : colour and opacity, each 0 to 1.
    """

    name: str
    points: ArrayLike
    radius: float
    rgba: tuple[float, float, float, float] = (0.8, 0.2, 0.2, 1.0)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name or self.name == PORT:
            raise InputError(f'name of a cloud: expected a text other than "{PORT}", got {self.name!r}')
        points = array(self.points, (None, 3), f"points of cloud {self.name}")
        if len(points) == 0:
            raise InputError(f"points of cloud {self.name}: expected at least one point, got none")
        number(self.radius, f"radius of cloud {self.name}", positive=True)

    def add_to(self, spec: Any) -> None:
        """Add the spheres to a `mujoco.MjSpec`, as one body of the cloud's name."""
        body = spec.worldbody.add_body(name=self.name)
        for point in np.array(self.points, dtype=float):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                pos=point,
                size=[self.radius, 0.0, 0.0],
                rgba=self.rgba,
                **_touchable(),
            )


def _touchable() -> dict[str, Any]:
    return {"contype": 0, "conaffinity": 1, "priority": 1, "condim": 3, "friction": FRICTION, **SOFTNESS}


def ring(axis: Array, radius: float) -> list[Array]:
    """Chords (6,) [start; end] of a ring around the origin, across a unit axis; their middles lie at the radius."""
    across = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 2.0 * np.pi, CHORDS + 1)
    corners = np.outer(np.cos(angles), across) + np.outer(np.sin(angles), np.cross(axis, across))
    return [np.concatenate(ends) for ends in pairwise(radius / np.cos(np.pi / CHORDS) * corners)]
