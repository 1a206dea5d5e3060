"""`Constraint` and `ConstraintSet`: what must hold, said once and without a word on how it is enforced."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

from primitives.checks import known, number
from primitives.elements import Element
from primitives.errors import InputError
from primitives.pair import CLOUD_PAIRS, Pair
from primitives.registry import pairs

Keep = Literal["outside", "inside"]
SafetyClass = Literal["patient", "robot", "task"]

KEEPS: tuple[str, ...] = get_args(Keep)
SAFETY_CLASSES: tuple[str, ...] = get_args(SafetyClass)
"""From the one that yields last to the one that yields first."""


@dataclass(frozen=True)
class Constraint:
    """A distance between two elements that must stay on one side of a safe distance.

    Parameters
    ----------
    name : by which margins, multipliers and errors call it.
    first, second : the elements, in the order of the pair.
    keep : "outside", margin = d - safe_distance (for a plane: above it); "inside", margin = safe_distance - d.
    safe_distance : metres or radians, >= 0. Radii of tools and vessels belong to it.
    pair : name of the pair; empty for the one named after the elements. Lines also know "line_line_angle".
    safety_class : "patient", "robot" or "task": in conflict the later ones yield first.
    enforced : False for a constraint that is watched: measured and logged, but without a row.

    Raises
    ------
    InputError : a field out of its range, or elements that the pair does not take.
    UnknownNameError : no such pair.
    """

    name: str
    first: Element
    second: Element
    keep: Keep
    safe_distance: float
    pair: str = ""
    safety_class: SafetyClass = "patient"
    enforced: bool = True

    def __post_init__(self) -> None:
        what = f'constraint "{self.name}"'
        if not isinstance(self.name, str) or not self.name:
            raise InputError(f"name of a constraint: expected some text, got {self.name!r}")
        for field in ("first", "second"):
            if not isinstance(getattr(self, field), Element):
                raise InputError(f"{what}: {field}: expected an element, got {getattr(self, field)!r}")
        if not isinstance(self.pair, str):
            raise InputError(f"{what}: pair: expected the name of a pair, got {self.pair!r}")
        known("side to keep", self.keep, KEEPS)
        known("safety class", self.safety_class, SAFETY_CLASSES)
        object.__setattr__(self, "safe_distance", number(self.safe_distance, f"{what}: safe distance", low=0.0))
        if not isinstance(self.enforced, bool):
            raise InputError(f"{what}: enforced: expected True or False, got {self.enforced!r}")
        kinds = (self.first.kind, self.second.kind)
        known_pairs = (*pairs.names(), *CLOUD_PAIRS)
        if not self.pair and "_".join(kinds) not in known_pairs and "_".join(kinds[::-1]) in known_pairs:
            raise InputError(f"{what}: give the {kinds[1]} first and the {kinds[0]} second, as the pair takes them")
        definition = self.definition
        if kinds != (definition.first, definition.second):
            raise InputError(
                f'{what}: pair "{definition.name}" takes a {definition.first} and a {definition.second}, in this '
                f"order; got a {kinds[0]} and a {kinds[1]}"
            )
        if self.is_cloud and self.keep != "outside":
            raise InputError(f'{what}: a cloud is a surface to stay outside of; got keep "{self.keep}"')

    @property
    def definition(self) -> Pair:
        """The pair of its elements."""
        name = self.pair or f"{self.first.kind}_{self.second.kind}"
        return CLOUD_PAIRS[name] if name in CLOUD_PAIRS else pairs[name]

    @property
    def is_cloud(self) -> bool:
        """Whether its second element is a point cloud."""
        return self.second.kind == "cloud"


@dataclass(frozen=True)
class ConstraintSet:
    """Constraints with different names; sets are joined with ``+``.

    Raises
    ------
    InputError : two constraints of one name, or something that is no constraint.
    """

    constraints: tuple[Constraint, ...] = ()

    def __init__(self, constraints: Iterable[Constraint] = ()):
        try:
            items = tuple(constraints)
        except TypeError:
            raise InputError(f"expected several constraints, e.g. a list of them, got {constraints!r}") from None
        seen: set[str] = set()
        for item in items:
            if not isinstance(item, Constraint):
                raise InputError(f"expected a Constraint, got {item!r}")
            if item.name in seen:
                raise InputError(f'two constraints are called "{item.name}"; every name must be its own')
            seen.add(item.name)
        object.__setattr__(self, "constraints", items)

    def __add__(self, other: "ConstraintSet | Constraint") -> "ConstraintSet":
        added = other.constraints if isinstance(other, ConstraintSet) else (other,)
        return ConstraintSet((*self.constraints, *added))

    def __iter__(self) -> Iterator[Constraint]:
        return iter(self.constraints)

    def __len__(self) -> int:
        return len(self.constraints)

    def __getitem__(self, name: str) -> Constraint:
        return self.constraints[self.names.index(known("constraint", name, self.names))]

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(c.name for c in self.constraints)

    def enforcing(self, names: Iterable[str]) -> "ConstraintSet":
        """The same constraints, of which those named are enforced and the others watched; raises UnknownNameError."""
        chosen = {known("constraint", n, self.names) for n in names}
        return ConstraintSet(replace(c, enforced=c.name in chosen) for c in self.constraints)
