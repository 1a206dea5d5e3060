"""How our own cycle grows: with the rows, with the joints, with the arms; with the guard and without."""

from itertools import pairwise

import numpy as np

from primitives import Constraint, ConstraintSet, Line, Point, Robot
from primitives import dual_quaternion as dq
from scenarios.robots import robots
from tests.bench import problem
from tests.bench.harness import measure, statistics
from tests.primitives.arms import random_rows
from vfi import Controller, Measurement, PoseTask, State

ROWS, JOINTS = (4, 44, 200, 2000), (6, 7, 8, 16, 32)
STEPS = 1000
LOOP = 250
"""Cycles of one turn of the reference, 2 s."""
MARGIN = (0.002, 0.05)
"""Margins of the random constraints at the start, metres."""


def obstacles(robot, q, frames, count, rng):
    """Points on the arm kept away from points and lines of the world, in turn; all margins positive at q."""
    snapshot, out = robot.kinematics(q), []
    for i in range(count):
        frame = frames[rng.integers(len(frames))]
        local = rng.uniform(-0.02, 0.02, 3)
        at = snapshot.translation(frame) + dq.rotation_matrix(snapshot.pose(frame)) @ local
        away = rng.standard_normal(3)
        away *= rng.uniform(0.06, 0.3) / np.linalg.norm(away)
        safe = np.linalg.norm(away) - rng.uniform(*MARGIN)
        there = Point.at(at + away) if i % 2 else Line.through(at + away, np.cross(away, rng.standard_normal(3)))
        out.append(Constraint(f"random{i}", Point.at(local, frame=frame), there, "outside", float(safe)))
    return ConstraintSet(out)


class Loop:
    """A controller whose tool follows a closed path around its first configuration."""

    def __init__(self, name, robot, constraints, q, guard, group="all"):
        self.name, self.group, self.failures, self.held = f"{name}, guard {guard}", robot.group(group), 0, 0
        eta, limit_eta = problem.ETA, problem.LIMIT_ETA
        self.controller = Controller(
            robot,
            constraints,
            PoseTask(),
            period=problem.PERIOD,
            group=group,
            eta=eta,
            limit_eta=limit_eta,
            guard=guard,
        )
        self.q, self.velocity, self.k, self.t = np.array(q), np.zeros(robot.n), 0, 0.0
        self.rest = np.zeros(len(self.group))
        self.resolves, self.active = 0, 0
        amplitude = np.zeros(robot.n)
        amplitude[self.group] = np.where(robot.limits.velocity[self.group] < 0.1, 0.005, 0.05)
        phase = np.arange(robot.n)
        turns = 2.0 * np.pi * np.arange(LOOP)[:, None] / LOOP
        path = self.q + amplitude * (np.sin(turns + phase) - np.sin(phase))
        poses = np.array([robot.kinematics(x).pose(robot.tip) for x in path])
        for before, pose in pairwise(poses):
            pose *= 1.0 if before @ pose >= 0.0 else -1.0
        self.reference = poses

    def prepare(self):
        self.t += problem.PERIOD

    def step(self):
        self.command = self.controller.step(Measurement(self.t, self.q, self.velocity), self.reference[self.k % LOOP])
        return self.command.qdot

    def advance(self, qdot):
        controller = self.controller
        record = controller.ring[(controller.cycles - 1) % len(controller.ring)]
        self.resolves += int(record[controller.columns["resolves"]][0])
        self.active += int((self.command.multipliers.array > 0.0).sum())
        self.held += self.command.state is not State.RUN
        self.velocity = np.zeros_like(self.q)
        self.velocity[self.group] = qdot
        self.q = self.q + problem.PERIOD * self.velocity
        self.k += 1


def _by_rows():
    q, robot = np.array(problem.SCENE.start), problem.PAIR
    frames = [f for f in robot.frames if f in ("moving/shaft", "moving/frame7", "moving/frame8", "moving/tip")]
    for m in ROWS:
        more = obstacles(robot, q, frames, m - 4, np.random.default_rng(m))
        for guard in ("off", "act"):
            yield ("rows", m, guard), Loop(f"{m} rows", robot, problem.SCENE.constraints + more, q, guard, "moving")


def _by_joints():
    for n in JOINTS:
        robot, rng = Robot.from_dh(random_rows(n, n), name=f"chain{n}"), np.random.default_rng(n)
        q = rng.uniform(-0.5, 0.5, n)
        constraints = obstacles(robot, q, [f"frame{i}" for i in range(n - 2, n + 1)], 4, rng)
        for guard in ("off", "act"):
            yield ("joints", n, guard), Loop(f"{n} joints", robot, constraints, q, guard)


def _by_arms():
    start, apart = np.array(problem.SCENE.start), problem.SCENE.constraints
    alone = robots["neuro8"].build()
    four = obstacles(alone, problem.START, ["shaft", "tip"], 4, np.random.default_rng(1))
    for guard in ("off", "act"):
        yield ("arms", "1", guard), Loop("1 arm", alone, four, problem.START, guard)
        yield (
            ("arms", "2, one decided", guard),
            Loop("2 arms, one decided", problem.PAIR, apart, start, guard, "moving"),
        )
        yield ("arms", "2, both decided", guard), Loop("2 arms, both decided", problem.PAIR, apart, start, guard)


def growth(steps=STEPS):
    """Statistics by (what grows, how much, guard), with the mean numbers of active rows and of re-solves."""
    out = {}
    for family in (_by_rows, _by_joints, _by_arms):
        loops = dict(family())
        times = measure(list(loops.values()), steps)
        for key, loop in loops.items():
            cycles = loop.controller.cycles
            extra = {"active": round(loop.active / cycles, 2), "resolves": round(loop.resolves / cycles, 3)}
            found = {**statistics(times[loop.name]), **extra, "not_run": loop.held, "failures": loop.failures}
            out[key] = found
    return out
