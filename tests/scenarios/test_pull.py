"""The hand of a scene: where it leads the shaft's end, and the wrench that this takes."""

import numpy as np
import pytest

from admittance.hand import SpringHand
from primitives import dual_quaternion as dq
from primitives.errors import InputError, UnknownNameError
from primitives.point_cloud import PointCloud
from scenarios.hands_on.pull import NEAREST_TO_PORT, Pull, Waypoint, handle_for

PORT = np.array([-0.6, -0.2, 0.03])
START = PORT + np.array([0.0, 0.0, -0.12])
LENGTH = 0.43
POINTS = np.random.default_rng(4).normal(size=(200, 3)) * 0.02
POSE = dq.from_rotation_translation(np.array([0.8, 0.0, 0.6, 0.0]), PORT + np.array([0.03, 0.01, -0.2]))
PARTS = {"vessels": PointCloud(POINTS, 0.003, pose=POSE)}
WORLD = PARTS["vessels"].world_points


def hand(*waypoints, seed=0, **options):
    return Pull(waypoints, **options).hand(PORT, START, LENGTH, PARTS, seed)


def force(pull, t, position=START, velocity=(0.0, 0.0, 0.0)):
    wrench = pull.wrench(t, np.array(position), np.array(velocity))
    assert np.array_equal(wrench[3:], np.zeros(3))
    return wrench[:3]


def test_the_handle_of_a_shaft_through_the_port():
    """On the line from the end through the port, a length from the end, on the port's side."""
    for end in PORT + np.random.default_rng(1).normal(size=(200, 3)) * 0.1:
        handle = handle_for(end, PORT, LENGTH)
        assert np.linalg.norm(handle - end) == pytest.approx(LENGTH, abs=1e-15)
        assert np.linalg.norm(np.cross(PORT - end, handle - end)) < 1e-15
        assert (PORT - end) @ (handle - end) > 0.0
    np.testing.assert_allclose(handle_for(np.array([3.0, 4.0, 0.0]), np.zeros(3), 10.0), [-3.0, -4.0, 0.0], atol=1e-15)


def test_targets_are_relative_to_the_port_or_at_a_part():
    pull = Pull(
        (
            Waypoint(1, (0.01, 0, -0.15)),
            Waypoint(2, "vessels", 0.02, "into"),
            Waypoint(3, "vessels", 0.02, "across"),
            Waypoint(4, "vessels", 0.0, "into"),
        )
    )
    to, into, across, at = pull.targets(PORT, START, PARTS)
    np.testing.assert_array_equal(to, PORT + np.array([0.01, 0.0, -0.15]))

    def nearest(place):
        return min(WORLD, key=lambda p: np.linalg.norm(p - place))

    touched = nearest(to)
    assert np.linalg.norm(into - touched) == pytest.approx(0.02)
    assert np.linalg.norm(np.cross(into - to, touched - to)) < 1e-12
    assert (into - to) @ (touched - to) > np.linalg.norm(touched - to) ** 2
    leant = nearest(into)
    assert np.linalg.norm(across - leant) == pytest.approx(0.02)
    assert np.linalg.norm(np.cross(across - PORT, leant - PORT)) < 1e-12
    assert np.linalg.norm(across - PORT) == pytest.approx(np.linalg.norm(leant - PORT) + 0.02)
    np.testing.assert_array_equal(at, nearest(across))


def test_an_unknown_part_is_named():
    with pytest.raises(UnknownNameError, match="Did you mean"):
        hand(Waypoint(1, "vessel", 0.0, "into"))


def test_the_end_of_the_shaft_is_led_straight_and_evenly():
    """Where the hand wants the handle, its shaft ends within 0.2 mm of the straight way, though the port turns it."""
    goal = PORT + np.array([0.09, 0.03, -0.1])
    led = hand(Waypoint(1, START - PORT), Waypoint(3, goal - PORT))
    assert isinstance(led, SpringHand)
    for t in np.linspace(0.0, 4.0, 401):
        share = np.clip((t - 1.0) / 2.0, 0.0, 1.0)
        wanted = START + share * (goal - START)
        handle = led.target(t)
        end = handle + LENGTH * (PORT - handle) / np.linalg.norm(PORT - handle)
        assert np.linalg.norm(end - wanted) < 2e-4
    np.testing.assert_allclose(led.target(0.0), handle_for(START, PORT, LENGTH), atol=1e-15)
    np.testing.assert_allclose(led.target(9.0), handle_for(goal, PORT, LENGTH), atol=1e-15)


