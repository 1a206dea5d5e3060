"""The border of the controller: what it refuses when it is built, what it survives in a loop, and what it says."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dqrobotics import DQ
from hypothesis import example, given, settings
from hypothesis import strategies as st

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.errors import ActiveConstraintsError, InactiveConstraintError, InputError, UnknownNameError
from primitives.evaluate import Entity
from tests.primitives.qps import cases
from tests.vfi.arms import START, Array, closed_loop, pair, paper_constraints, paper_reference, pose, seven
from vfi.controller import Controller
from vfi.messages import Command, Measurement, Rows
from vfi.outcome import Reason, Slot, State
from vfi.record import Head
from vfi.tasks import PoseTask, VelocityTask

PAIR, SEVEN = pair(), seven()
REFERENCE = paper_reference(PAIR)
STILL = np.zeros(16)
T = 0.004
TIP = Point.at([0.0, 0.0, 0.0], frame="moving/tip")
NAN, INF = float("nan"), float("inf")


def paper(**options: Any) -> Controller:
    return Controller(
        PAIR, paper_constraints(), PoseTask(), **{"period": T, "group": "moving", "latch": None, **options}
    )


def free(**options: Any) -> Controller:
    """Velocities of the moving arm, no constraint."""
    return Controller(
        PAIR, ConstraintSet(), VelocityTask(), **{"period": T, "group": "moving", "latch": None, **options}
    )


def with_entity(**options: Any) -> Controller:
    wall = Constraint("wall", TIP, Plane.through([0, 0, 0], [0, 0, 1], entity="table"), "outside", 0.0)
    return Controller(
        PAIR, ConstraintSet([wall]), VelocityTask(), **{"period": T, "group": "moving", "latch": None, **options}
    )


TABLE = {"table": Entity(pose([0.0, 0.0, -0.1]), np.zeros(6))}


def good(k: float = 0) -> Measurement:
    return Measurement(T * (k + 1), START, STILL)


def refused(c: Controller, command: Command, *words: str) -> None:
    """A FAULT in words, nothing moves, and the next good cycle runs again."""
    assert command.state == State.FAULT
    assert command.qdot.shape == (len(c.joints),) and not command.qdot.any()
    assert not np.asarray(command.multipliers).any() and np.isfinite(np.asarray(command.margins)).all()
    for word in words:
        assert word in command.reason, command.reason
    assert c.ring[(c.cycles - 1) % len(c.ring), c.columns["state"]][0] == State.FAULT
    entities = TABLE if c.entities else None
    reference = REFERENCE(0.0) if isinstance(c.task, PoseTask) else np.zeros(len(c.joints))
    again = c.step(Measurement(1e3 + c.cycles, START, STILL, entities=entities), reference)
    assert again.state == State.RUN and again.reason == ""


# Construction --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"period": 0.0}, "period: expected a number > 0"),
        ({"period": -1e-3}, "period: expected a number > 0"),
        ({"period": NAN}, "period: expected a finite number"),
        ({"period": "fast"}, "period: expected one number"),
        ({"eta": 0.0}, 'eta of constraint "C1": expected a number > 0'),
        ({"eta": INF}, 'eta of constraint "C1": expected a finite number'),
        ({"eta": 250.1}, r'eta of constraint "C1": expected eta T <= 1, got eta = 250.1 1/s and T = 0.004 s.*<= 250'),
        ({"eta": {"C1": 1.0, "C2": 1.0, "C3": 1.0}}, 'no eta for constraint "C4"'),
        ({"eta": {"": 1.0, "C2": -1.0}}, 'eta of constraint "C2"'),
        ({"limit_eta": 0.0}, "limit_eta"),
        ({"limit_eta": 300.0}, r"limit_eta: expected eta T <= 1"),
        ({"recovery_linear": 0.0}, "recovery_linear"),
        ({"recovery_angular": NAN}, "recovery_angular"),
        ({"user_rows": -1}, "user_rows: expected a number >= 0"),
        ({"user_rows": 1.5}, "user_rows: expected a whole number"),
        ({"ring": 0}, "ring: expected a number >= 1"),
        ({"ring": "long"}, "ring: expected one number"),
    ],
)
def test_numbers_that_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        paper(**options)


def test_gain_of_the_task_is_held_to_the_period_too():
    with pytest.raises(InputError, match=r"gain of PoseTask: expected eta T <= 1, got eta = 251"):
        Controller(PAIR, ConstraintSet(), PoseTask(gain=251.0), period=T)


@pytest.mark.parametrize("period", [1e-4, 1e-3, 3e-3, 7e-3, 1.0 / 3.0, 0.02])
def test_gain_of_one_over_the_period_is_allowed(period):
    c = Controller(PAIR, paper_constraints(), VelocityTask(), period=period, eta=1.0 / period, limit_eta=1.0 / period)
    assert c.period == period
    with pytest.raises(InputError, match="eta T <= 1"):
        Controller(PAIR, paper_constraints(), VelocityTask(), period=period, eta=1.0001 / period)


@pytest.mark.parametrize(
    ("options", "near"),
    [
        ({"group": "movin"}, 'unknown joint group "movin". Did you mean "moving"'),
        ({"solver": "active_set"}, 'unknown solver "active_set". Did you mean "active-set"'),
        ({"guard": "acts"}, 'unknown guard "acts". Did you mean "act"'),
        ({"eta": {"": 1.0, "C5": 1.0}}, 'unknown constraint "C5".* Known: C1, C2, C3, C4'),
    ],
)
def test_unknown_names(options, near):
    with pytest.raises(UnknownNameError, match=near):
        paper(**options)


def test_unknown_frame_of_a_constraint():
    c = ConstraintSet([Constraint("c", Point.at([0, 0, 0], frame="moving/tipp"), Point.at([0, 0, 0]), "inside", 1.0)])
    with pytest.raises(UnknownNameError, match='Did you mean "moving/tip"'):
        Controller(PAIR, c, VelocityTask(), period=T)


def test_solver_for_poses_refuses_another_task():
    with pytest.raises(InputError, match='solver "lp" needs a PoseTask'):
        free(solver="lp")


def test_entity_with_the_name_of_a_frame():
    c = ConstraintSet([Constraint("c", TIP, Point.at([0, 0, 0], entity="parked/tip"), "inside", 1.0)])
    with pytest.raises(InputError, match='"parked/tip" is a frame'):
        Controller(PAIR, c, VelocityTask(), period=T)


def on(name: str, first: Any, second: Any, **options: Any) -> ConstraintSet:
    return ConstraintSet([Constraint(name, first, second, "outside", 0.0, **options)])


ORIGIN = [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("first", "second", "group"),
    [
        (Point.at(ORIGIN), Point.at([1, 0, 0]), "moving"),
        (Point.at(ORIGIN, entity="e"), Point.at([1, 0, 0]), "moving"),
        (Point.at(ORIGIN, frame="parked/tip"), Point.at(ORIGIN), "moving"),
        (Point.at(ORIGIN, frame="moving/tip"), Point.at(ORIGIN), "parked"),
        # Both move, but as one body: between them nothing ever changes.
        (Point.at(ORIGIN, frame="moving/tip"), Point.at([0, 0, 1], frame="moving/tip"), "moving"),
        (Point.at(ORIGIN, frame="moving/tip"), Point.at(ORIGIN, frame="moving/frame8"), "moving"),
        (Point.at(ORIGIN, frame="moving/frame6"), Point.at(ORIGIN, frame="moving/frame3"), "first two"),
    ],
)
def test_constraint_that_no_decided_joint_can_influence(first, second, group):
    robot = PAIR.with_group("first two", ["moving/joint1", "moving/joint2"])
    with pytest.raises(InactiveConstraintError, match='constraint "useless" is enforced'):
        Controller(robot, on("useless", first, second), VelocityTask(), period=T, group=group)
    watched = on("useless", first, second, enforced=False)
    assert Controller(robot, watched, VelocityTask(), period=T, group=group).group == group


def test_constraint_between_two_bodies_of_one_arm_is_none_of_those():
    c = on("self", Point.at(ORIGIN, frame="moving/tip"), Point.at(ORIGIN, frame="moving/frame2"))
    assert Controller(PAIR, c, VelocityTask(), period=T, group="moving").constraints.names == ("self",)


def test_errors_are_ours_and_value_errors():
    with pytest.raises(ValueError, match="eta T"):
        paper(eta=1e6)
    assert issubclass(InactiveConstraintError, ActiveConstraintsError)


# Measurements --------------------------------------------------------------------------------------------------------


def spoiled(values: Array, place: int, value: float) -> Array:
    out = np.array(values, dtype=float)
    out[place] = value
    return out


@pytest.mark.parametrize("value", [NAN, INF, -INF])
@pytest.mark.parametrize("field", ["q", "qdot", "reference"])
def test_numbers_that_are_not_finite(field, value):
    for c in (paper(), paper(solver="lp"), paper(guard="off")):
        reference = REFERENCE(0.0)
        measurement = good()
        if field == "reference":
            reference = spoiled(reference, 6, value)
        else:
            measurement = measurement._replace(**{field: spoiled(getattr(measurement, field), 13, value)})
        refused(c, c.step(measurement, reference), f"{field}: expected finite numbers, got", str(value))


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("q", np.zeros(15), "q: expected shape (16), got (15,)"),
        ("q", np.zeros((16, 1)), "q: expected shape (16), got (16, 1)"),
        ("q", 0.3, "q: expected shape (16), got ()"),
        ("q", [], "q: expected shape (16), got (0,)"),
        ("q", None, "q"),
        ("q", "abc", "q: expected numbers"),
        ("q", [["a"] * 16], "q: expected numbers"),
        ("q", [[1.0], [1.0, 2.0]], "q: expected numbers"),
        ("q", {"joint1": 1.0}, "q: expected numbers"),
        ("q", object(), "q: expected numbers"),
        ("qdot", np.zeros(17), "qdot: expected shape (16), got (17,)"),
        ("qdot", None, "qdot"),
        ("reference", np.zeros(7), "reference: expected shape (8), got (7,)"),
        ("reference", "pose", "reference: expected numbers"),
        ("reference", None, "reference"),
        ("t", NAN, "t: expected"),
        ("t", INF, "t: expected"),
        ("t", -INF, "t: expected"),
        ("t", "noon", "t: expected one number"),
        ("t", None, "t: expected one number"),
        ("t", True, "t: expected one number"),
        ("t", [1.0], "t: expected one number"),
        ("t", 10**400, "t"),
        ("t", 1j, "t: expected one number"),
    ],
)
def test_inputs_of_the_wrong_form(field, value, words):
    c = paper()
    if field == "reference":
        command = c.step(good(), value)
    else:
        command = c.step(good()._replace(**{field: value}), REFERENCE(0.0))
    refused(c, command, words)


@pytest.mark.parametrize("measurement", [None, 3, "measurement", {}, (), SimpleNamespace(), SimpleNamespace(t=5.0)])
def test_things_that_are_no_measurement(measurement):
    c = paper()
    refused(c, c.step(measurement, REFERENCE(0.0)), "has no attribute")


def same(value: Any) -> None:
    """The command for this q is that for START itself, to the bit."""
    a, b = paper(), paper()
    expected = a.step(good(), REFERENCE(0.1))
    got = b.step(good()._replace(q=value), REFERENCE(0.1))
    assert got.state == State.RUN
    np.testing.assert_array_equal(got.qdot, expected.qdot)


def test_forms_that_mean_the_same():
    strided = np.zeros((16, 3))
    strided[:, 1] = START
    read_only = START.copy()
    read_only.setflags(write=False)
    for value in (
        START.tolist(),
        tuple(START),
        strided[:, 1],
        START[::-1].copy()[::-1],
        read_only,
        np.asfortranarray(START),
        START.astype(">f8"),
        START.astype(object),
        np.ma.masked_array(START),
    ):
        same(value)


def test_single_precision_and_whole_numbers_are_taken():
    c = free()
    command = c.step(Measurement(1, np.zeros(16, dtype=int), np.zeros(16, dtype=np.float32)), [0] * 8)
    assert command.state == State.DEGRADED and "moving/joint5 is at 0, outside its range" in command.reason
    command = c.step(Measurement(2, START.astype(np.float32), np.zeros(16, dtype=int)), np.zeros(8, dtype=bool))
    assert command.state == State.RUN and command.expires == pytest.approx(2.0 + 2 * T)


def test_time_may_be_any_real_number():
    c = free()
    for t in (1, np.float32(2.0), np.int64(3), np.float64(4.0), 5.0):
        command = c.step(Measurement(t, START, STILL), np.zeros(8))
        assert command.state == State.RUN and command.expires == pytest.approx(float(t) + 2 * T)


def _read_only(x):
    x = x.copy()
    x.setflags(write=False)
    return x


def _strided(x):
    return np.column_stack([x, -x])[:, 0]


@pytest.mark.parametrize("form", [list, _read_only, _strided, lambda x: x[None][0].astype(object)])
def test_the_form_of_the_inputs_changes_nothing(form):
    """Compiled code reads contiguous arrays itself; whatever else comes is read another way, to the same commands."""
    direct, other = paper(), paper()
    for k in range(1, 4):
        x, wanted = START + 1e-4 * k, REFERENCE(0.1 * k)
        a = direct.step(Measurement(k * T, x, STILL), wanted)
        b = other.step(Measurement(k * T, form(x), form(STILL)), form(wanted))
        assert a.state == b.state == State.RUN and a.expires == b.expires
        np.testing.assert_array_equal(np.delete(a.record, Head.CYCLE_US), np.delete(b.record, Head.CYCLE_US))
    assert direct._direct and not other._direct


def test_what_cannot_be_read_does_not_slow_down_what_can():
    """A refused measurement leaves the direct way open."""
    c = paper()
    for t, q in ((T, START), (T, START), (2 * T, START[:-1]), (np.nan, START), (3 * T, START)):
        c.step(Measurement(t, q, STILL), REFERENCE(0.0))
    assert c._direct


def test_inputs_are_not_kept():
    """What the caller does to its arrays afterwards changes nothing, and commands are not views of the controller."""
    c = paper()
    q = START.copy()
    first = c.step(Measurement(1.0, q, STILL), REFERENCE(0.0))
    margins, qdot = np.array(first.margins), first.qdot.copy()
    q[:] = NAN
    c.step(Measurement(2.0, START + 0.001, STILL), REFERENCE(0.3))
    np.testing.assert_array_equal(np.asarray(first.margins), margins)
    np.testing.assert_array_equal(first.qdot, qdot)


@pytest.mark.parametrize("t", [T, 0.5 * T, 0.0, -1.0])
def test_time_that_does_not_advance(t):
    c = paper()
    assert c.step(good(), REFERENCE(0.0)).state == State.RUN
    refused(c, c.step(good()._replace(t=t), REFERENCE(0.0)), f"t: expected a time after {T} s, got {t}")


def test_time_that_is_refused_is_forgotten():
    """After a time of infinity the clock goes on where it was."""
    c = paper()
    c.step(good(0), REFERENCE(0.0))
    for bad in (INF, NAN, 10**400, "x"):
        assert c.step(good()._replace(t=bad), REFERENCE(0.0)).state == State.FAULT
    assert c.step(good(1), REFERENCE(0.0)).state == State.RUN


def test_time_of_a_refused_measurement_may_be_sent_again():
    c = paper()
    assert c.step(good()._replace(q=np.zeros(3)), REFERENCE(0.0)).state == State.FAULT
    assert c.step(good(), REFERENCE(0.0)).state == State.RUN


ENTITIES = [
    (None, 'unknown entity "table"'),
    ({}, 'unknown entity "table"'),
    ({"tabel": TABLE["table"]}, "Known: tabel"),
    ({"table": Entity(spoiled(pose(ORIGIN), 2, NAN), np.zeros(6))}, 'pose of entity "table": expected finite'),
    ({"table": Entity(1.1 * pose(ORIGIN), np.zeros(6))}, 'pose of entity "table": expected a unit dual quaternion'),
    ({"table": Entity(np.zeros(8), np.zeros(6))}, 'pose of entity "table": expected a unit dual quaternion'),
    ({"table": Entity(pose(ORIGIN)[:7], np.zeros(6))}, 'pose of entity "table": expected shape (8)'),
    ({"table": Entity(pose(ORIGIN), spoiled(np.zeros(6), 5, INF))}, 'twist of entity "table": expected finite'),
    ({"table": Entity(pose(ORIGIN), np.zeros(5))}, 'twist of entity "table": expected shape (6)'),
    ({"table": Entity(pose(ORIGIN), None)}, 'twist of entity "table"'),
    ({"table": None}, 'entity "table": expected an Entity'),
    ({"table": pose(ORIGIN)}, 'entity "table": expected an Entity'),
    (["lamp"], 'unknown entity "table"'),
    (7, "not iterable"),
]


@pytest.mark.parametrize(("entities", "words"), ENTITIES)
def test_entities_that_are_refused(entities, words):
    c = with_entity()
    refused(c, c.step(good()._replace(entities=entities), np.zeros(8)), words)


def test_entities_nobody_asked_for_are_ignored():
    c = with_entity()
    more = {**TABLE, "lamp": Entity("nonsense", None)}
    assert c.step(good()._replace(entities=more), np.zeros(8)).state == State.RUN
    assert paper().step(good()._replace(entities=more), REFERENCE(0.0)).state == State.RUN


def test_entity_as_a_dq():
    a, b = with_entity(), with_entity()
    x = pose([0.0, 0.0, -0.06], [0.1, 0.0, 0.0])
    down = np.full(8, -0.02)
    first = a.step(good()._replace(entities={"table": Entity(x, np.zeros(6))}), down)
    second = b.step(good()._replace(entities={"table": Entity(DQ(x), np.zeros(6))}), down)
    np.testing.assert_array_equal(first.qdot, second.qdot)
    assert first.margins["wall"] == second.margins["wall"] != 0.0


# Nothing that is thrown at it makes `step` raise ---------------------------------------------------------------------


class Hostile:
    """Raises whatever is done with it."""

    def _no(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("hostile")

    __array__ = __float__ = __len__ = __iter__ = __getitem__ = __repr__ = __str__ = __lt__ = __gt__ = __eq__ = _no
    __hash__ = object.__hash__

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError("hostile")


numbers = st.floats(allow_nan=True, allow_infinity=True, width=64) | st.integers() | st.booleans()
junk = st.one_of(
    st.none(),
    numbers,
    st.text(max_size=5),
    st.binary(max_size=5),
    st.complex_numbers(),
    st.lists(numbers, max_size=17),
    st.dictionaries(st.sampled_from(["table", "x"]), numbers, max_size=2),
    st.builds(lambda: object()),
    st.sampled_from(
        [START, STILL, REFERENCE(0.0), np.zeros((2, 8)), np.array("x"), np.array(None), DQ([1.0]), np.datetime64("NaT")]
    ),
    st.lists(numbers, min_size=16, max_size=16).map(
        lambda x: np.array([float(v) for v in x if abs(v) < 1e300 or v != v])
    ),
    st.lists(st.lists(numbers, max_size=3), max_size=3),
)
entity_junk = st.one_of(
    junk,
    st.dictionaries(st.sampled_from(["table", "x"]), junk | st.builds(Entity, junk, junk) | st.just(TABLE["table"])),
)
FUZZED = {
    name: build() for name, build in {"paper": paper, "entity": with_entity, "lp": lambda: paper(solver="lp")}.items()
}
ROWED = free(user_rows=2)


def survives(c: Controller, command: Any) -> None:
    assert isinstance(command, Command)
    assert command.qdot.shape == (8,) and np.isfinite(command.qdot).all()
    assert isinstance(command.state, State) and isinstance(command.reason, str)
    if command.state >= State.HOLD:
        assert not command.qdot.any() and command.reason


@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")  # of NumPy, where nothing is compiled
@settings(max_examples=cases(600, 60), deadline=None, derandomize=True)
@given(name=st.sampled_from(sorted(FUZZED)), t=junk, q=junk, qdot=junk, reference=junk, entities=entity_junk)
@example("paper", 0.1, np.full(16, 1e300), STILL, REFERENCE(0.0), None)
@example("paper", 0.1, START, np.full(16, 1e308), REFERENCE(0.0), None)
@example("lp", 0.1, np.full(16, 1e300), STILL, REFERENCE(0.0), None)
@example("entity", 0.1, START, STILL, np.zeros(8), {"table": Entity(pose([1e300, 0, 0]), np.full(6, 1e300))})
def test_step_never_raises(name, t, q, qdot, reference, entities):
    c = FUZZED[name]
    survives(c, c.step(Measurement(t, q, qdot, entities=entities), reference))


@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")  # of NumPy, where nothing is compiled
@settings(max_examples=cases(300, 40), deadline=None, derandomize=True)
@given(measurement=junk, reference=junk, rows=junk | st.builds(Rows, junk, junk, junk, junk))
@example(good(), np.zeros(8), Rows(np.full((2, 8), 1e308), [0.1, 0.1]))
def test_step_never_raises_with_rows_of_the_user(measurement, reference, rows):
    survives(ROWED, ROWED.step(measurement, reference, rows))
    moving = ROWED.step(Measurement(1.0 + ROWED.cycles, START, STILL), np.zeros(8), rows)
    survives(ROWED, moving)


def test_objects_that_raise_whatever_is_done_with_them():
    """Not even their text can be had for the reason."""
    for c, field in ((paper(), "t"), (paper(), "q"), (paper(), "qdot"), (with_entity(), "entities")):
        reference = REFERENCE(0.0) if isinstance(c.task, PoseTask) else np.zeros(8)
        refused(c, c.step(good()._replace(**{field: Hostile()}), reference), "hostile")
    for hostile in (Hostile(), Entity(Hostile(), Hostile())):
        c = with_entity()
        refused(c, c.step(good()._replace(entities={"table": hostile}), np.zeros(8)), "hostile")
    c = paper()
    refused(c, c.step(good(), Hostile()), "hostile")
    c = paper()
    refused(c, c.step(Hostile(), REFERENCE(0.0)), "hostile")
    for rows in (Hostile(), Rows(np.eye(8)[:1], [0.1], Hostile())):
        c = free(user_rows=1)
        refused(c, c.step(good(), np.zeros(8), rows))


@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")  # of NumPy, where nothing is compiled
def test_a_million_radians():
    """Finite, absurd, and survived: a joint at 1e300 is out of its range and is told to come back."""
    for huge in (1e6, 1e12, 1e300):
        for c in (paper(), paper(guard="off"), paper(solver="lp")):
            survives(c, c.step(good()._replace(q=spoiled(START, 2, huge)), REFERENCE(0.0)))
            survives(c, c.step(good(1)._replace(q=spoiled(START, 0, huge)), REFERENCE(0.0)))
            survives(c, c.step(good(2)._replace(qdot=spoiled(STILL, 12, huge)), REFERENCE(0.0)))


def test_reference_velocity_of_a_million():
    c = free()
    command = c.step(good(), np.full(8, 1e6))
    np.testing.assert_allclose(command.qdot, PAIR.limits.velocity[:8], rtol=1e-9)


# Rows of the user ----------------------------------------------------------------------------------------------------


def test_rows_of_the_user_act_like_constraints():
    """jacobian v >= -eta margin - residual for the decided joints, each verified; without rows nothing acts."""
    c = free(user_rows=3)
    wish = np.full(8, 0.04)
    np.testing.assert_allclose(c.step(good(0), wish).qdot, wish, atol=1e-12)
    rows = Rows(-np.eye(8)[:2], [0.01, 0.01], eta=2.0, residual=[0.0, 0.005])
    command = c.step(good(1), wish, rows)
    np.testing.assert_allclose(command.qdot[:3], [0.02, 0.025, 0.04], atol=1e-9)
    assert command.state == State.RUN
    np.testing.assert_allclose(c.ring[1, c.columns["multiplier"]][:3], [0.02, 0.015, 0.0], atol=1e-9)
    np.testing.assert_allclose(c.step(good(2), wish).qdot, wish, atol=1e-12)


def test_rows_of_the_user_hold_beside_constraints():
    """Random rows on S5: A v >= -eta margin - residual in every cycle, whatever the constraints do."""
    rng = np.random.default_rng(1)
    c = paper(user_rows=4)
    q = START.copy()
    for k in range(cases(500, 40)):
        J, margin = rng.normal(size=(4, 8)), rng.exponential(0.01, 4)
        command = c.step(Measurement(k * T, q, STILL), REFERENCE(k * T), Rows(J, margin, eta=10.0, residual=0.001))
        assert command.state == State.RUN
        assert np.all(J @ command.qdot >= -10.0 * margin - 0.001 - 1e-9)
        q[:8] += T * command.qdot


def test_violated_row_recovers_no_faster_than_the_rest():
    c = free(user_rows=1, recovery_linear=0.01)
    command = c.step(good(), np.zeros(8), Rows(np.eye(8)[:1], [-5.0], eta=2.0))
    assert command.qdot[0] == pytest.approx(0.01, abs=1e-9)


@pytest.mark.parametrize("period", [1e-3, 3e-3, 7e-3, 1.0 / 3.0])
def test_gain_of_rows_may_be_one_over_the_period(period):
    c = free(user_rows=1, period=period, limit_eta=1.0 / period)
    assert c.step(good(), np.zeros(8), Rows(np.eye(8)[:1], [0.1], eta=1.0 / period)).state == State.RUN


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (Rows(np.eye(8)[:3], np.zeros(3)), "got 3 rows, expected at most 2; raise user_rows"),
        (Rows(np.eye(7)[:1], [0.0]), "jacobian of rows: expected shape (any, 8)"),
        (Rows(np.eye(8)[0], 0.0), "jacobian of rows: expected shape (any, 8), got (8,)"),
        (Rows(np.eye(8)[:2], [0.0]), "margin of rows: expected shape (2), got (1,)"),
        (Rows(np.eye(8)[:2], [0.0, NAN]), "margin of rows: expected finite"),
        (Rows(np.full((1, 8), INF), [0.0]), "jacobian of rows: expected finite"),
        (Rows(np.eye(8)[:2], [0.0, 0.0], residual=[1.0, 2.0, 3.0]), "residual of rows: expected shape (2), got (3,)"),
        (Rows(np.eye(8)[:2], [0.0, 0.0], residual=NAN), "residual of rows: expected finite"),
        (Rows(np.eye(8)[:1], [0.0], eta=0.0), "eta of rows: expected a number > 0, got 0"),
        (Rows(np.eye(8)[:1], [0.0], eta=251.0), "eta of rows: expected eta T <= 1, got eta = 251"),
        (Rows(np.eye(8)[:1], [0.0], eta=NAN), "eta of rows: expected a finite number"),
        (Rows(np.eye(8)[:1], [0.0], eta="fast"), "eta of rows: expected one number"),
        (Rows(np.eye(8)[:1], [0.0], eta=[1.0]), "eta of rows: expected one number"),
        ("rows", "has no attribute"),
    ],
)
def test_rows_that_are_refused(rows, words):
    c = free(user_rows=2)
    refused(c, c.step(good(), np.zeros(8), rows), words)


def test_rows_where_none_were_announced():
    c = free()
    refused(c, c.step(good(), np.zeros(8), Rows(np.eye(8)[:1], [0.0])), "got 1 rows, expected at most 0")


def test_rows_of_a_refused_cycle_are_gone():
    c = free(user_rows=1)
    c.step(good(0), np.full(8, 0.04), Rows(-np.eye(8)[:1], [0.0]))
    refused(c, c.step(good(1), np.full(8, 0.04), Rows(-np.eye(8)[:2], [0.0, 0.0])))
    np.testing.assert_allclose(c.step(Measurement(1e6, START, STILL), np.full(8, 0.04)).qdot, 0.04, atol=1e-12)


# Commands ------------------------------------------------------------------------------------------------------------


def test_command_expires_after_two_periods():
    c = paper()
    assert c.step(good(4), REFERENCE(0.0)).expires == pytest.approx(5 * T + 2 * T)


def test_margins_of_a_fault_are_those_of_the_last_usable_cycle():
    c = paper()
    before = c.step(good(0), REFERENCE(0.0))
    after = c.step(good(1)._replace(q=np.zeros(3)), REFERENCE(0.0))
    assert dict(after.margins) == dict(before.margins)
    assert c.ring[1, c.columns["where"]][0] == -1.0 and c.ring[1, c.columns["reason"]][0] == Reason.MEASUREMENT


@pytest.mark.parametrize("bad", [{"q": np.full(16, NAN)}, {"q": np.zeros(3)}])
def test_multipliers_and_slacks_of_a_fault_are_zero(bad):
    """Also where the cycle before had some."""
    tip = PAIR.kinematics(START).translation("moving/tip")
    floor = Constraint("floor", TIP, Plane.through(tip, [0, 0, 1]), "outside", 0.0)
    c = Controller(PAIR, ConstraintSet([floor]), VelocityTask(), period=T, group="moving")
    down = -0.04 * np.sign(PAIR.kinematics(START).jacobian("moving/tip")[2, :8])
    assert c.step(good(0), down).multipliers["floor"] > 0.0
    command = c.step(good(1)._replace(**bad), down)
    assert command.state == State.FAULT and command.multipliers["floor"] == 0.0
    assert not c.ring[1, c.columns["multiplier"]].any() and not c.ring[1, c.columns["slack"]].any()


def test_start_that_violates_is_said_and_recovered_from():
    """At most recovery_linear, then eta |margin|; DEGRADED until the violation is below 10 um."""
    tip = PAIR.kinematics(START).translation("moving/tip")
    floor = Constraint("floor", TIP, Plane.through(tip + np.array([0, 0, 0.006]), [0, 0, 1]), "outside", 0.0)
    c = Controller(
        PAIR, ConstraintSet([floor]), VelocityTask(), period=T, eta=5.0, group="moving", recovery_linear=0.01
    )
    run = closed_loop(c, START, lambda t: np.zeros(8), cases(500, 60))
    margins = run.margins[:, 0]
    assert margins[0] == pytest.approx(-0.006, abs=1e-12)
    for command, margin in zip(run.commands, margins, strict=True):
        assert command.state == (State.DEGRADED if margin < -1e-5 else State.RUN)
    assert run.commands[0].reason == 'constraint "floor" is violated by 0.006 m and is being left'
    expected = np.empty(len(margins))
    expected[0] = -0.006
    for k in range(1, len(margins)):
        expected[k] = expected[k - 1] + T * min(-5.0 * expected[k - 1], 0.01)
    np.testing.assert_allclose(margins, expected, atol=2e-6)


def test_two_constraints_with_gains_of_their_own():
    tip = PAIR.kinematics(START).translation("moving/tip")
    planes = [
        Constraint("slow", TIP, Plane.through(tip - [0, 0, 0.01], [0, 0, 1]), "outside", 0.0),
        Constraint("fast", TIP, Plane.through(tip - [0.01, 0, 0], [1, 0, 0]), "outside", 0.0),
    ]
    c = Controller(PAIR, ConstraintSet(planes), VelocityTask(), period=1e-3, eta={"slow": 0.5, "": 2.0}, group="moving")
    J = PAIR.kinematics(START).jacobian("moving/tip")[:3, :8]
    wish = np.linalg.lstsq(J, [-0.04, 0.0, -0.04], rcond=None)[0]
    command = c.step(good(), wish)
    assert (J @ command.qdot)[2] == pytest.approx(-0.005, rel=1e-3)
    assert (J @ command.qdot)[0] == pytest.approx(-0.02, rel=1e-3)


def test_group_of_all_joints_is_the_default():
    c = Controller(SEVEN, ConstraintSet(), VelocityTask(), period=T)
    assert c.joints == SEVEN.joints and c.group == "all"


def test_second_controller_does_not_disturb_the_first():
    """Two controllers step in turn; each commands what it would command alone."""
    alone, one, two = paper(), paper(), paper()
    expected = [alone.step(good(k), REFERENCE(0.05 * k)).qdot for k in range(10)]
    for k in range(10):
        np.testing.assert_array_equal(one.step(good(k), REFERENCE(0.05 * k)).qdot, expected[k])
        two.step(good(k)._replace(q=START + 0.002), REFERENCE(2.0))


def test_line_of_a_line():
    """Constraints on an angle have their margin in radians and recover at recovery_angular."""
    cone = Constraint(
        "cone",
        Line.z_axis("moving/frame6"),
        Line.through([0, 0, 0], [0, 0, -1]),
        "inside",
        0.05,
        "line_line_angle",
    )
    c = Controller(
        PAIR,
        ConstraintSet([cone]),
        VelocityTask(),
        period=1e-3,
        eta=100.0,
        group="moving",
        recovery_linear=1e-4,
        recovery_angular=0.02,
    )
    command = c.step(good(), np.zeros(8))
    angle = np.arccos(-PAIR.kinematics(START).rotation("moving/frame6")[2, 2])
    assert command.margins["cone"] == pytest.approx(0.05 - angle, abs=1e-9) and angle > 0.06
    after = c.step(Measurement(1.0, START + 1e-3 * np.r_[command.qdot, np.zeros(8)], STILL), np.zeros(8))
    assert after.margins["cone"] - command.margins["cone"] == pytest.approx(0.02e-3, rel=1e-3)


def test_outcome_of_a_plain_cycle_is_all_zero():
    c = paper()
    c.step(good(), REFERENCE(0.0))
    assert [int(c._outcome[slot]) for slot in Slot if slot != Slot.WHERE] == [0] * (len(Slot) - 1)
