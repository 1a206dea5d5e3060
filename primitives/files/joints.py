"""Values of joints in files: a configuration, ranges; radians of joints that turn and metres of those that slide."""

from typing import Annotated, Any, Literal

from pydantic import PlainValidator, TypeAdapter, ValidationError, ValidationInfo
from pydantic_core import InitErrorDetails

from primitives.errors import InputError
from primitives.files.fields import items
from primitives.files.model import TOLD, Names, kept, show, told
from primitives.files.quantities import of

Ranges = dict[str, tuple[float, float]]
Moves = Literal["turns", "slides", "moves"]

_NUMBERS: dict[Moves, TypeAdapter[list[float]]] = {
    "turns": TypeAdapter(list[Annotated[float, of("an angle")]]),
    "slides": TypeAdapter(list[Annotated[float, of("a length")]]),
    "moves": TypeAdapter(list[Annotated[float, of("an angle", "a length")]]),
}


def _moves(joint: str, names: Names) -> Moves:
    sliding = names.get("sliding joint")
    return "moves" if sliding is None else "slides" if joint in sliding else "turns"


def _configuration(value: Any, info: ValidationInfo) -> list[float]:
    names: Names = info.context or {}
    if not isinstance(value, list):
        raise InputError(f"expected a list, got {show(value)}")
    known = names.get("joint")
    if known is None:
        return _NUMBERS["moves"].validate_python(value, strict=True)
    joints = list(known)
    if len(value) != len(joints):
        raise InputError(
            f"expected {len(joints)} numbers, one a joint from {joints[0]} to {joints[-1]}, got {len(value)}"
        )
    out: list[float] = []
    found: list[InitErrorDetails] = []
    for i, (joint, number) in enumerate(zip(joints, value, strict=True)):
        try:
            out += _NUMBERS[_moves(joint, names)].validate_python([number], strict=True)
        except ValidationError as error:
            found += [kept({**d, "loc": (i, *d["loc"][1:])}, {}) for d in error.errors(include_url=False)]
    if found:
        raise ValidationError.from_exception_data(TOLD, found)
    return out


def _ranges(value: Any, info: ValidationInfo) -> Ranges:
    names: Names = info.context or {}
    if not isinstance(value, dict):
        raise InputError(f"expected joints and their ranges, e.g. {{joint1: [-1, 1]}}, got {show(value)}")
    known = names.get("joint")
    joints = None if known is None else list(known)
    out: Ranges = {}
    found: list[InitErrorDetails] = []
    for joint, limits in value.items():
        if joints is not None and joint not in joints:
            found.append(told((joint,), {"kind": "joint", "name": joint, "names": joints}))
            continue
        try:
            both = _NUMBERS[_moves(joint, names)].validate_python(limits, strict=True)
        except ValidationError as error:
            found += [kept({**d, "loc": (joint, *d["loc"])}, {}) for d in error.errors(include_url=False)]
            continue
        if len(both) != 2 or not both[0] < both[1]:
            text = f"expected two numbers, lower < upper, got {both[:2]} ({len(both)} numbers)"
            found.append(told((joint,), {"text": text}))
        else:
            out[joint] = both[0], both[1]
    if found:
        raise ValidationError.from_exception_data(TOLD, found)
    return out


_Numbers = list[Annotated[float, of("an angle", "a length")]]
Configuration = Annotated[list[float], PlainValidator(_configuration, json_schema_input_type=_Numbers)]
"""A number a joint; names "joint" and "sliding joint" say which, where the robot is known."""
RangesField = Annotated[
    Ranges, PlainValidator(_ranges, json_schema_input_type=dict[str, Annotated[_Numbers, items(2, 2)]])
]
"""{joint: (lower, upper)}."""
