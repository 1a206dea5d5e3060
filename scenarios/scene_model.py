"""What a scene file may hold: models of its keys, and a scene as plain data."""

from typing import Annotated, Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo, model_validator

from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.files.fields import (
    Numbers,
    Positive,
    Text,
    check_text,
    items,
    list_of,
    one_of,
    one_or_list_of,
    refers_to,
)
from primitives.files.joints import Configuration, Ranges, RangesField
from primitives.files.model import FileModel, gather
from primitives.files.quantities import Period, Position, Rate, Rotation, Span
from primitives.spec import Declared, DeclaredField, constraints_data
from scenarios.anatomy.model import AnatomyModel, anatomy_data
from scenarios.by_hand.model import GuideModel, JointParametersField, by_hand_data
from scenarios.enforcement import Enforcement, check_led_along
from scenarios.enforcement_model import EnforcementField, Seed, enforcement_data
from scenarios.own_robot_file import RobotField, robot_data
from scenarios.plants import PLANTS
from scenarios.pose_record import PoseRecord
from scenarios.scene import COORDINATIONS, NAME, Reference, Scene, check_duration, check_name
from scenarios.trajectory import PoseTrajectory, Waypoint
from vfi.tasks import PoseTask

_T = TypeVar("_T")


def _alone(several: list[_T]) -> _T | tuple[_T, ...]:
    """One item itself, several as a tuple."""
    return several[0] if len(several) == 1 else tuple(several)


class _WaypointModel(FileModel):
    declares = Waypoint
    position: Position
    rotation: Rotation = Field(default=[0.0, 0.0, 0.0])


def _some(value: list[_WaypointModel]) -> list[_WaypointModel]:
    if not value:
        raise InputError("expected at least one waypoint, got none")
    return value


