"""Elements: their dual quaternions and geometries are the same thing, and what is none is refused."""

import copy
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from dqrobotics import DQ, E_, cross, dot, k_

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.errors import InputError

NAN = float("nan")
RNG = np.random.default_rng(11)


def random_pose() -> Array:
    r = RNG.normal(size=4)
    return dq.from_rotation_translation(r / np.linalg.norm(r), RNG.normal(size=3))


def moved(x: Array, element: Element) -> Element:
    """The element after a rigid motion x, all done on its dual quaternion."""
    value, back = np.array(element.dual_quaternion), dq.conjugate(x)
    if isinstance(element, Point):  # p' = r p r* + t
        turned = dq.product(dq.product(np.r_[x[:4], np.zeros(4)], value), np.r_[back[:4], np.zeros(4)])
        return Point(turned + np.r_[0.0, dq.translation(x), np.zeros(4)])
    if isinstance(element, Line):  # l' = x l x*
        return Line(dq.product(dq.product(x, value), back))
    if isinstance(element, Plane):  # n' = r n r*, d' = d + <t, n'>
        n = dq.product(
            dq.product(np.r_[x[:4], np.zeros(4)], np.r_[value[:4], np.zeros(4)]), np.r_[back[:4], np.zeros(4)]
        )
        return Plane(np.r_[0.0, n[1:4], value[4] + dq.translation(x) @ n[1:4], np.zeros(3)])
    return Segment(dq.product(x, value), length=element.length)


def invariants(kind: str, g: Array) -> Array:
    """What of a geometry is the element itself: of lines and planes the point is anywhere on them."""
    point, direction = g[:3], g[3:6]
    if kind == "line":
        return np.r_[direction, np.cross(point, direction)]
    if kind == "plane":
        return np.r_[direction, point @ direction]
    return g


ELEMENTS: dict[str, Callable[[Array, Array], Element]] = {
    "point": lambda p, q: Point.at(p),
    "line": lambda p, q: Line.through(p, q - p),
    "plane": lambda p, q: Plane.through(p, q - p),
    "segment": lambda p, q: Segment.between(p, q),
}


@pytest.mark.parametrize("kind", ELEMENTS)
def test_a_dual_quaternion_moves_as_its_geometry(kind: str) -> None:
    for _ in range(200):
        p, q, x = RNG.normal(size=3), RNG.normal(size=3), random_pose()
        element = ELEMENTS[kind](p, q)
        g = element.geometry
        R, t = dq.rotation_matrix(x), dq.translation(x)
        expected = np.r_[t + R @ g[:3], R @ g[3:6], g[6:]]
        np.testing.assert_allclose(
            invariants(kind, moved(x, element).geometry), invariants(kind, expected), rtol=0, atol=1e-12
        )
        assert element.kind == kind
        if kind != "point":
            assert abs(np.linalg.norm(g[3:6]) - 1.0) <= 1e-15
            l = (q - p) / np.linalg.norm(q - p)
            np.testing.assert_allclose(g[3:6], l, atol=1e-15)
            np.testing.assert_allclose(invariants(kind, g), invariants(kind, np.r_[p, l, g[6:]]), atol=1e-14)
        if kind == "segment":
            np.testing.assert_allclose(g[:3] + g[6] * g[3:6], q, atol=1e-15 + 1e-15 * np.linalg.norm(q))


def test_the_stored_forms_are_those_of_the_paper() -> None:
    p, l = np.array([0.1, -0.2, 0.3]), np.array([2.0, -3.0, 6.0]) / 7.0
    np.testing.assert_array_equal(Point.at(p).dual_quaternion, [0, *p, 0, 0, 0, 0])
    np.testing.assert_allclose(Line.through(p, 7 * l).dual_quaternion, [0, *l, 0, *np.cross(p, l)], atol=1e-16)
    np.testing.assert_allclose(Plane.through(p, 7 * l).dual_quaternion, [0, *l, p @ l, 0, 0, 0], atol=1e-16)
    np.testing.assert_allclose(conversions.line(p, l), Line.through(p, l).dual_quaternion, atol=1e-16)
    np.testing.assert_allclose(conversions.plane(l, p), Plane.through(p, l).dual_quaternion, atol=1e-16)
    assert Line.z_axis("tip") == Line.through([0, 0, 0], [0, 0, 1], frame="tip")
    start = dq.translation(np.array(Segment.between(p, p + l).dual_quaternion))
    np.testing.assert_allclose(start, p, atol=1e-16)


def test_segments_along_every_axis_have_a_pose() -> None:
    for axis in (*np.eye(3), *-np.eye(3), [1e-9, 0, 1], [1, 1, 1e-12]):
        segment = Segment.between([0, 0, 0], np.asarray(axis) * 0.2)
        np.testing.assert_allclose(segment.geometry[3:6], axis / np.linalg.norm(axis), atol=1e-15)


def test_whatever_dq_robotics_computes_is_taken() -> None:
    """Its products leave a real part of 1e-17 where the algebra has none; it is stored as zero."""
    rounded = 0
    for _ in range(200):
        r, t = DQ(RNG.normal(size=4)).normalize(), DQ(np.r_[0.0, RNG.normal(size=3)])
        x = r + 0.5 * E_ * t * r
        l = r * k_ * r.conj()
        line, plane = x * k_ * x.conj(), l + E_ * dot(t, l)
        elements = Line(line), Line(l + E_ * cross(t, l)), Plane(plane), Point(x.translation()), Segment(x, length=0.1)
        rounded += line.vec8()[0] != 0.0
        for element, given in zip(elements, (line, l + E_ * cross(t, l), plane, x.translation(), x), strict=True):
            np.testing.assert_allclose(element.dual_quaternion, given.vec8(), atol=1e-14)
        assert all(np.all(e.dual_quaternion[[0, 4]] == 0.0) for e in elements[:2])
        np.testing.assert_allclose(elements[0].geometry, elements[1].geometry, atol=1e-14)
    assert rounded > 20


