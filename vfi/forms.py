"""In which form a declared entry port is enforced: as the row of its sphere, as an equality, or softly."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from primitives.checks import known, number
from primitives.constraint import Constraint, ConstraintSet
from primitives.errors import InputError

ROWS, EQUALITY = "rows", "equality"


@dataclass(frozen=True)
class Soft:
    """A port that is kept as far as all rows allow: weight |A v + eta x_c|^2 joins the cost.

    Parameters
    ----------
    weight : against the squares of the tasks, > 0; m/s against theirs.
    """

    weight: float = 1e4

    def __post_init__(self) -> None:
        number(self.weight, "weight of Soft", positive=True)


PortForm = str | Soft
"""`ROWS`, `EQUALITY` or a `Soft`."""


def form_of_each(constraints: ConstraintSet, forms: Mapping[str, PortForm]) -> list[PortForm]:
    """The form of every constraint, ROWS where none is given.

    Raises
    ------
    InputError, UnknownNameError : no such constraint or form, or a constraint that is no port: expected a shaft, the z
        axis of a robot frame, that is kept inside a distance from a point of the world or of an entity.
    """
    for name, form in forms.items():
        known("constraint", name, constraints.names)
        if not isinstance(form, Soft):
            known("form of a port", form, (ROWS, EQUALITY))
        if form != ROWS:
            _check_port(constraints[name])
    return [forms.get(name, ROWS) for name in constraints.names]


def _check_port(c: Constraint) -> None:
    shaft, what = c.first, f'form of constraint "{c.name}"'
    if c.definition.name != "line_point" or c.keep != "inside":
        raise InputError(f"{what}: only a line that is kept inside a distance from a point is a port")
    if c.second.frame != "world":
        raise InputError(f'{what}: expected a port in the world or on an entity, got one on frame "{c.second.frame}"')
    if shaft.entity is not None or not np.allclose(shaft.geometry[:6], [0, 0, 0, 0, 0, 1], atol=1e-12):
        raise InputError(f"{what}: expected the z axis of a robot frame as the shaft; name a frame that has it")
