"""What our own step is made of: microseconds and floating-point operations of each part.

Times of the parts are taken inside compiled loops, without a call from Python; the operations are counted by
`tests.bench.operations`, a process in which the same functions run as Python on numbers that count.
"""

import json
import os
import subprocess
import sys
from time import perf_counter
from timeit import repeat

import numba
import numpy as np

from tests.bench import part_calls, problem
from tests.bench.contenders.ours import Ours
from tests.bench.harness import quiet
from vfi import Measurement

CALLS, REPEATS = 500, 200
AT = 1200
"""Cycle of S5 whose data are used; constraints act there."""
CALL = "reading, calling, making the command"


def at_work():
    """Our contender after some cycles of its run."""
    ours = Ours()
    for _ in range(AT):
        ours.prepare()
        ours.advance(ours.step())
    return ours


def _fastest_inside(name, arguments, ring):
    """Microseconds of a part in a compiled loop: the best of many means, which others' work does not reach."""
    code = f"def loop(f, fl, w, wl, ring, calls):\n    for _ in range(calls):\n        {name}(f, fl, w, wl, ring)\n"
    scope = {name: numba.njit(getattr(part_calls, name))}
    exec(code, scope)
    loop = numba.njit(scope["loop"])
    loop(*arguments, ring, 1)
    best = np.inf
    for _ in range(REPEATS):
        start = perf_counter()
        loop(*arguments, ring, CALLS)
        best = min(best, perf_counter() - start)
    return best / CALLS * 1e6


def _operations(ours):
    """{part: floating-point operations} of one call each."""
    state = {"t": ours.t + problem.PERIOD, "q": list(ours.full), "qdot": list(ours.velocity), "k": ours.k}
    run = subprocess.run(
        [sys.executable, "-m", "tests.bench.operations"],
        input=json.dumps(state),
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(run.stdout)


def peak():
    """Operations a second of a large matrix product of NumPy's on one core: what the machine could do."""
    n = 512
    a = np.random.default_rng(0).random((n, n))
    return 2 * n**3 / min(repeat(lambda: a @ a, number=1, repeat=20))


def parts():
    """{"step": us, "peak_flops": 1/s, "parts": {part: {us, flops}}}; the parts are those of guard "act"."""
    ours = at_work()
    controller = ours.controller
    arguments, ring = controller._arguments, controller.ring

    def step():
        ours.t += problem.PERIOD
        return controller.step(Measurement(ours.t, ours.full, ours.velocity), problem.REFERENCE[ours.k]).qdot

    with quiet():
        whole = min(repeat(step, number=CALLS, repeat=REPEATS)) / CALLS * 1e6
        found = {name: {"us": _fastest_inside(name, arguments, ring)} for name in part_calls.NAMES}
        fastest = peak()
    for name, count in _operations(ours).items():
        found[name]["flops"] = count
    inside = sum(part["us"] for name, part in found.items() if name != "verification")
    found[CALL] = {"us": whole - inside, "flops": 0}
    return {"step_us": whole, "peak_flops": fastest, "parts": found}
