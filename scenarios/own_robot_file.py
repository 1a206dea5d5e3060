"""How the robot of a scene stands in its file: the name of a registered one, or keys of its own."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import ConfigDict, Field, PlainValidator, TypeAdapter, ValidationInfo

from primitives.errors import InputError, UnknownNameError
from primitives.files.fields import Positive, Text, one_of, refers_to
from primitives.files.joints import RangesField
from primitives.files.model import FileModel, show
from primitives.files.quantities import Position, Rotation, of
from primitives.files.unions import IfType
from scenarios.own_robot import OwnRobot, Placement, SceneRobot
from scenarios.robots import robots


def _three(value: list[float]) -> tuple[float, float, float]:
    x, y, z = value
    return x, y, z


class _PlacementModel(FileModel):
    declares = Placement
    on: Text
    position: Position = Field(default=[0.0, 0.0, 0.0])
    rotation: Rotation = Field(default=[0.0, 0.0, 0.0])

    def build(self) -> Placement:
        return Placement(self.on, _three(self.position), _three(self.rotation))


_Speed = Annotated[Positive, of("a turning speed", "a speed")]


class OwnRobotModel(FileModel):
    """The keys of an own robot."""

    declares = OwnRobot
    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": [file]} for file in ("urdf", "mjcf")]})
    urdf: Text | None = None
    mjcf: Text | None = None
    tip: Text | None = None
    tool: _PlacementModel | None = None
    frames: dict[Text, _PlacementModel] = Field(default_factory=dict)
    limits: RangesField = Field(default_factory=dict)
    velocity_limits: dict[Annotated[str, refers_to("joint")], _Speed] = Field(default_factory=dict)

    def build(self) -> OwnRobot:
        """The robot that the keys declare; raises InputError."""
        return OwnRobot(
            urdf=self.urdf or "",
            mjcf=self.mjcf or "",
            tip=self.tip or "",
            tool=self.tool.build() if self.tool is not None else None,
            frames={name: place.build() for name, place in self.frames.items()},
            limits=self.limits,
            velocity_limits=self.velocity_limits,
        )


def robot_from(value: Any, info: ValidationInfo) -> SceneRobot:
    """The robot that plain data declares, as a validator; raises InputError and ValidationError."""
    if isinstance(value, dict):
        return OwnRobotModel.model_validate(value, context=info.context).build()
    if value in robots.names():
        return str(value)
    if not isinstance(value, str):
        raise InputError(f"expected one of {', '.join(robots.names())}, or keys of an own one, got {show(value)}")
    raise UnknownNameError("robot", value[:60], robots.names())


_Registered = Annotated[str, one_of("robot", robots.names)]
_Written = Annotated[OwnRobotModel | _Registered, IfType("object")]
RobotField = Annotated[SceneRobot, PlainValidator(robot_from, json_schema_input_type=_Written)]
_ROBOT: TypeAdapter[SceneRobot] = TypeAdapter(RobotField)


def robot_of(data: Any) -> SceneRobot:
    """The robot of plain data as far as the data are right; raises ValueError where they are not."""
    return _ROBOT.validate_python(data, context={})


def robot_data(robot: SceneRobot) -> Any:
    """The robot as plain data, from which `robot_from` builds an equal one."""
    if isinstance(robot, str):
        return robot
    named: Mapping[str, Any] = {
        "urdf": robot.urdf,
        "mjcf": robot.mjcf,
        "tip": robot.tip,
        "tool": _placement_data(robot.tool) if robot.tool is not None else None,
        "frames": {name: _placement_data(place) for name, place in robot.frames.items()},
        "limits": {joint: [float(v) for v in limit] for joint, limit in robot.limits.items()},
        "velocity_limits": {joint: float(speed) for joint, speed in robot.velocity_limits.items()},
    }
    return {key: value for key, value in named.items() if value}


def _placement_data(place: Placement) -> dict[str, Any]:
    return {"on": place.on, "position": list(place.position), "rotation": list(place.rotation)}
