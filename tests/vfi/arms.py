"""Arms, constraints and closed loops for the tests of vfi, and what Pinocchio says of the same configurations."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from primitives import dual_quaternion as dq
from primitives.constraint import Constraint, ConstraintSet
from primitives.dh import DHRow
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.evaluate import Entity
from primitives.robot import Robot
from primitives.vectors import PARALLEL
from tests.primitives.pair_cases import CASES, sine
from vfi.controller import Controller
from vfi.messages import Command, Measurement

Array = NDArray[np.float64]
Long = NDArray[Any]

H = np.pi / 2
NEURO8 = [  # the arm of readings.md: modified Denavit-Hartenberg rows alpha, a, theta, d, range, speed
    DHRow("prismatic", -H, 0.0, H, 0.0, -0.06, 0.06, 0.05),
    DHRow("prismatic", H, 0.0, 0.0, 0.0, -0.06, 0.06, 0.05),
    DHRow("revolute", -H, 0.05, 0.0, 0.0, -H / 2, H / 2, 0.5),
    DHRow("revolute", H, 0.04, H, 0.0, -H / 2, H / 2, 0.5),
    DHRow("prismatic", H, 0.0, 0.0, 0.0, 0.15, 0.32, 0.05),
    DHRow("revolute", 0.0, 0.0, 0.0, 0.0, -np.pi, np.pi, 2.0),
    DHRow("revolute", -H, 0.0, -H, 0.0, -1.4, 1.4, 2.0),
    DHRow("revolute", H, 0.004, 0.0, 0.0, -1.4, 1.4, 2.0),
]
SEVEN = [  # seven revolute joints like those of the LWR4+: standard rows
    DHRow("revolute", alpha * H, 0.0, 0.0, d, -span, span, speed)
    for alpha, d, span, speed in (
        (1, 0.31, 2.9, 1.9),
        (-1, 0.0, 2.0, 1.9),
        (-1, 0.4, 2.9, 2.2),
        (1, 0.0, 2.0, 2.2),
        (1, 0.39, 2.9, 3.5),
        (-1, 0.0, 2.0, 3.2),
        (0, 0.508, 2.9, 3.2),
    )
]
BASES = {"moving": [-0.03, 0.0, 0.29], "parked": [0.03, 0.0, 0.29]}
MOVING = [-0.011, -0.001667, -0.110657, 0.0, 0.246754, 0.0, 0.15, 0.10]
PARKED = [0.002, -0.003645, 0.080471, 0.0, 0.26298, 0.0, 0.15, -0.10]
START = np.array(MOVING + PARKED)
"""Where the two arms of S1-S5 begin, as readings.md prints it."""


def pose(t: Sequence[float], rotation: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """(8,) pose of a translation and a rotation vector."""
    half = 0.5 * np.asarray(rotation, dtype=float)
    r = dq.exponential(np.r_[0.0, half, np.zeros(4)])[:4]
    return dq.from_rotation_translation(np.ascontiguousarray(r), np.array(t, dtype=float))


def neuro8() -> Robot:
    return Robot.from_dh(NEURO8, convention="modified", name="neuro8").with_tool(
        "tip", dq.product(pose([0.012, 0.0, 0.0]), pose([0.0, 0.0, 0.0], [0.0, H, 0.0]))
    )


def seven() -> Robot:
    return Robot.from_dh(SEVEN, name="seven")


def pair() -> Robot:
    """Two arms of eight joints side by side, "moving/..." and "parked/..."."""
    arm = neuro8()
    return Robot.assemble("pair", {name: (arm, pose(base)) for name, base in BASES.items()})


def paper_constraints(enforced: str = "C1 C2 C3 C4") -> ConstraintSet:
    """The four constraints of S1-S5, those not named being watched."""
    shaft, end = Line.z_axis("moving/frame6"), Point.at([0, 0, 0], frame="moving/frame6")
    axis = Line.through([0, 0, 0], [0, 0, 1])
    return ConstraintSet(
        [
            Constraint("C1", shaft, Line.z_axis("parked/frame6"), "outside", 0.005),
            Constraint("C2", shaft, Point.at([0, 0, 0]), "inside", 0.014),
            Constraint("C3", end, axis, "inside", 0.014),
            Constraint(
                "C4",
                Point.at([0, 0, 0], frame="moving/tip"),
                Plane.through([0, 0, -0.08], [0, 0, 1]),
                "outside",
                0.0,
            ),
        ]
    ).enforcing(enforced.split())


WAYPOINTS = (  # of S1-S5: position in mm and rotation vector, applied on the left of the first orientation
    ((2.931, -8.618, -60.532), (0.0, 0.0, 0.0)),
    ((2.931, 2.682, -65.532), (0.0, 0.0, 0.25)),
    ((2.931, -15.418, -68.532), (0.10, 0.0, 0.25)),
    ((2.931, -15.418, -84.0), (0.10, 0.0, 0.0)),
)


def paper_reference(robot: Robot) -> Callable[[float], Array]:
    """The tip's reference of S1-S5 as a function of time: 4 s of ScLERP for each segment, then rest."""
    first = np.ascontiguousarray(robot.kinematics(START).pose("moving/tip")[:4])
    poses = []
    for position, rotation in WAYPOINTS:
        r = dq.quaternion_product(np.ascontiguousarray(pose([0, 0, 0], rotation)[:4]), first)
        poses.append(dq.from_rotation_translation(r, 1e-3 * np.array(position)))

    def at(t: float) -> Array:
        i = min(int(t / 4.0), 3)
        return poses[3] if i == 3 else dq.sclerp(poses[i], poses[i + 1], t / 4.0 - i)

    return at


