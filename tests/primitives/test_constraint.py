"""Declared constraints: what they take, how they compose, and which side is safe."""

from collections.abc import Callable
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point, Segment
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import evaluate
from primitives.registry import pairs
from tests.primitives.arms import ARMS

TIP = Point.at([0.0, 0.0, 0.0], frame="frame8")
SHAFT = Line.z_axis("frame6")
PORT = Point.at([0.0, 0.0, 0.0])
AXIS = Line.through([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
FLOOR = Plane.through([0.0, 0.0, -0.08], [0.0, 0.0, 1.0])


def constraint(**changes: Any) -> Constraint:
    fields: dict[str, Any] = {"name": "floor", "first": TIP, "second": FLOOR, "keep": "outside", "safe_distance": 0.01}
    return Constraint(**(fields | changes))


def test_the_pair_is_that_of_the_elements() -> None:
    assert constraint().definition is pairs["point_plane"]
    assert constraint(first=SHAFT, second=AXIS).definition is pairs["line_line"]
    assert constraint(first=SHAFT, second=AXIS, pair="line_line_angle").definition.unit == "rad"
    assert constraint(first=SHAFT, second=PORT).definition.name == "line_point"
    capsule = Segment.between([0, 0, 0], [0, 0, 0.1], frame="frame6")
    assert constraint(first=capsule, second=capsule).definition.name == "segment_segment"


def test_defaults_are_the_strictest() -> None:
    assert (constraint().safety_class, constraint().enforced) == ("patient", True)
    assert constraint(safe_distance=np.float32(0.5)).safe_distance == 0.5
    assert type(constraint(safe_distance=1).safe_distance) is float
    assert constraint() == constraint() and hash(constraint()) == hash(constraint())
    assert constraint() != constraint(keep="inside")
    with pytest.raises(FrozenInstanceError):
        constraint().safe_distance = 0.0  # type: ignore[misc]


REFUSED: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"name": ""}, InputError, "name of a constraint: expected some text, got ''"),
    ({"name": 3}, InputError, "name of a constraint: expected some text, got 3"),
    ({"first": [0, 0, 0]}, InputError, r'constraint "floor": first: expected an element, got \[0, 0, 0\]'),
    ({"second": None}, InputError, 'constraint "floor": second: expected an element, got None'),
    ({"keep": "outsid"}, UnknownNameError, 'unknown side to keep "outsid". Did you mean "outside"'),
    ({"safety_class": "pacient"}, UnknownNameError, 'unknown safety class "pacient". Did you mean "patient"'),
    ({"safe_distance": -1e-9}, InputError, 'constraint "floor": safe distance: expected a number >= 0, got -1e-09'),
    ({"safe_distance": float("nan")}, InputError, "safe distance: expected a finite number"),
    ({"safe_distance": float("inf")}, InputError, "safe distance: expected a finite number"),
    ({"safe_distance": "far"}, InputError, "safe distance: expected one number, got 'far'"),
    ({"safe_distance": [0.1]}, InputError, "safe distance: expected one number"),
    ({"safe_distance": True}, InputError, "safe distance: expected one number, got True"),
    ({"enforced": "no"}, InputError, "enforced: expected True or False, got 'no'"),
    ({"pair": "point_plan"}, UnknownNameError, 'unknown pair "point_plan". Did you mean "point_plane"'),
    ({"pair": ["point_plane"]}, InputError, "pair: expected the name of a pair"),
    (
        {"pair": "line_line"},
        InputError,
        'pair "line_line" takes a line and a line, in this order; got a point and a plane',
    ),
    ({"first": FLOOR, "second": TIP}, InputError, 'constraint "floor": give the point first and the plane second'),
    ({"first": FLOOR, "second": FLOOR}, UnknownNameError, 'unknown pair "plane_plane"'),
]


@pytest.mark.parametrize(("changes", "error", "message"), REFUSED)
def test_what_cannot_be_meant_is_refused(changes: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        constraint(**changes)


def test_sets_are_joined_and_keep_their_order() -> None:
    a, b, c = constraint(name="a"), constraint(name="b"), constraint(name="c")
    both = ConstraintSet([a]) + ConstraintSet([c, b])
    assert both.names == ("a", "c", "b") and len(both) == 3 and list(both) == [a, c, b]
    assert (both + constraint(name="d")).names == ("a", "c", "b", "d")
    assert both["c"] is c
    assert both == ConstraintSet((a, c, b)) != ConstraintSet((a, b, c))
    assert ConstraintSet().names == () and (ConstraintSet() + both) == both
    assert ConstraintSet(x for x in (a, b)).names == ("a", "b")


def test_enforcing_watches_the_rest() -> None:
    whole = ConstraintSet([constraint(name=n, enforced=n == "C2") for n in ("C1", "C2", "C3")])
    assert [c.enforced for c in whole.enforcing(["C1", "C3"])] == [True, False, True]
    assert [c.enforced for c in whole.enforcing([])] == [False] * 3
    assert [c.enforced for c in whole] == [False, True, False], "the set itself does not change"
    assert whole.enforcing(whole.names).names == whole.names
    with pytest.raises(UnknownNameError, match=r'unknown constraint "C4"\. Known: C1, C2, C3\.'):
        whole.enforcing(["C1", "C4"])


SET_REFUSED: list[tuple[Callable[[], object], type[Exception], str]] = [
    (lambda: ConstraintSet([constraint(), constraint()]), InputError, 'two constraints are called "floor"'),
    (
        lambda: ConstraintSet([constraint()]) + constraint(keep="inside"),
        InputError,
        'two constraints are called "floor"',
    ),
    (lambda: ConstraintSet([TIP]), InputError, "expected a Constraint, got Point"),  # type: ignore[list-item]
    (lambda: ConstraintSet() + 3, InputError, "expected a Constraint, got 3"),  # type: ignore[operator]
    (lambda: ConstraintSet(constraint()), InputError, "expected several constraints"),  # type: ignore[arg-type]
    (
        lambda: ConstraintSet([constraint()])["flor"],
        UnknownNameError,
        'unknown constraint "flor". Did you mean "floor"',
    ),
    (lambda: ConstraintSet()["floor"], UnknownNameError, "Known: none are declared"),
]


@pytest.mark.parametrize(("make", "error", "message"), SET_REFUSED)
def test_what_is_no_set_is_refused(make: Callable[[], object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make()


def test_safe_means_a_margin_of_zero_or_more() -> None:
    """The paper's tilde distances, printed after its program, have the opposite sign: none of these would hold."""
    robot, q = ARMS["neuro8"].robot, np.array([0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    tip = robot.kinematics(q).translation("frame8")

    def margin(second: Any, keep: str, safe: float) -> float:
        return float(
            evaluate(robot, ConstraintSet([constraint(second=second, keep=keep, safe_distance=safe)]), q).margin[0]
        )

    x, z = 0.01 * np.eye(3)[[0, 2]]
    for beside in (Point.at(tip + x), Line.through(tip + x, z)):
        assert margin(beside, "outside", 0.004) == pytest.approx(0.006)
        assert margin(beside, "outside", 0.012) == pytest.approx(-0.002)
        assert margin(beside, "inside", 0.012) == pytest.approx(0.002)
        assert margin(beside, "inside", 0.004) == pytest.approx(-0.006)
    above, below = Plane.through(tip - z, z), Plane.through(tip + z, z)
    assert margin(above, "outside", 0.0) == pytest.approx(0.01)
    assert margin(below, "outside", 0.0) == pytest.approx(-0.01)
    assert margin(below, "inside", 0.0) == pytest.approx(0.01)
