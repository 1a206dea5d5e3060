"""YAML <-> `ConstraintSet`, without loss: what `dump_constraints` writes is loaded as an equal set, to the bit.

    constraints:
      - name: C2
        first: {kind: line, frame: moving/shaft}
        second: {kind: point, position: [0, 0, 0]}
        keep: inside
        safe_distance: 0.014

`Constraint` says what the keys mean; `pair`, `safety_class` and `enforced` may be left out. `primitives.files.elements`
says how an element is written. Lengths are in metres, angles in radians.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PlainValidator, TypeAdapter, ValidationError, ValidationInfo

from primitives.constraint import KEEPS, SAFETY_CLASSES, Constraint, ConstraintSet, Keep, SafetyClass
from primitives.files.document import Document, Mark, ValuePath
from primitives.files.elements import ElementField, element_data
from primitives.files.fields import Text, check_text, list_of, one_of
from primitives.files.model import FileModel, gather, validate
from primitives.files.yaml_file import read, write
from primitives.registry import pairs


class _ConstraintModel(FileModel):
    name: Text
    first: ElementField
    second: ElementField
    keep: Annotated[Keep, one_of("side to keep", lambda: KEEPS)]
    safe_distance: Annotated[float, Field(ge=0.0)]
    pair: Annotated[str, one_of("pair", pairs.names)] = ""
    safety_class: Annotated[SafetyClass, one_of("safety class", lambda: SAFETY_CLASSES)] = "patient"
    enforced: bool = True

    def build(self) -> Constraint:
        return Constraint(**{name: getattr(self, name) for name in _ConstraintModel.model_fields})


def _constraint(data: Any, info: ValidationInfo) -> Constraint:
    return _ConstraintModel.model_validate(data, context=info.context).build()


_LIST = TypeAdapter(Annotated[list[Constraint], list_of(Annotated[Constraint, PlainValidator(_constraint)])])


def _constraint_set(data: Any, info: ValidationInfo) -> ConstraintSet:
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
    gather(below, repeated)
    return ConstraintSet(items)


def declared_names(data: Any) -> list[str | None]:
    """Name of each constraint in data that need not be right; None where there is none."""
    items = data if isinstance(data, list) else []
    names = [item.get("name") if isinstance(item, dict) else None for item in items]
    return [name if isinstance(name, str) else None for name in names]


ConstraintsField = Annotated[ConstraintSet, PlainValidator(_constraint_set)]
"""A list of constraints in a file; the names given to `validate` as "frame" are the frames it may refer to."""


class _ConstraintsModel(FileModel):
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
    return validate(_ConstraintsModel, read(path), {"frame": frames}).constraints


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
    return validate(_ConstraintsModel, document, {"frame": frames}).constraints


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
