"""What a hands-on scene file may hold, and YAML <-> `HandsOnScene`, without loss."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Annotated, Any, Self

from pydantic import ConfigDict, Field, PlainValidator, TypeAdapter, WithJsonSchema, create_model, model_validator

from admittance import NEURO8, TABLE_1, Parameters
from primitives.errors import InputError, UnknownNameError
from primitives.files.document import ValuePath
from primitives.files.fields import Numbers, Text, check_text, list_of, one_of, refers_to
from primitives.files.joints import Configuration
from primitives.files.model import FileModel, gather, show
from primitives.files.quantities import (
    Forces,
    Length,
    Moment,
    NotNegative,
    Period,
    Position,
    PositiveForce,
    PositiveLength,
    SomeForce,
    Torques,
    of,
)
from primitives.files.unions import IfType
from primitives.files.yaml_file import write
from primitives.spec import DeclaredField, constraints_data
from scenarios.anatomy.model import AnatomyModel, anatomy_data
from scenarios.enforcement_model import EnforcementField, Seed, enforcement_data
from scenarios.hands_on.pull import WAYS, Pull, Waypoint
from scenarios.hands_on.push import Push
from scenarios.hands_on.scene import HandsOnScene
from scenarios.own_robot_file import RobotField, robot_data
from scenarios.scene_model import Duration, LimitsField, PlantField, SceneName, chosen

PARAMETERS = {"table-1": TABLE_1, "neuro8": NEURO8}
"""Sets of parameters that a file can begin from."""


class _WaypointModel(FileModel):
    """Where the hand wants the end of the shaft at a time: to, into or across something.

    Attributes
    ----------
    to : (3,) relative to the port, metres, world axes.
    into : a part of the anatomy, straight on from the last waypoint.
    across : a part of the anatomy, on the line from the port through its nearest point, so that the shaft leans on it.
    beyond : metres beyond the point of the part that is nearest to the last waypoint.
    """

    declares = Waypoint
    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": [way]} for way in WAYS]})
    t: Moment
    to: Position | None = None
    into: Text | None = None
    across: Text | None = None
    beyond: Length = 0.0

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.build()
        return self

    def build(self) -> Waypoint:
        given = [(way, getattr(self, way)) for way in WAYS if getattr(self, way) is not None]
        if len(given) != 1:
            raise InputError(f"expected one of {', '.join(WAYS)}, got {' and '.join(w for w, _ in given) or 'none'}")
        way, at = given[0]
        return Waypoint(self.t, at if isinstance(at, str) else _triple(at), self.beyond, way)


class _WrenchModel(FileModel):
    """What the hand does from a time on.

    Attributes
    ----------
    t : seconds. force : (3,) N, world axes. torque : (3,) Nm, world axes, at the handle.
    """

    t: Moment
    force: Forces = Field(default=[0.0, 0.0, 0.0])
    torque: Torques = Field(default=[0.0, 0.0, 0.0])


_PULLS = ("stiffness", "damping", "most", "delay")
_PUSHES = ("interpolate",)
_HANDS = ("waypoints", "wrenches", "record")


class HandModel(FileModel):
    """A hand that pulls along waypoints, or one whose wrenches are given, here or on a record.

    Attributes
    ----------
    wrenches : a list of them, in the order of their times. record : a CSV file of the scene's folder in their place.
    interpolate : straight lines from one wrench to the next, else each lasts until the next.
    """

    declares = Pull
    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": [way]} for way in _HANDS]})
    waypoints: Annotated[list[_WaypointModel], list_of(_WaypointModel)] | None = None
    wrenches: Annotated[list[_WrenchModel], list_of(_WrenchModel)] | None = None
    record: Text | None = None
    stiffness: Annotated[NotNegative, of("a stiffness")] = Pull.stiffness
    damping: Annotated[NotNegative, of("a damping")] = Pull.damping
    most: PositiveForce = Pull.most
    delay: Moment = Pull.delay
    interpolate: bool = Push.interpolate
    tremor: SomeForce = Pull.tremor

    @model_validator(mode="after")
    def _fits(self) -> Self:
        try:
            self.build()
        except InputError as error:
            gather(None, [((), str(error))])
        return self

    def elsewhere(self, parts: Sequence[str]) -> list[tuple[ValuePath, str]]:
        """Where its waypoints are at parts that an anatomy with these has not, and what to say of it."""
        return [
            (("waypoints", i, way), str(UnknownNameError("part of the anatomy", name, parts)))
            for i, waypoint in enumerate(self.waypoints or [])
            for way in ("into", "across")
            if (name := getattr(waypoint, way)) is not None and name not in parts
        ]

    def build(self) -> Pull | Push:
        """The hand that is declared; raises InputError."""
        given = [name for name in _HANDS if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError(f"expected one of {', '.join(_HANDS)}, got {' and '.join(given) or 'none'}")
        foreign = set(_PUSHES if self.waypoints is not None else _PULLS) & self.model_fields_set
        if foreign:
            raise InputError(f"{' and '.join(sorted(foreign))} cannot go with {given[0]}; leave out one or the other")
        if self.waypoints is not None:
            own = {name: getattr(self, name) for name in _PULLS}
            return Pull(waypoints=tuple(w.build() for w in self.waypoints), tremor=self.tremor, **own)
        rows = self.wrenches or []
        return Push(
            times=tuple(row.t for row in rows),
            wrenches=tuple((*_triple(row.force), *_triple(row.torque)) for row in rows),
            file=self.record or "",
            interpolate=self.interpolate,
            tremor=self.tremor,
        )


def _triple(value: list[float]) -> tuple[float, float, float]:
    x, y, z = value
    return x, y, z


def _hand_data(hand: Pull | Push) -> dict[str, Any]:
    if isinstance(hand, Pull):
        waypoints = [
            {"t": w.t, w.way: w.at if isinstance(w.at, str) else list(w.at), "beyond": w.beyond} for w in hand.waypoints
        ]
        return {**{name: getattr(hand, name) for name in (*_PULLS, "tremor")}, "waypoints": waypoints}
    plain = {"interpolate": hand.interpolate, "tremor": hand.tremor}
    if hand.file:
        return {**plain, "record": hand.file}
    rows = zip(hand.times, hand.wrenches, strict=True)
    return {**plain, "wrenches": [{"t": t, "force": list(w[:3]), "torque": list(w[3:])} for t, w in rows]}


class _Declared(FileModel):
    """Parameters of the target admittance; four numbers stand for [along the shaft, about the port x 3].

    Attributes
    ----------
    set : the set that the other keys change.
    """

    declares = Parameters


_FIELDS: dict[str, Any] = {
    **{f.name: (Numbers if isinstance(f.default, tuple) else float, f.default) for f in fields(Parameters)},
    **{name: (Length, getattr(TABLE_1, name)) for name in ("d_0", "shaft_length")},
    **{name: (Annotated[float, of("a rate")], getattr(TABLE_1, name)) for name in ("alpha", "beta", "port_gain")},
    "k": (Annotated[float, of("an energy")], TABLE_1.k),
    "W": (Annotated[Any, WithJsonSchema(TypeAdapter(float | Numbers).json_schema())], TABLE_1.W),
    "implicit_damping": (bool, TABLE_1.implicit_damping),
    "set": (Annotated[str, one_of("set of parameters", lambda: PARAMETERS)], "table-1"),
}
_ParametersModel = create_model("_ParametersModel", __base__=_Declared, **_FIELDS)
_Named = Annotated[str, one_of("set of parameters", lambda: PARAMETERS)]
_Written = Annotated[_ParametersModel | _Named, IfType("object")]


def _parameters(value: Any) -> Parameters:
    """A name of PARAMETERS, or keys and values: `set` names the set that the other keys change."""
    if not isinstance(value, str | dict):
        raise InputError(f"expected a set ({', '.join(PARAMETERS)}), or keys and values, got {show(value)}")
    model: Any = _ParametersModel.model_validate({"set": value} if isinstance(value, str) else value)
    changes = {name: getattr(model, name) for name in model.model_fields_set - {"set"}}
    gather(None, [((name,), words) for name in changes if (words := _problem(name, changes[name]))])
    return Parameters(**(asdict(PARAMETERS[model.set]) | changes))


def _problem(name: str, value: Any) -> str:
    """What is wrong with the value of a parameter, empty where nothing is."""
    try:
        Parameters(**{name: value})
    except InputError as error:
        return str(error)
    return ""


class HandsOnModel(FileModel):
    """The keys of a hands-on scene file, once those of its base are joined.

    Attributes
    ----------
    enforce : names of the constraints that are enforced, the others are watched; left out, as each declares.
    """

    declares = HandsOnScene
    name: SceneName
    summary: Text
    robot: RobotField
    group: Annotated[Text, refers_to("joint group")] = "all"
    shaft: Annotated[Text, refers_to("frame")] = "tip"
    start: Configuration
    port: Position
    port_radius: PositiveLength = HandsOnScene.port_radius
    parameters: Annotated[Parameters, PlainValidator(_parameters, json_schema_input_type=_Written)] = TABLE_1
    form: Annotated[str, one_of("form", lambda: ("reduced", "full", "printed"))] = HandsOnScene.form
    integrator: Annotated[str, one_of("integrator", lambda: ("semi-implicit", "euler", "rk4", "robust"))] = (
        HandsOnScene.integrator
    )
    anatomy: AnatomyModel | None = None
    constraints: DeclaredField
    enforce: list[Annotated[str, refers_to("constraint")]] | None = None
    hand: HandModel
    hand_on_files: HandModel | None = None
    period: Period = HandsOnScene.period
    duration: Duration
    limits: LimitsField = Field(default_factory=dict)
    enforcement: EnforcementField = HandsOnScene.enforcement
    plant: PlantField = HandsOnScene.plant
    seed: Seed = HandsOnScene.seed

    @model_validator(mode="after")
    def _waypoints_at_parts(self) -> Self:
        parts = self.anatomy.build().parts if self.anatomy is not None else ()
        gather(None, [(("hand", *place), text) for place, text in self.hand.elsewhere(parts)])
        return self

    def build(self) -> HandsOnScene:
        """The scene that the file declares; raises InputError."""
        other = self.hand_on_files.build() if self.hand_on_files is not None else None
        built = {
            "anatomy": self.anatomy.build() if self.anatomy is not None else None,
            "constraints": chosen(self.constraints, self.enforce),
            "hand": self.hand.build(),
            "limits": self.constraints.limits | self.limits,
            "hand_on_files": other,
        }
        own = {name: getattr(self, name) for name in type(self).model_fields if name not in (*built, "enforce")}
        return HandsOnScene(**(own | built))


def hands_on_data(scene: HandsOnScene) -> dict[str, Any]:
    """The scene as plain data, from which `HandsOnModel` builds an equal one; raises InputError."""
    plain = {name: getattr(scene, name) for name in ("name", "group", "shaft", "form", "integrator")}
    parameters = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(scene.parameters).items()}
    return {
        **plain,
        "robot": robot_data(scene.robot),
        "summary": check_text(scene.summary),
        "start": list(scene.start),
        "port": list(scene.port),
        "port_radius": float(scene.port_radius),
        "parameters": parameters,
        **anatomy_data(scene.anatomy),
        "constraints": constraints_data(scene.constraints),
        "hand": _hand_data(scene.hand),
        **({"hand_on_files": _hand_data(scene.hand_on_files)} if scene.hand_on_files is not None else {}),
        "period": float(scene.period),
        "duration": float(scene.duration),
        **enforcement_data(scene.enforcement),
        "plant": scene.plant,
        "seed": scene.seed,
        **({"limits": {joint: list(limit) for joint, limit in scene.limits.items()}} if scene.limits else {}),
    }


def dump_hands_on(scene: HandsOnScene) -> str:
    """The scene as YAML, on no base: what is loaded from it is equal to the scene."""
    return write(hands_on_data(scene))
