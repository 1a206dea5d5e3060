"""`Controller.step` at equal work: no verification, nobody reads the records.

It follows the parked arm in each cycle, from its measured joints. A second contender takes the parked shaft for a fixed
line, as all peers but those called "two arms" do.
"""

from dataclasses import replace

from primitives import ConstraintSet, Line
from scenarios.enforcement import chosen
from scenarios.run import build
from tests.bench import problem
from tests.bench.contender import Contender
from vfi import Controller, Measurement


class Ours(Contender):
    name = "ours, equal work"
    guard = "off"

    def __init__(self):
        super().__init__()
        self.controller = self.make()
        self.t = 0.0
        self.full, self.velocity = problem.both(self.q), problem.both(self.q) * 0.0

    def make(self):
        return build(chosen(problem.SCENE, guard=self.guard), solver="active-set")

    def prepare(self):
        self.t += problem.PERIOD
        self.full = problem.both(self.q)

    def step(self):
        return self.controller.step(Measurement(self.t, self.full, self.velocity), problem.REFERENCE[self.k]).qdot

    def advance(self, qdot):
        super().advance(qdot)
        self.velocity = problem.both(qdot)
        self.velocity[problem.PARKED] = 0.0


class OursParkedFixed(Ours):
    """One arm of eight joints, and a line of the world."""

    name = "ours, parked line fixed"

    def make(self):
        line = Line.through(problem.PARKED_POINT, problem.PARKED_DIRECTION)
        fixed = ConstraintSet(replace(c, second=line) if c.name == "C1" else c for c in problem.SCENE.constraints)
        return Controller(
            problem.ALONE,
            fixed,
            problem.SCENE.task,
            period=problem.PERIOD,
            eta=problem.ETA,
            limit_eta=problem.LIMIT_ETA,
            guard=self.guard,
        )

    def prepare(self):
        self.t += problem.PERIOD
        self.full = self.q

    def advance(self, qdot):
        super().advance(qdot)
        self.velocity = qdot


CONTENDERS = (Ours, OursParkedFixed)
