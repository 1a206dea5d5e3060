"""The floor: a Python method that returns an array that is there."""

import numpy as np

from tests.bench.contender import Contender


class NoOp(Contender):
    name = "no-op call"
    moves = False
    zero = np.zeros(8)

    def step(self):
        return self.zero


CONTENDERS = (NoOp,)
