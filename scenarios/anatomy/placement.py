"""Poses that put anatomy under an entry port, so that its vessels face the tool."""

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, number, unit
from primitives.errors import InputError
from primitives.surface import Surface

DOWN = (0.0, 0.0, -1.0)


def placed_under(
    port: ArrayLike, depth: float, *, target: ArrayLike, facing: ArrayLike, turn: float = 0.0, axis: ArrayLike = DOWN
) -> Array:
    """The pose (8,) that puts a point of an anatomy at a depth under a port and turns a direction of it to the port.

    Parameters
    ----------
    port : (3,) entry port in the world, metres.
    depth : from the port along `axis` to the point, metres, > 0.
    target : (3,) the point, in the anatomy's own frame, metres.
    facing : (3,) the direction of that frame which will look back along `axis`; of any length but zero.
    turn : about `axis`, rad; 0 is the smallest rotation that turns `facing` so.
    axis : (3,) world direction of the tool from the port into the body.

    Raises
    ------
    InputError : not finite, a depth that is not > 0, or a direction of length zero.
    """
    inward, front = unit(axis, "axis of the tool"), unit(facing, "facing direction")
    origin, place = array(port, (3,), "entry port"), array(target, (3,), "target of the placement")
    rotation = _rotation(inward, number(turn, "turn, rad")) @ _shortest(front, -inward)
    end = origin + number(depth, "depth under the port, metres", positive=True) * inward
    return dq.from_matrix(np.ascontiguousarray(rotation), end - rotation @ place)


def under_port(
    port: ArrayLike, depth: float, *, vessels: Surface, organ: Surface, turn: float = 0.0, axis: ArrayLike = DOWN
) -> Array:
    """The pose (8,) that puts an organ and its vessels, in one frame, under a port with the vessels towards it.

    The direction from the organ's middle to the vessels' looks to the port, the line through both middles passes
    through it, and the first of all points lies at the depth. The other arguments are those of `placed_under`.

    Raises
    ------
    InputError : as of `placed_under`, or middles that coincide.
    """
    middle = _middle(vessels)
    facing = middle - _middle(organ)
    if np.linalg.norm(facing) < 1e-9:
        raise InputError("placement: the vessels lie around the middle of the organ; give `placed_under` a direction")
    front = unit(facing, "direction from organ to vessels")
    every = np.concatenate([vessels.vertices, organ.vertices])
    target = middle + (every @ front - middle @ front).max() * front
    return placed_under(port, depth, target=target, facing=front, turn=turn, axis=axis)


def _middle(surface: Surface) -> Array:
    """Centre of the area, or of the points where there are no faces, (3,)."""
    if not surface.area > 0.0:
        return np.asarray(surface.vertices.mean(axis=0))
    return np.asarray(surface.areas @ surface.triangles.mean(axis=1) / surface.area)


def _rotation(axis: Array, angle: float) -> Array:
    """(3, 3) by an angle about a unit axis."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    out: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return out


def _shortest(a: Array, b: Array) -> Array:
    """(3, 3) the smallest rotation that turns unit vector a to b; about some axis across where they are opposite."""
    axis, cosine = np.cross(a, b), float(a @ b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        if cosine > 0.0:
            return np.eye(3)
        axis, sine = np.cross(a, np.eye(3)[np.argmin(np.abs(a))]), 0.0
    return _rotation(axis / np.linalg.norm(axis), float(np.arctan2(sine, cosine)))
