"""What a contender is: one way to write the S5 cycle, and the run it makes of it."""

import numpy as np

from tests.bench import problem


class Contender:
    """One way to compute q̇ (8,) of the moving arm from its q (8,), with the state of its own run of S5.

    Only `step` is timed. A run that has reached its end starts again; what is recorded is the first one.
    """

    name = ""
    differs = ""
    """In what cost or rows differ from those of S5; empty where they are the same to rounding."""
    explained_by = None
    """A contender that solves the program of S5 with just that difference in it."""
    moves = True
    """False for what is no controller."""
    rest = np.zeros(8)
    """What is commanded where a step raises, which is counted."""

    def __init__(self):
        self.q, self.k, self.cycles, self.failures = problem.START.copy(), 0, 0, 0
        self.visited = []

    def prepare(self):
        """What is not to be timed, before a step."""

    def step(self):
        """One cycle: q̇ (8,)."""
        raise NotImplementedError

    def advance(self, qdot):
        """Euler's step of the ideal plant; not timed."""
        if self.cycles < problem.CYCLES:
            self.visited.append(self.q)
        self.q = self.q + problem.PERIOD * qdot
        self.k += 1
        self.cycles += 1
        if self.k == problem.CYCLES:
            self.q, self.k = problem.START.copy(), 0

    def at(self, q, k):
        """The answer to q in cycle k, outside a run."""
        self.q, self.k = q.copy(), k
        self.prepare()
        return np.array(self.step())

    def margins(self):
        """Smallest margins (4,) over the first run, metres, by the same judge for everybody."""
        return np.min([problem.rows(q)[1] for q in self.visited], axis=0)

    def tracking(self):
        """Root mean square of the tip's distance from the reference over the first run, metres."""
        return float(np.sqrt(np.mean([problem.tip_error(q, k) ** 2 for k, q in enumerate(self.visited)])))

    def close(self):
        """Give back files."""
