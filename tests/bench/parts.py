"""What our own step is made of, guard off: the compiled cycle and its parts, and the Python around it."""

from timeit import repeat

import numpy as np

from tests.bench import problem
from tests.bench.contenders.ours import Ours
from tests.bench.harness import quiet
from vfi import Measurement, State, cycle
from vfi.messages import ByName, Command

CALLS, REPEATS = 100, 400
AT = 1200
"""Cycle of S5 whose data are used; constraints act there."""


def _fastest(call):
    """Microseconds of a call: the best of many means over about a millisecond, which others' work does not reach."""
    return round(min(repeat(call, number=CALLS, repeat=REPEATS)) / CALLS * 1e6, 2)


def parts():
    """{part: microseconds}; the parts of the compiled cycle are calls of their own and add up to a little more."""
    ours = Ours()
    for _ in range(AT):
        ours.prepare()
        ours.advance(ours.step())
    controller, names = ours.controller, dict.fromkeys(problem.SCENE.constraints.names, 0)
    arguments, ring, k = controller._arguments, controller.ring, ours.k
    small, measurement = np.zeros(8), Measurement(0.0, ours.full, ours.velocity)

    def step():
        ours.t += problem.PERIOD
        ours.step()

    def take_in():
        controller._t = -1.0
        controller._take_in(measurement, problem.REFERENCE[k], None)

    def command():
        return Command(small.copy(), State.RUN, "", 0.0, ByName(names, small.copy()), ByName(names, small.copy()))

    with quiet():
        return {
            "step": _fastest(step),
            "compiled cycle": _fastest(lambda: cycle.cycle(*arguments, 0.0, ring, 0)),
            "kinematics, rows, program": _fastest(lambda: cycle.prepare(*arguments)),
            "solution": _fastest(lambda: cycle.optimise(*arguments)),
            "record": _fastest(lambda: cycle.finish(*arguments, 0.0, ring, 0)),
            "reading the inputs": _fastest(take_in),
            "making the command": _fastest(command),
        }
