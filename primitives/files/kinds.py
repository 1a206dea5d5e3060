"""How the kinds of `primitives.kinds` stand in a file, each beside its keys."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PlainValidator, ValidationInfo

from primitives import kinds
from primitives.constraint import SAFETY_CLASSES, Constraint, SafetyClass
from primitives.elements import Element, Line, Plane, Point
from primitives.errors import InputError
from primitives.files.elements import SHAPES, Direction, ElementField, element_from
from primitives.files.fields import Text, one_of, refers_to
from primitives.files.joints import Ranges, RangesField
from primitives.files.model import FileModel
from primitives.files.quantities import Position, PositiveAngle, PositiveLength, SomeLength
from primitives.files.unions import IfType


def _part(kind: str, make: Callable[[str], Element]) -> Any:
    """Annotations of a part of the tool: an element of a kind ("" for any), or only the name of a frame."""
    check = refers_to("frame").func

    def build(data: Any, info: ValidationInfo) -> Element:
        element = make(check(data, info)) if isinstance(data, str) and data else element_from(data, info)  # type: ignore[call-arg]
        if kind and element.kind != kind:
            raise InputError(f"expected a {kind}, got a {element.kind}")
        return element

    frame = Annotated[str, Field(min_length=1)]
    return PlainValidator(build, json_schema_input_type=Annotated[SHAPES[kind] | frame, IfType("object")])


What = Annotated[Element, _part("", kinds.origin_of)]
WhatPoint = Annotated[Point, _part("point", kinds.origin_of)]
Shaft = Annotated[Line, _part("line", Line.z_axis)]


class _Kind(FileModel):
    """A constraint of a kind.

    Attributes
    ----------
    what : part of the tool: an element, or the name of a frame for its origin.
    shaft, axis : line of the tool: an element, or the name of a frame for its z axis.
    """

    declares: ClassVar[Any] = Constraint
    name: Text
    safety_class: Annotated[SafetyClass, one_of("safety class", lambda: SAFETY_CLASSES)] = "patient"
    enforced: bool = True

    def more(self) -> dict[str, Any]:
        return {"safety_class": self.safety_class, "enforced": self.enforced}

    @abstractmethod
    def build(self) -> Constraint: ...


class _Forbidden(_Kind):
    declares = kinds.forbidden_region
    kind: Literal["forbidden_region"]
    what: What
    around: ElementField
    radius: SomeLength
    tool_radius: SomeLength = 0.0

    def build(self) -> Constraint:
        return kinds.forbidden_region(
            self.name, self.what, self.around, self.radius, tool_radius=self.tool_radius, **self.more()
        )


class _Inside(_Forbidden):
    declares = kinds.stay_inside
    kind: Literal["stay_inside"]  # type: ignore[assignment]

    def build(self) -> Constraint:
        return kinds.stay_inside(
            self.name, self.what, self.around, self.radius, tool_radius=self.tool_radius, **self.more()
        )


class _Above(_Kind):
    """Keep a point on the side of a plane that its normal points to, a distance away from it.

    Attributes
    ----------
    point : (3,) of the plane, metres, world. normal : (3,) in the world, of any length but zero; z by default.
    distance : metres.
    """

    declares = kinds.keep_above
    kind: Literal["keep_above"]
    what: WhatPoint
    point: Position
    normal: Direction = Field(default=[0.0, 0.0, 1.0])
    distance: SomeLength = 0.0

    def build(self) -> Constraint:
        plane = Plane.through(self.point, self.normal)
        return kinds.keep_above(self.name, self.what, plane, distance=self.distance, **self.more())


class _Below(_Above):
    """Keep a point on the side of a plane that its normal does not point to, a distance away from it."""

    declares = kinds.keep_below
    kind: Literal["keep_below"]  # type: ignore[assignment]

    def build(self) -> Constraint:
        plane = Plane.through(self.point, self.normal)
        return kinds.keep_below(self.name, self.what, plane, distance=self.distance, **self.more())


class _Cone(_Kind):
    declares = kinds.cone
    kind: Literal["cone"]
    axis: Shaft
    around: Direction
    angle: PositiveAngle

    def build(self) -> Constraint:
        return kinds.cone(self.name, self.axis, Line.through([0.0] * 3, self.around), self.angle, **self.more())


class _Rcm(_Kind):
    declares = kinds.rcm
    kind: Literal["rcm"]
    shaft: Shaft
    port: Position
    tolerance: PositiveLength

    def build(self) -> Constraint:
        return kinds.rcm(self.name, self.shaft, Point.at(self.port), self.tolerance, **self.more())


class _OfCloud(_Kind):
    declares = kinds.cloud
    kind: Literal["cloud"]
    what: What
    cloud: Annotated[Text, refers_to("cloud")]
    tool_radius: SomeLength = 0.0

    def build(self) -> Constraint:
        return kinds.cloud(self.name, self.what, self.cloud, tool_radius=self.tool_radius, **self.more())


class JointLimits(FileModel):
    """Ranges of joints, which a scene keeps beside its constraints.

    Attributes
    ----------
    limits : {joint: [lower, upper]}, rad and m.
    """

    kind: Literal["joint_limits"]
    limits: RangesField

    def build(self) -> Ranges:
        """{joint: (lower, upper)}."""
        return self.limits


KINDS: dict[str, type[_Kind] | type[JointLimits]] = {
    "forbidden_region": _Forbidden,
    "stay_inside": _Inside,
    "keep_above": _Above,
    "keep_below": _Below,
    "cone": _Cone,
    "rcm": _Rcm,
    "cloud": _OfCloud,
    "joint_limits": JointLimits,
}
"""What ``kind`` of an entry of constraints may say."""
