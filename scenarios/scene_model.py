"""What a scene file may hold: models of its keys, and a scene as plain data."""

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, Field, PlainValidator, TypeAdapter, ValidationInfo

from primitives.errors import InputError
from primitives.files.fields import (
    Numbers,
    Positive,
    Text,
    Vector,
    check_text,
    list_of,
    one_of,
    one_or_list_of,
    refers_to,
)
from primitives.files.model import FileModel, show
from primitives.spec import ConstraintsField, constraints_data
from scenarios.robots import robots
from scenarios.scene import COORDINATIONS, Scene, check_duration, check_name
from scenarios.trajectory import PoseTrajectory, Waypoint
from vfi.tasks import PoseTask

_T = TypeVar("_T")


def _alone(items: list[_T]) -> _T | tuple[_T, ...]:
    """One item itself, several as a tuple."""
    return items[0] if len(items) == 1 else tuple(items)


class _WaypointModel(FileModel):
    position: Vector
    rotation: Vector = Field(default=[0.0, 0.0, 0.0])


def _some(value: list[_WaypointModel]) -> list[_WaypointModel]:
    if not value:
        raise InputError("expected at least one waypoint, got none")
    return value


class _ReferenceModel(FileModel):
    waypoints: Annotated[list[_WaypointModel], list_of(_WaypointModel), AfterValidator(_some)]
    segment: Positive

    def build(self) -> PoseTrajectory:
        """The trajectory that is declared."""
        waypoints = (Waypoint(_triple(w.position), _triple(w.rotation)) for w in self.waypoints)
        return PoseTrajectory(tuple(waypoints), self.segment)


def _weight(value: list[float]) -> list[float]:
    if len(value) != 8 or min(value) < 0.0:
        raise InputError(f"expected 8 numbers >= 0, got {value[:8]} ({len(value)} numbers)")
    return value


class _TaskModel(FileModel):
    frame: Annotated[Text, refers_to("frame")] | None = None
    gain: Positive = PoseTask.gain
    damping: Positive = PoseTask.damping
    weight: Annotated[Numbers, AfterValidator(_weight)] = [1.0] * 8


def _range(value: list[float]) -> list[float]:
    if len(value) != 2 or not value[0] < value[1]:
        raise InputError(f"expected two numbers, lower < upper, got {value[:2]} ({len(value)} numbers)")
    return value


def _start(value: list[float], info: ValidationInfo) -> list[float]:
    joints = (info.context or {}).get("joint")
    if joints is not None and len(value) != len(joints):
        first, last = joints[0], joints[-1]
        raise InputError(f"expected {len(joints)} numbers, one a joint from {first} to {last}, got {len(value)}")
    return value


def _duration(value: float, info: ValidationInfo) -> float:
    return check_duration(value, info.data["period"]) if "period" in info.data else value


Start = Annotated[Numbers, AfterValidator(_start)]
"""A number a joint, where the robot is known."""
Duration = Annotated[Positive, AfterValidator(_duration)]
"""Not too many of the periods that stand before it."""

_GAIN = TypeAdapter(Positive)
_GAINS = TypeAdapter(dict[Annotated[str, refers_to("constraint", "")], Positive])


def _eta(value: Any, info: ValidationInfo) -> float | Mapping[str, float]:
    if isinstance(value, dict):
        return _GAINS.validate_python(value, strict=True, context=info.context)
    if isinstance(value, str | list | None):
        raise InputError(f'expected a number, or a number a constraint with "" for the others, got {show(value)}')
    return _GAIN.validate_python(value, strict=True)


class SceneModel(FileModel):
    """The keys of a scene file, once those of its base are joined."""

    name: Annotated[Text, AfterValidator(check_name)]
    summary: Text
    robot: Annotated[str, one_of("robot", robots.names)]
    group: Annotated[Text, refers_to("joint group")]
    start: Start
    constraints: ConstraintsField
    enforce: list[Annotated[str, refers_to("constraint")]] | None = None
    task: Annotated[list[_TaskModel], one_or_list_of(_TaskModel)]
    reference: Annotated[list[_ReferenceModel], one_or_list_of(_ReferenceModel)]
    arms: list[Annotated[str, refers_to("joint group")]] = Field(default_factory=list)
    coordination: Annotated[str, one_of("coordination", lambda: COORDINATIONS)] = Scene.coordination
    period: Positive
    duration: Duration
    eta: Annotated[float | Mapping[str, float], PlainValidator(_eta)] = Scene.eta
    limit_eta: Positive = Scene.limit_eta
    limits: dict[Annotated[str, refers_to("joint")], Annotated[Numbers, AfterValidator(_range)]] = Field(
        default_factory=dict
    )

    def build(self) -> Scene:
        """The scene that the file declares; raises InputError."""
        return Scene(
            name=self.name,
            summary=self.summary,
            robot=self.robot,
            group=self.group,
            start=tuple(self.start),
            constraints=self.constraints if self.enforce is None else self.constraints.enforcing(self.enforce),
            task=_alone([PoseTask(t.frame, t.gain, t.damping, tuple(t.weight)) for t in self.task]),
            reference=_alone([reference.build() for reference in self.reference]),
            period=self.period,
            duration=self.duration,
            eta=self.eta,
            limit_eta=self.limit_eta,
            limits={joint: (low, high) for joint, (low, high) in self.limits.items()},
            arms=tuple(self.arms),
            coordination=self.coordination,
        )


def scene_data(scene: Scene) -> dict[str, Any]:
    """The scene as plain data, from which `SceneModel` builds an equal one; raises InputError."""
    eta = scene.eta
    return {
        "name": scene.name,
        "summary": check_text(scene.summary),
        "robot": scene.robot,
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
        "eta": {name: float(gain) for name, gain in eta.items()} if isinstance(eta, Mapping) else float(eta),
        "limit_eta": float(scene.limit_eta),
        "limits": {joint: _floats(limit) for joint, limit in scene.limits.items()},
        **({"arms": [check_text(arm) for arm in scene.arms], "coordination": scene.coordination} if scene.arms else {}),
    }


def _task_data(task: PoseTask) -> dict[str, Any]:
    return {
        **({"frame": check_text(task.frame)} if task.frame is not None else {}),
        "gain": float(task.gain),
        "damping": float(task.damping),
        "weight": _floats(task.weight),
    }


def _reference_data(reference: PoseTrajectory) -> dict[str, Any]:
    return {
        "waypoints": [{"position": _floats(w.position), "rotation": _floats(w.rotation)} for w in reference.waypoints],
        "segment": float(reference.segment),
    }


def _floats(values: ArrayLike) -> list[float]:
    return [float(v) for v in np.asarray(values).ravel()]


def _triple(value: list[float]) -> tuple[float, float, float]:
    x, y, z = value
    return x, y, z
