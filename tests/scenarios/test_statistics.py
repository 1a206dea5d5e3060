"""Bootstrap intervals against scipy's, and their coverage on samples whose median is known."""

import numpy as np
import pytest
from scipy import stats

from scenarios.analysis.statistics import FEWEST, RESAMPLES, median_interval, paired_interval


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("count", [FEWEST, 20, 101])
def test_intervals_are_those_of_scipy(seed, count):
    """Two bootstraps with other random numbers agree to what 9999 resamples leave uncertain."""
    values = np.random.default_rng(seed).gamma(2.0, size=count)
    found = median_interval(values)
    oracle = stats.bootstrap(
        (values,), np.median, n_resamples=RESAMPLES, method="percentile", vectorized=True, rng=np.random.default_rng(99)
    ).confidence_interval
    assert found.median == np.median(values)
    ordered = np.sort(values)
    gap = np.max(np.diff(ordered)[: count - 2]) if count < 20 else 0.02 * np.ptp(values)
    assert abs(found.low - oracle.low) <= gap
    assert abs(found.high - oracle.high) <= gap
    assert found.low <= found.median <= found.high


def test_intervals_hold_the_true_median_about_as_often_as_they_say():
    """Of 300 samples of 25, whose true median is 0: the percentile interval is known to be a little short."""
    rng = np.random.default_rng(4)
    held = sum(i.low <= 0.0 <= i.high for i in (median_interval(rng.normal(size=25)) for _ in range(300)))
    assert 0.91 <= held / 300 <= 0.99


def test_few_values_have_a_median_and_no_interval():
    found = median_interval([3.0, 1.0, 2.0, 5.0, 4.0])
    assert (found.median, found.low, found.high, found.excludes_zero) == (3.0, None, None, False)


def test_pairing_takes_out_what_a_seed_does_to_both():
    rng = np.random.default_rng(1)
    seeds = rng.normal(scale=10.0, size=12)
    a, b = seeds + 1.0 + 0.1 * rng.normal(size=12), seeds + 0.1 * rng.normal(size=12)
    paired = paired_interval(a, b)
    assert paired.excludes_zero and 0.5 < paired.low < paired.high < 1.5
    assert median_interval(a).low < median_interval(b).high, "apart from each other the two overlap"
    assert not paired_interval(a, a).excludes_zero


def test_the_same_values_give_the_same_interval():
    values = np.random.default_rng(2).normal(size=30)
    assert median_interval(values) == median_interval(values.tolist())
