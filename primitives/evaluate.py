"""The compiled loop over a table of constraints: distances, margins, rows and residuals of one snapshot.

`evaluate_rows` and `evaluate_margins` run over the arrays of `primitives.table` each cycle; `evaluate` is the same for
people.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.checks import Array, array, known
from primitives.compiled import compiled
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from primitives.intrinsics import call_pair, scratch
from primitives.kinematics import snapshot
from primitives.robot import Robot
from primitives.table import tabulate, used_entities, used_frames


class Entity(NamedTuple):
    """A moving entity as measured.

    Attributes
    ----------
    pose : (8,) unit dual quaternion in the world.
    twist : (6,) [linear; angular] of its origin, world axes, m/s and rad/s.
    """

    pose: ArrayLike
    twist: ArrayLike


class Evaluation(NamedTuple):
    """Constraints at one snapshot, m of them, n joints.

    Attributes
    ----------
    names : m names.
    distance, margin : (m,) metres or radians.
    jacobian : (m, n) of the margin.
    residual : (m,) the margin's rate of change by the entities' own motion and by the given joint velocities.
    status : (m,) `vectors.OK`, `DEGENERATE` or `IN_BAND`.
    """

    names: tuple[str, ...]
    distance: Array
    margin: Array
    jacobian: Array
    residual: Array
    status: np.ndarray


@compiled("void(float64[:,::1], int64, float64[:,::1], int64, float64[::1])")
def to_world(pose: Array, frame: int, geometry: Array, row: int, out: Array) -> None:
    """Geometry (8,) of an element in the world, from its local one and the pose of its frame."""
    for r in range(3):
        x, y, z = pose[frame, 3 * r], pose[frame, 3 * r + 1], pose[frame, 3 * r + 2]
        out[r] = pose[frame, 9 + r] + x * geometry[row, 0] + y * geometry[row, 1] + z * geometry[row, 2]
        out[3 + r] = x * geometry[row, 3] + y * geometry[row, 4] + z * geometry[row, 5]
    out[6] = geometry[row, 6]
    out[7] = geometry[row, 7]


@compiled("void(float64[::1], float64[::1], int64, float64[:,::1], int64, float64[::1])")
def to_covector(world: Array, gradient: Array, part: int, pose: Array, frame: int, out: Array) -> None:
    """Derivative (6,) of a distance with respect to the twist of a frame, from its gradient for one element.

    With p' = v + w x (p - o) and l' = w x l: [g_p; (p - o) x g_p + l x g_l].
    """
    a, b, c = world[0] - pose[frame, 9], world[1] - pose[frame, 10], world[2] - pose[frame, 11]
    x, y, z = gradient[part], gradient[part + 1], gradient[part + 2]
    u, v, w = gradient[part + 3], gradient[part + 4], gradient[part + 5]
    out[0] = x
    out[1] = y
    out[2] = z
    out[3] = b * z - c * y + world[4] * w - world[5] * v
    out[4] = c * x - a * z + world[5] * u - world[3] * w
    out[5] = a * y - b * x + world[3] * v - world[4] * u


@compiled(
    "void(int64[::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1],"
    "float64[::1], float64[::1], int64[::1])"
)
def evaluate_margins(
    address: np.ndarray,
    frame: np.ndarray,
    geometry: Array,
    side: Array,
    safe: Array,
    pose: Array,
    distance: Array,
    margin: Array,
    status: np.ndarray,
) -> None:
    """Fill distance, margin and status (m,) from the poses of all frames (F, 12); those of clouds stay as they are."""
    a, b, gradient = scratch(8), scratch(8), scratch(12)
    for i in range(address.shape[0]):
        if address[i] == 0:
            continue
        to_world(pose, frame[i, 0], geometry, 2 * i, a)
        to_world(pose, frame[i, 1], geometry, 2 * i + 1, b)
        distance[i], status[i] = call_pair(address[i], a, b, gradient)
        margin[i] = side[i] * (distance[i] - safe[i])


@compiled(
    "void(int64[::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1],"
    "float64[:,:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[:,::1], float64[::1],"
    "int64[::1])"
)
def evaluate_rows(
    address: np.ndarray,
    frame: np.ndarray,
    geometry: Array,
    side: Array,
    safe: Array,
    pose: Array,
    jacobian: Array,
    twist: Array,
    velocity: Array,
    distance: Array,
    margin: Array,
    row: Array,
    residual: Array,
    status: np.ndarray,
) -> None:
    """As `evaluate_margins`, and the margins' Jacobian row (m, n) and residual (m,).

    jacobian (F, 6, n) and twist (F, 6) are those of all frames: an entity has a twist and no Jacobian, a robot frame
    has a Jacobian and its twist is zero. velocity (n,) holds the velocities of the joints that are not decided.
    """
    n = velocity.shape[0]
    a, b, gradient, covector = scratch(8), scratch(8), scratch(12), scratch(6)
    for i in range(address.shape[0]):
        if address[i] == 0:
            continue
        to_world(pose, frame[i, 0], geometry, 2 * i, a)
        to_world(pose, frame[i, 1], geometry, 2 * i + 1, b)
        distance[i], status[i] = call_pair(address[i], a, b, gradient)
        margin[i] = side[i] * (distance[i] - safe[i])
        for j in range(n):
            row[i, j] = 0.0
        residual[i] = 0.0
        for part in range(2):
            f = frame[i, part]
            if f == 0:
                continue
            to_covector(a if part == 0 else b, gradient, 6 * part, pose, f, covector)
            for k in range(6):
                weight = side[i] * covector[k]
                residual[i] += weight * twist[f, k]
                for j in range(n):
                    row[i, j] += weight * jacobian[f, k, j]
        for j in range(n):
            residual[i] += row[i, j] * velocity[j]


def entity_arrays(entities: Mapping[str, Entity], names: tuple[str, ...]) -> tuple[Array, Array]:
    """Poses (E, 12) and twists (E, 6) of the named entities; raises InputError and UnknownNameError."""
    poses, twists = np.empty((len(names), 12)), np.empty((len(names), 6))
    for i, name in enumerate(names):
        measured = entities[known("entity", name, entities)]
        if not isinstance(measured, Entity):
            raise InputError(f'entity "{name}": expected an Entity(pose, twist), got {measured!r}')
        pose = conversions.as_pose(measured.pose, f'pose of entity "{name}"')
        poses[i, :9], poses[i, 9:] = dq.rotation_matrix(pose).ravel(), dq.translation(pose)
        twists[i] = array(measured.twist, (6,), f'twist of entity "{name}"')
    return poses, twists


def evaluate(
    robot: Robot,
    constraints: ConstraintSet,
    q: ArrayLike,
    *,
    velocity: ArrayLike | None = None,
    entities: Mapping[str, Entity] | None = None,
) -> Evaluation:
    """Distances, margins, Jacobians and residuals of constraints at q.

    Parameters
    ----------
    q : (n,) rad and m.
    velocity : (n,) joint velocities that count as given, e.g. those of the other arm; default zero.
    entities : pose and twist of every entity the constraints refer to.

    Raises
    ------
    InputError, UnknownNameError : values of another shape or not finite, unknown frames or entities.
    """
    frames, names = used_frames(constraints), used_entities(constraints)
    kinematics = snapshot(robot.flat(frames), frames, array(q, (robot.n,), "q"))
    given = np.zeros(robot.n) if velocity is None else array(velocity, (robot.n,), "velocity")
    poses, twists = entity_arrays(entities or {}, names)
    m, count = len(constraints), len(names)
    out = Evaluation(
        constraints.names, np.empty(m), np.empty(m), np.empty((m, robot.n)), np.empty(m), np.empty(m, dtype=np.int64)
    )
    table = tabulate(constraints, frames, names)
    evaluate_rows(
        *table[:5],
        np.concatenate([kinematics.poses, poses]),
        np.concatenate([kinematics.jacobians, np.zeros((count, 6, robot.n))]),
        np.concatenate([np.zeros((len(frames), 6)), twists]),
        given,
        *out[1:],
    )
    return out
