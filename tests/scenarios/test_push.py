"""The hand of a scene whose wrench is given beforehand, in the scene or on a record."""

import numpy as np
import pytest

from primitives.errors import FileError, InputError
from scenarios.hands_on.push import Push

FIRST, SECOND = (1.0, 2.0, 3.0, 0.1, 0.2, 0.3), (3.0, 0.0, -1.0, 0.0, 0.0, 0.1)


def wrenches(push, times, seed=0):
    hand = push.hand(np.zeros(3), np.ones(3), 0.4, {}, seed)
    return np.array([hand.wrench(t, np.zeros(3), np.zeros(3)) for t in times])


def test_each_wrench_lasts_until_the_next_or_leads_to_it():
    times = [0.5, 1.0, 1.5, 2.0, 9.0]
    held = wrenches(Push((1, 2), (FIRST, SECOND)), times)
    np.testing.assert_allclose(held, [np.zeros(6), FIRST, FIRST, SECOND, SECOND], atol=1e-15)
    led = wrenches(Push((1, 2), (FIRST, SECOND), interpolate=True), times)
    np.testing.assert_allclose(led[2], 0.5 * (np.array(FIRST) + SECOND), atol=1e-15)


def test_a_record_is_played_and_ends(tmp_path):
    file = tmp_path / "hand.csv"
    rows = "\n".join(",".join(str(v) for v in (t, *w)) for t, w in ((1.0, FIRST), (2.0, SECOND)))
    file.write_text(f"t,fx,fy,fz,tx,ty,tz\n{rows}\n", encoding="utf-8")
    played = wrenches(Push(file=str(file)), [0.5, 1.5, 2.5])
    np.testing.assert_allclose(played, [np.zeros(6), FIRST, np.zeros(6)], atol=1e-15)
    with pytest.raises(FileError, match=r"none\.csv"):
        wrenches(Push(file=str(tmp_path / "none.csv")), [0.0])


def test_tremor_is_on_top_and_seeded():
    still, shaking = Push((0,), (FIRST,)), Push((0,), (FIRST,), tremor=0.5)
    times = np.arange(500) * 0.004
    added = [wrenches(shaking, times, seed) - wrenches(still, times) for seed in (1, 1, 2)]
    assert np.array_equal(added[0], added[1])
    assert not np.allclose(added[0], added[2])
    assert np.sqrt((added[0][:, :3] ** 2).sum(axis=1).mean()) == pytest.approx(0.5, rel=0.3)
    assert not added[0][:, 3:].any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "expected wrenches or the file of a record"),
        ({"times": (0,), "wrenches": (FIRST,), "file": "x.csv"}, "one of them"),
        ({"times": (1, 1), "wrenches": (FIRST, SECOND)}, "growing"),
        ({"times": (1, 2), "wrenches": (FIRST,)}, "wrenches of a push: expected shape"),
        ({"times": (1,), "wrenches": (FIRST[:5],)}, "wrenches of a push"),
        ({"times": (1,), "wrenches": ((np.nan,) * 6,)}, "finite"),
        ({"file": "x.csv", "tremor": -1}, "tremor of a push"),
    ],
)
def test_bad_pushes_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        Push(**options)