def test_what_is_stored_is_exactly_of_unit_norm() -> None:
    """Within its tolerance a dual quaternion is mended, so that no distance is off by that tolerance."""
    line = Line(conversions.line([0.3, 0.2, 0.1], [1.0, 2.0, 3.0]) * (1 + 4e-10))
    plane = Plane(conversions.plane([1.0, 2.0, 3.0], [0.3, 0.2, 0.1]) * (1 + 4e-10))
    segment = Segment(random_pose() * (1 + 4e-7), length=1.0)
    for element in (line, plane, segment):
        assert abs(np.linalg.norm(element.geometry[3:6]) - 1.0) <= 1e-15
        again = type(element)(element.dual_quaternion, length=element.length)
        assert again == element, "what is stored is taken again to the last digit"
    np.testing.assert_allclose(line.dual_quaternion, conversions.line([0.3, 0.2, 0.1], [1.0, 2.0, 3.0]), atol=1e-15)


def test_elements_are_values() -> None:
    given = np.array([0.0, 1, 2, 3, 0, 0, 0, 0])
    a, b = Point(given), Point.at([1, 2, 3])
    given[1] = 7.0
    assert a == b and hash(a) == hash(b) and a != "a point"
    assert a != Point.at([1, 2, 3], frame="tip") and a != Point.at([1, 2, 3], entity="vessel")
    assert Point.at([0, 0, 1]) != Line.z_axis("world")
    x = random_pose()
    assert Segment(x, length=0.1) != Segment(x, length=0.2)
    with pytest.raises(ValueError, match="read-only"):
        a.dual_quaternion[0] = 1.0
    with pytest.raises(FrozenInstanceError):
        a.frame = "tip"  # type: ignore[misc]
    assert replace(a, frame="tip").frame == "tip"
    assert copy.deepcopy(a) == a == pickle.loads(pickle.dumps(a))


ONE = [1.0, 0, 0, 0, 0, 0, 0, 0]
REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: Point.at([0, 0]), r"position of Point: expected shape \(3\), got \(2,\)"),
    (lambda: Point.at([0, NAN, 0]), "position of Point: expected finite numbers"),
    (lambda: Point.at("abc"), "position of Point: expected numbers"),
    (lambda: Line.through([0, 0, 0], [0, 0, 0]), "direction of Line: expected a direction, got a vector of length 0"),
    (lambda: Line.through([0, 0, np.inf], [0, 0, 1]), "point of Line: expected finite"),
    (lambda: Plane.through([0, 0, 0], [0, 1e-12, 0]), "normal of Plane: expected a direction"),
    (lambda: Plane.through([[0, 0, 0]], [0, 1, 0]), "point of Plane: expected shape"),
    (lambda: Segment.between([1, 2, 3], [1, 2, 3]), "Segment from start to end: expected a direction"),
    (lambda: Segment.between([0, 0, NAN], [1, 0, 0]), "start of Segment: expected finite"),
    (lambda: Segment(ONE, length=0.0), "Segment: length in metres: expected a number > 0"),
    (lambda: Segment(ONE, length=NAN), "Segment: length in metres: expected a finite number"),
    (lambda: Segment(ONE, length="long"), "Segment: length in metres: expected one number"),  # type: ignore[arg-type]
    (lambda: Segment(ONE), "Segment: length in metres"),
    (lambda: Segment([2.0, 0, 0, 0, 0, 0, 0, 0], length=1.0), "pose of Segment: expected a unit dual quaternion"),
    (lambda: Segment(np.zeros(8), length=1.0), "pose of Segment: expected a unit dual quaternion"),
    (lambda: Point([0, 1, 2, 3]), r"dual quaternion of Point: expected shape \(8\)"),
    (lambda: Point([1e-6, 1, 2, 3, 0, 0, 0, 0]), "Point: expected a pure quaternion"),
    (lambda: Point([0, 1, 2, 3, 0, 0, 1e-6, 0]), "Point: expected a pure quaternion"),
    (lambda: Line([0, 0, 0, 2.0, 0, 0, 0, 0]), "Line: expected a Plücker line"),
    (lambda: Line([0, 0, 0, 1.0, 0, 0, 0, 1e-6]), "Line: expected a Plücker line"),
    (lambda: Line([1e-6, 0, 0, 1.0, 0, 0, 0, 0]), "Line: expected a Plücker line"),
    (lambda: Line(np.zeros(8)), "Line: expected a Plücker line"),
    (lambda: Line([0, 0, 0, 1.0, NAN, 0, 0, 0]), "dual quaternion of Line: expected finite"),
    (lambda: Plane([0, 0, 0, 1.1, 0, 0, 0, 0]), "Plane: expected a plane"),
    (lambda: Plane([0, 0, 0, 1.0, 0.1, 1e-6, 0, 0]), "Plane: expected a plane"),
    (lambda: Point.at([0, 0, 0], frame="tip", entity="vessel"), "attached to one of them"),
    (lambda: Point.at([0, 0, 0], frame=3), "expected the name of its frame, got 3"),  # type: ignore[arg-type]
    (lambda: Point.at([0, 0, 0], entity=""), "expected the name of its entity, got ''"),
    (lambda: Element(ONE).geometry, "use Point, Line, Plane or Segment"),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_what_is_no_element_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
