"""Times of several contenders, interleaved in one process: whatever disturbs the machine disturbs all of them."""

import gc
import os
from contextlib import contextmanager
from time import perf_counter_ns

import numpy as np

BLOCK = 125
"""Steps of one contender before the next one's turn."""


@contextmanager
def quiet():
    """One core where the system lets us choose, no garbage collection."""
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
    if cores:
        os.sched_setaffinity(0, {max(cores)})
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()
        if cores:
            os.sched_setaffinity(0, cores)


def block(contender, steps, times, at):
    """Let a contender make some steps, and write down what each took, nanoseconds."""
    for i in range(at, at + steps):
        contender.prepare()
        start = perf_counter_ns()
        try:
            qdot = contender.step()
        except Exception:
            qdot = None
        times[i] = perf_counter_ns() - start
        if qdot is None:
            contender.failures += 1
            qdot = contender.rest
        contender.advance(qdot)


def measure(contenders, steps, warm_up=BLOCK):
    """Times (steps,) of each contender, nanoseconds, by name; the order of turns is drawn anew each round."""
    times = {c.name: np.zeros(steps, dtype=np.int64) for c in contenders}
    with quiet():
        for c in contenders:
            block(c, warm_up, np.zeros(warm_up, dtype=np.int64), 0)
        rng = np.random.default_rng(0)
        for at in range(0, steps, BLOCK):
            for i in rng.permutation(len(contenders)):
                c = contenders[i]
                block(c, min(BLOCK, steps - at), times[c.name], at)
            gc.collect()
    return times


def statistics(times):
    """Of times in nanoseconds: n and, in microseconds, p5, median, mean, p99, p99.9 and max, and the median of `cold`.

    A cold step is the first of its block: the processor's caches are full of what the other contenders did.
    """
    us = np.asarray(times) * 1e-3
    p5, median, p99, p999 = np.percentile(us, [5, 50, 99, 99.9])
    named = {"p5": p5, "median": median, "mean": us.mean(), "p99": p99, "p99.9": p999, "max": us.max()}
    named["cold"] = np.median(us[::BLOCK])
    return {"n": len(us), **{name: round(float(value), 3) for name, value in named.items()}}
