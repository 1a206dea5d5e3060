"""A Pinocchio model as the flat arrays of `kinematics.FlatModel`."""

import re
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from primitives.checks import Array
from primitives.elements import WORLD
from primitives.errors import ModelError
from primitives.kinematics import FlatModel

_SUPPORTED = re.compile(r"JointModel((R|P|RUB)[XYZ]|(Revolute|RevoluteUnbounded|Prismatic)Unaligned)")
"""Pinocchio's types of one degree of freedom whose joint frame is exactly `jointPlacements`."""


def motion_axis(model: pin.Model, joint: int) -> tuple[bool, Array]:
    """Whether a joint is prismatic, and its axis (3,), of unit length, in its own frame.

    Raises
    ------
    ModelError : not revolute, continuous or prismatic, or an axis that is not of unit length; names the joint.
    """
    name, variable = model.names[joint], model.joints[joint]
    if not _SUPPORTED.fullmatch(variable.shortname()):
        raise ModelError(
            f'joint "{name}" is of type {variable.shortname().removeprefix("JointModel")}; revolute, continuous, '
            "prismatic and fixed joints are supported. Replace it by these, or fix it in the robot's file."
        )
    data = variable.createData()
    variable.calc(data, pin.neutral(model))
    subspace = np.asarray(data.S, dtype=np.float64).reshape(6)
    linear, angular = subspace[:3], subspace[3:]
    prismatic = bool(linear.any())
    axis = linear if prismatic else angular
    if not abs(axis @ axis - 1.0) < 1e-12:
        raise ModelError(f'joint "{name}": expected an axis of unit length, got {axis.tolist()}')
    return prismatic, axis


_BY_PREFERENCE = (
    pin.FrameType.BODY,
    pin.FrameType.OP_FRAME,
    pin.FrameType.JOINT,
    pin.FrameType.FIXED_JOINT,
    pin.FrameType.SENSOR,
)


def frame_index(model: pin.Model, name: str) -> int:
    """Index of the frame of that name; of several, a link comes before a tool or site, and these before a joint.

    Raises
    ------
    ModelError : there is none.
    """
    for kind in _BY_PREFERENCE:
        if model.existFrame(name, kind):
            return int(model.getFrameId(name, kind))
    raise ModelError(f'the model has no frame "{name}"')


def _to_z(axis: Array) -> Array:
    """Rotation (3, 3) whose third column is the axis; exactly a permutation for axes of the frame."""
    x = np.eye(3)[(int(np.argmax(np.abs(axis))) + 1) % 3]
    x = x - axis * (x @ axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _twelve(rotation: Array, translation: Array) -> Array:
    return np.concatenate([np.asarray(rotation).ravel(), translation])


def flatten(model: pin.Model, frames: Sequence[str]) -> FlatModel:
    """Joints of a model, each turned so that its axis is z, and the named frames ("world" first).

    Raises
    ------
    ModelError : a joint of an unsupported type, or an unknown frame.
    """
    n = model.njoints - 1
    prismatic, placement = np.zeros(n, dtype=np.int64), np.empty((n, 12))
    turned = [np.eye(3)]
    for joint in range(1, n + 1):
        slides, axis = motion_axis(model, joint)
        prismatic[joint - 1] = slides
        turned.append(_to_z(axis))
        before, here = turned[model.parents[joint]], model.jointPlacements[joint]
        placement[joint - 1] = _twelve(before.T @ here.rotation @ turned[joint], before.T @ here.translation)
    frame_joint = np.full(len(frames), -1, dtype=np.int64)
    frame_placement = np.tile(_twelve(np.eye(3), np.zeros(3)), (len(frames), 1))
    for i, name in enumerate(frames):
        if name == WORLD:
            continue
        frame = model.frames[frame_index(model, name)]
        before = turned[frame.parentJoint]
        frame_joint[i] = frame.parentJoint - 1
        frame_placement[i] = _twelve(before.T @ frame.placement.rotation, before.T @ frame.placement.translation)
    parents = np.array([model.parents[j] - 1 for j in range(1, n + 1)], dtype=np.int64)
    return FlatModel(parents, prismatic, placement, frame_joint, frame_placement)
