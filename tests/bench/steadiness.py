"""What must not happen in the loop: a compilation, a garbage collection, memory that grows."""

import gc
import os
import sys
import tracemalloc
from pathlib import Path

from numba.core import event
from numba.core.dispatcher import Dispatcher

PACKAGES = ("primitives", "vfi", "scenarios")


def signatures():
    """{function: number of compiled signatures} of every dispatcher of the project."""
    found = {}
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] in PACKAGES:
            for attribute, value in vars(module).items():
                if isinstance(value, Dispatcher):
                    found[f"{value.py_func.__module__}.{attribute}"] = len(value.signatures)
    return found


def resident():
    """Resident memory in bytes, 0 where the system does not say."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") if statm.exists() else 0


def _loop(contender, cycles):
    for _ in range(cycles):
        contender.prepare()
        contender.advance(contender.step())


def steadiness(contender, cycles=20_000, warm_up=2_000):
    """Compilations, signatures and collections while cycles run with the collector on, and the memory they keep.

    The collections are counted in one pass, the memory in a second one, as tracing it makes objects of its own.
    """
    _loop(contender, warm_up)
    before, collections = signatures(), []
    gc.collect()
    pages = resident()
    with event.install_recorder("numba:compile") as recorder:
        gc.callbacks.append(lambda phase, info: collections.append(info["generation"]) if phase == "start" else None)
        try:
            _loop(contender, cycles)
        finally:
            gc.callbacks.pop()
        pages = resident() - pages
        compilations = len(recorder.buffer)
    tracemalloc.start()
    try:
        _loop(contender, warm_up)
        held = tracemalloc.get_traced_memory()[0]
        _loop(contender, cycles)
        held = tracemalloc.get_traced_memory()[0] - held
    finally:
        tracemalloc.stop()
    after = signatures()
    return {
        "cycles": cycles,
        "dispatchers": len(after),
        "signatures_added": sum(after.values()) - sum(before.values()),
        "compilations": compilations,
        "collections": len(collections),
        "bytes_held": held,
        "resident_bytes_added": pages,
    }
