"""Arms, clouds and runs that the tests of the admittance share. All clouds are analytic."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from admittance.controller import Admittance
from admittance.parameters import NEURO8, TABLE_1
from admittance.regions import Region
from primitives.elements import Point, Segment
from primitives.robot import Robot
from primitives.voxel_grid import VoxelGrid, build_grid
from scenarios.robots import robots

Array = NDArray[np.float64]

Q0 = np.radians([20.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0])
NEURO_Q0 = np.array([0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.15, 0.10])


class Covered(NamedTuple):
    """The least that a region needs of a cloud."""

    grid: VoxelGrid
    radius: float


def covered(points: Array, radius: float) -> Covered:
    return Covered(build_grid(points), radius)


def lwr4plus() -> Robot:
    return robots["lwr4plus"].build()


def neuro8() -> Robot:
    return robots["neuro8"].build()


def on_shaft(robot: Robot, q: Array, frame: str, back: float) -> Array:
    """A point of the shaft, metres back from its frame's origin."""
    k = robot.kinematics(q)
    return k.translation(frame) - back * k.rotation(frame)[:, 2]


def paper_port(robot: Robot) -> Array:
    """The port of paper A, moved by its rounding error onto the shaft."""
    k = robot.kinematics(Q0)
    n, p = k.rotation("tip")[:, 2], k.translation("tip")
    return p + n * (n @ (np.array([-0.6053, -0.2203, 0.0]) - p))


def below_tip(robot: Robot, gap: float, d_c: float = 0.0035) -> Covered:
    """One cloud point on the shaft's line, its sphere at a gap before the tip."""
    return covered(on_shaft(robot, Q0, "tip", -(gap + d_c))[None], d_c)


def plane_below_tip(
    robot: Robot, gap: float, d_c: float = 0.0035, spacing: float = 0.004, half: float = 0.04
) -> Covered:
    """A plane of points across the shaft's line, its spheres at a gap before the tip."""
    k = robot.kinematics(Q0)
    side = np.arange(-half, half + 1e-9, spacing)
    x, y = np.meshgrid(side, side)
    frame = k.rotation("tip")
    flat = np.outer(x.ravel(), frame[:, 0]) + np.outer(y.ravel(), frame[:, 1])
    return covered(flat + on_shaft(robot, Q0, "tip", -(gap + d_c)), d_c)


def bowl(center: Array, radius: float, spacing: float, opening: float = 1.2) -> Array:
    """Points of the lower part of a sphere, evenly (a spiral), polar angle from straight down up to `opening`, rad."""
    count = int(2.0 * np.pi * radius**2 * (1.0 - np.cos(opening)) / spacing**2)
    z = -1.0 + (np.arange(count) + 0.5) / count * (1.0 - np.cos(opening))
    angle = np.pi * (1.0 + 5.0**0.5) * np.arange(count)
    across = np.sqrt(1.0 - z * z)
    return center + radius * np.column_stack([across * np.cos(angle), across * np.sin(angle), z])


def tip_region(cloud: Covered, frame: str = "tip") -> Region:
    return Region("r", cloud, Point.at([0.0, 0.0, 0.0], frame=frame))


def tool_region(cloud: Covered, frame: str = "tip", length: float = 0.43, r: float = 0.0035) -> Region:
    return Region("r", cloud, Segment.between([0.0, 0.0, -length], [0.0, 0.0, 0.0], frame=frame), r)


def paper(**more: object) -> Admittance:
    robot = lwr4plus()
    return Admittance(robot, port=paper_port(robot), start=Q0, **{"parameters": TABLE_1, **more})


def neuro(**more: object) -> Admittance:
    robot = neuro8()
    port = on_shaft(robot, NEURO_Q0, "frame6", 0.045)
    return Admittance(robot, port=port, start=NEURO_Q0, shaft="frame6", **{"parameters": NEURO8, **more})


def column(a: Admittance, name: str) -> Array:
    """A quantity of all cycles so far, which the ring must still hold."""
    assert a.cycles <= len(a.ring)
    values = a.ring[: a.cycles, a.columns[name]]
    return values[:, 0] if values.shape[1] == 1 else values


def push(a: Admittance, wrench: Array, seconds: float) -> float:
    """Hold a wrench; returns the smallest clearance at and (8 times) between the samples."""
    steps, smallest = round(seconds / a.period), np.inf
    for _ in range(steps):
        m = a.step((a.cycles + 1) * a.period, wrench)
        smallest = min(smallest, m.clearance)
        if m.state >= 2:
            break
    return smallest
