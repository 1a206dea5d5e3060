"""Constraints from a VFI configuration of Adorno-Lab's robot_constraint_manager, and what could not be carried over.

Their objects become elements: those of the environment stand where the file places them (version 3), or are moving
entities of the same name (version 2, where only the simulator knows their pose); those of the robot lie on the frame of
their joint with the offset of the file (version 3), or at the origin of a frame of the same name (version 2). A
segment kept on one side of a plane becomes its two ends. `vfi_gain` becomes eta: their rows act on squared distances,
d^2 - d_safe^2, so the two agree at the boundary, and theirs allow (d + d_safe) / (2 d) of our speed elsewhere.
"""

from collections.abc import Mapping, Sequence
from math import radians
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from primitives import dual_quaternion as dq
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Element, Line, Plane, Point
from primitives.errors import InputError
from primitives.files.yaml_file import write
from primitives.spec import constraints_data
from scenarios.imports.vfi_file import (
    AXES,
    DIRECTIONS,
    End,
    EnvironmentEntity,
    RobotEntity,
    Vfi,
    VfiFile,
    read_vfi_file,
)

PAIRS = {
    ("POINT", "POINT"): "",
    ("POINT", "LINE"): "",
    ("POINT", "PLANE"): "",
    ("LINE", "POINT"): "",
    ("LINE", "LINE"): "",
    ("LINE_ANGLE", "LINE_ANGLE"): "line_line_angle",
}
"""Our pair for the primitives of the robot and of the other side; empty for the one named after its elements."""


class Note(NamedTuple):
    """Something that was not carried over as it stands: where, of which constraint, and what became of it."""

    place: str
    tag: str
    text: str


class Imported(NamedTuple):
    """What came of a file.

    Attributes
    ----------
    constraints : those that could be carried over. eta : {constraint: 1/s}.
    left_out : what was not carried over. changed : what was, with another meaning or under a condition.
    """

    constraints: ConstraintSet
    eta: Mapping[str, float]
    left_out: Sequence[Note]
    changed: Sequence[Note]


class _NotCarriedError(Exception):
    """Why a VFI has no counterpart."""


def import_vfi(path: str | Path, *, frames: Sequence[str] | None = None, joint_frames: Sequence[str] = ()) -> Imported:
    """The constraints of a file of version 2 or 3.

    Parameters
    ----------
    frames : of the robot, e.g. `Robot.frames`; None for any.
    joint_frames : frame of each joint of theirs, in their order (version 3); default "frame1", "frame2", ..

    Raises
    ------
    FileError : everything that is wrong with the file, a line each, with file and line.
    """
    file, places = read_vfi_file(str(path))
    constraints: list[Constraint] = []
    eta: dict[str, float] = {}
    left_out, changed = [], _of_file(str(path), file.unknown(), file.vfi_file_version)

    places_of = _Places(file, frames, joint_frames)
    for vfi, place in zip(file.vfi_array, places, strict=True):
        try:
            made = _constraints(vfi, places_of)
        except (_NotCarriedError, InputError) as error:
            left_out.append(Note(place, vfi.tag, str(error)))
            continue
        constraints += made
        eta |= {c.name: vfi.vfi_gain for c in made}
        changed += [Note(place, vfi.tag, text) for text in _changes(vfi, file.vfi_file_version)]
    return Imported(ConstraintSet(constraints), eta, left_out, changed)


def _of_file(path: str, unknown: Sequence[str], version: int) -> list[Note]:
    notes = [Note(path, "", f'key "{key}" is unknown and was left out') for key in unknown]
    if version == 3:
        text = "offsets are from DQ Robotics' joint frames, the last with its end effector; check that ours are alike"
        notes.append(Note(path, "", text))
    return notes


def _constraints(vfi: Vfi, places: "_Places") -> list[Constraint]:
    first, second = vfi.ends()
    keep: Any = DIRECTIONS[vfi.direction]
    if first.primitive == "LINESEGMENT":
        if second.primitive != "PLANE" or len(first.names) != 3:
            raise _NotCarriedError(_no_pair(first, second))
        plane = places.element(_single(second), second)
        point = first._replace(primitive="POINT")
        ends = {f"{vfi.tag}-{word}": name for word, name in zip(("start", "end"), first.names[1:], strict=True)}
        return [Constraint(tag, places.element(n, point), plane, keep, vfi.safe_distance) for tag, n in ends.items()]
    if (first.primitive, second.primitive) not in PAIRS:
        raise _NotCarriedError(_no_pair(first, second))
    pair = PAIRS[first.primitive, second.primitive]
    a, b = (places.element(_single(end), end) for end in (first, second))
    return [Constraint(vfi.tag, a, b, keep, radians(vfi.safe_distance) if pair else vfi.safe_distance, pair)]


