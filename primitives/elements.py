"""Points, lines, planes and segments, attached to a robot frame, to the world, or to a moving entity.

An element is given and stored as a dual quaternion in the frame it is attached to. Kernels work on its *geometry*,
eight numbers ``[point (3), direction (3), length, 0]`` that a rigid motion maps in the obvious way; the two forms are
held equal by tests.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, unit
from primitives.errors import InputError

WORLD = "world"


@dataclass(frozen=True, eq=False)
class Element:
    """What all elements share: a dual quaternion and where it is attached.

    Parameters
    ----------
    dual_quaternion : (8,) in the coordinates of what the element is attached to, metres; an array or a
        ``dqrobotics.DQ``. `Point`, `Line`, `Plane` and `Segment` say which dual quaternion they take.
    frame : name of a robot frame, or "world" for an element that stands still.
    entity : name of a moving entity, whose pose and twist come with each measurement. Excludes `frame`.
    length : metres, for segments.

    Raises
    ------
    InputError : not finite, not of the element's kind, or both a frame and an entity are given.
    """

    dual_quaternion: Array
    frame: str = WORLD
    entity: str | None = None
    length: float = 0.0

    kind: ClassVar[str] = "element"

    def __post_init__(self) -> None:
        value = dq.as_dual_quaternion(self.dual_quaternion, f"dual quaternion of {type(self).__name__}")
        value.setflags(write=False)
        object.__setattr__(self, "dual_quaternion", value)
        if self.entity is not None and self.frame != WORLD:
            raise InputError(
                f'{type(self).__name__}: got frame "{self.frame}" and entity "{self.entity}"; an element is attached '
                "to one of them"
            )
        self._check()

    def _check(self) -> None:
        """Refuse a dual quaternion that is not of this element's kind."""

    def _refuse(self, expected: str) -> None:
        got = self.dual_quaternion.tolist()
        raise InputError(f"{type(self).__name__}: expected {expected}, got {got}")

    @property
    def geometry(self) -> Array:
        """(8,) point, direction, length, 0; in the coordinates of what the element is attached to, metres."""
        raise InputError(f"{type(self).__name__} has no geometry; use Point, Line, Plane or Segment")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Element):
            return NotImplemented
        mine, theirs = (
            (self.kind, self.frame, self.entity, self.length),
            (
                other.kind,
                other.frame,
                other.entity,
                other.length,
            ),
        )
        return mine == theirs and bool(np.array_equal(self.dual_quaternion, other.dual_quaternion))

    def __hash__(self) -> int:
        return hash((self.kind, self.frame, self.entity, self.length, self.dual_quaternion.tobytes()))


class Point(Element):
    """A point, stored as the pure quaternion t (dual part zero)."""

    kind = "point"

    @classmethod
    def at(cls, position: ArrayLike, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The point at a position (3,), metres."""
        return cls(np.r_[0.0, array(position, (3,), "position of Point"), np.zeros(4)], frame, entity)

    def _check(self) -> None:
        if self.dual_quaternion[0] != 0.0 or np.any(self.dual_quaternion[4:]):
            self._refuse("a pure quaternion (w = 0, dual part 0)")

    @property
    def geometry(self) -> Array:
        return np.r_[self.dual_quaternion[1:4], np.zeros(5)]


class Line(Element):
    """A Plücker line l + eps m with m = p x l, a pure unit dual quaternion; paper V, (1)."""

    kind = "line"

    @classmethod
    def through(cls, point: ArrayLike, direction: ArrayLike, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The line through a point (3,), metres, along a direction (3,) of any length but zero."""
        l = unit(direction, "direction of Line")
        m = np.cross(array(point, (3,), "point of Line"), l)
        return cls(np.r_[0.0, l, 0.0, m], frame, entity)

    @classmethod
    def z_axis(cls, frame: str) -> Self:
        """The z axis of a robot frame; paper V, (17)."""
        return cls.through([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], frame=frame)

    def _check(self) -> None:
        w, l, v, m = np.split(self.dual_quaternion, [1, 4, 5])
        if w[0] or v[0] or abs(l @ l - 1.0) > 1e-9 or abs(l @ m) > 1e-9:
            self._refuse("a Plücker line: pure, of unit direction, with the moment perpendicular to it")

    @property
    def geometry(self) -> Array:
        l, m = self.dual_quaternion[1:4], self.dual_quaternion[5:8]
        return np.r_[np.cross(l, m), l, 0.0, 0.0]


class Plane(Element):
    """A plane n + eps d with d = <p, n>; its distance is positive on the side that n points to; paper V, V-A."""

    kind = "plane"

    @classmethod
    def through(cls, point: ArrayLike, normal: ArrayLike, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The plane through a point (3,), metres, with a normal (3,) of any length but zero."""
        n = unit(normal, "normal of Plane")
        d = float(array(point, (3,), "point of Plane") @ n)
        return cls(np.r_[0.0, n, d, 0.0, 0.0, 0.0], frame, entity)

    def _check(self) -> None:
        n = self.dual_quaternion[1:4]
        if self.dual_quaternion[0] or np.any(self.dual_quaternion[5:]) or abs(n @ n - 1.0) > 1e-9:
            self._refuse("a plane: unit normal in the primary part, offset in the real dual part")

    @property
    def geometry(self) -> Array:
        n, d = self.dual_quaternion[1:4], self.dual_quaternion[4]
        return np.r_[n * d, n, 0.0, 0.0]


class Segment(Element):
    """A segment, the axis of a capsule: a pose at its start whose z axis runs to its end, and a length in metres.

    The capsule's radius is no part of it: radii belong to the safe distance.
    """

    kind = "segment"

    @classmethod
    def between(cls, start: ArrayLike, end: ArrayLike, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The segment between two points (3,), metres."""
        a, b = array(start, (3,), "start of Segment"), array(end, (3,), "end of Segment")
        z = unit(b - a, "Segment from start to end")
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        pose = dq.from_matrix(np.ascontiguousarray(np.column_stack([x, np.cross(z, x), z])), a)
        return cls(pose, frame, entity, float(np.linalg.norm(b - a)))

    def _check(self) -> None:
        dq.as_pose(self.dual_quaternion, "pose of Segment")
        if not (np.isfinite(self.length) and self.length > 0.0):
            raise InputError(f"Segment: expected a length > 0 m, got {self.length}")

    @property
    def geometry(self) -> Array:
        z = dq.rotation_matrix(np.array(self.dual_quaternion))[:, 2]
        return np.r_[dq.translation(np.array(self.dual_quaternion)), z, self.length, 0.0]
