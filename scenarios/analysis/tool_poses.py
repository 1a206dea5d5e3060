"""Where the tool was: its shaft, and what of it a region keeps away, from the joints of a run."""

import numpy as np

from primitives.checks import Array
from primitives.constraint import Constraint
from primitives.kinematics import snapshot, world_first
from primitives.robot import Robot
from scenarios.analysis.trace import Trace
from scenarios.hands_on.scene import HandsOnScene


def _poses(robot: Robot, frame: str, q: Array) -> tuple[Array, Array]:
    """Rotations (k, 3, 3) and origins (k, 3) of a frame at configurations (k, n)."""
    frames = world_first((frame,))
    flat, place = robot.flat(frames), frames.index(frame)
    poses = np.array([snapshot(flat, frames, row).poses[place] for row in q])
    return poses[:, :9].reshape(-1, 3, 3), poses[:, 9:]


def shaft_lines(scene: HandsOnScene, robot: Robot, trace: Trace) -> tuple[Array, Array]:
    """(k, 3) ends and (k, 3) directions of the shaft as the plant had it after each cycle, world, metres."""
    rotations, ends = _poses(robot, scene.shaft, trace["plant_q"])
    return ends, rotations[:, :, 2]


def kept_away(constraint: Constraint, robot: Robot, q: Array) -> tuple[Array, Array]:
    """(k, 3) both ends, world, metres, of what of the tool a region keeps away; the same twice for a point."""
    rotations, origins = _poses(robot, constraint.first.frame, q)
    geometry = constraint.first.geometry
    starts = rotations @ geometry[:3] + origins
    return starts, starts + geometry[6] * (rotations @ geometry[3:6])
