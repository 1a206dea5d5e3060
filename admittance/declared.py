"""Declared constraints for the admittance: which of them its barrier can enforce, and from how far."""

from typing import Protocol

import numpy as np

from admittance.margins import LINEAR, RANGE, SIGHT
from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.errors import InputError


class Barrier(Protocol):
    """What the barrier needs to know of parameters."""

    @property
    def k(self) -> float:
        """Its gain, J."""

    @property
    def d_0(self) -> float:
        """Its range, metres."""

    @property
    def d_0_angle(self) -> float:
        """Its range for margins that are angles, rad."""


def check_kinds(constraints: ConstraintSet, *, port: bool = True) -> None:
    """Refuse clouds, which are regions where there is a port, and elements on entities, which nothing measures here."""
    if not isinstance(constraints, ConstraintSet):
        raise InputError(f"constraints: expected a ConstraintSet, got {constraints!r}")
    for c in constraints:
        if c.is_cloud and not port:
            raise InputError(
                f'constraint "{c.name}" is about a cloud, which an admittance without a port does not push off; '
                "enforce it by a controller of inequalities, or use an Admittance, with a region"
            )
        if c.is_cloud:
            raise InputError(
                f'constraint "{c.name}" is about a cloud, whose points the admittance takes as a region: leave it out '
                f'of the set and give regions=[Region("{c.name}", cloud, element, tool_radius={c.safe_distance:g})]'
            )
        for element in (c.first, c.second):
            if element.entity is not None:
                raise InputError(
                    f'constraint "{c.name}": its {element.kind} moves with entity "{element.entity}", which the '
                    "admittance does not measure; fix it on a robot frame or in the world, or enforce it by a "
                    "controller of inequalities"
                )


def largest_margin(constraint: Constraint) -> float:
    """The margin at the far end of a distance, where its gradient ends: rad or m; infinite where there is none."""
    pair = constraint.definition
    if constraint.keep == "inside":
        # The distance to a plane has a sign, and no end.
        return np.inf if "plane" in (pair.first, pair.second) else constraint.safe_distance
    return np.pi - constraint.safe_distance if pair.unit == "rad" else np.inf


def reaches(constraints: ConstraintSet, parameters: Barrier, sight: float, linear_below: float) -> Array:
    """REACH (c, 3) of `margins`: metres, and for margins in radians the same shares of their range.

    The range is d_0, or d_0_angle for radians; at most the largest margin that there can be, so that the potential has
    faded where the distance has no gradient, as on the axis of a cylinder that something is kept in.

    Raises
    ------
    InputError : an enforced constraint that leaves no room.
    """
    out = np.empty((len(constraints), 3))
    for i, c in enumerate(constraints):
        full = parameters.d_0_angle if c.definition.unit == "rad" else parameters.d_0
        reach = min(full, largest_margin(c))
        if c.enforced and not reach > 0.0:
            raise InputError(
                f'constraint "{c.name}": keeping {c.keep} of {c.safe_distance:g} {c.definition.unit} leaves no room; '
                "give another safe distance, or watch it"
            )
        out[i, RANGE] = reach
        out[i, SIGHT] = reach + full * sight / parameters.d_0
        out[i, LINEAR] = min(full * linear_below / parameters.d_0, reach)
    return out
