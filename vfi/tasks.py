"""Cost terms: what the tool should do as far as the constraints allow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from primitives import dual_quaternion as dq
from primitives.checks import Array, array, number
from primitives.compiled import compiled
from primitives.dual_jacobians import fill_pose_jacobian
from primitives.errors import InputError

POSE = 0
VELOCITY = 1
PROJECTION = 2


@dataclass(frozen=True)
class PoseTask:
    """Track a pose: |W (J v + gain x~)|^2 + damping |v|^2 with x~ = vec8(x - x_d); paper V, (6).

    The squares stand without a factor 1/2. The sign of x_d is chosen each cycle so that <x, x_d> >= 0.

    Parameters
    ----------
    frame : robot frame that is to follow; None for the robot's tip.
    gain : eta of the task, 1/s.
    damping : lambda, weight of the squared joint velocities (rad/s and m/s alike).
    weight : (8,) diagonal of W; ones weigh 4 mm of position as 0.23 deg.

    Raises
    ------
    InputError : a gain or damping that is not > 0, weights that are not eight numbers >= 0.
    """

    frame: str | None = None
    gain: float = 50.0
    damping: float = 1e-3
    weight: ArrayLike = (1.0,) * 8

    def __post_init__(self) -> None:
        number(self.gain, "gain of PoseTask", positive=True)
        number(self.damping, "damping of PoseTask", positive=True)
        if np.any(array(self.weight, (8,), "weight of PoseTask") < 0.0):
            raise InputError(f"weight of PoseTask: expected numbers >= 0, got {self.weight}")


@dataclass(frozen=True)
class VelocityTask:
    """Track joint velocities of the decided group: sum of weight (v - v_ref)^2.

    Parameters
    ----------
    weight : one number for all joints, or (d,), all > 0.
    """

    weight: ArrayLike = 1.0

    def __post_init__(self) -> None:
        shape = () if np.isscalar(self.weight) else (None,)
        if np.any(array(self.weight, shape, "weight of VelocityTask") <= 0.0):
            raise InputError(f"weight of VelocityTask: expected numbers > 0, got {self.weight}")


@dataclass(frozen=True)
class ProjectionTask:
    """Stay nearest to a reference in free coordinates: |y - v_ref|^2 in a metric, with q̇ = basis y + offset.

    The reference of each cycle is a `vfi.messages.FreeReference`, e.g. what a target admittance proposes. With its
    metric M + T D the projection is passive (see `vfi.energy`); no damping is added, for that would not be.

    Parameters
    ----------
    coordinates : m, how many free coordinates there are.
    """

    coordinates: int

    def __post_init__(self) -> None:
        count = number(self.coordinates, "coordinates of ProjectionTask", low=1)
        if count != int(count):
            raise InputError(f"coordinates of ProjectionTask: expected a whole number, got {count:g}")


Task = PoseTask | VelocityTask | ProjectionTask | Sequence[PoseTask]
"""What a controller takes. Several pose tasks, each of a frame of its own, add up; their dampings are the same."""


@compiled("float64(float64[::1])")
def unit_defect(x: Array) -> float:
    """How far x (8,) is from a unit dual quaternion: the larger of | |P|^2 - 1 | and |<P, D>|."""
    square, mixed = 0.0, 0.0
    for i in range(4):
        square += x[i] * x[i]
        mixed += x[i] * x[4 + i]
    return max(abs(square - 1.0), abs(mixed))


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], int64[::1], float64,"
    "float64[:,::1], float64[::1], float64[:,::1], float64[::1])"
)
def fill_pose_task(
    x: Array,
    jacobian: Array,
    reference: Array,
    weight: Array,
    given: Array,
    decided: np.ndarray,
    gain: float,
    J: Array,
    error: Array,
    task: Array,
    target: Array,
) -> None:
    """Task matrix (8, d) and target (8,) of |task v + target|: W J and W (gain x~ + J given); error is x~ itself.

    x, jacobian (6, n) and J (8, n) are the pose of the task's frame, its geometric and its dual quaternion Jacobian.
    """
    fill_pose_jacobian(x, jacobian, J)
    sign = dq.sign_towards(reference, x)
    for i in range(8):
        error[i] = x[i] - sign * reference[i]
        target[i] = gain * error[i]
        for j in range(given.shape[0]):
            target[i] += J[i, j] * given[j]
        target[i] *= weight[i]
        for j in range(decided.shape[0]):
            task[i, j] = weight[i] * J[i, decided[j]]


@compiled("void(float64[::1], float64[::1], float64[:,::1], float64[::1])")
def fill_velocity_task(reference: Array, weight: Array, task: Array, target: Array) -> None:
    """Task matrix (d, d) and target (d,) of |task v + target|, the roots of the weights on the diagonal."""
    task[:, :] = 0.0
    for j in range(reference.shape[0]):
        root = np.sqrt(weight[j])
        task[j, j] = root
        target[j] = -root * reference[j]


@compiled("void(float64[:,::1], float64[::1], float64, float64[:,::1], float64[::1])")
def fill_cost(task: Array, target: Array, damping: float, H: Array, g: Array) -> None:
    """H = task^T task + damping I and g = task^T target, half of the squares that the tasks name."""
    rows, n = task.shape
    H[:, :] = 0.0
    g[:] = 0.0
    for k in range(rows):
        for i in range(n):
            value = task[k, i]
            g[i] += value * target[k]
            for j in range(n):
                H[i, j] += value * task[k, j]
    for i in range(n):
        H[i, i] += damping
