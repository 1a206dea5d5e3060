"""`Robot`: a kinematic tree with named frames, limits and joint groups, read by Pinocchio and flattened to arrays."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.checks import Array, array, known
from primitives.dh import DHRow, model_from_dh
from primitives.elements import WORLD
from primitives.errors import InputError, ModelError
from primitives.flatten import flatten, frame_index, motion_axis
from primitives.kinematics import FlatModel, Kinematics, snapshot, world_first
from primitives.model_files import model_from_mjcf, model_from_urdf


class Limits(NamedTuple):
    """Limits of all joints (n,): positions in rad or m, and per second, and per second squared; infinite where none."""

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class Robot:
    """A tree of revolute, continuous and prismatic joints; q is one number a joint, in the order of `joints`.

    Make one with `from_urdf`, `from_mjcf`, `from_dh` or `assemble`; each `with_...` returns a changed copy.

    Attributes
    ----------
    name : shown to people.
    model : the Pinocchio model it was read from.
    limits : see `Limits`.
    groups : joints (names) that can be decided together; "all" is always there.
    tip : frame of the tool tip, the default of tasks.
    """

    name: str
    model: pin.Model
    limits: Limits
    groups: Mapping[str, tuple[str, ...]]
    tip: str

    @classmethod
    def from_model(cls, name: str, model: pin.Model, tip: str | None = None) -> Self:
        """A robot from a Pinocchio model.

        Raises
        ------
        ModelError : no joints, a joint of an unsupported type, a velocity limit of zero, a pose that is not finite,
            a frame "world" elsewhere than at the origin.
        UnknownNameError : tip is no frame of the model.
        """
        if model.njoints < 2:
            raise ModelError(f'robot "{name}" has no movable joint')
        model = pin.Model(model)
        _check_placements(model)
        for joint in range(1, model.njoints):
            motion_axis(model, joint)
        lower, upper = np.full(model.nv, -np.inf), np.full(model.nv, np.inf)
        for joint in range(1, model.njoints):
            j = model.joints[joint]
            if j.nq == 1:
                lower[j.idx_v], upper[j.idx_v] = model.lowerPositionLimit[j.idx_q], model.upperPositionLimit[j.idx_q]
        lower, upper = np.where(lower < -1e30, -np.inf, lower), np.where(upper > 1e30, np.inf, upper)
        velocity = np.where(np.abs(model.upperVelocityLimit) > 1e30, np.inf, model.upperVelocityLimit)
        limits = Limits(lower, upper, velocity, np.full(model.nv, np.inf))
        joints = tuple(model.names)[1:]
        robot = cls(name, model, limits, {"all": joints}, tip or model.frames[model.nframes - 1].name)
        robot._check_limits()
        known("frame", robot.tip, robot.frames)
        return robot

    @classmethod
    def from_urdf(cls, path: str | Path, *, tip: str | None = None, name: str | None = None) -> Self:
        """A robot from a URDF file; `tip` names the link or joint frame of the tool tip (default: the last link).

        Raises
        ------
        FileError : missing, or not a URDF.
        ModelError, UnknownNameError : see `from_model`.
        """
        return cls._from_file(path, tip, name, model_from_urdf)

    @classmethod
    def from_mjcf(cls, path: str | Path, *, tip: str | None = None, name: str | None = None) -> Self:
        """A robot from a MuJoCo XML file; q is MuJoCo's qpos, named bodies and sites become frames.

        `tip` names a body or a site (default: the last one). Errors as for `from_urdf`.
        """
        return cls._from_file(path, tip, name, model_from_mjcf)

    @classmethod
    def _from_file(cls, path: str | Path, tip: str | None, name: str | None, read: Callable[[Path], pin.Model]) -> Self:
        model = read(Path(path))
        return cls.from_model(name or model.name or Path(path).stem, model, tip)

    @classmethod
    def from_dh(
        cls,
        rows: Sequence[DHRow],
        *,
        convention: Literal["standard", "modified"] = "standard",
        name: str = "arm",
    ) -> Self:
        """A serial arm from a Denavit-Hartenberg table; frames "frame1".. follow the joints, the last one is the tip.

        Raises
        ------
        InputError : see `primitives.dh.model_from_dh`.
        """
        return cls.from_model(name, model_from_dh(rows, convention), f"frame{len(rows)}")

    @classmethod
    def assemble(cls, name: str, arms: Mapping[str, tuple["Robot", ArrayLike]]) -> Self:
        """Several arms as one tree: {prefix: (robot, pose of its base in the world)}.

        Joints, frames and groups get the prefix and a slash, e.g. "moving/tip"; each arm becomes a group under its
        prefix. The first arm's tip is the tip.

        Raises
        ------
        InputError : no arms, or a pose that is not a unit dual quaternion.
        """
        if not arms:
            raise InputError(f'robot "{name}": expected at least one arm, got none')
        model, groups, parts = pin.Model(), {}, []
        for prefix, (arm, base) in arms.items():
            pose = conversions.as_pose(base, f'base of arm "{prefix}"')
            branch = pin.Model(arm.model)
            for i in range(1, branch.njoints):
                branch.names[i] = f"{prefix}/{branch.names[i]}"
            for frame in (branch.frames[i] for i in range(1, branch.nframes)):
                # appendModel looks names up and fails where a link and a joint share one: the type sets them apart.
                mark = "" if frame.type == pin.FrameType.JOINT else f"{frame.type}:"
                frame.name = f"{mark}{prefix}/{frame.name}"
            placement = pin.SE3(dq.rotation_matrix(pose), dq.translation(pose))
            model = pin.appendModel(model, branch, 0, placement)
            groups[prefix] = tuple(f"{prefix}/{j}" for j in arm.joints)
            for group, joints in arm.groups.items():
                if group != "all":
                    groups[f"{prefix}/{group}"] = tuple(f"{prefix}/{j}" for j in joints)
            parts.append((prefix, arm))
        for frame in (model.frames[i] for i in range(1, model.nframes)):
            frame.name = frame.name.removeprefix(f"{frame.type}:")
        first, tool = parts[0]
        robot = cls.from_model(name, model, f"{first}/{tool.tip}")
        stacked = {f"{p}/{j}": [row[i] for row in a.limits] for p, a in parts for i, j in enumerate(a.joints)}
        limits = Limits(*np.array([stacked[j] for j in robot.joints]).T.copy())
        return replace(robot, limits=limits, groups={**robot.groups, **groups})

    @property
    def n(self) -> int:
        """Number of joints."""
        return int(self.model.nv)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of q."""
        return tuple(self.model.names)[1:]

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of all frames, "world" first."""
        return world_first(tuple(f.name for f in list(self.model.frames)[1:]))

    def with_tool(self, name: str, pose: ArrayLike, *, on: str | None = None) -> Self:
        """The robot with one more frame, its new tip.

        Parameters
        ----------
        name : of the new frame.
        pose : (8,) unit dual quaternion of the new frame in `on`, metres.
        on : frame that carries it; default the present tip.
        """
        carrier = known("frame", on or self.tip, self.frames)
        if name in self.frames:
            raise InputError(f'frame "{name}" is there already; known: {", ".join(self.frames)}')
        value = conversions.as_pose(pose, f'pose of tool "{name}"')
        model = pin.Model(self.model)
        base = model.frames[frame_index(model, carrier) if carrier != WORLD else 0]
        placement = base.placement * pin.SE3(dq.rotation_matrix(value), dq.translation(value))
        model.addFrame(pin.Frame(name, base.parentJoint, 0, placement, pin.FrameType.OP_FRAME))
        return replace(self, model=model, tip=name)

    def with_group(self, name: str, joints: Sequence[str]) -> Self:
        """The robot with one more named group of joints.

        Raises
        ------
        InputError : no joints, one of them twice, or the name "all", which is taken.
        UnknownNameError : an unknown joint.
        """
        if name == "all" or not joints or len(set(joints)) != len(joints):
            raise InputError(
                f'joint group "{name}": expected different joints under a name other than "all", got {list(joints)}'
            )
        return replace(self, groups={**self.groups, name: tuple(known("joint", j, self.joints) for j in joints)})

    def with_limits(
        self,
        *,
        lower: Any = None,
        upper: Any = None,
        velocity: Any = None,
        acceleration: Any = None,
    ) -> Self:
        """The robot with other limits: an array (n,) for all joints, or {joint: value} for some of them.

        Raises
        ------
        InputError : lower >= upper, or a velocity or acceleration <= 0; names the joint.
        """
        changed = []
        for field, value in zip(Limits._fields, (lower, upper, velocity, acceleration), strict=True):
            row = getattr(self.limits, field).copy()
            if isinstance(value, Mapping):
                for joint, limit in value.items():
                    i = self.joints.index(known("joint", joint, self.joints))
                    row[i] = array(limit, (), f'{field} limit of joint "{joint}"', finite=False)
            elif value is not None:
                row = array(value, (self.n,), f"{field} limits", finite=False)
            changed.append(row)
        robot = replace(self, limits=Limits(*changed))
        robot._check_limits()
        return robot

    def _check_limits(self) -> None:
        for i, joint in enumerate(self.joints):
            low, high, speed, acceleration = (float(row[i]) for row in self.limits)
            if not low < high:
                raise ModelError(f'joint "{joint}": expected lower < upper, got {low} and {high}')
            if not speed > 0.0 or not acceleration > 0.0:
                raise ModelError(
                    f'joint "{joint}": expected limits of velocity and acceleration > 0, got {speed} and '
                    f"{acceleration}; mend the robot's file"
                )

    def group(self, name: str) -> np.ndarray:
        """Indices (int64) into q of the joints of a group."""
        joints = self.groups[known("joint group", name, self.groups)]
        return np.array([self.joints.index(j) for j in joints], dtype=np.int64)

    def flat(self, frames: Sequence[str]) -> FlatModel:
        """Arrays for these frames, in this order, "world" first."""
        return flatten(self.model, world_first(tuple(known("frame", f, self.frames) for f in frames)))

    def configuration(self, q: ArrayLike) -> Array:
        """q (n,) as Pinocchio wants it: a continuous joint becomes its cosine and sine."""
        values, out = array(q, (self.n,), "q"), pin.neutral(self.model)
        for j in list(self.model.joints)[1:]:
            angle = values[j.idx_v]
            out[j.idx_q : j.idx_q + j.nq] = angle if j.nq == 1 else (np.cos(angle), np.sin(angle))
        return np.asarray(out, dtype=np.float64)

    def kinematics(self, q: ArrayLike) -> Kinematics:
        """Poses and Jacobians of every named frame at q (n,), rad and m.

        Raises
        ------
        InputError : q of another size, or not finite.
        """
        return snapshot(self.flat(self.frames), self.frames, array(q, (self.n,), "q"))


def _check_placements(model: pin.Model) -> None:
    for name, pose in zip(model.names, model.jointPlacements, strict=True):
        if not np.isfinite(pose.homogeneous).all():
            raise ModelError(f'joint "{name}": its placement is not finite; mend the robot\'s file')
    for frame in list(model.frames)[1:]:
        if not np.isfinite(frame.placement.homogeneous).all():
            raise ModelError(f'frame "{frame.name}": its placement is not finite; mend the robot\'s file')
        if frame.name == WORLD and (frame.parentJoint or not frame.placement.isIdentity(1e-12)):
            raise ModelError(f'frame "{WORLD}" is the fixed origin of everything; give this one another name')
