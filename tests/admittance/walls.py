"""Constraints, arms and hands for the tests of the barrier on margins, and the same margins in plain NumPy."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from admittance.controller import Admittance
from admittance.parameters import NEURO8, TABLE_1, Parameters
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.kinematics import Kinematics
from primitives.robot import Robot
from scenarios.robots import robots
from scenarios.scene_file import load_any
from tests.admittance.cases import Q0, lwr4plus, on_shaft, paper_port

Array = NDArray[np.float64]

PAIR = robots["neuro8-pair"].build()
S5 = load_any("S5", None)
START = np.array(S5.start)
SHAFT = "moving/shaft"
ARM = range(8)
"""The moving arm's joints in q."""


def placed(element: Element, k: Kinematics) -> tuple[Array, Array, float]:
    """Point, direction and length of an element in the world."""
    p, l, length = element.geometry[:3], element.geometry[3:6], element.geometry[6]
    return k.rotation(element.frame) @ p + k.translation(element.frame), k.rotation(element.frame) @ l, length


def distance(c: Constraint, k: Kinematics) -> float:
    """Of a constraint's elements, by textbook formulas; of segments by a bounded least-squares solver."""
    (p, l, a), (r, s, b) = placed(c.first, k), placed(c.second, k)
    match c.definition.name:
        case "line_line":
            n = np.cross(l, s)
            return abs((p - r) @ n) / np.linalg.norm(n)
        case "line_line_angle":
            return np.arctan2(np.linalg.norm(np.cross(l, s)), l @ s)
        case "line_point":
            return np.linalg.norm(np.cross(r - p, l))
        case "point_line":
            return np.linalg.norm(np.cross(p - r, s))
        case "point_plane":
            return (p - r) @ s
        case "segment_segment":
            A = np.column_stack([l, -s])
            x = lsq_linear(A, r - p, ([0.0, 0.0], [a, b]), method="bvls", tol=1e-15).x
            return np.linalg.norm(A @ x + p - r)
    raise AssertionError(c.definition.name)


def margin(c: Constraint, k: Kinematics) -> float:
    d = distance(c, k)
    return d - c.safe_distance if c.keep == "outside" else c.safe_distance - d


def printed(m: float, k: float, d_0: float) -> float:
    """(9) with its square outside of the logarithm, the margin in the place of the clearance."""
    return 0.5 * k * np.log(1.0 / (1.0 - (1.0 - m / d_0) ** 2)) ** 2 if m < d_0 else 0.0


def reach(c: Constraint, parameters: Parameters) -> float:
    """Range of a constraint's barrier; what is kept inside a radius can have no larger margin than that."""
    full = parameters.d_0 if c.definition.unit == "m" else parameters.d_0_angle
    return min(full, c.safe_distance) if c.keep == "inside" else full


def potential(constraints: ConstraintSet, k: Kinematics, parameters: Parameters) -> float:
    """Of the enforced constraints, J."""
    return sum(printed(margin(c, k), parameters.k, reach(c, parameters)) for c in constraints if c.enforced)


def port_map(robot: Robot, q: Array, shaft: str, port: Array) -> Array:
    """Z_x (4, 6) of (15)."""
    k = robot.kinematics(q)
    out = np.zeros((4, 6))
    out[0, :3], out[1:, 3:] = k.rotation(shaft)[:, 2], np.eye(3)
    out[1:, :3] = np.cross(k.translation(shaft) - port, np.eye(3)).T
    return out


def free_map(q: Array, port: Array) -> Array:
    """Z (6, 8) of the moving arm: what turns torques of its joints into free forces; its wrist is beyond the shaft."""
    J = PAIR.kinematics(q).jacobian(SHAFT)[:, ARM]
    return np.vstack([port_map(PAIR, q, SHAFT, port) @ np.linalg.pinv(J).T, np.eye(8)[6:]])


Around = list[tuple[Kinematics, Kinematics]]


def around(robot: Robot, q: Array, joints: Sequence[int], h: float) -> Around:
    """The robot with each of these joints moved ahead and back by h."""
    steps = [h * np.eye(robot.n)[j] for j in joints]
    return [(robot.kinematics(q + e), robot.kinematics(q - e)) for e in steps]