# What Pinocchio and other formulas say -------------------------------------------------------------------------------


class Oracle:
    """Margins of a constraint set by Pinocchio's kinematics and the distance formulas of the pairs' tests.

    Entities have poses (N, 8), or one pose (8,) for all configurations.
    """

    def __init__(self, robot: Robot, constraints: ConstraintSet):
        self.robot, self.constraints, self.data = robot, constraints, robot.model.createData()

    def frames(self, q: Array) -> dict[str, tuple[Array, Array]]:
        """Rotations (N, 3, 3) and origins (N, 3) of every frame at configurations (N, n)."""
        model, data = self.robot.model, self.data
        names = [f.name for f in model.frames]
        R, t = np.empty((len(q), len(names), 3, 3)), np.empty((len(q), len(names), 3))
        for k, row in enumerate(q):
            pin.framesForwardKinematics(model, data, self.robot.configuration(row))
            for i in range(len(names)):
                R[k, i], t[k, i] = data.oMf[i].rotation, data.oMf[i].translation
        out = {name: (R[:, i], t[:, i]) for i, name in enumerate(names)}
        out["world"] = (np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3)))
        return out

    def margins(self, q: Array, entities: Mapping[str, Array] | None = None) -> Long:
        """(N, m) margins in extended precision."""
        frames = self._all_frames(q, entities)
        out = np.empty((len(frames["world"][1]), len(self.constraints)), dtype=np.longdouble)
        for i, c in enumerate(self.constraints):
            first, second = (self._world(e, frames) for e in (c.first, c.second))
            distance = CASES[c.definition.name].distance(first, second)
            distance = np.abs(distance) if c.definition.name == "line_line" else distance
            out[:, i] = (1 if c.keep == "outside" else -1) * (distance - c.safe_distance)
        return out

    def sines(self, q: Array, entities: Mapping[str, Array] | None = None) -> Array:
        """(N, m) sine of the angle between two infinite lines, infinite for all other pairs."""
        frames = self._all_frames(q, entities)
        out = np.full((len(frames["world"][1]), len(self.constraints)), np.inf)
        for i, c in enumerate(self.constraints):
            if c.definition.name == "line_line":
                out[:, i] = sine(*(self._world(e, frames) for e in (c.first, c.second)))
        return out

    def near_parallel(self, q: Array, entities: Mapping[str, Array] | None = None) -> NDArray[np.bool_]:
        """(N, m) where two infinite lines are in, or nearly in, their declared band: their distance jumps there."""
        return self.sines(q, entities) < 1.001 * PARALLEL

    def _all_frames(self, q: Array, entities: Mapping[str, Array] | None) -> dict[str, tuple[Array, Array]]:
        q = np.atleast_2d(q)
        frames = self.frames(q)
        for name, poses in (entities or {}).items():
            rows = np.broadcast_to(poses, (len(q), 8))
            frames[f"entity {name}"] = (
                np.array([dq.rotation_matrix(np.array(x)) for x in rows]),
                np.array([dq.translation(np.array(x)) for x in rows]),
            )
        return frames

    @staticmethod
    def _world(element: Element, frames: Mapping[str, tuple[Array, Array]]) -> Array:
        R, t = frames[f"entity {element.entity}" if element.entity else element.frame]
        g = np.tile(element.geometry, (len(t), 1))
        g[:, :3] = t + np.einsum("nij,nj->ni", R, g[:, :3])
        g[:, 3:6] = np.einsum("nij,nj->ni", R, g[:, 3:6])
        return g


