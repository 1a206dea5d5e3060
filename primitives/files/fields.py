"""Values that stand in several kinds of file: texts, vectors, names of things, lists."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
)
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from primitives.errors import InputError
from primitives.files.document import MAX_PROBLEMS
from primitives.files.model import TOLD, Names, kept, show
from primitives.files.unions import IfType


def _unknown(kind: str, name: str, names: list[str]) -> PydanticCustomError:
    return PydanticCustomError(TOLD, TOLD, {"kind": kind, "name": name, "names": names})


def refers_to(kind: str, *also: str) -> AfterValidator:
    """Validator of a name: one of `also`, or of those that the names given to `validate` hold for this kind."""

    def check(name: str, info: ValidationInfo) -> str:
        names: Names = info.context or {}
        accepted = names.get(kind)
        if accepted is not None and name not in also and name not in (listed := list(accepted)):
            raise _unknown(kind, name, listed)
        return name

    return AfterValidator(check)


@dataclass(frozen=True)
class one_of:  # noqa: N801
    """Validator of a text that is one of a few; `names` is called when they are needed."""

    kind: str
    names: Callable[[], Iterable[str]]

    def check(self, value: Any) -> Any:
        """The value, if it is one of them."""
        listed = list(self.names())
        if isinstance(value, str) and value not in listed:
            raise _unknown(self.kind, value, listed)
        if not isinstance(value, str):
            raise InputError(f"expected one of {', '.join(listed)}, got {show(value)}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.check, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": list(self.names())}


def check_text(text: str) -> str:
    """Text as it may stand in a file: 1 to 200 printable characters; raises InputError."""
    if not 1 <= len(text) <= 200 or not text.isprintable():
        raise InputError(f"expected 1 to 200 printable characters, got {text[:60]!r} ({len(text)} characters)")
    return text


def three(value: list[float]) -> list[float]:
    """Three numbers; raises InputError."""
    if len(value) != 3:
        raise InputError(f"expected 3 numbers (x, y, z), got {len(value)}")
    return value


def items(least: int, most: int | None = None) -> Any:
    """What editors are told of the length of a list that a validator checks."""
    length: dict[str, Any] = {"minItems": least} if most is None else {"minItems": least, "maxItems": most}
    return Field(json_schema_extra=length)


Text = Annotated[str, AfterValidator(check_text), Field(json_schema_extra={"minLength": 1, "maxLength": 200})]
Numbers = list[float]
Vector = Annotated[Numbers, AfterValidator(three), items(3, 3)]
Positive = Annotated[float, Field(gt=0.0)]


def list_of(item: Any) -> PlainValidator:
    """Validator of a list of items of a type; it stops where there are more problems than are shown."""
    adapter = TypeAdapter(item)

    def check(value: Any, info: ValidationInfo) -> list[Any]:
        if not isinstance(value, list):
            raise InputError(f"expected a list, got {show(value)}")
        out: list[Any] = []
        found: list[InitErrorDetails] = []
        for i, below in enumerate(value):
            try:
                out.append(adapter.validate_python(below, strict=True, context=info.context))
            except ValidationError as error:
                details = error.errors(include_url=False)
                found += [kept({**detail, "loc": (i, *detail["loc"])}, {}) for detail in details]
                if len(found) > MAX_PROBLEMS:
                    break
        if found:
            raise ValidationError.from_exception_data(TOLD, found)
        return out

    return PlainValidator(check, json_schema_input_type=list[item])


def one_or_list_of(item: Any) -> PlainValidator:
    """Validator of one item of a type, or of a list of them; gives a list either way."""
    adapter, many = TypeAdapter(item), TypeAdapter(Annotated[Any, list_of(item)])

    def check(value: Any, info: ValidationInfo) -> list[Any]:
        if isinstance(value, list):
            return list(many.validate_python(value, context=info.context))
        return [adapter.validate_python(value, strict=True, context=info.context)]

    return PlainValidator(check, json_schema_input_type=Annotated[list[item] | item, IfType("array")])
