"""What a VFI configuration of Adorno-Lab's robot_constraint_manager may hold, versions 2 and 3.

Source: its specification of version 3 and the examples of version 2 (github.com/Adorno-Lab/robot_constraint_editor
and robot_constraint_manager, 2026). Version 2 names objects of a simulator, which has their geometry; version 3 has
the geometry in the file. Keys that are not known here are kept, so that they can be named.
"""

from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import ConfigDict, Field, PlainValidator, TypeAdapter, ValidationInfo

from primitives.checks import Array
from primitives.conversions import as_pose
from primitives.dual_quaternion import from_rotation_translation
from primitives.errors import InputError
from primitives.files.document import Problem, refuse
from primitives.files.fields import Numbers, Text, Vector, list_of, one_of
from primitives.files.model import FileModel, show, validate
from primitives.files.yaml_file import read

PRIMITIVES = ("POINT", "LINE", "PLANE", "LINE_ANGLE", "LINESEGMENT")
DIRECTIONS = {
    "RESTRICTED_ZONE": "outside",
    "SAFE_ZONE": "inside",
    "KEEP_ROBOT_OUTSIDE": "outside",
    "KEEP_ROBOT_INSIDE": "inside",
}
AXES = {"i_": (1, 0, 0), "j_": (0, 1, 0), "k_": (0, 0, 1), "-i_": (-1, 0, 0), "-j_": (0, -1, 0), "-k_": (0, 0, -1)}
TYPES = ("ENVIRONMENT_TO_ROBOT", "ROBOT_TO_ROBOT")


class _Open(FileModel):
    """A mapping whose unknown keys are kept."""

    model_config = ConfigDict(extra="allow", strict=True, allow_inf_nan=False)

    def unknown(self) -> list[str]:
        """Keys that are not of the format, or of no version of it known here."""
        return sorted(self.model_extra or {})


Primitive = Annotated[str, one_of("primitive", lambda: PRIMITIVES)]
Names = Annotated[list[Text], list_of(Text)]


class End(NamedTuple):
    """One side of a VFI: the names of its objects or entities, its primitive, and whether the robot carries it."""

    names: list[str]
    primitive: str
    on_robot: bool


class Vfi(_Open):
    """An item of `vfi_array`; each type and version adds the keys of its two sides."""

    vfi_type: Annotated[str, one_of("vfi_type", lambda: TYPES)]
    safe_distance: Annotated[float, Field(ge=0.0)]
    vfi_gain: Annotated[float, Field(gt=0.0)]
    direction: Annotated[str, one_of("direction", lambda: DIRECTIONS)]
    tag: Text
    buffer: Annotated[float, Field(ge=0.0)] = 0.0

    def ends(self) -> tuple[End, End]:
        """The robot's side, or the first of the robots', and the other one."""
        prefix = "cs_entity" if hasattr(self, "cs_entity_robot") or hasattr(self, "cs_entity_one") else "entity"
        sides = ("robot", "environment") if self.vfi_type == TYPES[0] else ("one", "two")
        first, second = (
            End(getattr(self, f"{prefix}_{s}"), getattr(self, f"entity_{s}_primitive_type"), s != "environment")
            for s in sides
        )
        return first, second


class EnvironmentToRobot2(Vfi):
    """Version 2, by the names of the simulator's objects."""

    cs_entity_environment: Names
    cs_entity_robot: Names
    entity_environment_primitive_type: Primitive
    entity_robot_primitive_type: Primitive
    robot_index: int
    joint_index: int


class RobotToRobot2(Vfi):
    """Version 2, by the names of the simulator's objects."""

    cs_entity_one: Names
    cs_entity_two: Names
    entity_one_primitive_type: Primitive
    entity_two_primitive_type: Primitive
    robot_index_one: int
    robot_index_two: int
    joint_index_one: int
    joint_index_two: int


class EnvironmentToRobot3(Vfi):
    """Version 3, by the names of the file's entities."""

    entity_environment: Names
    entity_robot: Names
    entity_environment_primitive_type: Primitive
    entity_robot_primitive_type: Primitive