def _no_pair(first: End, second: End) -> str:
    return f"there is no pair for a {first.primitive} of the robot and a {second.primitive}"


def _single(end: End) -> str:
    if len(end.names) != 1:
        raise _NotCarriedError(f"expected one object for a {end.primitive}, got {', '.join(end.names) or 'none'}")
    return end.names[0]


class _Places:
    """Where the objects of a file are; see `import_vfi`."""

    def __init__(self, file: VfiFile, frames: Sequence[str] | None, joint_frames: Sequence[str]):
        self._entities: dict[str, EnvironmentEntity | RobotEntity] = {e.name: e for e in file.environment_entities}
        self._entities |= {e.name: e for e in file.robot_entities}
        self._placed, self._zero = file.vfi_file_version == 3, file.zero_indexed
        self._frames, self._joint_frames = frames, joint_frames

    def element(self, name: str, end: End) -> Element:
        """The primitive of one object of a side; raises _NotCarriedError where nothing is known of its place."""
        pose, axis = np.array([1.0, *[0.0] * 7]), AXES["k_"]
        where = {"frame": name} if end.on_robot else {"entity": name}
        if self._placed:
            entity = self._entities.get(name)
            if not isinstance(entity, RobotEntity if end.on_robot else EnvironmentEntity):
                raise _NotCarriedError(f'"{name}" is none of its {"robot" if end.on_robot else "environment"}_entities')
            axis = AXES[entity.attached_direction]
            pose = entity.offset if isinstance(entity, RobotEntity) else entity.pose
            where = {"frame": self._frame_of(entity.joint_index)} if isinstance(entity, RobotEntity) else {}
        self._check_frame(where.get("frame"))
        point, direction = dq.translation(pose), dq.rotation_matrix(pose) @ np.array(axis, dtype=float)
        if end.primitive == "POINT":
            return Point.at(point, **where)
        return (Plane if end.primitive == "PLANE" else Line).through(point, direction, **where)

    def _frame_of(self, joint: int) -> str:
        number = joint if self._zero else joint - 1
        if self._joint_frames and not 0 <= number < len(self._joint_frames):
            raise _NotCarriedError(f"joint {joint} has no frame among {', '.join(self._joint_frames)}")
        return self._joint_frames[number] if self._joint_frames else f"frame{number + 1}"

    def _check_frame(self, frame: str | None) -> None:
        if frame is None or self._frames is None or frame in self._frames:
            return
        hint = "" if self._placed else "its place on the joint is known to the simulator only; "
        raise _NotCarriedError(f'the robot has no frame "{frame}"; {hint}add one there with Robot.with_tool')


def _changes(vfi: Vfi, version: int) -> list[str]:
    """What of a VFI that was carried over has another meaning here, or none."""
    first, second = vfi.ends()
    out = [f'key "{key}" is unknown and was left out' for key in vfi.unknown()]
    if vfi.buffer > 0.0:
        out.append(f"buffer {vfi.buffer:g} was left out: constraints have no buffer zone; add it to safe_distance")
    if version == 2 and not second.on_robot:
        out.append(f'"{second.names[0]}" became a moving entity: its pose must come with every measurement')
    if version == 2:
        names = dict.fromkeys(n for end in (first, second) if end.on_robot for n in end.names[-2:])
        out.append(f"expects frames of the robot at: {', '.join(names)}; joint and robot index were left out")
    if first.primitive == "LINESEGMENT":
        out.append("became two constraints, one for each end of the segment")
    if vfi.vfi_type == "ROBOT_TO_ROBOT" and DIRECTIONS[vfi.direction] == "inside":
        out.append("keeps inside, as it says; their manager keeps such a VFI outside whatever it says")
    return out


def to_yaml(imported: Imported) -> str:
    """The constraints and their eta as the base of a scene file; raises InputError for what a file cannot hold."""
    eta = {name: float(value) for name, value in imported.eta.items()}
    return write({"constraints": constraints_data(imported.constraints), "enforcement": {"eta": eta}})