def test_a_waypoint_at_the_beginning_takes_the_place_of_the_start():
    led = hand(Waypoint(0, (0, 0, -0.2)))
    for t in (0.0, 5.0):
        np.testing.assert_allclose(led.target(t), PORT + np.array([0, 0, -0.2 + LENGTH]), atol=1e-15)


def test_the_force_is_a_spring_a_damper_and_no_more_than_the_most():
    led = hand(Waypoint(0, START - PORT), stiffness=200.0, damping=10.0, most=5.0)
    home = handle_for(START, PORT, LENGTH)
    np.testing.assert_allclose(force(led, 1.0, home - [0.01, 0, 0], [0, 0.02, 0]), [2.0, -0.2, 0.0], atol=1e-12)
    np.testing.assert_allclose(force(led, 1.0, home + np.array([0, 0, 1.0])), [0.0, 0.0, -5.0], atol=1e-12)


def test_tremor_is_seeded_and_of_the_rms_and_band_asked_for():
    quiet, times = hand(Waypoint(0, START - PORT)), np.arange(5000) * 0.004
    shaking = {seed: hand(Waypoint(0, START - PORT), tremor=0.7, seed=seed) for seed in (1, 2)}
    added = {s: np.array([force(h, t) - force(quiet, t) for t in times]) for s, h in shaking.items()}
    again = hand(Waypoint(0, START - PORT), tremor=0.7, seed=1)
    assert np.array_equal(added[1], [force(again, t) - force(quiet, t) for t in times])
    assert not np.allclose(added[1], added[2])
    for values in added.values():
        assert np.sqrt((values**2).sum(axis=1).mean()) == pytest.approx(0.7, rel=0.2)
        power = (np.abs(np.fft.rfft(values * np.hanning(len(values))[:, None], axis=0)) ** 2).sum(axis=1)
        frequency = np.fft.rfftfreq(len(values), 0.004)
        assert power[(frequency > 7.5) & (frequency < 12.5)].sum() > 0.999 * power.sum()


@pytest.mark.parametrize("delay", [0.018, 0.02])  # between two cycles, and exactly five of them
def test_a_delayed_hand_pulls_as_if_the_handle_were_where_it_was(delay):
    late, prompt = (hand(Waypoint(0, START - PORT), delay=d, most=1e3) for d in (delay, 0.0))
    places = START + np.random.default_rng(2).normal(size=(30, 3)) * 1e-2
    for k, place in enumerate(places):
        seen = places[max(k - 5, 0)]
        np.testing.assert_array_equal(force(late, 0.004 * k, place), force(prompt, 0.004 * k, seen))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((-1, (0, 0, 1)), "t of Waypoint: expected a number >= 0"),
        ((np.nan, (0, 0, 1)), "finite"),
        ((1, (0, 0)), "expected shape"),
        ((1, (0, 0, NEAREST_TO_PORT / 2)), "a place off the port"),
        ((1, (0, 0, 1), np.inf), "beyond of Waypoint"),
        ((1, "vessels"), "go with a part's name"),
        ((1, (0, 0, 1), 0.0, "into"), "go with a part's name"),
        ((1, "vessels", 0.0, "onto"), 'Did you mean "into"'),
    ],
)
def test_bad_waypoints_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        Waypoint(*arguments)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"waypoints": ()}, "at least one, with growing times"),
        ({"waypoints": (Waypoint(2, (0, 0, 1)), Waypoint(2, (0, 1, 1)))}, r"growing times, got \[2.0, 2.0\]"),
        ({"stiffness": -1.0}, "stiffness of a pull"),
        ({"damping": np.nan}, "damping of a pull"),
        ({"most": 0.0}, "most of a pull"),
        ({"tremor": -0.1}, "tremor of a pull"),
        ({"delay": "long"}, "delay of a pull"),
    ],
)
def test_bad_pulls_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        Pull(**({"waypoints": (Waypoint(1, (0, 0, 1)),)} | options))


def test_a_way_through_the_port_is_refused():
    beside, across = Waypoint(1, (0.0004, 0, -0.1)), Waypoint(2, (0.0004, 0, 0.1))
    with pytest.raises(InputError, match=r"the way from 1 s on passes the port at 0\.4 mm"):
        hand(beside, across, Waypoint(3, (0, 0, 0.2)))
    hand(beside, Waypoint(2, (0.1, 0, 0)), Waypoint(3, (0, 0, 0.2)))
