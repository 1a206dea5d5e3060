"""What several runs say together: medians with bootstrap intervals, and whether one method's runs are better."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from primitives.checks import Array

LEVEL = 0.95
RESAMPLES = 9999
SEED = 20260101
FEWEST = 6
"""Runs from which on there are intervals: of fewer, even differences that all have one sign arise by chance in more
than 5 % of cases (2 / 2^5), so that no interval of the median could hold at this level."""


class Interval(NamedTuple):
    """A median, and between which values it lies; low and high are None for fewer than `FEWEST` values."""

    median: float
    low: float | None
    high: float | None

    @property
    def excludes_zero(self) -> bool:
        """Whether the whole interval lies on one side of zero."""
        return self.low is not None and self.high is not None and (self.low > 0.0 or self.high < 0.0)


def median_interval(values: Sequence[float]) -> Interval:
    """The median of independent values and its percentile bootstrap interval at `LEVEL`, the same at every call.

    Medians of `RESAMPLES` samples of the same size, drawn with replacement; the interval holds the middle 95 % of them.
    """
    given: Array = np.array(values, dtype=float)
    median = float(np.median(given))
    if len(given) < FEWEST:
        return Interval(median, None, None)
    picks = np.random.default_rng(SEED).integers(0, len(given), (RESAMPLES, len(given)))
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(np.median(given[picks], axis=1), [tail, 100.0 - tail])
    return Interval(median, float(low), float(high))


def paired_interval(first: Sequence[float], second: Sequence[float]) -> Interval:
    """The median difference first - second of runs with the same seeds, and its interval; see `median_interval`."""
    return median_interval([a - b for a, b in zip(first, second, strict=True)])
