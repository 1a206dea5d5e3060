"""A constraint set lowered to arrays, once, for the compiled loops of `primitives.evaluate`; which joints act on it."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from primitives.checks import Array, known
from primitives.constraint import SAFETY_CLASSES, Constraint, ConstraintSet
from primitives.elements import Element
from primitives.errors import InactiveConstraintError
from primitives.intrinsics import address_of
from primitives.kinematics import FlatModel, world_first


class Table(NamedTuple):
    """A constraint set as arrays of m rows.

    Attributes
    ----------
    address : (m,) int64, where each pair's kernel stands; 0 of a cloud, which has none.
    frame : (m, 2) int64, index of each element's frame: 0 the world, then robot frames, then entities.
    geometry : (2m, 8) local geometries, first and second in turn.
    side : (m,) +1 keep outside, -1 keep inside.
    safe : (m,) safe distances.
    enforced, safety_class, angular : (m,) int64; angular is 1 where the margin is in radians.
    """

    address: np.ndarray
    frame: np.ndarray
    geometry: Array
    side: Array
    safe: Array
    enforced: np.ndarray
    safety_class: np.ndarray
    angular: np.ndarray


def used_frames(constraints: ConstraintSet) -> tuple[str, ...]:
    """Robot frames that the constraints refer to, "world" first."""
    return world_first(tuple(e.frame for e in _elements(constraints) if e.entity is None))


def used_entities(constraints: ConstraintSet) -> tuple[str, ...]:
    """Entities that the constraints refer to."""
    return tuple(dict.fromkeys(e.entity for e in _elements(constraints) if e.entity is not None))


def _elements(constraints: ConstraintSet) -> list[Element]:
    return [e for c in constraints for e in (c.first, c.second)]


def movers(frame: str, frames: tuple[str, ...], flat: FlatModel) -> set[int]:
    """Joints that move one of the frames of a flat model."""
    found, joint = set(), int(flat.frame_joint[frames.index(frame)])
    while joint >= 0:
        found.add(joint)
        joint = int(flat.parent[joint])
    return found


def influences(c: Constraint, frames: tuple[str, ...], flat: FlatModel, decided: np.ndarray) -> bool:
    """Whether a decided joint moves the elements of a constraint against each other."""
    first, second = (
        set() if e.entity is not None else movers(e.frame, frames, flat) & set(decided.tolist())
        for e in (c.first, c.second)
    )
    return first != second


def check_influence(
    constraints: Iterable[Constraint], frames: tuple[str, ...], flat: FlatModel, decided: np.ndarray
) -> None:
    """Refuse enforced constraints whose elements no decided joint moves against each other: nothing can keep them.

    Raises
    ------
    InactiveConstraintError : the first of them.
    """
    for c in constraints:
        if c.enforced and not influences(c, frames, flat, decided):
            on = " and ".join(f'"{e.entity or e.frame}"' for e in (c.first, c.second))
            raise InactiveConstraintError(
                f'constraint "{c.name}" is enforced, but none of the decided joints moves its elements, on {on}, '
                "against each other: put one on another frame of the arm, or watch it"
            )


def tabulate(constraints: ConstraintSet, frames: tuple[str, ...], entities: tuple[str, ...]) -> Table:
    """The constraints as arrays, for these robot frames ("world" first) followed by these entities.

    Raises
    ------
    UnknownNameError : an element on a frame or entity that is not among them.
    """
    m = len(constraints)

    def place(element: Element) -> int:
        if element.entity is not None:
            return len(frames) + entities.index(known("entity", element.entity, entities))
        return frames.index(known("frame", element.frame, frames))

    items = list(constraints)
    return Table(
        address=np.array([address_of(k) if (k := c.definition.kernel) else 0 for c in items], dtype=np.int64),
        frame=np.array([[place(c.first), place(c.second)] for c in items], dtype=np.int64).reshape(m, 2),
        geometry=np.array([e.geometry for e in _elements(constraints)], dtype=np.float64).reshape(2 * m, 8),
        side=np.array([1.0 if c.keep == "outside" else -1.0 for c in items]),
        safe=np.array([float(c.safe_distance) for c in items]),
        enforced=np.array([c.enforced for c in items], dtype=np.int64),
        safety_class=np.array([SAFETY_CLASSES.index(c.safety_class) for c in items], dtype=np.int64),
        angular=np.array([c.definition.unit == "rad" for c in items], dtype=np.int64),
    )