# Closed loops --------------------------------------------------------------------------------------------------------


class Run(NamedTuple):
    """A closed loop: q (N + 1, n) at the samples, commands, and the entities' poses at the samples, by name."""

    q: Array
    commands: list[Command]
    entities: dict[str, Array]

    @property
    def margins(self) -> Array:
        return np.array([np.asarray(c.margins) for c in self.commands])

    @property
    def qdot(self) -> Array:
        return np.array([c.qdot for c in self.commands])


class Mover(NamedTuple):
    """An entity that moves with a constant twist [linear; angular] about its origin."""

    start: Array
    twist: Array

    def at(self, t: float) -> Array:
        v, w = self.twist[:3], self.twist[3:]
        R = pin.exp3(w * t) @ dq.rotation_matrix(self.start)
        return dq.from_matrix(np.ascontiguousarray(R), dq.translation(self.start) + t * v)


def closed_loop(
    controller: Controller,
    q: Array,
    reference: Callable[[float], Array],
    cycles: int,
    *,
    others: Callable[[float], Array] | None = None,
    movers: Mapping[str, Mover] | None = None,
    begin: float = 0.0,
) -> Run:
    """The plant that does what it is told: q grows by T qdot; joints that are not decided move as `others` says."""
    T, decided = controller.period, controller.robot.group(controller.group)
    movers = movers or {}
    path, commands, poses = [np.array(q, dtype=float)], [], {name: [m.at(begin)] for name, m in movers.items()}
    for k in range(cycles):
        t = begin + k * T
        qdot = np.zeros(len(q)) if others is None else np.array(others(t))
        entities = {name: Entity(m.at(t), m.twist) for name, m in movers.items()}
        commands.append(controller.step(Measurement(t, path[-1], qdot, entities=entities), reference(t)))
        qdot[decided] = commands[-1].qdot
        path.append(path[-1] + T * qdot)
        for name, m in movers.items():
            poses[name].append(m.at(t + T))
    return Run(np.array(path), commands, {name: np.array(p) for name, p in poses.items()})


# Random scenes -------------------------------------------------------------------------------------------------------


def random_unit(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v))


def random_element(rng: np.random.Generator, kind: str, near: Array, reach: float, **on: Any) -> Element:
    """An element whose point lies within `reach` of `near`, in the coordinates of what it is attached to."""
    p, l = near + reach * rng.uniform(-1.0, 1.0, 3), random_unit(rng)
    match kind:
        case "point":
            return Point.at(p, **on)
        case "line":
            return Line.through(p, l, **on)
        case "plane":
            return Plane.through(p, l, **on)
        case _:
            return Segment.between(p, p + reach * rng.uniform(0.2, 2.0) * l, **on)


def random_constraints(
    rng: np.random.Generator,
    robot: Robot,
    q: Array,
    *,
    frames: Sequence[str],
    against: Sequence[Mapping[str, str]],
    count: int,
    reach: float,
    near: Array,
    margin: tuple[float, float],
    entities: Mapping[str, Array] | None = None,
) -> ConstraintSet:
    """Constraints of all pairs and both sides, between `frames` and `against`, whose margins at q lie in `margin`.

    margin is a share of the distance (keep outside) or of `reach` (keep inside).
    """
    out: list[Constraint] = []
    names = sorted(CASES)
    while len(out) < count:
        name = names[int(rng.integers(len(names)))]
        kinds = name.split("_")[:2]
        first = random_element(rng, kinds[0], np.zeros(3), 0.1 * reach, frame=str(rng.choice(frames)))
        on = against[int(rng.integers(len(against)))]
        second = random_element(rng, kinds[1], near if not on else np.zeros(3), reach, **on)
        trial = Constraint(f"c{len(out)}", first, second, "outside", 0.0, name)
        d = float(Oracle(robot, ConstraintSet([trial])).margins(q, entities)[0, 0])
        if d < 0.05 * reach:
            continue
        share = rng.uniform(*margin)
        if rng.random() < 0.5:
            out.append(Constraint(trial.name, first, second, "outside", d * (1.0 - share), name))
        else:
            out.append(Constraint(trial.name, first, second, "inside", max(d + share * reach, 0.0), name))
    return ConstraintSet(out)
