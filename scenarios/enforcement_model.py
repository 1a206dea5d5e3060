"""What a scene file may hold of how it is run: the keys `enforcement` and `seed`."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, TypeAdapter, ValidationInfo

from primitives.checks import known
from primitives.errors import InputError
from primitives.files.fields import Positive, one_of, refers_to
from primitives.files.model import FileModel, gather, show
from primitives.files.quantities import PositiveLength, Rate
from primitives.files.unions import IfType
from scenarios.enforcement import FORMS, GUARDS, METHODS, METRICS, Enforcement, Gains
from vfi.forms import PortForm, Soft, form_of_each

_GAIN = TypeAdapter(Rate)
_GAINS = TypeAdapter(dict[Annotated[str, refers_to("constraint", "")], Rate])
_Eta = Annotated[dict[str, Rate] | Rate, IfType("object")]


def _eta(value: Any, info: ValidationInfo) -> Gains:
    if isinstance(value, dict):
        return _GAINS.validate_python(value, strict=True, context=info.context)
    if isinstance(value, list | None):
        raise InputError(f'expected a number, or a number a constraint with "" for the others, got {show(value)}')
    return _GAIN.validate_python(value, strict=True)


class _SoftModel(FileModel):
    """A port that is kept as far as all rows allow.

    Attributes
    ----------
    soft : weight against the squares of the tasks.
    """

    soft: Positive


_SOFT = FORMS[-1]


def _form(value: Any) -> PortForm:
    """A name of FORMS, or the weight of a soft one."""
    if isinstance(value, dict):
        return Soft(_SoftModel.model_validate(value).soft)
    if not isinstance(value, str):
        raise InputError(f"expected one of {', '.join(FORMS)}, or {{{_SOFT}: weight}}, got {show(value)}")
    return Soft() if known("form of a port", value, FORMS) == _SOFT else value


_NamedForm = Annotated[str, one_of("form of a port", lambda: FORMS)]
_FormField = Annotated[
    PortForm, PlainValidator(_form, json_schema_input_type=Annotated[_SoftModel | _NamedForm, IfType("object")])
]


class _EnforcementModel(FileModel):
    declares = Enforcement
    method: Annotated[str, one_of("enforcement", lambda: METHODS)] | None = None
    eta: Annotated[Gains | None, PlainValidator(_eta, json_schema_input_type=_Eta)] = None
    limit_eta: Rate | None = None
    guard: Annotated[str, one_of("guard", lambda: GUARDS)] | None = None
    metric: Annotated[str, one_of("metric", lambda: METRICS)] = Enforcement.metric
    reach: PositiveLength | None = None
    forms: dict[Annotated[str, refers_to("constraint")], _FormField] = Field(default_factory=dict)


def _enforcement(value: Any, info: ValidationInfo) -> Enforcement:
    """The name of a method, or keys and values."""
    if isinstance(value, str):
        return Enforcement(known("enforcement", value, METHODS))
    if not isinstance(value, dict):
        raise InputError(f"expected one of {', '.join(METHODS)}, or keys and values, got {show(value)}")
    model = _EnforcementModel.model_validate(value, context=info.context)
    return Enforcement(**{name: getattr(model, name) for name in _EnforcementModel.model_fields})


def _fits(value: Enforcement, info: ValidationInfo) -> Enforcement:
    """Refuse forms of constraints that are no entry ports, as far as the constraints are known."""
    problems = []
    if "constraints" in info.data:
        for name, form in value.forms.items():
            try:
                form_of_each(info.data["constraints"].constraints, {name: form})
            except InputError as error:
                problems.append((("forms", name), str(error)))
    gather(None, problems)
    return value


_Written = Annotated[_EnforcementModel | Annotated[str, one_of("enforcement", lambda: METHODS)], IfType("object")]
EnforcementField = Annotated[
    Enforcement, PlainValidator(_enforcement, json_schema_input_type=_Written), AfterValidator(_fits)
]
"""The key `enforcement` of a scene, which stands behind `constraints`; see `Enforcement`."""


def _whole(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"expected a whole number, got {show(value)}")
    return value


Seed = Annotated[int, BeforeValidator(_whole), Field(ge=0)]
"""Of everything random."""


def enforcement_data(enforcement: Enforcement) -> dict[str, Any]:
    """The key `enforcement` with what it gives, from which the model builds an equal one; nothing where it is open."""
    eta = enforcement.eta
    gains = {k: float(v) for k, v in eta.items()} if isinstance(eta, Mapping) else None if eta is None else float(eta)
    numbers = {name: getattr(enforcement, name) for name in ("limit_eta", "reach")}
    given = {
        "method": enforcement.method,
        "eta": gains,
        **{name: None if value is None else float(value) for name, value in numbers.items()},
        "guard": enforcement.guard,
        "metric": enforcement.metric if enforcement.metric != Enforcement.metric else None,
        "forms": {
            name: {_SOFT: float(form.weight)} if isinstance(form, Soft) else form
            for name, form in enforcement.forms.items()
        }
        or None,
    }
    own = {name: value for name, value in given.items() if value is not None}
    return {"enforcement": own} if own else {}
