"""Hands: what they pull with, that they repeat, and that a recorded one trusts no file."""

import numpy as np
import pytest

from admittance.hand import Delay, ScriptedHand, SpringHand, Tremor
from admittance.hand_file import COLUMNS, load_hand
from primitives.errors import FileError, InputError

STILL = np.zeros(3)
HEADER = ",".join(COLUMNS)


def test_scripted_holds_or_interpolates():
    times, wrenches = np.array([1.0, 2.0, 4.0]), np.arange(18.0).reshape(3, 6)
    held, lines = ScriptedHand(times, wrenches), ScriptedHand(times, wrenches, True, 5.0)
    for t, expected in ((0.999, np.zeros(6)), (1.0, wrenches[0]), (3.9, wrenches[1]), (9.0, wrenches[2])):
        np.testing.assert_array_equal(held.wrench(t, STILL, STILL), expected)
    np.testing.assert_allclose(lines.wrench(2.5, STILL, STILL), 0.75 * wrenches[1] + 0.25 * wrenches[2])
    np.testing.assert_array_equal(lines.wrench(5.1, STILL, STILL), np.zeros(6))


def test_what_a_hand_gives_is_no_view_of_what_it_keeps():
    hand = ScriptedHand(np.array([0.0]), np.ones((1, 6)))
    hand.wrench(1.0, STILL, STILL)[:] = 9.0
    np.testing.assert_array_equal(hand.wrench(1.0, STILL, STILL), np.ones(6))


def test_spring_pulls_towards_its_target_and_no_harder_than_it_can():
    hand = SpringHand(
        np.array([0.0, 2.0]), np.array([[0.0, 0, 0], [0.02, 0, 0]]), stiffness=100.0, damping=10.0, most=1.5
    )
    np.testing.assert_allclose(hand.wrench(1.0, STILL, STILL), [1.0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(hand.wrench(1.0, STILL, np.array([0.0, 0.05, 0.0])), [1.0, -0.5, 0, 0, 0, 0])
    far = hand.wrench(1.0, np.array([0.0, -3.0, 4.0]), STILL)
    assert np.linalg.norm(far) == pytest.approx(1.5)
    np.testing.assert_allclose(hand.wrench(9.0, STILL, STILL)[:3], [1.5, 0, 0])


def test_tremor_has_its_rms_its_band_and_its_seed():
    quiet = ScriptedHand(np.array([0.0]), np.zeros((1, 6)))
    hand, again, other = Tremor(quiet, 0.5), Tremor(quiet, 0.5), Tremor(quiet, 0.5, seed=1)
    t = np.arange(0.0, 60.0, 0.004)
    force = np.array([hand.wrench(x, STILL, STILL)[:3] for x in t])
    assert np.sqrt((force**2).sum(1).mean()) == pytest.approx(0.5, rel=0.1)
    power = (np.abs(np.fft.rfft(force, axis=0)) ** 2).sum(1)
    frequency = np.fft.rfftfreq(len(t), 0.004)
    assert power[(frequency > 7.8) & (frequency < 12.2)].sum() > 0.99 * power.sum()
    np.testing.assert_array_equal(again.wrench(1.234, STILL, STILL), hand.wrench(1.234, STILL, STILL))
    assert np.abs(other.wrench(1.234, STILL, STILL) - hand.wrench(1.234, STILL, STILL)).max() > 1e-3


def test_delay_shows_the_hand_what_was():
    spring = SpringHand(np.array([0.0]), np.zeros((1, 3)), stiffness=1.0, damping=0.0, most=1e3)
    hand = Delay(spring, 0.1)
    seen = [hand.wrench(0.01 * k, np.array([k, 0.0, 0.0]), STILL)[0] for k in range(40)]
    np.testing.assert_allclose(seen, [-max(0, k - 10) for k in range(40)], atol=1.01)
    assert seen[5] == 0.0 and seen[39] == pytest.approx(-29.0, abs=1.01)
    hand.reset()
    assert hand.wrench(0.0, np.array([7.0, 0, 0]), STILL)[0] == -7.0


def test_recorded_hand(tmp_path):
    file = tmp_path / "hand.csv"
    file.write_text(f"{HEADER}\n0,1,2,3,4,5,6\n1e0,2,2,3,4,5,6\n")
    hand = load_hand(file)
    np.testing.assert_allclose(hand.wrench(0.5, STILL, STILL), [1.5, 2, 3, 4, 5, 6])
    np.testing.assert_array_equal(hand.wrench(1.01, STILL, STILL), np.zeros(6))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "1: expected the header"),
        (b"\xff\xfe\x00", "UTF-8"),
        (b"a,b\n1,2\n", ":1: expected the header"),
        (HEADER.encode() + b"\n", "has no records"),
        (HEADER.encode() + b"\n0,1,2,3,4,5\n", ":2: expected 7 fields, got 6"),
        (HEADER.encode() + b"\n0,1,2,3,4,5,6,7\n", ":2: expected 7 fields, got 8"),
        (HEADER.encode() + b"\n0,1,2,3,4,5,nan\n", ":2: tz: expected a number"),
        (HEADER.encode() + b"\n0,1,2,inf,4,5,6\n", ":2: fz: expected a number"),
        (HEADER.encode() + b"\n0,1,2,1e300,4,5,6\n", ":2: fz: expected a number"),
        (HEADER.encode() + b"\n0,1,2,x,4,5,6\n", ":2: fz: .* got 'x'"),
        (HEADER.encode() + b"\n0,1,2," + b"1" * 10_000 + b",4,5,6\n", ":2: fz"),
        (HEADER.encode() + b"\n1,1,2,3,4,5,6\n1,1,2,3,4,5,6\n", ":3: t: expected more than 1.0 s"),
        (HEADER.encode() + b'\n0,1,2,3,4,5,"6\n', "hand.csv"),
        (HEADER.encode() + b"\n0,1,2,3,4,5,6\x00\n", "hand.csv"),
        (HEADER.encode() + b"\n" + b"9" * 200_000, "hand.csv"),
    ],
)
def test_hostile_files_are_refused_with_file_and_line(tmp_path, content, words):
    file = tmp_path / "hand.csv"
    file.write_bytes(content)
    with pytest.raises(FileError, match=words):
        load_hand(file)


def test_missing_files_and_folders_are_refused(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(FileError, match="no such file"):
            load_hand(path)


@pytest.mark.parametrize(
    "make",
    [
        lambda: ScriptedHand(np.array([1.0, 1.0]), np.zeros((2, 6))),
        lambda: ScriptedHand(np.array([]), np.zeros((0, 6))),
        lambda: ScriptedHand(np.array([0.0]), np.full((1, 6), np.nan)),
        lambda: SpringHand(np.array([0.0]), np.zeros((2, 3))),
        lambda: SpringHand(np.array([0.0]), np.zeros((1, 3)), most=0.0),
        lambda: Tremor(SpringHand(np.array([0.0]), np.zeros((1, 3))), low=12.0, high=8.0),
        lambda: Delay(SpringHand(np.array([0.0]), np.zeros((1, 3))), -1.0),
    ],
)
def test_bad_hands_are_refused(make):
    with pytest.raises(InputError):
        make()
