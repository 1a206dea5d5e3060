"""`Recorder`: carries the records of a running controller to a trace, on disk while the run goes on and in memory."""

from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np

from primitives.checks import Array
from primitives.state import State
from scenarios.analysis.trace import Event, Trace, TraceWriter

DRAIN_SECONDS = 0.05
"""At most this much time passes before records reach the trace file."""
PROGRESS_SECONDS = 0.1


class Recording(Protocol):
    """What writes a record a cycle into a ring: the controller or the admittance."""

    ring: Array
    cycles: int


class Recorder:
    """Call `after_cycle` after each cycle, in a ``with`` statement; `trace` is what came of it.

    Parameters
    ----------
    source : whose ring is drained.
    columns : {quantity: slice}, those of the ring and of `more`.
    header : facts on the run. out : file to write, or None. total : cycles of the run.
    more : (total, k) further columns of each cycle, filled by the caller, or None.
    progress : called about ten times a second with the share that is done.
    """

    def __init__(
        self,
        source: Recording,
        columns: Mapping[str, slice],
        header: Mapping[str, Any],
        out: Path | None,
        total: int,
        *,
        more: Array | None = None,
        progress: Callable[[float], None] | None = None,
    ):
        self._source, self._columns, self._header, self._more = source, columns, header, more
        self._writer = TraceWriter(out, columns, header) if out is not None else None
        self._total, self._progress = total, progress
        self._drained, self._wrote, self._told = 0, perf_counter(), 0.0
        self._state: State = State.RUN
        self._blocks: list[Array] = []
        self._events: list[Event] = []

    def after_cycle(self, t: float, state: State, reason: str) -> None:
        """Note a change of state, drain the ring when it is time, say how far the run is."""
        if state is not self._state:
            self._state = state
            self._events.append(Event(t, state.name, reason))
            if self._writer is not None:
                self._writer.note(self._events[-1])
        done, now, ring = self._source.cycles, perf_counter(), self._source.ring
        if done - self._drained >= len(ring) // 2 or now - self._wrote > DRAIN_SECONDS or done == self._total:
            self._drain(done)
            self._wrote = now
        if self._progress is not None and (now - self._told > PROGRESS_SECONDS or done == self._total):
            self._progress(done / self._total)
            self._told = now

    def _drain(self, done: int) -> None:
        rows = np.arange(self._drained, done)
        block = self._source.ring[rows % len(self._source.ring)]
        if self._more is not None:
            block = np.hstack([block, self._more[rows]])
        self._blocks.append(block)
        if self._writer is not None:
            self._writer.write(block)
        self._drained = done

    @property
    def trace(self) -> Trace:
        """All that was recorded."""
        return Trace(self._header, self._columns, np.concatenate(self._blocks), tuple(self._events))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._writer is not None:
            self._writer.__exit__(kind, error, traceback)