def slope(value: Callable[[Kinematics], float], moved: Around, h: float) -> Array:
    """Derivative of a function of the configuration by the joints that were moved."""
    return np.array([(value(ahead) - value(behind)) / (2.0 * h) for ahead, behind in moved])


def pair(constraints: ConstraintSet = S5.constraints, back: float = 0.045, **more: object) -> Admittance:
    """The moving arm of S1-S5, its port on its shaft `back` metres from the shaft's end."""
    options = {"shaft": SHAFT, "group": "moving", "parameters": NEURO8, "start": START, **more}
    port = on_shaft(PAIR, options["start"], SHAFT, back)
    return Admittance(PAIR, port=port, constraints=constraints, **options)


def paper_arm(constraints: ConstraintSet, **more: object) -> Admittance:
    """The LWR4+ of paper A."""
    robot = lwr4plus()
    options = {"parameters": TABLE_1, "start": Q0, **more}
    return Admittance(robot, port=paper_port(robot), constraints=constraints, **options)


def aimed(a: Admittance, port: Array, name: str, force: float) -> Array:
    """A wrench (6,) of a force at the handle, newtons, in the direction that moves the tool fastest against a wall."""
    q, k = a.q, a.robot.kinematics(a.q)
    joints = [a.robot.joints.index(j) for j in a.joints]
    Z_x = port_map(a.robot, q, a.shaft, port)
    c, moved = a.constraints[name], around(a.robot, q, joints, 1e-7)
    by_joints = slope(lambda k: margin(c, k), moved, 1e-7)
    row = Z_x @ np.linalg.pinv(k.jacobian(a.shaft)[:, joints]).T @ by_joints
    arm = a.handle - k.translation(a.shaft)
    at_handle = Z_x @ np.vstack([np.eye(3), np.cross(arm, np.eye(3)).T])
    f = -at_handle.T @ (row / np.array(a.parameters.D_c))
    return np.r_[force * f / max(float(np.linalg.norm(f)), 1e-12), 0.0, 0.0, 0.0]


def lean(a: Admittance, port: Array, name: str, force: float, seconds: float, ramp: float = 0.0) -> float:
    """Push against a wall, with a force that sets in at once or over `ramp` seconds; returns the smallest margin."""
    least = np.inf
    for k in range(round(seconds / a.period)):
        if k % 40 == 0:
            full = aimed(a, port, name, force)
        t = (a.cycles + 1) * a.period
        m = a.step(t, full * min(1.0, k * a.period / ramp if ramp else 1.0))
        least = min(least, m.margin[a.constraints.names.index(name)])
        if m.state >= 2:
            break
    return least


def walls(robot: Robot, q: Array, shaft: str, port: Array, gap: float, angle: float) -> ConstraintSet:
    """What the tool can be pushed at, each a gap (m, or an angle in rad) away: see the names."""
    k = robot.kinematics(q)
    tip, R = k.translation(shaft), k.rotation(shaft)
    x, y, n = R.T
    middle = 0.5 * (tip + port)
    end, axis = Point.at([0.0, 0.0, 0.0], frame=shaft), Line.z_axis(shaft)
    tool = Segment.between([0.0, 0.0, -1.2 * np.linalg.norm(tip - port)], [0.0, 0.0, 0.0], frame=shaft)
    other = middle + (gap + 0.004) * y
    return ConstraintSet(
        [
            Constraint("plane", end, Plane.through(tip + gap * n, -n), "outside", 0.0),
            Constraint("cylinder", end, Line.through(tip - 0.5 * gap * x, n + 0.2 * y), "inside", 1.5 * gap),
            Constraint("hole", axis, Point.at(tip - 0.5 * gap * x), "inside", 1.5 * gap),
            Constraint("shaft", tool, Segment.between(other - 0.05 * x, other + 0.1 * x), "outside", 0.004),
            Constraint("line", axis, Line.through(other, x + 0.3 * n), "outside", 0.004),
            Constraint(
                "cone", axis, Line.through(port, n + 0.1 * x), "inside", np.arctan(0.1) + angle, pair="line_line_angle"
            ),
        ]
    )
