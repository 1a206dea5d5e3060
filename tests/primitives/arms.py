"""Arms for the tests, each as a `Robot` and as the same table in DQ Robotics, and elements put on them."""

from typing import Any, NamedTuple

import numpy as np
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH
from numpy.typing import NDArray

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.dh import DHRow
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.pair import Pair
from primitives.robot import Robot

H = np.pi / 2
NEURO8 = [  # paper V's arm, modified Denavit-Hartenberg rows (alpha, a, theta, d); readings.md
    DHRow("prismatic", -H, 0, H, 0, -0.06, 0.06),
    DHRow("prismatic", H, 0, 0, 0, -0.06, 0.06),
    DHRow("revolute", -H, 0.05, 0, 0, -H / 2, H / 2),
    DHRow("revolute", H, 0.04, H, 0, -H / 2, H / 2),
    DHRow("prismatic", H, 0, 0, 0, 0.15, 0.32),
    DHRow("revolute", 0, 0, 0, 0, -np.pi, np.pi),
    DHRow("revolute", -H, 0, -H, 0, -1.4, 1.4),
    DHRow("revolute", H, 0.004, 0, 0, -1.4, 1.4),
]


def random_rows(n: int, seed: int) -> list[DHRow]:
    """A revolute chain of no special geometry, about a metre long."""
    rng = np.random.default_rng(seed)
    table = rng.uniform((-3, -0.2, -3, -0.2), (3, 0.2, 3, 0.2), (n, 4)).tolist()
    return [DHRow("revolute", alpha, a, theta, d, -2.8, 2.8) for alpha, a, theta, d in table]


class Arm(NamedTuple):
    """One table in both libraries; link i of `twin` is frame{i + 1} of `robot`."""

    robot: Robot
    twin: DQ_SerialManipulatorDH | DQ_SerialManipulatorMDH


def make(name: str, rows: list[DHRow], modified: bool) -> Arm:
    table = np.array([[r.theta, r.d, r.a, r.alpha, float(r.kind == "prismatic")] for r in rows]).T
    twin = (DQ_SerialManipulatorMDH if modified else DQ_SerialManipulatorDH)(table)
    return Arm(Robot.from_dh(rows, convention="modified" if modified else "standard", name=name), twin)


ARMS = {
    "neuro8": make("neuro8", NEURO8, True),
    "six": make("six", random_rows(6, 6), False),
    "eight": make("eight", random_rows(8, 8), False),
    "seven": make("seven", random_rows(7, 7), False),
}


def two_arms(first: str, second: str) -> Robot:
    """Both arms in one robot, 0.6 m apart; frames are called a/frame1.. and b/frame1.."""
    at = [dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), np.array([x, 0.0, 0.3])) for x in (-0.3, 0.3)]
    return Robot.assemble("two", {"a": (ARMS[first].robot, at[0]), "b": (ARMS[second].robot, at[1])})


def random_q(robot: Robot, rng: np.random.Generator) -> Array:
    return rng.uniform(robot.limits.lower, robot.limits.upper)


def element(kind: str, geometry: Array, **on: str) -> Element:
    """The element of a geometry (8,), attached to `frame` or `entity`."""
    point, direction = geometry[:3], geometry[3:6]
    match kind:
        case "point":
            return Point.at(point, **on)
        case "line":
            return Line.through(point, direction, **on)
        case "plane":
            return Plane.through(point, direction, **on)
        case _:
            return Segment.between(point, point + geometry[6] * direction, **on)


def to_world(R: Array, t: Array, g: NDArray[Any]) -> NDArray[Any]:
    """Geometries (N, 8) from frames with rotations R (N, 3, 3) and origins t (N, 3)."""
    out = g.copy()
    out[:, :3] = t + np.einsum("nij,nj->ni", R, g[:, :3])
    out[:, 3:6] = np.einsum("nij,nj->ni", R, g[:, 3:6])
    return out


def to_local(R: Array, t: Array, g: NDArray[Any]) -> NDArray[Any]:
    """Geometries (N, 8) of the world, seen from frames."""
    turned = R.transpose(0, 2, 1)
    return to_world(turned, -np.einsum("nij,nj->ni", turned, t), g)


def distances(pair: Pair, first: list[Element], second: list[Element]) -> ConstraintSet:
    """One constraint an element pair, whose margins are the distances themselves."""
    both = enumerate(zip(first, second, strict=True))
    return ConstraintSet(Constraint(f"c{i}", a, b, "outside", 0.0, pair.name) for i, (a, b) in both)
