"""YAML <-> `ConstraintSet`, without loss: what `dump_constraints` writes is loaded as an equal set, to the bit.

    constraints:
      - name: C2
        first: {kind: line, frame: moving/shaft}
        second: {kind: point, position: [0, 0, 0]}
        keep: inside
        safe_distance: 0.014

`Constraint` says what the keys mean; `pair`, `safety_class` and `enforced` may be left out. `primitives.files.elements`
says how an element is written, `primitives.files.kinds` which shorter forms there are. Lengths are in metres and angles
in radians, or texts such as "5 mm" and "30 deg"; what is written is the form above in SI numbers.
"""

from collections.abc import Iterable
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import (
    BeforeValidator,
    Field,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
)

from primitives.constraint import KEEPS, SAFETY_CLASSES, Constraint, ConstraintSet, Keep, SafetyClass
from primitives.errors import InputError, UnknownNameError
from primitives.files.document import Document, Mark, ValuePath
from primitives.files.elements import ElementField, element_data
from primitives.files.fields import Text, check_text, list_of, one_of
from primitives.files.joints import Ranges
from primitives.files.kinds import KINDS
from primitives.files.model import FileModel, gather, problem_at, validate
from primitives.files.quantities import or_text, quantity
from primitives.files.unions import ByKind
from primitives.files.yaml_file import read, write
from primitives.pair import CLOUD_PAIRS
from primitives.registry import pairs


def pair_names() -> tuple[str, ...]:
    """Every pair that a constraint can name."""
    return (*pairs.names(), *CLOUD_PAIRS)


def _distance(value: Any, info: ValidationInfo) -> Any:
    """A distance in the unit of the pair, as far as the pair is known."""
    if not isinstance(value, str):
        return value
    first, second = info.data.get("first"), info.data.get("second")
    name = info.data.get("pair") or (f"{first.kind}_{second.kind}" if first and second else "")
    if name not in pair_names():
        return quantity(value, "a length", "an angle")
    angular = name in pairs.names() and pairs[name].unit == "rad"
    return quantity(value, "an angle" if angular else "a length")


class _ConstraintModel(FileModel):
    declares = Constraint
    name: Text
    first: ElementField
    second: ElementField
    keep: Annotated[Keep, one_of("side to keep", lambda: KEEPS)]
    pair: Annotated[str, one_of("pair", pair_names)] = ""
    safe_distance: Annotated[float, Field(ge=0.0), BeforeValidator(_distance), or_text("a length", "an angle")]
    safety_class: Annotated[SafetyClass, one_of("safety class", lambda: SAFETY_CLASSES)] = "patient"
    enforced: bool = True

    def build(self) -> Constraint:
        return Constraint(**{name: getattr(self, name) for name in _ConstraintModel.model_fields})


class Declared(NamedTuple):
    """What a list of constraints declares: the constraints, and ranges of joints {joint: (lower, upper)}."""

    constraints: ConstraintSet
    limits: Ranges


def _entry(data: Any, info: ValidationInfo) -> Constraint | Ranges:
    if not isinstance(data, dict) or "kind" not in data:
        return _ConstraintModel.model_validate(data, context=info.context).build()
    kind = data["kind"]
    if not isinstance(kind, str) or kind not in KINDS:
        text = str(UnknownNameError("kind of constraint", str(kind)[:60], KINDS))
        raise problem_at(("kind",), f"{text} Or write first, second, keep and safe_distance.")
    return KINDS[kind].model_validate(data, context=info.context).build()


_LIST = TypeAdapter(Annotated[list[Any], list_of(Annotated[Any, PlainValidator(_entry)])])


