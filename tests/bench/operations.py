"""Counts the floating-point operations of each part of a cycle: the functions run as Python, on numbers that count.

A process of its own, under NUMBA_DISABLE_JIT=1; it reads a state of S5 from stdin and prints {part: count}. An
addition, product, quotient, comparison of two numbers, root or trigonometric function is one operation.
"""

import json
import sys

import numpy as np

from primitives import intrinsics

count = 0


class Counted(np.float64):
    """A float64 whose operations are counted; what comes out of one is counted again."""


def _counting(name):
    plain = getattr(np.float64, name)

    def operation(self, *others):
        global count
        count += 1
        out = plain(self, *others)
        return Counted(out) if isinstance(out, float) else out

    return operation


for _name in ("add", "sub", "mul", "truediv", "radd", "rsub", "rmul", "rtruediv", "lt", "le", "gt", "ge", "neg", "abs"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__"))


def _function(plain):
    def operation(*values):
        global count
        if not any(isinstance(v, Counted) for v in values):
            return plain(*values)
        count += 1
        return Counted(plain(*(float(v) for v in values)))

    return operation


def _arm():
    """Make NumPy's functions count, and scratch hold numbers that do; before anything of ours imports them."""
    intrinsics.scratch = lambda size: np.full(size, Counted(0.0), dtype=object)
    for name in ("sqrt", "sin", "cos", "arctan2", "copysign"):
        setattr(np, name, _function(getattr(np, name)))


def main():
    """Count at the state on stdin."""
    state = json.load(sys.stdin)
    _arm()
    from tests.bench import part_calls, problem
    from tests.bench.contenders.ours import Ours
    from vfi import Measurement

    controller = Ours().controller
    before = np.array(state["q"])
    for i in (0, 1):  # the second cycle starts warm
        measurement = Measurement(state["t"] + i * problem.PERIOD, before, np.array(state["qdot"]))
        controller.step(measurement, problem.REFERENCE[state["k"]])
    f, fl, w, wl = controller._arguments
    numbers = np.array([Counted(v) for v in f], dtype=object)
    found = {}
    for name in part_calls.NAMES:
        global count
        count = 0
        getattr(part_calls, name)(numbers, fl, w, wl, controller.ring)
        found[name] = count
    print(json.dumps(found))


if __name__ == "__main__":
    main()
