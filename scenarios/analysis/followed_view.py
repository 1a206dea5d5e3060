"""What the figures of a comparison need of one run along a trajectory, computed once from its trace."""

from dataclasses import dataclass

import numpy as np

from primitives.checks import Array
from scenarios.analysis.cells import Cell
from scenarios.analysis.look import Look
from scenarios.analysis.metrics import orientation_error, position_error, positions
from scenarios.analysis.picture import Dash
from scenarios.analysis.trace import Trace

WINDOW = 0.2
"""Seconds over which an acceleration is told: of single cycles a tremor leaves nothing to be seen."""


@dataclass(frozen=True)
class FollowedView:
    """One run of a cell.

    Attributes
    ----------
    label : of its curves. colour, dash : of its curves.
    tips, wanted : (k, 3) of each tool, where it was and where it was to be, metres.
    off, turned : (k,) of each tool, how far it was from there, metres, and turned from how it was to be, rad.
    speed, acceleration : (k,) norms over the decided joints, rad and m together; the second as rms over `WINDOW`.
    """

    label: str
    trace: Trace
    tips: tuple[Array, ...]
    wanted: tuple[Array, ...]
    off: tuple[Array, ...]
    turned: tuple[Array, ...]
    speed: Array
    acceleration: Array
    colour: str
    dash: Dash


def followed_view(cell: Cell, look: Look, trace: Trace) -> FollowedView:
    """Compute what is drawn of a run of a cell."""
    tools, qdot = range(len(trace.header["tasks"])), trace["qdot"]
    period = float(trace.header["period_s"])
    change = np.diff(qdot, axis=0, prepend=qdot[:1]) / period
    return FollowedView(
        cell.name,
        trace,
        tuple(positions(trace["pose"][:, 8 * i : 8 * i + 8]) for i in tools),
        tuple(positions(trace["reference"][:, 8 * i : 8 * i + 8]) for i in tools),
        tuple(position_error(trace, i) for i in tools),
        tuple(orientation_error(trace, i) for i in tools),
        np.linalg.norm(qdot, axis=1),
        _running_rms(change, max(1, round(WINDOW / period))),
        *look,
    )


def _running_rms(values: Array, window: int) -> Array:
    """(k,) rms of the norms of values (k, n) over the last `window` rows, or as many as there are."""
    total = np.cumsum(np.sum(values**2, axis=1))
    before = np.concatenate([np.zeros(min(window, len(total))), total])[: len(total)]
    out: Array = np.sqrt(np.maximum(total - before, 0.0) / np.minimum(np.arange(1, len(total) + 1), window))
    return out
