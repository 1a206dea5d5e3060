"""What goes into a controller and what comes out of it, cycle by cycle."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from primitives.checks import Array, known
from primitives.evaluate import Entity
from vfi.outcome import State


class Measurement(NamedTuple):
    """What is known at the beginning of a cycle.

    Attributes
    ----------
    t : seconds; must grow from cycle to cycle.
    q, qdot : (n,) positions and velocities of all joints of the robot, rad and m.
    wrench : (6,) [force; torque] of the hand as the sensor reads it, N and Nm, world axes, at the sensor; None where
        not measured.
    entities : every moving entity that the constraints refer to, by name.
    stamps : when "q", "qdot", "wrench" and entities, by their names, were measured, seconds, on the clock of t; None,
        or without a name, where that is not known.
    """

    t: float
    q: Array
    qdot: Array
    wrench: Array | None = None
    entities: Mapping[str, Entity] | None = None
    stamps: Mapping[str, float] | None = None


class Rows(NamedTuple):
    """Rows of the user's own, jacobian v >= -eta margin - residual, for the decided joints.

    Attributes
    ----------
    jacobian : (k, d). margin : (k,), >= 0 where safe. eta : 1/s. residual : (k,) or one number.
    """

    jacobian: ArrayLike
    margin: ArrayLike
    eta: float = 1.0
    residual: ArrayLike = 0.0


class FreeReference(NamedTuple):
    """The reference of a `ProjectionTask`, for d decided joints and m free coordinates.

    Attributes
    ----------
    v_ref : (m,) free velocity that is wanted.
    metric : (m, m) positive definite; M + T D of a target admittance, in SI units.
    basis, offset : (d, m) and (d,): joint velocities are basis y + offset, rad/s and m/s.
    """

    v_ref: ArrayLike
    metric: ArrayLike
    basis: ArrayLike
    offset: ArrayLike


class ByName(Mapping[str, float]):
    """An array whose entries have names; making one costs nothing per entry."""

    __slots__ = ("_names", "array")

    def __init__(self, names: Mapping[str, int], array: Array):
        self._names, self.array = names, array

    def __getitem__(self, name: str) -> float:
        return float(self.array[self._names[known("constraint", name, self._names)]])

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def get(self, name: str, default: Any = None) -> Any:
        """The entry of that name, or the default."""
        return self[name] if name in self._names else default

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __array__(self, dtype: object = None, copy: bool | None = None) -> np.ndarray:
        return self.array if dtype is None else self.array.astype(dtype)  # type: ignore[call-overload]

    def __repr__(self) -> str:
        return f"ByName({dict(self)})"


class Layout(NamedTuple):
    """Where a command finds what it holds in the record of its cycle.

    Attributes
    ----------
    qdot, margin, multiplier, free : columns of the record.
    names : {constraint: its place among the margins and multipliers}.
    """

    qdot: slice
    margin: slice
    multiplier: slice
    free: slice
    names: Mapping[str, int]

    @classmethod
    def of(cls, columns: Mapping[str, slice], names: tuple[str, ...]) -> Self:
        """The layout of records with these columns, for these constraints."""
        first = columns["multiplier"].start
        places = {name: i for i, name in enumerate(names)}
        return cls(columns["qdot"], columns["margin"], slice(first, first + len(names)), columns["free"], places)


class Command(NamedTuple):
    """What a cycle commands.

    Attributes
    ----------
    record : of the cycle, with the controller's `columns`; a copy that stays.
    layout : where the record holds what the properties give.
    state : RUN, DEGRADED, HOLD or FAULT.
    reason : empty in RUN; otherwise what yielded or what is wrong, in words.
    expires : seconds; after this time the command must not be executed any more.
    """

    record: Array
    layout: Layout
    state: State
    reason: str
    expires: float

    @property
    def qdot(self) -> Array:
        """(d,) velocities of the decided joints, rad/s and m/s; always finite."""
        return self.record[self.layout.qdot]

    @property
    def valid(self) -> bool:
        """False in FAULT: qdot is zero because nothing is known, and the robot has to stop by itself."""
        return self.state < State.FAULT

    @property
    def free(self) -> Array:
        """(m,) free velocities that qdot consists of, where the program is solved in a basis; else empty."""
        return self.record[self.layout.free]

    @property
    def margins(self) -> ByName:
        """Of every constraint, metres or radians; those of the last usable cycle in FAULT."""
        return ByName(self.layout.names, self.record[self.layout.margin])

    @property
    def multipliers(self) -> ByName:
        """Of every constraint, 0 where its row does not act; of a cloud the sum over its points."""
        return ByName(self.layout.names, self.record[self.layout.multiplier])


new_command = partial(tuple.__new__, Command)
"""A command from a tuple of its fields, in a third of the time that its constructor takes."""
