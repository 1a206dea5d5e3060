"""The potential's gain and range: a hand leads the tip of the LWR4+ onto a ball, slowly; and pushes it all at once."""

from dataclasses import replace

import numpy as np

from admittance import TABLE_1, Admittance, Region, ScriptedHand, SpringHand
from admittance.hand import Hand
from docs.tables.point import millimetres
from primitives import Point, PointCloud
from primitives import dual_quaternion as dq
from primitives.checks import Array
from scenarios.anatomy import Ellipsoid
from scenarios.robots import robots

NAME = "potential"
CASES = ((0.003, 0.0115), (0.01, 0.0115), (0.03, 0.0115), (0.1, 0.0115), (0.01, 0.006), (0.01, 0.020))
"""k in J, d_0 in m."""
D_C, GAP = 0.0035, 0.027
"""Radius of the spheres, and from the tip to the ball's spheres at the start, m."""
HEAD = (
    "$k$, J",
    "$d_0$, mm",
    "1 N is felt at, mm",
    "rests under 15 N at, mm",
    "smallest, step of 20 N, mm",
    "the same, `robust`, mm",
)
START = np.radians([20.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0])


def _admittance(k: float, d_0: float, integrator: str) -> tuple[Admittance, Array]:
    """The admittance with a ball below the tip, and the direction (3,) of the shaft."""
    robot = robots["lwr4plus"].build()
    arm = robot.kinematics(START)
    tip, shaft = arm.translation("tip"), arm.rotation("tip")[:, 2]
    radius, upright = 0.02, np.array([1.0, 0.0, 0.0, 0.0])
    middle = dq.from_rotation_translation(upright, tip + (radius + D_C + GAP) * shaft)
    cloud: PointCloud = Ellipsoid(np.full(3, radius), pose=middle).cloud(D_C)
    ball = Region("ball", cloud, Point.at([0.0, 0.0, 0.0], frame="tip"), pose=cloud.pose)
    parameters = replace(TABLE_1, k=k, d_0=d_0)
    return Admittance(
        robot, port=tip - 0.13 * shaft, start=START, parameters=parameters, regions=[ball], integrator=integrator
    ), shaft


def _lead(admittance: Admittance, hand: Hand, seconds: float) -> tuple[Array, Array]:
    """Clearance in metres and repulsion in newtons of every cycle; a tip that is inside ends the run."""
    handle, velocity, clearance, repulsion = admittance.handle, np.zeros(3), [], []
    for n in range(1, round(seconds / admittance.period) + 1):
        t = n * admittance.period
        motion = admittance.step(t, hand.wrench(t, handle, velocity))
        handle, velocity = motion.handle, motion.handle_velocity
        record = admittance.ring[(admittance.cycles - 1) % len(admittance.ring)]
        clearance.append(motion.clearance)
        repulsion.append(np.linalg.norm(record[admittance.columns["repulsion"]][:3]))
        if motion.clearance <= 0.0:
            break
    return np.array(clearance), np.array(repulsion)


def rows() -> list[tuple[str, ...]]:
    """One row for each pair of gain and range."""
    out = []
    for k, d_0 in CASES:
        admittance, shaft = _admittance(k, d_0, "robust")
        top = admittance.handle
        slow = SpringHand([0.0, 6.0], np.array([top, top + 0.1 * shaft]), stiffness=300.0, damping=20.0, most=15.0)
        clearance, repulsion = _lead(admittance, slow, 10.0)
        felt = clearance[int(np.argmax(repulsion >= 1.0))]
        smallest = []
        for integrator in ("semi-implicit", "robust"):
            pushed, shaft = _admittance(k, d_0, integrator)
            push = ScriptedHand([0.0], np.array([[*(20.0 * shaft), 0.0, 0.0, 0.0]]))
            smallest.append(millimetres(_lead(pushed, push, 3.0)[0].min(), 2))
        out.append((f"{k:g}", f"{d_0 * 1e3:g}", millimetres(felt, 2), millimetres(clearance[-1], 2), *smallest))
    return out
