"""Numbers with units in files: an SI number, or a text such as "5 mm"; all dimensions and their units are named here.

Decimal digits are multiplied as decimals, so that "1.2 mm" is the same float as 0.0012.
"""

import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from math import radians
from typing import Annotated, Any

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from primitives.errors import InputError, UnknownNameError
from primitives.files.fields import Positive, items, three
from primitives.files.model import show

Convert = Callable[[Decimal], float]


def _times(factor: str) -> Convert:
    return lambda number: float(number * Decimal(factor))


_TIME: Mapping[str, Convert] = {"s": _times("1"), "ms": _times("0.001"), "us": _times("0.000001"), "min": _times("60")}

UNITS: Mapping[str, Mapping[str, Convert]] = {
    "a length": {"m": _times("1"), "cm": _times("0.01"), "mm": _times("0.001"), "um": _times("0.000001")},
    "an angle": {"rad": _times("1"), "mrad": _times("0.001"), "deg": lambda number: radians(float(number))},
    "a time": _TIME,
    "a period": {**_TIME, "Hz": lambda number: float(1 / number), "kHz": lambda number: float(1 / (1000 * number))},
    "a rate": {"1/s": _times("1"), "Hz": _times("1")},
    "a speed": {"m/s": _times("1"), "cm/s": _times("0.01"), "mm/s": _times("0.001")},
    "a turning speed": {"rad/s": _times("1"), "deg/s": lambda number: radians(float(number))},
    "a force": {"N": _times("1"), "mN": _times("0.001"), "kN": _times("1000")},
    "a torque": {"Nm": _times("1"), "mNm": _times("0.001")},
    "a stiffness": {"N/m": _times("1"), "N/mm": _times("1000")},
    "a damping": {"N s/m": _times("1"), "N s/mm": _times("1000")},
    "an energy": {"J": _times("1"), "mJ": _times("0.001")},
}
"""Units of each dimension, the SI unit first, and how a number of each becomes one of the first."""

LONGEST = 60
"""Characters of a text that can be a quantity."""
_QUANTITY = re.compile(r"([-+]?(?:\.[0-9]++|[0-9]++(?:\.[0-9]*+)?)(?:[eE][-+]?[0-9]{1,3})?+)\s*+([^\s0-9.].*|1/s)")


def quantity(value: Any, *dimensions: str) -> Any:
    """A text with a unit as an SI number; anything else as it is.

    Parameters
    ----------
    dimensions : keys of `UNITS`, of which one is expected.

    Raises
    ------
    InputError : no number with a unit, or a unit of another dimension, which it names.
    UnknownNameError : no unit at all.
    """
    if not isinstance(value, str):
        return value
    units = {unit: convert for d in dimensions for unit, convert in UNITS[d].items()}
    expected = _expected(dimensions)
    found = _QUANTITY.fullmatch(value.strip()) if len(value) <= LONGEST else None
    if found is None:
        raise InputError(f"expected {expected}, got {show(value)}")
    unit = " ".join(found[2].split())
    if unit not in units:
        other = next((d for d, known in UNITS.items() if unit in known), None)
        if other is None:
            raise UnknownNameError("unit", unit, units)
        raise InputError(f"expected {expected}, got {show(value)}, {other}")
    try:
        return units[unit](Decimal(found[1]))
    except ArithmeticError:
        raise InputError(f"expected {expected}, got {show(value)}") from None


def _expected(dimensions: tuple[str, ...]) -> str:
    first = " or ".join(next(iter(UNITS[d])) for d in dimensions)
    units = ", ".join(unit for d in dimensions for unit in UNITS[d])
    return f"{' or '.join(dimensions)}: a number in {first}, or a text with {units}"


class or_text:  # noqa: N801
    """JSON Schema, for editors, of a number or a text of one of these dimensions, keys of `UNITS`."""

    def __init__(self, *dimensions: str):
        self.dimensions = dimensions

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        number = handler(core)
        signed = not {"minimum", "exclusiveMinimum"} & number.keys()
        return {
            **number,
            "type": ["number", "string"],
            "pattern": _pattern(self.dimensions, signed=signed),
            "patternErrorMessage": f"expected {_expected(self.dimensions)}{'' if signed else '; not below 0'}",
            "maxLength": LONGEST,
        }


class of(or_text):  # noqa: N801
    """Validator of a number of one of these dimensions, keys of `UNITS`."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(
            lambda value: quantity(value, *self.dimensions), handler(source)
        )


def _pattern(dimensions: tuple[str, ...], *, signed: bool) -> str:
    """Regular expression, of Python and of JavaScript alike, of the texts that are taken."""
    units = [re.escape(unit).replace("\\ ", r"\s+") for d in dimensions for unit in UNITS[d]]
    apart = "|".join(rf"\s{unit}" if unit[0].isdigit() else unit for unit in units)
    not_below_zero = "" if signed else "(?!-[0.]*[1-9])"
    return rf"^\s*{not_below_zero}[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]{{1,3}})?\s*({apart})\s*$"


Length = Annotated[float, of("a length")]
Angle = Annotated[float, of("an angle")]
NotNegative = Annotated[float, Field(ge=0.0)]
SomeLength = Annotated[NotNegative, of("a length")]
PositiveLength = Annotated[Positive, of("a length")]
PositiveAngle = Annotated[Positive, of("an angle")]
Moment = Annotated[NotNegative, of("a time")]
Span = Annotated[Positive, of("a time")]
Period = Annotated[Positive, of("a period")]
Rate = Annotated[Positive, of("a rate")]
SomeForce = Annotated[NotNegative, of("a force")]
PositiveForce = Annotated[Positive, of("a force")]
Position = Annotated[list[Length], AfterValidator(three), items(3, 3)]
Rotation = Annotated[list[Angle], AfterValidator(three), items(3, 3)]
Forces = Annotated[list[Annotated[float, of("a force")]], AfterValidator(three), items(3, 3)]
Torques = Annotated[list[Annotated[float, of("a torque")]], AfterValidator(three), items(3, 3)]
