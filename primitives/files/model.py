"""pydantic models of what a file may hold, whose errors are sentences with file and line."""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any, ClassVar, Self, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails, InitErrorDetails, PydanticCustomError

from primitives.errors import UnknownNameError
from primitives.files.described import describe
from primitives.files.document import Document, Problem, ValuePath, in_words, refuse

TOLD = "told"
"""Type of the errors of `told`."""

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
    return ValidationError.from_exception_data(TOLD, [told(path, {"text": message})])


def gather(error: ValidationError | None, problems: Iterable[tuple[ValuePath, str]]) -> None:
    """Raise what a validator found itself together with what was found below it; do nothing where there is neither."""
    below = [] if error is None else [kept(d, {}) for d in error.errors(include_url=False)]
    found = [*below, *(told(path, {"text": message}) for path, message in problems)]
    if found:
        raise ValidationError.from_exception_data(TOLD, found)


def told(path: ValuePath, context: dict[str, Any]) -> InitErrorDetails:
    """An error that can be put into words later: {"text"}, {"kind", "name", "names"} or {"detail", "keys"}."""
    return InitErrorDetails(type=PydanticCustomError(TOLD, TOLD, context), loc=path, input=None)


def kept(detail: ErrorDetails, keys: Mapping[str, bool]) -> InitErrorDetails:
    """An error as it goes up, with the keys of the place it came from; putting each into words would take too long."""
    context = detail["ctx"] if detail["type"] == TOLD else {"detail": detail, "keys": keys}
    return told(detail["loc"], context)


_EXPECTED = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "string_type": "text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "keys and values",
    "model_type": "keys and values",
}
_BOUNDS = {"greater_than": (">", "gt"), "greater_than_equal": (">=", "ge")}


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
    if kind == "string_type" and isinstance(got, int | float):
        return f"expected text, got {show(got)}; put it in quotes"
    if kind == "float_type" and isinstance(got, str):
        return f"expected a number, got {show(got)}; it has no unit"
    return f"expected {_EXPECTED[kind]}, got {show(got)}" if kind in _EXPECTED else f"{detail['msg']}, got {show(got)}"


class FileModel(BaseModel):
    """A mapping in a file: no unknown keys, no conversions but from whole numbers to floats, and errors in words.

    Attributes
    ----------
    declares : what the mapping declares; where the model's own docstring is silent, editors are told what this one's
        says of the keys.
    """

    declares: ClassVar[Any] = None
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler, /) -> dict[str, Any]:
        schema = handler(core)
        models = cls.__mro__[: cls.__mro__.index(FileModel)]
        things = [thing for model in models for thing in (model, vars(model).get("declares")) if thing is not None]
        found = handler.resolve_ref_schema(schema)
        describe(found, things)
        found["title"] = cls.__name__.strip("_").removesuffix("Model")
        return schema

    @model_validator(mode="wrap")
    @classmethod
    def _with_keys(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            return handler(data)
        except ValidationError as error:
            keys = {name: field.is_required() for name, field in cls.model_fields.items()}
            found = [kept(detail, keys) for detail in error.errors(include_url=False)]
            raise ValidationError.from_exception_data(cls.__name__, found) from None


Names = Mapping[str, Iterable[str] | None]
"""Names that a file may refer to, by kind, e.g. {"frame": [...]}; None or no entry where they are not known."""


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
