"""pydantic models of what a file may hold, whose errors are sentences with file and line."""

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from primitives.document import Document, Problem, ValuePath, in_words, refuse
from primitives.errors import InputError, UnknownNameError

_WORDED = "worded"
_WORDED_KEY = "worded_key"
"""An error about a key, whose field is therefore what the key is in."""


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
    return ValidationError.from_exception_data(_WORDED, [_details(_WORDED, path, message)])


def _details(kind: str, path: ValuePath, message: str) -> InitErrorDetails:
    return InitErrorDetails(type=PydanticCustomError(kind, "{text}", {"text": message}), loc=path, input=None)


def gather(error: ValidationError | None, problems: Iterable[tuple[ValuePath, str]]) -> None:
    """Raise what a validator found itself together with what was found below it; do nothing where there is neither."""
    found = [_details(_WORDED, path, message) for path, message in problems]
    below = [] if error is None else [_worded(d, {}) for d in error.errors(include_url=False)]
    if below or found:
        raise ValidationError.from_exception_data(_WORDED, [*below, *found])


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


def _worded(detail: ErrorDetails, keys: Mapping[str, bool]) -> InitErrorDetails:
    kind, path, got, context = detail["type"], detail["loc"], detail["input"], detail.get("ctx", {})
    if kind in (_WORDED, _WORDED_KEY):
        return _details(kind, path, detail["msg"])
    if kind == "missing":
        needed = ", ".join(k for k, required in keys.items() if required)
        return _details(_WORDED_KEY, path, f'missing key "{path[-1]}"; needed here: {needed}')
    if kind == "extra_forbidden":
        return _details(_WORDED_KEY, path, str(UnknownNameError("key", str(path[-1])[:60], keys)))
    if kind == "value_error":
        return _details(_WORDED, path, str(context["error"]))
    if kind in _BOUNDS:
        sign, name = _BOUNDS[kind]
        return _details(_WORDED, path, f"expected a number {sign} {context[name]:g}, got {got:g}")
    if kind in ("too_short", "too_long"):
        bound = f"at least {context['min_length']}" if kind == "too_short" else f"at most {context['max_length']}"
        return _details(_WORDED, path, f"expected {bound} values, got {context['actual_length']}")
    if kind == "string_type" and isinstance(got, int | float):
        return _details(_WORDED, path, f"expected text, got {show(got)}; put it in quotes")
    if kind == "float_type" and isinstance(got, str):
        return _details(_WORDED, path, f"expected a number, got {show(got)}; write SI units, without their names")
    if kind in _EXPECTED:
        return _details(_WORDED, path, f"expected {_EXPECTED[kind]}, got {show(got)}")
    return _details(_WORDED, path, f"{detail['msg']}, got {show(got)}")


class FileModel(BaseModel):
    """A mapping in a file: no unknown keys, no conversions but from whole numbers to floats, and errors in words."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="wrap")
    @classmethod
    def _in_words(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except ValidationError as error:
            keys = {name: field.is_required() for name, field in cls.model_fields.items()}
            details = [_worded(d, keys) for d in error.errors(include_url=False)]
            raise ValidationError.from_exception_data(cls.__name__, details) from None


Names = Mapping[str, Iterable[str] | None]
"""Names that a file may refer to, by kind, e.g. {"frame": [...]}; None or no entry where they are not known."""


def refers_to(kind: str, *also: str) -> AfterValidator:
    """Validator of a name: one of `also`, or of those that the names given to `validate` hold for this kind."""

    def check(name: str, info: ValidationInfo) -> str:
        names: Names = info.context or {}
        accepted = names.get(kind)
        if accepted is not None and name not in also and name not in (listed := list(accepted)):
            raise UnknownNameError(kind, name[:60], listed)
        return name

    return AfterValidator(check)


def one_of(kind: str, names: Callable[[], Iterable[str]]) -> BeforeValidator:
    """Validator of a text that is one of a few; `names` is called when they are needed."""

    def check(value: Any) -> Any:
        listed = list(names())
        if isinstance(value, str) and value not in listed:
            raise UnknownNameError(kind, value[:60], listed)
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
            path = detail["loc"]
            if any(path[:i] in known for i in range(1, len(path) + 1)):
                continue
            field = in_words(path[:-1] if detail["type"] == _WORDED_KEY else path)
            text = f"{field}: {detail['msg']}" if field else detail["msg"]
            problems.append(Problem(document.mark(path), path, text))
    if problems:
        refuse(problems)
    return value
