"""How the admittance grows with the cloud: its cycle and the whole-tool forces alone, LWR4+, leaning on the vessels.

The arm, the anatomy and the hand are those of scene hands-on-tool, from when the shaft leans on the vessels. Spheres
keep their radius, so the points within reach grow with the cloud; k is divided by as much, so that the force does not.
"""

from dataclasses import replace

import numpy as np

from admittance.potential import repel
from primitives.point_cloud import PointCloud
from scenarios.anatomy.parts import Part, build_parts
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any
from tests.bench.harness import measure, statistics

SIZES = (10**3, 10**4, 10**5, 10**6)
STEPS = 500
SCENE = load_any("hands-on-tool", "lwr4plus")
REGION = "vessels"
AFTER = 1.0
"""How long the shaft has leant on them when the bench begins, seconds."""


class Lean:
    """Where the bench begins: the anatomy, and the recorded configuration and time at which the shaft leans on it."""

    def __init__(self):
        self.parts = build_parts(SCENE.anatomy, np.array(SCENE.port))
        trace = run_hands_on(SCENE, parts=self.parts)
        leaning = trace["repulsion"].any(axis=1).astype(int)
        edges = np.flatnonzero(np.diff(leaning, prepend=0, append=0)).reshape(-1, 2)
        first = int(edges[np.argmax(edges[:, 1] - edges[:, 0]), 0]) + round(AFTER / SCENE.period)
        self.q, self.t = trace["q"][first], float(trace.t[first])
        self.points = len(self.parts[REGION].cloud.points)

    def cloud(self, size):
        """About so many points, evenly over the vessels, as spheres of the scene's radius."""
        part = self.parts[REGION]
        points = part.surface.samples(np.sqrt(part.surface.area / size))
        return Part(PointCloud(points, SCENE.anatomy.cover[REGION]), part.surface, part.shape)


class Cycle:
    """`Admittance.step` in the loop with the scene's hand; only the step is timed."""

    rest = None

    def __init__(self, lean, size):
        self.name, self.failures, self.touching, self.seen, self.steps = f"cycle {size}", 0, 0, 0, 0
        parameters = replace(SCENE.parameters, k=SCENE.parameters.k * lean.points / size)
        scene = SCENE.with_changes(start=tuple(lean.q), parameters=parameters)
        robot = scene.build_robot()
        self.admittance = scene.build(robot, {**lean.parts, REGION: lean.cloud(size)})
        clouds = {name: part.cloud for name, part in lean.parts.items()}
        first, length = SCENE.first_end(robot), SCENE.parameters.shaft_length
        self.hand = SCENE.hand.hand(np.array(SCENE.port), first, length, clouds, seed=0)
        self.t, self.handle = lean.t, (self.admittance.handle, np.zeros(3))

    def prepare(self):
        self.t += SCENE.period
        self.wrench = self.hand.wrench(self.t, *self.handle)

    def step(self):
        return self.admittance.step(self.t, self.wrench)

    def advance(self, motion):
        if motion is None:
            return
        a, self.handle = self.admittance, (motion.handle, motion.handle_velocity)
        record = a.ring[(a.cycles - 1) % len(a.ring)]
        self.failures += int(motion.state != 0)
        self.touching += int(record[a.columns["repulsion"]].any())
        self.seen += int(record[a.columns["nearby"]][0])
        self.steps += 1


class Forces:
    """The compiled repulsion of the whole tool alone, where the cycle of the same size has led the arm to."""

    rest = None

    def __init__(self, cycle):
        self.name, self.failures, self._cycle = cycle.name.replace("cycle", "forces"), 0, cycle
        a = cycle.admittance
        region, self._robot = a.regions[REGION], a.robot
        grid, count = region.cloud.grid, len(region.cloud.grid.points)
        self._grid = (grid.points, grid.start, grid.shape, grid.origin, grid.cell, region.twelve())
        self._length, self._safe, self._k = a.parameters.shaft_length, region.safe, a.parameters.k
        self._port = np.array(SCENE.port)
        self._found = np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count), np.zeros((count, 5))
        self._out = np.zeros(6), np.zeros(4), np.zeros((4, 4)), np.zeros(3)

    def prepare(self):
        frames = self._robot.kinematics(self._cycle.admittance.q)
        axis, tip = frames.rotation(SCENE.shaft)[:, 2].copy(), frames.translation(SCENE.shaft).copy()
        d_0, out = SCENE.parameters.d_0, self._out
        for block in out:
            block[...] = 0.0
        out[3][:] = 0.0, np.inf, -1.0
        segment = tip - self._length * axis, axis, self._length
        scalars = self._safe, d_0, self._k, d_0, 0.0
        self._arguments = (*self._grid, *segment, *scalars, tip, self._port, axis, 0, *self._found, *out)

    def step(self):
        return repel(*self._arguments)

    def advance(self, count):
        self.failures += int(count is None or count < 0)


def by_size(sizes=SIZES, steps=STEPS):
    """{size: {"points", "in_reach", "contact", "cycle_us", "forces_us", "failures"}}."""
    lean = Lean()
    cycles = [Cycle(lean, size) for size in sizes]
    forces = [Forces(cycle) for cycle in cycles]
    times = measure([*cycles, *forces], steps)
    return {
        str(size): {
            "points": len(cycle.admittance.regions[REGION].cloud.grid.points),
            "in_reach": round(cycle.seen / cycle.steps),
            "contact": cycle.touching / cycle.steps,
            "cycle_us": statistics(times[cycle.name]),
            "forces_us": statistics(times[force.name]),
            "failures": cycle.failures + force.failures,
        }
        for size, cycle, force in zip(sizes, cycles, forces, strict=True)
    }


def lines(result):
    """Of the table: microseconds of the whole cycle and of the whole-tool forces in it."""
    columns = ("median", "cold", "p99", "max")
    head = "".join(f"   {part:<6}" + "".join(f"{c:>9}" for c in columns) for part in ("cycle", "forces"))
    out = [f"{'admittance, points':<20}{'in reach':>10}{head}"]
    for size, found in result.items():
        line = f"{size:<20}{found['in_reach']:>10}"
        for part in ("cycle_us", "forces_us"):
            line += " " * 9 + "".join(f"{found[part][k]:>9.1f}" for k in columns)
        out.append(line)
    return out
