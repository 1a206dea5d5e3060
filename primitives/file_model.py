"""pydantic models of what a file may hold, whose errors are sentences with file and line."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Annotated, Any, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from primitives.document import MAX_PROBLEMS, Document, Problem, ValuePath, in_words, refuse
from primitives.errors import InputError, UnknownNameError

_TOLD = "told"
"""An error with all that is needed to put it into words: its text, or the keys that its place takes."""


_KEY = "[key]"
"""What pydantic adds to the place of a dict's key."""


def show(value: Any) -> str:
    """What was got, in the words of somebody who edits the file."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) or (isinstance(value, int) and abs(value) < 1e300):
        return f"the number {value:.10g}"
    if isinstance(value, str):
        return f'the text "{value if len(value) <= 60 else value[:57] + "..."}"'
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return "keys and values" if isinstance(value, dict) else f"something else ({type(value).__name__})"


def problem_at(path: ValuePath, message: str) -> ValidationError:
    """What a validator raises about a value inside the one it was given."""
    return ValidationError.from_exception_data(_TOLD, [_told(path, {"text": message})])


def gather(error: ValidationError | None, problems: Iterable[tuple[ValuePath, str]]) -> None:
    """Raise what a validator found itself together with what was found below it; do nothing where there is neither."""
    below = [] if error is None else [_keep(d, {}) for d in error.errors(include_url=False)]
    found = [*below, *(_told(path, {"text": message}) for path, message in problems)]
    if found:
        raise ValidationError.from_exception_data(_TOLD, found)


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
                found += [_keep({**detail, "loc": (i, *detail["loc"])}, {}) for detail in details]
                if len(found) > MAX_PROBLEMS:
                    break
        if found:
            raise ValidationError.from_exception_data(_TOLD, found)
        return out

    return PlainValidator(check)


def _told(path: ValuePath, context: dict[str, Any]) -> InitErrorDetails:
    return InitErrorDetails(type=PydanticCustomError(_TOLD, _TOLD, context), loc=path, input=None)


def _keep(detail: ErrorDetails, keys: Mapping[str, bool]) -> InitErrorDetails:
    """An error as it goes up, with the keys of the place it came from; putting each into words would take too long."""
    told = detail["ctx"] if detail["type"] == _TOLD else {"detail": detail, "keys": keys}
    return _told(detail["loc"], told)


_EXPECTED = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "string_type": "text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "keys and values",
    "model_type": "keys and values",
    "model_attributes_type": "keys and values",
}
_BOUNDS = {"greater_than": (">", "gt"), "greater_than_equal": (">=", "ge"), "less_than_equal": ("<=", "le")}


def _in_words(told: Mapping[str, Any]) -> str:
    if "text" in told:
        return str(told["text"])
    if "kind" in told:
        return str(UnknownNameError(told["kind"], told["name"][:60], told["names"]))
    detail, keys = told["detail"], told["keys"]
    kind, got, context = detail["type"], detail["input"], detail.get("ctx", {})
    if kind == "missing":
        return f'missing key "{detail["loc"][-1]}"; needed here: {", ".join(k for k, needed in keys.items() if needed)}'
    if kind == "extra_forbidden":
        return str(UnknownNameError("key", str(detail["loc"][-1])[:60], keys))
    if kind == "value_error":
        return str(context["error"])
    if kind in _BOUNDS:
        sign, name = _BOUNDS[kind]
        return f"expected a number {sign} {context[name]:g}, got {got:g}"
    if kind == "too_short":
        return f"expected at least {context['min_length']} values, got {context['actual_length']}"
    if kind == "string_type" and isinstance(got, int | float):
        return f"expected text, got {show(got)}; put it in quotes"
    if kind == "float_type" and isinstance(got, str):
        return f"expected a number, got {show(got)}; write SI units, without their names"
    return f"expected {_EXPECTED[kind]}, got {show(got)}" if kind in _EXPECTED else f"{detail['msg']}, got {show(got)}"


class FileModel(BaseModel):
    """A mapping in a file: no unknown keys, no conversions but from whole numbers to floats, and errors in words."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="wrap")
    @classmethod
    def _with_keys(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except ValidationError as error:
            keys = {name: field.is_required() for name, field in cls.model_fields.items()}
            found = [_keep(detail, keys) for detail in error.errors(include_url=False)]
            raise ValidationError.from_exception_data(cls.__name__, found) from None


Names = Mapping[str, Iterable[str] | None]
"""Names that a file may refer to, by kind, e.g. {"frame": [...]}; None or no entry where they are not known."""


def _unknown(kind: str, name: str, names: list[str]) -> PydanticCustomError:
    return PydanticCustomError(_TOLD, _TOLD, {"kind": kind, "name": name, "names": names})


def refers_to(kind: str, *also: str) -> AfterValidator:
    """Validator of a name: one of `also`, or of those that the names given to `validate` hold for this kind."""

    def check(name: str, info: ValidationInfo) -> str:
        names: Names = info.context or {}
        accepted = names.get(kind)
        if accepted is not None and name not in also and name not in (listed := list(accepted)):
            raise _unknown(kind, name, listed)
        return name

    return AfterValidator(check)


def one_of(kind: str, names: Callable[[], Iterable[str]]) -> BeforeValidator:
    """Validator of a text that is one of a few; `names` is called when they are needed."""

    def check(value: Any) -> Any:
        listed = list(names())
        if isinstance(value, str) and value not in listed:
            raise _unknown(kind, value, listed)
        if not isinstance(value, str):
            raise InputError(f"expected one of {', '.join(listed)}, got {show(value)}")
        return value

    return BeforeValidator(check)


def check_text(text: str) -> str:
    """Text as it may stand in a file: 1 to 200 printable characters; raises InputError."""
    if not 1 <= len(text) <= 200 or not text.isprintable():
        raise InputError(f"expected 1 to 200 printable characters, got {text[:60]!r} ({len(text)} characters)")
    return text


def _three(value: list[float]) -> list[float]:
    if len(value) != 3:
        raise InputError(f"expected 3 numbers (x, y, z), got {len(value)}")
    return value


Text = Annotated[str, AfterValidator(check_text)]
Numbers = list[float]
Vector = Annotated[Numbers, AfterValidator(_three)]
Positive = Annotated[float, Field(gt=0.0)]

M = TypeVar("M", bound=FileModel)


def validate(model: type[M], document: Document, names: Names | None = None) -> M:
    """The document as a model.

    Parameters
    ----------
    names : those that the file may refer to.

    Raises
    ------
    FileError : everything that is wrong with the document, reading it included.
    """
    problems = list(document.problems)
    known = {p.path for p in problems}
    try:
        value = model.model_validate(document.data, context=names or {})
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            path, told = detail["loc"], detail["ctx"]
            path = path[:-1] if path[-1:] == (_KEY,) else path
            if any(path[:i] in known for i in range(1, len(path) + 1)):
                continue
            about_key = "detail" in told and told["detail"]["type"] in ("missing", "extra_forbidden")
            field = in_words(path[:-1] if about_key else path)
            problems.append(Problem(document.mark(path), path, partial(_sentence, field, told)))
    if problems:
        refuse(problems)
    return value


def _sentence(field: str, told: Mapping[str, Any]) -> str:
    return f"{field}: {_in_words(told)}" if field else _in_words(told)
