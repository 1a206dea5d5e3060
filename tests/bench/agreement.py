"""Do the contenders command the same? Each is asked for q̇ at states of our own run."""

import numpy as np

FIRST, EVERY = 50, 10
"""Cycles that count as the first ones; after them one cycle in so many is looked at."""


def _difference(found, expected):
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def agreement(ours, contender):
    """|q̇ - ours| / |ours|: the largest of the first cycles, the median and the largest of the run.

    `explained` is the largest against `Contender.explained_by` instead of ours. The largest of the run is above 1 where
    the reference cannot be reached and ours is nearly at rest.
    """
    visited, saved = list(ours.visited), [(c, c.q, c.k) for c in (ours, contender)]
    cause = contender.explained_by() if contender.explained_by else ours
    first, later, explained = [], [], []
    for k in [*range(1, FIRST), *range(FIRST, len(visited), EVERY)]:
        found = contender.at(visited[k], k)
        (first if k < FIRST else later).append(_difference(found, ours.at(visited[k], k)))
        explained.append(_difference(found, cause.at(visited[k], k)))
    for c, q, k in saved:
        c.q, c.k = q, k
    return {
        "first_cycles": max(first),
        "run_median": float(np.median(later)),
        "run_max": max(later),
        "explained": max(explained),
    }
