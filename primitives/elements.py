"""Points, lines, planes, segments and clouds, attached to a robot frame, to the world, or to a moving entity.

An element is given and stored as a dual quaternion in the frame it is attached to. Kernels work on its *geometry*,
eight numbers ``[point (3), direction (3), length, 0]`` that a rigid motion maps in the obvious way; the two forms are
held equal by tests.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn, Self

import numpy as np
from numpy.typing import ArrayLike

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.checks import Array, array, number, unit
from primitives.errors import InputError

WORLD = "world"

_TOLERANCE = 1e-9
"""How far a dual quaternion from outside may be from its kind (times its reach, beyond 1 m) before it is refused."""

_ROUNDING = 1e-15
"""Nearer to unit norm than this, a dual quaternion is stored to the digit as it was given."""


def _vanish(*values: float | Array) -> bool:
    return all(np.max(np.abs(v)) <= _TOLERANCE for v in values)


def _normalized(value: Array) -> Array:
    primary, dual = dq.norm(value)
    reach = max(1.0, float(np.max(np.abs(value[4:]))))
    exact = abs(primary - 1.0) <= _ROUNDING and abs(dual) <= _ROUNDING * reach
    return value if exact else dq.normalized(value)


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
    InputError : not finite, further than rounding (1e-9) from the element's kind, or both a frame and an entity given.
    """

    dual_quaternion: Array
    frame: str = WORLD
    entity: str | None = None
    length: float = 0.0

    kind: ClassVar[str] = "element"

    def __post_init__(self) -> None:
        value = self._stored(
            conversions.as_dual_quaternion(self.dual_quaternion, f"dual quaternion of {type(self).__name__}")
        )
        value.setflags(write=False)
        object.__setattr__(self, "dual_quaternion", value)
        for field, name in (("frame", self.frame), ("entity", self.entity)):
            if name is not None and (not isinstance(name, str) or not name):
                raise InputError(f"{type(self).__name__}: expected the name of its {field}, got {name!r}")
        if self.entity is not None and self.frame != WORLD:
            raise InputError(
                f'{type(self).__name__}: got frame "{self.frame}" and entity "{self.entity}"; an element is attached '
                "to one of them"
            )

    def _stored(self, value: Array) -> Array:
        """A dual quaternion as this element keeps it, free of rounding; refuses one that is not of its kind."""
        return value

    def _refuse(self, value: Array, expected: str) -> NoReturn:
        raise InputError(f"{type(self).__name__}: expected {expected}, got {value.tolist()}")

    @property
    def geometry(self) -> Array:
        """(8,) point, direction, length, 0; in the coordinates of what the element is attached to, metres."""
        point, direction, length = self._parts()
        return np.array([*point, *direction, length, 0.0])

    def _parts(self) -> tuple[Array, Array, float]:
        raise InputError(f"{type(self).__name__} has no geometry; use Point, Line, Plane or Segment")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Element):
            return NotImplemented
        return self._told() == other._told() and bool(np.array_equal(self.dual_quaternion, other.dual_quaternion))

    def __hash__(self) -> int:
        return hash((self._told(), self.dual_quaternion.tobytes()))

    def _told(self) -> tuple[Any, ...]:
        """What tells elements of one dual quaternion apart."""
        return self.kind, self.frame, self.entity, self.length


class Point(Element):
    """A point, stored as the pure quaternion t (dual part zero)."""

    kind = "point"

    @classmethod
    def at(cls, position: ArrayLike, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The point at a position (3,), metres."""
        return cls(np.r_[0.0, array(position, (3,), "position of Point"), np.zeros(4)], frame, entity)

    def _stored(self, value: Array) -> Array:
        if not _vanish(value[[0, 4, 5, 6, 7]]):
            self._refuse(value, "a pure quaternion (w = 0, dual part 0)")
        value[[0, 4, 5, 6, 7]] = 0.0
        return value

    def _parts(self) -> tuple[Array, Array, float]:
        return self.dual_quaternion[1:4], np.zeros(3), 0.0


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

    def _stored(self, value: Array) -> Array:
        size, along = dq.norm(value)
        reach = max(1.0, float(np.max(np.abs(value[4:]))))
        if not _vanish(value[[0, 4]] / reach, size - 1.0, along / reach):
            self._refuse(value, "a Plücker line: pure, of unit direction, with the moment perpendicular to it")
        value[[0, 4]] = 0.0
        return _normalized(value)

    def _parts(self) -> tuple[Array, Array, float]:
        l, m = self.dual_quaternion[1:4], self.dual_quaternion[5:8]
        return np.cross(l, m), l, 0.0


class Plane(Element):
    """A plane n + eps d with d = <p, n>; its distance is positive on the side that n points to; paper V, V-A."""

    kind = "plane"

    @classmethod
    def through(cls, point: ArrayLike, normal: ArrayLike, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The plane through a point (3,), metres, with a normal (3,) of any length but zero."""
        n = unit(normal, "normal of Plane")
        d = float(array(point, (3,), "point of Plane") @ n)
        return cls(np.r_[0.0, n, d, 0.0, 0.0, 0.0], frame, entity)

    def _stored(self, value: Array) -> Array:
        size = float(np.linalg.norm(value[1:4]))
        if not _vanish(value[[0, 5, 6, 7]], size - 1.0):
            self._refuse(value, "a plane: unit normal in the primary part, offset in the real dual part")
        value[[0, 5, 6, 7]] = 0.0
        return value if abs(size - 1.0) <= _ROUNDING else value / size

    def _parts(self) -> tuple[Array, Array, float]:
        n, d = self.dual_quaternion[1:4], self.dual_quaternion[4]
        return n * d, n, 0.0


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

    def _stored(self, value: Array) -> Array:
        object.__setattr__(self, "length", number(self.length, "Segment: length in metres", positive=True))
        conversions.as_pose(value, "pose of Segment")
        return _normalized(value)

    def _parts(self) -> tuple[Array, Array, float]:
        pose = np.array(self.dual_quaternion)
        return dq.translation(pose), dq.rotation_matrix(pose)[:, 2], self.length


@dataclass(frozen=True, eq=False)
class Cloud(Element):
    """A point cloud, by the name under which its points are given to whoever enforces the constraint.

    The distance to a cloud is that to the nearest of the spheres which cover its surface (paper A, (8)), negative
    inside one. The dual quaternion moves the cloud from where its own pose puts it, in the coordinates of what the
    element is attached to.

    Parameters
    ----------
    name : of the cloud.
    """

    name: str = ""

    kind = "cloud"

    @classmethod
    def named(cls, name: str, *, frame: str = WORLD, entity: str | None = None) -> Self:
        """The cloud of that name, where its own pose puts it."""
        return cls(np.r_[1.0, np.zeros(7)], frame, entity, 0.0, name)

    def _stored(self, value: Array) -> Array:
        if not isinstance(self.name, str) or not self.name:
            raise InputError(f"Cloud: expected the name of a point cloud, got {self.name!r}")
        return _normalized(conversions.as_pose(value, f'pose of cloud "{self.name}"'))

    def _told(self) -> tuple[Any, ...]:
        return *super()._told(), self.name

    def _parts(self) -> tuple[Array, Array, float]:
        return dq.translation(np.array(self.dual_quaternion)), np.zeros(3), 0.0
