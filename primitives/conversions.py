"""Values from outside as dual quaternions, checked, and back to `dqrobotics.DQ`."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, array, unit
from primitives.dual_quaternion import norm, normalized
from primitives.errors import InputError

if TYPE_CHECKING:
    from dqrobotics import DQ

_UNIT_TOLERANCE = 1e-6
"""How far a pose from outside may be from unit norm before it is refused."""


def from_dq(value: "DQ") -> Array:
    """The eight numbers of a dqrobotics.DQ, (8,), unchecked."""
    return np.array(value.vec8(), dtype=np.float64)


def to_dq(value: ArrayLike) -> "DQ":
    """A dqrobotics.DQ of eight numbers.

    Raises
    ------
    InputError : not eight finite numbers.
    """
    from dqrobotics import DQ

    return DQ(as_dual_quaternion(value, "dual quaternion"))


def as_dual_quaternion(value: Any, what: str) -> Array:
    """A dual quaternion, (8,), from a dqrobotics.DQ or from eight numbers; `what` names it in an error.

    Raises
    ------
    InputError : another shape, or not finite.
    """
    return array(value.vec8() if hasattr(value, "vec8") else value, (8,), what)


def as_pose(value: Any, what: str) -> Array:
    """A pose, (8,), from a dqrobotics.DQ or from eight numbers, normalised; `what` names it in an error.

    Raises
    ------
    InputError : another shape, not finite, or more than 1e-6 from unit norm (of the dual part of the norm,
    1e-6 m, or 1e-6 of the translation where that is longer than 1 m).
    """
    x = as_dual_quaternion(value, what)
    primary, dual = norm(x)
    allowed = _UNIT_TOLERANCE * max(1.0, float(np.linalg.norm(x[4:])))
    if abs(primary - 1.0) > _UNIT_TOLERANCE or abs(dual) > allowed:
        raise InputError(
            f"{what}: expected a unit dual quaternion r + eps (1/2) t r, got {x.tolist()}, whose norm is "
            f"{primary:.9g} + eps {dual:.3g}; primitives.dual_quaternion.normalized scales it"
        )
    return normalized(x)


def line(point: ArrayLike, direction: ArrayLike) -> Array:
    """Line through a point (3,), in metres, as the unit dual quaternion l + eps p x l, (8,), paper V (1).

    The direction (3,) needs no unit length.

    Raises
    ------
    InputError : not three finite numbers, or a direction of length zero.
    """
    p, axis = array(point, (3,), "point of line"), unit(direction, "direction of line")
    return np.concatenate(([0.0], axis, [0.0], np.cross(p, axis)))


def plane(normal: ArrayLike, point: ArrayLike) -> Array:
    """Plane through a point (3,), in metres, as n + eps d, (8,), with d = <p, n> in metres, paper V (15).

    The normal (3,) needs no unit length; it points to the side of positive distance.

    Raises
    ------
    InputError : not three finite numbers, or a normal of length zero.
    """
    n, p = unit(normal, "normal of plane"), array(point, (3,), "point of plane")
    return np.concatenate(([0.0], n, [float(n @ p), 0.0, 0.0, 0.0]))