class RobotToRobot3(Vfi):
    """Version 3, by the names of the file's entities."""

    entity_one: Names
    entity_two: Names
    entity_one_primitive_type: Primitive
    entity_two_primitive_type: Primitive


_ITEMS: dict[str, tuple[type[Vfi], type[Vfi]]] = {
    TYPES[0]: (EnvironmentToRobot2, EnvironmentToRobot3),
    TYPES[1]: (RobotToRobot2, RobotToRobot3),
}


def _item(data: Any, info: ValidationInfo) -> Vfi:
    kind = data.get("vfi_type") if isinstance(data, dict) else None
    models = _ITEMS.get(kind, (Vfi, Vfi)) if isinstance(kind, str) else (Vfi, Vfi)
    return models["3" in (info.context or {})["version"]].model_validate(data, context=info.context)


class _Placed(_Open):
    translation: Vector
    rotation: Numbers


_NUMBERS: TypeAdapter[list[float]] = TypeAdapter(Numbers)


def _pose(data: Any) -> Array:
    """(8,) unit dual quaternion from its eight coefficients, or from a translation and a rotation [w, x, y, z]."""
    if isinstance(data, list):
        return as_pose(_NUMBERS.validate_python(data, strict=True), "pose")
    if not isinstance(data, dict):
        raise InputError(f"expected translation and rotation, or eight numbers, got {show(data)}")
    placed = _Placed.model_validate(data)
    if len(placed.rotation) != 4:
        raise InputError(f"rotation: expected 4 numbers (w, x, y, z), got {len(placed.rotation)}")
    return as_pose(from_rotation_translation(np.array(placed.rotation), np.array(placed.translation)), "pose")


Pose = Annotated[Array, PlainValidator(_pose)]
Axis = Annotated[str, one_of("attached direction", lambda: AXES)]


class EnvironmentEntity(_Open):
    """Version 3: a frame that stands still in the world."""

    name: Text
    pose: Pose
    attached_direction: Axis = "k_"


class RobotEntity(_Open):
    """Version 3: a frame on a joint of the robot."""

    name: Text
    robot_index: int
    joint_index: int
    offset: Pose
    attached_direction: Axis = "k_"


class VfiFile(_Open):
    """The whole file, of either version."""

    vfi_file_version: int = 2
    zero_indexed: bool = True
    metadata: Any = None
    robots: Any = None
    environment_entities: Annotated[list[EnvironmentEntity], list_of(EnvironmentEntity)] = Field(default_factory=list)
    robot_entities: Annotated[list[RobotEntity], list_of(RobotEntity)] = Field(default_factory=list)
    vfi_array: Annotated[list[Vfi], list_of(Annotated[Vfi, PlainValidator(_item)])]


def read_vfi_file(path: str) -> tuple[VfiFile, list[str]]:
    """A configuration file, and where each item of its `vfi_array` stands, as file:line.

    Raises
    ------
    FileError : everything that is wrong with the file, a line each, with file and line.
    """
    document = read(path)
    data = document.data
    version = data.get("vfi_file_version", 2) if isinstance(data, dict) else None
    if version not in (2, 3):
        got = "no keys and values" if version is None else show(version)
        text = f"expected a VFI configuration with vfi_file_version 2 or 3, got {got}; older ones have another form"
        refuse([*document.problems, Problem(document.mark(("vfi_file_version",)), ("vfi_file_version",), text)])
    file = validate(VfiFile, document, {"version": [str(version)]})
    tags: dict[str, int] = {}
    repeated = [
        Problem(document.mark(("vfi_array", i, "tag")), (), f'tag "{v.tag}" is taken; give every VFI its own')
        for i, v in enumerate(file.vfi_array)
        if tags.setdefault(v.tag, i) != i
    ]
    if repeated:
        refuse(repeated)
    return file, [str(document.mark(("vfi_array", i))) for i in range(len(file.vfi_array))]
