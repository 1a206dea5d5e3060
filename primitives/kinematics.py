"""Forward kinematics and geometric Jacobians of every frame of a tree of one-degree-of-freedom joints.

Poses are stored as twelve numbers, the rotation row by row and then the translation. Jacobians are [linear; angular]
in world axes at the frame's origin, dense (frames, 6, n); frame 0 is the world.
"""

from typing import NamedTuple

import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array, known
from primitives.compiled import compiled
from primitives.elements import WORLD


class FlatModel(NamedTuple):
    """A robot as arrays: joints in topological order, each about or along the z axis of its own frame.

    Attributes
    ----------
    parent : (n,) int64, index of the parent joint, -1 for the base.
    prismatic : (n,) int64, 1 where the joint translates.
    placement : (n, 12) pose of the joint frame at q = 0 in the parent joint's frame.
    frame_joint : (F,) int64, the joint each frame moves with, -1 for a fixed one; frame 0 is the world.
    frame_placement : (F, 12) pose of the frame in its joint's frame.
    """

    parent: np.ndarray
    prismatic: np.ndarray
    placement: Array
    frame_joint: np.ndarray
    frame_placement: Array


class Kinematics(NamedTuple):
    """One snapshot of a robot: poses and Jacobians of its named frames, all of one q.

    Attributes
    ----------
    q : (n,) rad and m.
    frames : F names; the first is "world".
    poses : (F, 12) rotation row by row, then translation in metres, in the world.
    jacobians : (F, 6, n) [linear; angular], world axes, at the frame's origin.
    """

    q: Array
    frames: tuple[str, ...]
    poses: Array
    jacobians: Array

    def place(self, frame: str) -> int:
        """Place of a frame in `poses` and `jacobians`; raises UnknownNameError."""
        return self.frames.index(known("frame", frame, self.frames))

    def rotation(self, frame: str) -> Array:
        """(3, 3) rotation from the frame to the world."""
        return self.poses[self.place(frame), :9].reshape(3, 3)

    def translation(self, frame: str) -> Array:
        """(3,) origin of the frame in the world, metres."""
        return self.poses[self.place(frame), 9:]

    def pose(self, frame: str) -> Array:
        """(8,) unit dual quaternion of the frame in the world."""
        return dq.from_matrix(np.ascontiguousarray(self.rotation(frame)), np.ascontiguousarray(self.translation(frame)))

    def jacobian(self, frame: str) -> Array:
        """(6, n) [linear; angular] of the frame's origin, world axes."""
        out: Array = self.jacobians[self.place(frame)]
        return out


@compiled("void(float64[:,::1], int64, float64[:,::1], int64, float64[:,::1], int64)")
def compose(a: Array, i: int, b: Array, j: int, out: Array, k: int) -> None:
    """Pose out[k] = a[i] b[j]; out[k] must not be one of the factors."""
    for r in range(3):
        x, y, z = a[i, 3 * r], a[i, 3 * r + 1], a[i, 3 * r + 2]
        for c in range(3):
            out[k, 3 * r + c] = x * b[j, c] + y * b[j, 3 + c] + z * b[j, 6 + c]
        out[k, 9 + r] = a[i, 9 + r] + x * b[j, 9] + y * b[j, 10] + z * b[j, 11]


@compiled(
    "void(int64[::1], int64[::1], float64[:,::1], int64[::1], float64[:,::1],"
    "float64[::1], float64[:,::1], float64[:,::1])"
)
def forward_kinematics(
    parent: np.ndarray,
    prismatic: np.ndarray,
    placement: Array,
    frame_joint: np.ndarray,
    frame_placement: Array,
    q: Array,
    joint_pose: Array,
    frame_pose: Array,
) -> None:
    """Fill joint_pose (n, 12) and frame_pose (at least F, 12) for a configuration q (n,)."""
    for j in range(parent.shape[0]):
        if parent[j] < 0:
            for k in range(12):
                joint_pose[j, k] = placement[j, k]
        else:
            compose(joint_pose, parent[j], placement, j, joint_pose, j)
        if prismatic[j]:
            for r in range(3):
                joint_pose[j, 9 + r] += q[j] * joint_pose[j, 3 * r + 2]
        else:
            c, s = np.cos(q[j]), np.sin(q[j])
            for r in range(3):
                x, y = joint_pose[j, 3 * r], joint_pose[j, 3 * r + 1]
                joint_pose[j, 3 * r] = c * x + s * y
                joint_pose[j, 3 * r + 1] = c * y - s * x
    for f in range(frame_joint.shape[0]):
        if frame_joint[f] < 0:
            for k in range(12):
                frame_pose[f, k] = frame_placement[f, k]
        else:
            compose(joint_pose, frame_joint[f], frame_placement, f, frame_pose, f)


@compiled("void(int64[::1], int64[::1], int64[::1], float64[:,::1], float64[:,::1], float64[:,:,::1])")
def frame_jacobians(
    parent: np.ndarray,
    prismatic: np.ndarray,
    frame_joint: np.ndarray,
    joint_pose: Array,
    frame_pose: Array,
    jacobian: Array,
) -> None:
    """Fill the columns of the joints that move each frame; the others of jacobian (F, 6, n) must be zero already."""
    for f in range(frame_joint.shape[0]):
        j = frame_joint[f]
        while j >= 0:
            x, y, z = joint_pose[j, 2], joint_pose[j, 5], joint_pose[j, 8]
            if prismatic[j]:
                jacobian[f, 0, j] = x
                jacobian[f, 1, j] = y
                jacobian[f, 2, j] = z
            else:
                a = frame_pose[f, 9] - joint_pose[j, 9]
                b = frame_pose[f, 10] - joint_pose[j, 10]
                c = frame_pose[f, 11] - joint_pose[j, 11]
                jacobian[f, 0, j] = y * c - z * b
                jacobian[f, 1, j] = z * a - x * c
                jacobian[f, 2, j] = x * b - y * a
                jacobian[f, 3, j] = x
                jacobian[f, 4, j] = y
                jacobian[f, 5, j] = z
            j = parent[j]


def snapshot(model: FlatModel, frames: tuple[str, ...], q: Array) -> Kinematics:
    """Kinematics of all frames of a flat model at q (n,)."""
    n, count = len(model.parent), len(model.frame_joint)
    joint_pose, frame_pose = np.empty((n, 12)), np.empty((count, 12))
    jacobian = np.zeros((count, 6, n))
    forward_kinematics(*model, q, joint_pose, frame_pose)
    frame_jacobians(model.parent, model.prismatic, model.frame_joint, joint_pose, frame_pose, jacobian)
    return Kinematics(q, frames, frame_pose, jacobian)


def world_first(frames: tuple[str, ...]) -> tuple[str, ...]:
    """The names with "world" in front, each once."""
    return (WORLD, *dict.fromkeys(f for f in frames if f != WORLD))