def _declared(data: Any, info: ValidationInfo) -> Declared:
    items, below = [], None
    try:
        items = _LIST.validate_python(data, strict=True, context=info.context)
    except ValidationError as error:
        below = error
    first: dict[str, int] = {}
    repeated: list[tuple[ValuePath, str]] = []
    for i, name in enumerate(declared_names(data)):
        if name is not None and first.setdefault(name, i) != i:
            text = f'constraint {first[name] + 1} is called "{name[:60]}" already; give this one another name'
            repeated.append(((i, "name"), text))
    limits: Ranges = {}
    for i, item in enumerate(items):
        if isinstance(item, dict):
            repeated += [((i, "limits", joint), f"{joint} is limited already") for joint in item if joint in limits]
            limits |= item
    gather(below, repeated)
    return Declared(ConstraintSet(item for item in items if isinstance(item, Constraint)), limits)


def _no_limits(declared: Declared) -> ConstraintSet:
    if declared.limits:
        raise InputError("joint_limits belong to a robot, and so to a scene; leave them out of a set of constraints")
    return declared.constraints


def declared_names(data: Any) -> list[str | None]:
    """Name of each constraint in data that need not be right; None where there is none."""
    items = data if isinstance(data, list) else []
    names = [item.get("name") if isinstance(item, dict) else None for item in items]
    return [name if isinstance(name, str) else None for name in names]


def _entries(*kinds: str) -> Any:
    """How a list of constraints of these kinds, and of the plain form, may be written."""
    models: Any = [*(KINDS[kind] for kind in kinds), _ConstraintModel]
    return list[Annotated[reduce(or_, models), ByKind(kinds, {"not": {"required": ["kind"]}})]]  # type: ignore[misc]


DeclaredField = Annotated[Declared, PlainValidator(_declared, json_schema_input_type=_entries(*KINDS))]
"""A list of constraints in a file; the names given to `validate` as "frame" are the frames it may refer to."""
ConstraintsField = Annotated[
    ConstraintSet,
    PlainValidator(
        lambda data, info: _no_limits(_declared(data, info)),
        json_schema_input_type=_entries(*(kind for kind in KINDS if kind != "joint_limits")),
    ),
]
"""The same where there is no robot whose joints could be limited."""


class ConstraintsModel(FileModel):
    """A file with constraints alone.

    Attributes
    ----------
    constraints : each of a kind, or in the plain form: first, second, keep and safe_distance.
    """

    constraints: ConstraintsField


def load_constraints(path: str | Path, *, frames: Iterable[str] | None = None) -> ConstraintSet:
    """The constraints of a YAML file.

    Parameters
    ----------
    frames : frames that the elements may be attached to, e.g. `Robot.frames`; None for any.

    Raises
    ------
    FileError : everything that is wrong with the file, a line each, with file and line.
    """
    return validate(ConstraintsModel, read(path), {"frame": frames}).constraints


def constraints_from_data(
    data: Any, *, frames: Iterable[str] | None = None, name: str = "constraints"
) -> ConstraintSet:
    """The constraints in a list of plain data, of the form that a file has under "constraints".

    Parameters
    ----------
    frames : as for `load_constraints`.
    name : what errors call the data.

    Raises
    ------
    FileError : everything that is wrong with the data.
    """
    document = Document({"constraints": data}, {(): Mark(name, 0)})
    return validate(ConstraintsModel, document, {"frame": frames}).constraints


def constraints_data(constraints: ConstraintSet) -> list[dict[str, Any]]:
    """The constraints as plain data, which `constraints_from_data` takes; raises InputError as `dump_constraints`."""
    return [
        {
            "name": check_text(c.name),
            "first": element_data(c.first),
            "second": element_data(c.second),
            "keep": c.keep,
            "safe_distance": float(c.safe_distance),
            **({"pair": c.pair} if c.pair else {}),
            "safety_class": c.safety_class,
            "enforced": bool(c.enforced),
        }
        for c in constraints
    ]


def dump_constraints(constraints: ConstraintSet) -> str:
    """The constraints as YAML.

    Raises
    ------
    InputError : what a file cannot hold: a name over 200 characters or not printable, more than 1000 constraints.
    """
    return write({"constraints": constraints_data(constraints)})
