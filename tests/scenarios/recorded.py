"""Programs recorded from runs of the project's own scenes, and what each back end makes of them.

``python -m tests.scenarios.recorded 10000`` prints the table of docs/solvers.md.
"""

import sys
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np

from primitives import active_set
from primitives.errors import SolverError
from scenarios.enforcement import chosen
from scenarios.plants.kinematic import KinematicPlant
from scenarios.run import build
from scenarios.scene_file import load_scene
from vfi.backends import solvers
from vfi.qp import QP, SolverStatus

KINDS = {"easy": 1e-3, "nearly degenerate": 1e-8}
"""Damping lambda of the task: at 1e-8 the Hessian's condition is 1e8 or so."""


class Record(NamedTuple):
    """A program and the scene's kind that it comes from."""

    kind: str
    qp: QP


class Verdict(NamedTuple):
    """One back end on one kind: failures, worst row violation (m/s), worst and median distance from the kernel, us."""

    count: int
    failures: int
    violation: float
    cost: float
    distance: float
    median_us: float
    worst_us: float


def record(count):
    """About `count` programs, S2-S5 in equal parts, both kinds, at 8 ms."""
    out = []
    for kind, damping in KINDS.items():
        for name in ("S2", "S3", "S4", "S5"):
            scene = load_scene(name)
            scene = scene.with_changes(task=type(scene.task)(scene.task.frame, scene.task.gain, damping))
            out += [Record(kind, qp) for qp in _programs(scene, count // 8)]
    return out


def _programs(scene, count):
    cycles = round(scene.duration / scene.period)
    controller = build(chosen(scene, guard="off"), solver="active-set")
    robot, start = controller.robot, np.array(scene.start)
    plant = KinematicPlant(start, robot.group(scene.group), scene.period)
    first = robot.kinematics(start).pose(scene.task.frame)[:4]
    reference = scene.reference.sample(first, scene.period, cycles)
    kept, measurement = set(np.linspace(0, cycles - 1, min(count, cycles)).astype(int)), plant.reset()
    for k in range(cycles):
        measurement = plant.step(controller.step(measurement, reference[k]))
        if k in kept:
            yield QP(*(block.copy() for block in controller.qp))


def kernel(qp):
    """The active-set kernel's answer, from a cold start."""
    m, n = qp.A.shape
    x, work = np.zeros(n), np.zeros((active_set.work_rows(n), n))
    active, mask = np.zeros(n + 2, dtype=np.int64), np.zeros(m + 2 * n, dtype=np.int64)
    status = active_set.solve(
        qp.H, qp.g, qp.A, qp.b, qp.low, qp.high, x, np.zeros(m + 2 * n), active, mask, np.zeros(m), work
    )
    assert status == SolverStatus.OPTIMAL
    return x


def cost(qp, x):
    """1/2 x^T H x + g^T x."""
    return 0.5 * x @ qp.H @ x + qp.g @ x


def shortfall(qp, x):
    """Largest violation of a row or a bound, unscaled."""
    rows = qp.b > -np.inf
    return max(0.0, *(qp.b[rows] - qp.A[rows] @ x), *(qp.low - x), *(x - qp.high))


def judge(name, records):
    """Verdicts of a back end by kind; raises SolverError where it is not installed."""
    out = {}
    for kind in KINDS:
        chosen = [r.qp for r in records if r.kind == kind]
        memory = QP(*(block.copy() for block in chosen[0]))
        backend = solvers[name].bind(memory) if solvers[name].bind else None
        failures, violations, costs, distances, times = 0, [0.0], [0.0], [0.0], []
        for qp in chosen:
            for mine, theirs in zip(memory, qp, strict=True):
                mine[:] = theirs
            expected, v = kernel(qp), np.zeros(len(qp.g))
            begin = perf_counter_ns()
            if backend is None:
                v, status = kernel(qp), SolverStatus.OPTIMAL
            else:
                status = backend.solve(v, np.zeros(len(qp.b) + 2 * len(v)))
            times.append((perf_counter_ns() - begin) * 1e-3)
            if status != SolverStatus.OPTIMAL:
                failures += 1
                continue
            violations.append(shortfall(qp, v))
            costs.append(cost(qp, v) - cost(qp, expected))
            distances.append(np.abs(v - expected).max())
        out[kind] = Verdict(
            len(chosen), failures, max(violations), max(costs), max(distances), float(np.median(times)), max(times)
        )
    return out


def main():
    records = record(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
    print("| solver | programs | of | not found | worst row | cost above the kernel's | farthest | median | worst |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in solvers.names():
        if solvers[name].tracks_pose_only:
            continue
        try:
            verdicts = judge(name, records)
        except SolverError as error:
            print(f"| {name} | not installed: {error} |")
            continue
        for kind, v in verdicts.items():
            print(
                f"| {name} | {kind} | {v.count} | {v.failures} | {v.violation:.1e} | {v.cost:.1e} | {v.distance:.1e} "
                f"| {v.median_us:.0f} us | {v.worst_us:.0f} us |"
            )


if __name__ == "__main__":
    main()
