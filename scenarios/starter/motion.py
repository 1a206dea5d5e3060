"""A first configuration for an arm, an entry port on its tool's axis, and a short motion through it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from primitives.checks import Array, array
from primitives.errors import InputError
from primitives.robot import Robot

SEED, SAMPLES = 0, 500
"""Of the configurations that are tried where the middle of the ranges is near a singularity."""
CONDITION = 30.0
"""Largest condition of the tip's Jacobian (positions over the arm's reach) that a start may have."""
TRIED = 0.5, 0.95
"""Shares of the joints' ranges in which they are drawn, one after the other."""
SHARE = 0.5
"""Of the way from the last joint to the tip at which the port lies."""
SHORTEST = 0.05
"""Metres between tip and port at least."""
TURN = 0.08
"""By which the shaft pivots about the port, rad."""
DEEP, AHEAD = 0.3, 0.6
"""How far the tip goes in, as a share of its distance from the port; and where on that way the plane lies."""
_STEPS = 60


class Motion(NamedTuple):
    """What a first scene is made of.

    Attributes
    ----------
    start : (n,) rad and m. port : (3,) p_c, world, metres, on the z axis of the tip. tip : (3,) where the tip starts.
    axis : (3,) along which the shaft points. plane : (3,) a point of the plane, whose normal is -axis.
    tool : metres from the last joint to the tip. positions, rotations : (k, 3) of the tip at the waypoints, metres,
        and rotation vectors in the world from the first orientation, rad. condition : of the tip's Jacobian.
    """

    start: Array
    port: Array
    tip: Array
    axis: Array
    plane: Array
    tool: float
    positions: Array
    rotations: Array
    condition: float


def first_motion(robot: Robot, start: ArrayLike | None = None) -> Motion:
    """A motion at a start (n,), or at one that is looked for: in, out, to one side about the port, and back.

    Raises
    ------
    InputError : a start of another size, outside the limits or near a singularity; or none that is not.
    """
    q = _found(robot) if start is None else _given(robot, start)
    kinematics = robot.kinematics(q)
    tip, rotation = kinematics.translation(robot.tip).copy(), kinematics.rotation(robot.tip)
    axis = rotation[:, 2].copy()
    tool = max(_tool_length(robot, q), SHORTEST)
    port = tip - max(SHARE * tool, SHORTEST) * axis
    depth = DEEP * float(np.linalg.norm(tip - port))
    aside = Rotation.from_rotvec(TURN * rotation[:, 0])
    wanted = [
        (tip, Rotation.identity()),
        (tip + depth * axis, Rotation.identity()),
        (port + aside.apply(tip - port), aside),
        (tip, Rotation.identity()),
    ]
    reached = [_reached(robot, q, position, turn) for position, turn in wanted]
    positions, rotations = (np.array([pose[k] for pose in reached]) for k in (0, 1))
    plane = tip + AHEAD * depth * axis
    return Motion(q, port, tip, axis, plane, tool, positions, rotations, condition(robot, q))


def condition(robot: Robot, q: Array) -> float:
    """Of the tip's Jacobian, positions divided by the tip's distance from the origin; infinite at a singularity."""
    kinematics = robot.kinematics(q)
    jacobian = kinematics.jacobian(robot.tip).copy()
    jacobian[:3] /= max(float(np.linalg.norm(kinematics.translation(robot.tip))), 1e-3)
    values = np.linalg.svd(jacobian, compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 1e-12 else np.inf


def _given(robot: Robot, start: ArrayLike) -> Array:
    q = array(start, (robot.n,), "start")
    outside = [j for j, x, a, b in zip(robot.joints, q, *robot.limits[:2], strict=True) if not a <= x <= b]
    if outside:
        raise InputError(f"start: outside the limits of {', '.join(outside)}; see the robot's file")
    if condition(robot, q) > CONDITION:
        raise InputError(
            f"start: near a singularity, the tip's Jacobian has the condition {condition(robot, q):.3g}, expected at "
            f"most {CONDITION:g}; leave the start out to have one looked for"
        )
    return q


def _found(robot: Robot) -> Array:
    """The middle of all ranges, or the best conditioned of many near it."""
    low, high = robot.limits.lower, robot.limits.upper
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    if condition(robot, middle) <= CONDITION:
        return np.asarray(middle)
    rng, best = np.random.default_rng(SEED), middle
    for share in TRIED:
        drawn = middle + share * rng.uniform(-1.0, 1.0, (SAMPLES, robot.n)) * half
        best = np.round(min(drawn, key=lambda q: condition(robot, q)), 3)
        if condition(robot, best) <= CONDITION:
            return np.asarray(best)
    tried = f"{len(TRIED) * SAMPLES} configurations (best {condition(robot, best):.3g})"
    raise InputError(
        f'robot "{robot.name}": the condition of the Jacobian of its tip is above {CONDITION:g} at all of {tried}; '
        "does every joint move the tip?"
    )


def _tool_length(robot: Robot, q: Array) -> float:
    """Metres from the last joint that moves the tip to the tip; 0 for a robot whose joints are no frames."""
    kinematics = robot.kinematics(q)
    moves = np.abs(kinematics.jacobian(robot.tip)).max(axis=0) > 0.0
    moving = [j for j, m in zip(robot.joints, moves, strict=True) if m and j in kinematics.frames]
    if not moving:
        return 0.0
    return float(np.linalg.norm(kinematics.translation(robot.tip) - kinematics.translation(moving[-1])))


def _reached(robot: Robot, q: Array, position: Array, turn: Rotation) -> tuple[Array, Array]:
    """Position and rotation vector, from the start, of the pose nearest to a wanted one that damped steps come to."""
    first = robot.kinematics(q).rotation(robot.tip)
    x = q.copy()
    for _ in range(_STEPS):
        kinematics = robot.kinematics(x)
        jacobian = kinematics.jacobian(robot.tip)
        here = Rotation.from_matrix(kinematics.rotation(robot.tip) @ first.T)
        error = np.r_[position - kinematics.translation(robot.tip), (turn * here.inv()).as_rotvec()]
        step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-8 * np.eye(6), error)
        x = np.clip(x + step, robot.limits.lower, robot.limits.upper)
    kinematics = robot.kinematics(x)
    turned = Rotation.from_matrix(kinematics.rotation(robot.tip) @ first.T).as_rotvec()
    return kinematics.translation(robot.tip).copy(), turned