class _ReferenceModel(FileModel):
    """Waypoints that are joined, or poses that were recorded.

    Attributes
    ----------
    segment : seconds from one waypoint to the next; not of a record.
    record : a CSV file of the scene's folder, with the header t,x,y,z,qw,qx,qy,qz: seconds, metres in the world, a unit
        quaternion with its scalar first.
    """

    declares = PoseTrajectory
    model_config = ConfigDict(json_schema_extra={"anyOf": [{"required": ["waypoints"]}, {"required": ["record"]}]})
    waypoints: Annotated[list[_WaypointModel], list_of(_WaypointModel), AfterValidator(_some), items(1)] | None = None
    segment: Span | None = None
    record: Text | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.build()
        return self

    def build(self) -> Reference:
        """The reference that is declared."""
        given = [name for name in ("waypoints", "record") if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError(f"expected waypoints or a record, got {' and '.join(given) or 'neither'}")
        if self.record is not None:
            if self.segment is not None:
                raise InputError("segment cannot go with a record, which has its own times; leave it out")
            return PoseRecord(self.record)
        if self.segment is None:
            raise InputError("waypoints need a segment, the seconds from one to the next")
        waypoints = (Waypoint(_triple(w.position), _triple(w.rotation)) for w in self.waypoints or [])
        return PoseTrajectory(tuple(waypoints), self.segment)


def _weight(value: list[float]) -> list[float]:
    if len(value) != 8 or min(value) < 0.0:
        raise InputError(f"expected 8 numbers >= 0, got {value[:8]} ({len(value)} numbers)")
    return value


class _TaskModel(FileModel):
    declares = PoseTask
    frame: Annotated[Text, refers_to("frame")] | None = None
    gain: Rate = PoseTask.gain
    damping: Positive = PoseTask.damping
    weight: Annotated[Numbers, AfterValidator(_weight), items(8, 8)] = [1.0] * 8


def _duration(value: float, info: ValidationInfo) -> float:
    return check_duration(value, info.data["period"]) if "period" in info.data else value


Duration = Annotated[Span, AfterValidator(_duration)]
"""Not too many of the periods that stand before it."""

PlantField = Annotated[str, one_of("plant", lambda: PLANTS)]


def _led_along(value: Enforcement, info: ValidationInfo) -> Enforcement:
    if "hand" in info.data:
        check_led_along(value, info.data["hand"] is not None)
    return value


def _limits(value: Ranges, info: ValidationInfo) -> Ranges:
    declared = info.data["constraints"].limits if "constraints" in info.data else {}
    gather(
        None, [((joint,), "joint_limits among the constraints limit it too") for joint in value if joint in declared]
    )
    return value


LimitsField = Annotated[RangesField, AfterValidator(_limits)]
"""Ranges of joints that the constraints before it do not limit."""


def chosen(declared: Declared, enforce: list[str] | None) -> ConstraintSet:
    """The constraints, of which those named are enforced; as they are declared where no list is given."""
    return declared.constraints if enforce is None else declared.constraints.enforcing(enforce)


SceneName = Annotated[Text, AfterValidator(check_name), Field(json_schema_extra={"pattern": f"^{NAME}$"})]


class SceneModel(FileModel):
    """The keys of a scene file, once those of its base are joined.

    Attributes
    ----------
    enforce : names of the constraints that are enforced, the others are watched; left out, as each declares.
    """

    declares = Scene
    name: SceneName
    summary: Text
    robot: RobotField
    group: Annotated[Text, refers_to("joint group")]
    start: Configuration
    constraints: DeclaredField
    enforce: list[Annotated[str, refers_to("constraint")]] | None = None
    task: Annotated[list[_TaskModel], one_or_list_of(_TaskModel)]
    reference: Annotated[list[_ReferenceModel], one_or_list_of(_ReferenceModel)]
    arms: list[Annotated[str, refers_to("joint group")]] = Field(default_factory=list)
    coordination: Annotated[str, one_of("coordination", lambda: COORDINATIONS)] = Scene.coordination
    period: Period
    duration: Duration
    limits: LimitsField = Field(default_factory=dict)
    anatomy: AnatomyModel | None = None
    hand: GuideModel | None = None
    admittance: JointParametersField | None = None
    enforcement: Annotated[EnforcementField, AfterValidator(_led_along)] = Scene.enforcement
    plant: PlantField = Scene.plant
    seed: Seed = Scene.seed

    def build(self) -> Scene:
        """The scene that the file declares; raises InputError."""
        return Scene(
            name=self.name,
            summary=self.summary,
            robot=self.robot,
            group=self.group,
            start=tuple(self.start),
            constraints=chosen(self.constraints, self.enforce),
            task=_alone([PoseTask(t.frame, t.gain, t.damping, tuple(t.weight)) for t in self.task]),
            reference=_alone([reference.build() for reference in self.reference]),
            period=self.period,
            duration=self.duration,
            anatomy=self.anatomy.build() if self.anatomy is not None else None,
            enforcement=self.enforcement,
            plant=self.plant,
            seed=self.seed,
            limits=self.constraints.limits | self.limits,
            hand=self.hand.build() if self.hand is not None else None,
            admittance=self.admittance,
            arms=tuple(self.arms),
            coordination=self.coordination,
        )


def scene_data(scene: Scene) -> dict[str, Any]:
    """The scene as plain data, from which `SceneModel` builds an equal one; raises InputError."""
    return {
        "name": scene.name,
        "summary": check_text(scene.summary),
        "robot": robot_data(scene.robot),
        "group": check_text(scene.group),
        "start": _floats(scene.start),
        "constraints": constraints_data(scene.constraints),
        "task": [_task_data(t) for t in scene.tasks] if isinstance(scene.task, tuple) else _task_data(scene.task),
        "reference": (
            [_reference_data(r) for r in scene.references]
            if isinstance(scene.reference, tuple)
            else _reference_data(scene.reference)
        ),
        "period": float(scene.period),
        "duration": float(scene.duration),
        **anatomy_data(scene.anatomy),
        **enforcement_data(scene.enforcement),
        "plant": scene.plant,
        "seed": scene.seed,
        "limits": {joint: _floats(limit) for joint, limit in scene.limits.items()},
        **(by_hand_data(scene.hand, scene.admittance) if scene.hand and scene.admittance else {}),
        **({"arms": [check_text(arm) for arm in scene.arms], "coordination": scene.coordination} if scene.arms else {}),
    }


def _task_data(task: PoseTask) -> dict[str, Any]:
    return {
        **({"frame": check_text(task.frame)} if task.frame is not None else {}),
        "gain": float(task.gain),
        "damping": float(task.damping),
        "weight": _floats(task.weight),
    }


def _reference_data(reference: Reference) -> dict[str, Any]:
    if isinstance(reference, PoseRecord):
        return {"record": reference.file}
    return {
        "waypoints": [{"position": _floats(w.position), "rotation": _floats(w.rotation)} for w in reference.waypoints],
        "segment": float(reference.segment),
    }


def _floats(values: ArrayLike) -> list[float]:
    return [float(v) for v in np.asarray(values).ravel()]


def _triple(value: list[float]) -> tuple[float, float, float]:
    x, y, z = value
    return x, y, z
