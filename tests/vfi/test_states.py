"""HOLD and FAULT: what leads to them, when they stay, how they are left, and how a HOLD ends in rest."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import Entity, evaluate
from tests.vfi.arms import START, pair, pose, seven
from vfi.controller import Controller
from vfi.latch import Keeper, Latch
from vfi.messages import Command, Measurement
from vfi.outcome import Reason, State
from vfi.record import Head
from vfi.tasks import PoseTask, VelocityTask

T, PAIR, SEVEN = 0.004, pair(), seven()
TIP = Point.at([0.0, 0.0, 0.0], frame="moving/tip")
AT = PAIR.kinematics(START).translation("moving/tip")
STILL = np.zeros(16)
PUSH = np.array([0.004, 0.003, 0.02, 0.02, 0.004, 0.0, 0.0, 0.0])
BELOW = {"table": Entity(pose([0.0, 0.0, AT[2] - 0.05]), np.zeros(6))}


def controller(**options: Any) -> Controller:
    """The tip above a table that is measured."""
    wall = Constraint("above", TIP, Plane.through([0, 0, 0], [0, 0, 1], entity="table"), "outside", 0.01)
    return Controller(PAIR, ConstraintSet([wall]), VelocityTask(), period=T, group="moving", **options)


class Loop:
    """A controller with a clock; every cycle is as `good` says but for what is said of it."""

    def __init__(self, c: Controller, reference: Array = PUSH, q: Array = START):
        self.c, self.k = c, 0
        self.good = {"q": q.copy(), "qdot": np.zeros(len(q)), "entities": BELOW, "reference": reference}

    def cycle(self, **changes: Any) -> Command:
        self.k += 1
        given = {"t": self.k * T, **self.good, **changes}
        return self.c.step(Measurement(**{k: v for k, v in given.items() if k != "reference"}), given["reference"])

    def cycles(self, count: int, **changes: Any) -> list[Command]:
        return [self.cycle(**changes) for _ in range(count)]


# What leads where ----------------------------------------------------------------------------------------------------

Fault = tuple[Loop, dict[str, Any]]


def out_of_reach(**options: Any) -> Fault:
    """One joint beyond its range and a wall in its way back: no velocity keeps both."""
    q = np.zeros(7)
    q[1] = SEVEN.limits.upper[1] + 0.1
    seen = SEVEN.kinematics(q)
    plane = Plane.through(seen.translation("frame7"), seen.jacobian("frame7")[:3, 1])
    wall = Constraint("wall", Point.at([0, 0, 0], frame="frame7"), plane, "outside", 0.0)
    robot = SEVEN.with_group("second", ["joint2"])
    c = Controller(robot, ConstraintSet([wall]), VelocityTask(), period=T, group="second", **options)
    good = q.copy()
    good[1] -= 0.2
    assert evaluate(SEVEN, c.constraints, good).margin[0] < 0.0, "it comes back out of the wall"
    return Loop(c, np.zeros(1), good), {"q": q}


def on_an_axis(**options: Any) -> Fault:
    """A tip on the axis of a needle that it is to keep away from."""
    needle = Constraint("needle", TIP, Line.through([0, 0, 0], [0, 0, 1], entity="table"), "outside", 0.0)
    c = Controller(PAIR, ConstraintSet([needle]), VelocityTask(), period=T, group="moving", **options)
    loop = Loop(c)
    loop.good["entities"] = {"table": Entity(pose(AT + np.array([0.01, 0.0, 0.0])), np.zeros(6))}
    return loop, {"entities": {"table": Entity(pose(AT), np.zeros(6))}}


def following(**options: Any) -> Fault:
    c = Controller(PAIR, ConstraintSet(), PoseTask(), period=T, group="moving", **options)
    return Loop(c, PAIR.kinematics(START).pose("moving/tip")), {"reference": np.r_[1.1, np.zeros(7)]}


def given(**changes: Any) -> Callable[..., Fault]:
    return lambda **options: (Loop(controller(**options)), changes)


def old(name: str, age: float) -> Callable[..., Fault]:
    """The stamp of a name lies `age` before the time of the second cycle."""
    return lambda **options: (Loop(controller(**options)), {"stamps": {name: 2 * T - age}})


FAULTS = {
    "a number that is NaN or infinite": (given(q=np.full(16, np.nan)), State.FAULT, "finite"),
    "an array of another shape or kind": (given(qdot=np.zeros(15)), State.FAULT, "expected shape (16)"),
    "a time that does not advance": (given(t=T), State.FAULT, "t: expected a time after"),
    "a stamp later than the time": (old("q", -1.0), State.FAULT, "stamp of q: expected a time up to"),
    "a stamp of something unknown": (old("tabel", 0.0), State.FAULT, 'Did you mean "table"'),
    "an entity that is missing": (given(entities={}), State.FAULT, 'unknown entity "table"'),
    "a reference pose that is no unit dual quaternion": (following, State.FAULT, "expected a unit dual quaternion"),
    "a keep-outside constraint at distance zero": (on_an_axis, State.FAULT, "no row can be written"),
    "joints measured more than 1.5 periods ago": (old("qdot", 1.6 * T), State.HOLD, "qdot was measured"),
    "an entity measured more than 0.1 s ago": (old("table", 0.11), State.HOLD, "table was measured"),
    "no velocity that keeps everything": (out_of_reach, State.HOLD, "no velocity within the joint limits"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_leads_where_and_how_it_is_left(fault):
    """In its first cycle; what stays is zero when the fault is over, until it is acknowledged."""
    build, state, words = FAULTS[fault]
    loop, changes = build()
    assert loop.cycle().state < State.HOLD and loop.c.latched == ""
    lasting = 1 if state == State.FAULT else 5
    for k in range(lasting):
        command = loop.cycle(**changes)
        assert command.state == state and words in command.reason and not command.qdot.any()
        assert command.valid == (state == State.HOLD)
        assert bool(loop.c.latched) == (k == lasting - 1)
    since = f"{state.name} since t = {(1 + lasting) * T if 't' not in changes else T:.6g} s, until it is acknowledged"
    for command in loop.cycles(10):
        assert command.state == state and command.reason == loop.c.latched and not command.qdot.any()
        assert command.reason.startswith(since) and words in command.reason
        assert command.record[loop.c.columns["reason"]][0] == Reason.LATCHED
        assert np.isfinite(np.asarray(command.margins)).all()
    loop.c.acknowledge()
    assert loop.c.latched == "" and loop.cycle().state < State.HOLD


@pytest.mark.parametrize("fault", FAULTS)
def test_without_a_latch_the_next_good_cycle_goes_on(fault):
    build, state, _ = FAULTS[fault]
    loop, changes = build(latch=None)
    loop.cycle()
    assert [command.state for command in loop.cycles(20, **changes)] == [state] * 20 and loop.c.latched == ""
    assert loop.cycle().state < State.HOLD


def test_the_page_says_the_same():
    page = (Path(__file__).parents[2] / "docs" / "vfi.md").read_text(encoding="utf-8")
    for fault, (_, state, _) in FAULTS.items():
        assert f"| {fault} | {state.name} |" in page, fault


# When it stays -------------------------------------------------------------------------------------------------------


def test_a_hold_that_passes_by_itself():
    """Four cycles, a good one between: nothing stays."""
    loop, changes = out_of_reach()
    for _ in range(3):
        loop.cycle()
        assert {command.state for command in loop.cycles(4, **changes)} == {State.HOLD}
    assert loop.cycle().state < State.HOLD and loop.c.latched == ""


def test_how_long_it_takes_is_a_setting():
    loop, changes = given(q=np.full(16, np.inf))(latch=Latch(hold=2, fault=3))
    loop.cycles(1, **changes)
    loop.cycle()
    loop.cycles(2, **changes)
    assert loop.c.latched.startswith("HOLD since t = 0.016 s"), "two cycles without a command that holds"
    loop.c.acknowledge()
    loop.cycles(2, **changes)
    loop.cycle()
    loop.cycles(2, **changes)
    assert loop.c.latched.startswith("HOLD since t = 0.024 s"), "not three on end"
    loop.cycle(**changes)
    assert loop.c.latched.startswith("FAULT since t = 0.04 s")


def test_what_stays_gets_graver_and_never_milder():
    loop, changes = out_of_reach()
    loop.cycles(5, **changes)
    assert loop.c.latched.startswith("HOLD")
    assert loop.cycle(q=np.full(7, np.nan)).state == State.FAULT
    assert loop.c.latched.startswith("FAULT since t = 0.024 s") and "finite" in loop.c.latched
    assert {command.state for command in loop.cycles(20, **changes)} == {State.FAULT}
    assert loop.c.latched.startswith("FAULT since t = 0.024 s")


def test_a_fault_that_is_still_there_comes_back():
    loop, changes = given(qdot=None)()
    loop.cycle(**changes)
    loop.c.acknowledge()
    assert loop.cycle(**changes).state == State.FAULT and loop.c.latched
    loop.c.acknowledge()
    assert loop.cycle().state == State.RUN


def test_acknowledging_what_does_not_stay_changes_nothing():
    one, two = Loop(controller()), Loop(controller())
    for _ in range(5):
        two.c.acknowledge()
        np.testing.assert_array_equal(
            np.delete(one.cycle().record, Head.CYCLE_US), np.delete(two.cycle().record, Head.CYCLE_US)
        )


def test_keeper_counts_cycles_on_end():
    keeper = Keeper(Latch(hold=2, fault=2))
    assert not keeper.note(State.FAULT, "a", 1.0)
    assert keeper.note(State.HOLD, "b", 2.0) and keeper.state == State.HOLD
    assert not keeper.note(State.FAULT, "c", 3.0), "one in FAULT since the HOLD"
    assert keeper.note(State.FAULT, "d", 4.0) and keeper.reason == "FAULT since t = 4 s, until it is acknowledged: d"
    assert not keeper.note(State.HOLD, "e", 5.0)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"latch": 5}, InputError, "latch: expected a Latch or None, got 5"),
        ({"latch": Latch(hold=0)}, InputError, "hold of Latch: expected a number >= 1"),
        ({"latch": Latch(fault=1.5)}, InputError, "fault of Latch: expected a whole number of cycles, got 1.5"),
        ({"max_age": {"tabel": 1.0}}, UnknownNameError, 'unknown stamp "tabel". Did you mean "table"'),
        ({"max_age": {"q": 0.0}}, InputError, "max_age of q: expected a number > 0"),
    ],
)
def test_settings_that_are_refused(options, error, words):
    with pytest.raises(error, match=words):
        controller(**options)


# Stamps --------------------------------------------------------------------------------------------------------------


def test_stamps_that_are_fresh_enough_change_nothing():
    one, two = Loop(controller()), Loop(controller())
    for k in range(1, 6):
        stamps = {"q": k * T - 1.4 * T, "qdot": k * T, "wrench": -5.0, "table": k * T - 0.09}
        np.testing.assert_array_equal(
            np.delete(one.cycle().record, Head.CYCLE_US), np.delete(two.cycle(stamps=stamps).record, Head.CYCLE_US)
        )


def test_an_entity_is_taken_on_from_its_stamp():
    """By its twist, to where it is now: the same margin as from a fresh pose."""
    twist = np.array([0.01, 0.0, -0.02, 0.0, 0.3, 0.1])
    x0 = pose([0.0, 0.01, AT[2] - 0.05], [0.1, 0.0, 0.0])
    age, step = 0.08, 1e-4
    now = np.array([0.0, 0.01, AT[2] - 0.05]) + age * twist[:3]
    loop = Loop(controller())
    late = loop.cycle(entities={"table": Entity(x0, twist)}, stamps={"table": T - age}).margins["above"]
    # The rotation in a thousand small steps, as an integrator would do it.
    from primitives import dual_quaternion as dq

    r = np.ascontiguousarray(x0[:4])
    for _ in range(round(age / step)):
        r = dq.quaternion_product(np.ascontiguousarray(pose([0, 0, 0], step * twist[3:])[:4]), r)
    fresh = Entity(dq.from_rotation_translation(r, now), twist)
    other = Loop(controller()).cycle(entities={"table": fresh}).margins["above"]
    assert late == pytest.approx(other, abs=1e-9)
    unmoved = Loop(controller()).cycle(entities={"table": Entity(x0, twist)}).margins["above"]
    assert abs(late - unmoved) > 1e-4


def test_max_age_is_a_setting():
    loop = Loop(controller(max_age={"q": 0.05, "table": 0.02}))
    assert loop.cycle(stamps={"q": T - 0.049, "table": T - 0.019}).state == State.RUN
    command = loop.cycle(stamps={"q": 2 * T - 0.051, "table": 2 * T - 0.021})
    assert command.state == State.HOLD
    assert command.reason == "q was measured 51 ms ago, more than 50 ms; table was measured 21 ms ago, more than 20 ms"


def test_one_old_stamp_does_not_outlast_its_cycle():
    """Also where the next measurement has none."""
    c = Controller(PAIR, ConstraintSet(), VelocityTask(), period=T, group="moving")
    loop = Loop(c)
    assert loop.cycle(stamps={"q": -1.0}).state == State.HOLD
    assert loop.cycle().state == State.RUN
    assert loop.cycle(stamps={"q": -1.0}, q=np.full(16, np.nan)).state == State.FAULT
    c.acknowledge()
    assert loop.cycle().state == State.RUN


# Rest ----------------------------------------------------------------------------------------------------------------

LIMIT = np.where([j.endswith(("1", "2", "5")) for j in PAIR.joints], 0.1, 2.0)
SLOW = PAIR.with_limits(acceleration=dict(zip(PAIR.joints, LIMIT, strict=True)))


def braking(robot: Any, plane: float, eta: float = 5.0) -> tuple[list[Command], Controller]:
    """From full motion to an old stamp: commands of the HOLD. The tip moves towards a plane so far below."""
    floor = Constraint("floor", TIP, Plane.through(AT - [0, 0, plane], [0, 0, 1]), "outside", 0.0)
    c = Controller(
        robot, ConstraintSet([floor]), VelocityTask(), period=T, group="moving", eta=eta, latch=Latch(hold=2)
    )
    q, out = START.copy(), []
    down = -np.sign(robot.kinematics(q).jacobian("moving/tip")[2, :8]) * [0.02, 0.02, 0.1, 0.1, 0.02, 0.2, 0.2, 0.2]
    for k in range(1, 300):
        bad = k > 150
        command = c.step(Measurement(k * T, q, STILL, stamps={"q": k * T - T * (2 * bad)}), down)
        assert (command.state == State.HOLD) == bad
        out.append(command)
        q[:8] += T * command.qdot
    return out[149:], c


def test_hold_brakes_within_the_acceleration_limits_and_ends_in_rest():
    commands, c = braking(SLOW, 0.2)
    v = np.array([command.qdot for command in commands])
    assert np.abs(v[0]).max() > 0.05 and np.abs(v[1]).max() > 0.05, "it does not stop at once"
    expected = v[0].copy()
    for row in v[1:]:
        expected = np.sign(expected) * np.maximum(np.abs(expected) - T * LIMIT[:8], 0.0)
        np.testing.assert_allclose(row, expected, atol=1e-15)
    assert not v[-1].any() and c.latched
    assert min(command.margins["floor"] for command in commands) > 0.0


def test_without_acceleration_limits_it_stops_at_once():
    commands, _ = braking(PAIR, 0.2)
    assert commands[0].qdot.any() and not any(command.qdot.any() for command in commands[1:])


def test_it_stops_at_once_where_braking_would_not_keep_a_margin():
    """Near the floor the row allows a velocity that cannot be braked in the room that is left."""
    weak = PAIR.with_limits(acceleration=dict.fromkeys(PAIR.joints, 1e-3))
    floor = Constraint("floor", TIP, Plane.through(AT - [0, 0, 1e-3], [0, 0, 1]), "outside", 0.0)
    c = Controller(weak, ConstraintSet([floor]), VelocityTask(), period=T, group="moving", eta=100.0)
    down = -1e-3 * np.sign(PAIR.kinematics(START).jacobian("moving/tip")[2, :8])
    q = START.copy()
    for k in range(1, 400):
        command = c.step(Measurement(k * T, q, STILL), 10.0 * down)
        q[:8] += T * command.qdot
        if command.margins["floor"] < 2e-5:
            break
    assert command.qdot.any()
    held = c.step(Measurement((k + 1) * T, q, STILL, stamps={"q": 0.0}), down)
    assert held.state == State.HOLD and not held.qdot.any()


def test_motion_begins_from_rest_after_the_acknowledgement():
    commands, c = braking(SLOW, 0.2)
    assert not commands[-1].qdot.any()
    c.acknowledge()
    begun = c.step(Measurement(300 * T, START, STILL), np.full(8, 0.05))
    assert begun.state == State.RUN and begun.qdot.any()
    assert (np.abs(begun.qdot) <= T * LIMIT[:8] + 1e-12).all()
