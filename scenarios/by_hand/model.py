"""What a scene file may hold of a hand that leads the tool along a trajectory: the keys `hand` and `admittance`."""

from dataclasses import asdict
from typing import Annotated, Any

from pydantic import PlainValidator, TypeAdapter

from admittance.joint_parameters import LWR4PLUS_JOINTS, NEURO8_JOINTS, Each, JointParameters
from primitives.checks import known
from primitives.errors import InputError
from primitives.files.fields import Numbers, Positive, items, one_of
from primitives.files.model import FileModel, show
from primitives.files.quantities import NotNegative, PositiveAngle, PositiveForce, PositiveLength, SomeForce, of
from primitives.files.unions import IfType
from scenarios.by_hand.hand import Guide

SETS = {"lwr4plus": LWR4PLUS_JOINTS, "neuro8": NEURO8_JOINTS}
"""Sets of parameters that a file can name."""


class GuideModel(FileModel):
    """The key `hand`: how a hand leads the tool along the reference; see `Guide`."""

    declares = Guide
    stiffness: Annotated[NotNegative, of("a stiffness")] = Guide.stiffness
    damping: Annotated[NotNegative, of("a damping")] = Guide.damping
    most: PositiveForce = Guide.most
    turning_stiffness: NotNegative = Guide.turning_stiffness
    turning_damping: NotNegative = Guide.turning_damping
    most_torque: Annotated[Positive, of("a torque")] = Guide.most_torque
    tremor: SomeForce = Guide.tremor

    def build(self) -> Guide:
        """The hand that the file declares."""
        return Guide(**self.model_dump())


_ONE, _SEVERAL = TypeAdapter(Positive), TypeAdapter(Numbers)


def _each(value: Any) -> Each:
    if not isinstance(value, list):
        return _ONE.validate_python(value, strict=True)
    numbers = tuple(_SEVERAL.validate_python(value, strict=True))
    if not numbers or not min(numbers) > 0.0:
        raise InputError(f"expected numbers > 0, one a joint, got {list(numbers[:8])} ({len(numbers)} numbers)")
    return numbers


_Several = Annotated[list[Positive], items(1)]
_EachField = Annotated[
    Each, PlainValidator(_each, json_schema_input_type=Annotated[_Several | Positive, IfType("array")])
]


class _JointParametersModel(FileModel):
    declares = JointParameters
    inertia: _EachField
    damping: _EachField
    k: NotNegative = JointParameters.k
    d_0: PositiveLength = JointParameters.d_0
    d_0_angle: PositiveAngle = JointParameters.d_0_angle


def _parameters(value: Any) -> JointParameters:
    """A name of SETS, or keys and values."""
    if isinstance(value, str):
        return SETS[known("set of parameters", value, SETS)]
    if not isinstance(value, dict):
        raise InputError(f"expected a set ({', '.join(SETS)}), or keys and values, got {show(value)}")
    return JointParameters(**_JointParametersModel.model_validate(value).model_dump())


_Named = Annotated[str, one_of("set of parameters", lambda: SETS)]
_Written = Annotated[_JointParametersModel | _Named, IfType("object")]
JointParametersField = Annotated[JointParameters, PlainValidator(_parameters, json_schema_input_type=_Written)]
"""The key `admittance`; see `JointParameters`."""


def by_hand_data(hand: Guide, admittance: JointParameters) -> dict[str, Any]:
    """Both keys as plain data, from which the models build equal ones."""
    numbers = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(admittance).items()}
    return {"hand": asdict(hand), "admittance": numbers}
