"""How an element stands in a file.

A `kind` (point, line, plane, segment or cloud) with its geometry, metres or texts with units, in the coordinates of
what it is attached to: a robot's `frame`, a moving `entity`, or the world where neither is given.

    point    position
    line     point (default: the origin), direction (default: z), of any length but zero
    plane    point, normal, of any length but zero
    segment  start, end
    cloud    cloud: its name
    any      dual_quaternion, eight numbers, in place of the above (and a segment's length)
"""

from abc import abstractmethod
from collections.abc import Mapping
from functools import reduce
from math import hypot
from operator import or_
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, ValidationInfo

from primitives.elements import WORLD, Cloud, Element, Line, Plane, Point, Segment
from primitives.errors import InputError, UnknownNameError
from primitives.files.fields import Numbers, Text, Vector, check_text, items, one_of, refers_to
from primitives.files.model import FileModel, problem_at, show
from primitives.files.quantities import Length, Position
from primitives.files.unions import ByKind


def _direction(value: list[float]) -> list[float]:
    length = hypot(*value)
    if not 1e-9 <= length <= 1e100:
        raise InputError(f"expected a direction, got {value}, whose length is {length:g}")
    return value


Direction = Annotated[Vector, AfterValidator(_direction)]


class _Attached(FileModel):
    """An element.

    Attributes
    ----------
    cloud : name of a part of the anatomy.
    """

    declares = Element
    kind: Any
    frame: Annotated[Text, refers_to("frame")] = WORLD
    entity: Text | None = None

    @abstractmethod
    def build(self) -> Element: ...


class _Point(_Attached):
    """A point.

    Attributes
    ----------
    position : (3,) metres.
    """

    declares = Point
    kind: Literal["point"]
    position: Position

    def build(self) -> Element:
        return Point.at(self.position, frame=self.frame, entity=self.entity)


class _Line(_Attached):
    """A line.

    Attributes
    ----------
    point : (3,) of the line, metres; the origin by default.
    direction : (3,) along the line, of any length but zero; z by default.
    """

    declares = Line
    kind: Literal["line"]
    point: Position = Field(default=[0.0, 0.0, 0.0])
    direction: Direction = Field(default=[0.0, 0.0, 1.0])

    def build(self) -> Element:
        return Line.through(self.point, self.direction, frame=self.frame, entity=self.entity)


class _Plane(_Attached):
    """A plane; above it is the side that its normal points to.

    Attributes
    ----------
    point : (3,) of the plane, metres. normal : (3,) of any length but zero.
    """

    declares = Plane
    kind: Literal["plane"]
    point: Position
    normal: Direction

    def build(self) -> Element:
        return Plane.through(self.point, self.normal, frame=self.frame, entity=self.entity)


class _Segment(_Attached):
    """A segment, the axis of a capsule.

    Attributes
    ----------
    start, end : (3,) metres.
    """

    declares = Segment
    kind: Literal["segment"]
    start: Position
    end: Position

    def build(self) -> Element:
        _direction((np.array(self.end) - self.start).tolist())
        return Segment.between(self.start, self.end, frame=self.frame, entity=self.entity)


class _Cloud(_Attached):
    """A point cloud."""

    declares = Cloud
    kind: Literal["cloud"]
    cloud: Annotated[Text, refers_to("cloud")]

    def build(self) -> Element:
        return Cloud.named(self.cloud, frame=self.frame, entity=self.entity)


class _Exact(_Attached):
    """An element by its dual quaternion."""

    kind: Annotated[str, one_of("kind of element", lambda: _SHAPES)]
    dual_quaternion: Annotated[Numbers, items(8, 8)]
    length: Length = 0.0
    cloud: Annotated[Text, refers_to("cloud")] | None = None

    def build(self) -> Element:
        place = np.array(self.dual_quaternion), self.frame, self.entity, self.length
        try:
            return Cloud(*place, self.cloud or "") if self.kind == "cloud" else _ELEMENTS[self.kind](*place)
        except InputError as error:
            raise problem_at(("dual_quaternion",), str(error)) from None


_SHAPES: dict[str, type[_Attached]] = {
    "point": _Point,
    "line": _Line,
    "plane": _Plane,
    "segment": _Segment,
    "cloud": _Cloud,
}
_ELEMENTS: dict[str, type[Element]] = {e.kind: e for e in (Point, Line, Plane, Segment, Cloud)}


def element_from(data: Any, info: ValidationInfo) -> Element:
    """The element that plain data declares, as a validator; raises InputError and ValidationError."""
    if not isinstance(data, dict):
        raise InputError(f"expected keys and values, e.g. {{kind: line, frame: ...}}, got {show(data)}")
    kind = data.get("kind")
    if not isinstance(kind, str):
        raise problem_at(("kind",), f"expected one of {', '.join(sorted(_SHAPES))}, got {show(kind)}")
    if kind not in _SHAPES:
        raise problem_at(("kind",), str(UnknownNameError("kind of element", kind[:60], _SHAPES)))
    model = _Exact if "dual_quaternion" in data else _SHAPES[kind]
    with np.errstate(over="ignore", invalid="ignore"):
        return model.model_validate(data, context=info.context).build()


def _written(*kinds: str) -> Any:
    models: Any = [*(_SHAPES[kind] for kind in kinds), _Exact]
    return Annotated[reduce(or_, models), ByKind(kinds, {"required": ["dual_quaternion"]})]


SHAPES: Mapping[str, Any] = {"": _written(*_SHAPES), **{kind: _written(kind) for kind in _SHAPES}}
"""How an element of a kind, "" for any, may be written."""
ElementField = Annotated[Element, PlainValidator(element_from, json_schema_input_type=SHAPES[""])]
"""An element in a file; the names given to `validate` as "frame" are the frames it may refer to."""


def element_data(element: Element) -> dict[str, Any]:
    """The element as plain data: its geometry where that gives it back to the bit, else its dual quaternion.

    Raises
    ------
    InputError : of another kind than those above, or the name of a frame or entity that a file cannot hold.
    """
    if element.kind not in _ELEMENTS:
        raise InputError(f"cannot write {type(element).__name__} to a file; use Point, Line, Plane, Segment or Cloud")
    place: dict[str, Any] = {"kind": element.kind}
    if element.entity is not None:
        place["entity"] = check_text(element.entity)
    elif element.frame != WORLD:
        place["frame"] = check_text(element.frame)
    if isinstance(element, Cloud):
        place["cloud"] = check_text(element.name)
    if element.kind != "segment":
        readable = {**place, **_shape(element)}
        if _gives_back(readable, element):
            return readable
    exact = {**place, "dual_quaternion": element.dual_quaternion.tolist()}
    return {**exact, "length": float(element.length)} if element.length else exact


def _gives_back(data: dict[str, Any], element: Element) -> bool:
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            again = _SHAPES[element.kind].model_validate(data).build()
    except ValueError:
        return False
    return again == element and again.dual_quaternion.tobytes() == element.dual_quaternion.tobytes()


def _shape(element: Element) -> dict[str, list[float]]:
    """Geometry of a point, line or plane; a segment's two ends do not hold its pose to the bit."""
    if element.kind == "cloud":
        return {}
    point, direction = element.geometry[:3].tolist(), element.geometry[3:6].tolist()
    if element.kind == "point":
        return {"position": point}
    return {"point": point, "normal" if element.kind == "plane" else "direction": direction}
