"""S5 as plain numbers, the same for every contender: where it starts, what it follows, what it must keep."""

import numpy as np

from primitives import dual_quaternion as dq
from primitives.evaluate import evaluate
from primitives.robot import Robot
from scenarios.robots import robots
from scenarios.robots.neuro8_pair import BASES
from scenarios.scene_file import load_scene

PERIOD = 0.008  # s

SCENE = load_scene("S5").with_changes(period=PERIOD)
PAIR = SCENE.build_robot()
MOVING, PARKED = PAIR.group("moving"), PAIR.group("parked")
START = np.array(SCENE.start)[MOVING]
"""(8,) of the moving arm, m and rad; the parked arm stays where it is."""
STILL = np.array(SCENE.start)[PARKED]
BASE = np.array(BASES["moving"])
"""(3,) base of the moving arm, world, metres."""
ALONE = Robot.assemble(
    "moving", {"moving": (robots["neuro8"].build(), dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), BASE))}
)
"""The moving arm without the parked one."""
LOWER, UPPER, SPEED = (limit[MOVING] for limit in PAIR.limits[:3])

_FIRST = PAIR.kinematics(SCENE.start)
CYCLES = round(SCENE.duration / PERIOD)
REFERENCE = SCENE.reference.sample(_FIRST.pose("moving/tip")[:4], PERIOD, CYCLES)
"""(cycles, 8) unit dual quaternions of the tip, of one sign."""
REFERENCE *= np.sign(REFERENCE @ _FIRST.pose("moving/tip"))[:, None]

PARKED_POINT = _FIRST.translation("parked/shaft")
PARKED_DIRECTION = dq.rotation_matrix(_FIRST.pose("parked/shaft"))[:, 2].copy()
ENTRY = np.zeros(3)
AXIS_POINT, AXIS = np.zeros(3), np.array([0.0, 0.0, 1.0])
FLOOR, NORMAL = np.array([0.0, 0.0, -0.08]), np.array([0.0, 0.0, 1.0])
APART, OPENING, RADIUS = (SCENE.constraints[name].safe_distance for name in ("C1", "C2", "C3"))
"""Safe distances of C1 (shafts), C2 (entry point) and C3 (cylinder), metres; that of C4 is 0."""

GAIN, DAMPING = SCENE.task.gain, SCENE.task.damping
ETA, LIMIT_ETA = float(SCENE.in_force.eta), SCENE.in_force.limit_eta


def both(q):
    """Joints of both arms (16,) from those of the moving one (8,)."""
    out = np.empty(16)
    out[MOVING], out[PARKED] = q, STILL
    return out


def rows(q):
    """Rows (4, 8) and margins (4,) of C1..C4 at q (8,) of the moving arm, by the project's own kernels."""
    found = evaluate(PAIR, SCENE.constraints, both(q))
    return found.jacobian[:, MOVING].copy(), found.margin


def tip_error(q, k):
    """Distance of the tip from its reference in cycle k, metres."""
    return float(np.linalg.norm(PAIR.kinematics(both(q)).translation("moving/tip") - dq.translation(REFERENCE[k])))
