"""Rows and residuals: d(margin)/dt = jacobian @ decided velocity + residual, whatever moves, and by whose account."""

from typing import Any

import numpy as np
import pytest
from dqrobotics import DQ, E_, cross, k_
from dqrobotics.robot_modeling import DQ_Kinematics
from scipy.spatial.transform import Rotation

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import Entity, Evaluation, evaluate
from primitives.registry import pairs
from primitives.table import tabulate, used_entities, used_frames
from primitives.vectors import DEGENERATE, OK
from tests.primitives.arms import ARMS, distances, element, random_q, two_arms

NAMES = pairs.names()
NEURO8, SIX, SEVEN = (ARMS[n] for n in ("neuro8", "six", "seven"))
TWO = two_arms("six", "seven")


def some(kind: str, rng: np.random.Generator, **on: str) -> Element:
    g = np.zeros(8)
    g[:3], g[3:6], g[6] = rng.uniform(-0.3, 0.3, 3), rng.normal(size=3), rng.uniform(0.1, 0.5)
    g[3:6] /= np.linalg.norm(g[3:6])
    return element(kind, g, **on)


class Moving:
    """An entity on a path of its own: it turns about an axis of its own through a point that flies on a curve."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.axis, self.start = rng.normal(size=3), Rotation.random(random_state=int(rng.integers(1000)))
        self.at, self.speed, self.bend = rng.normal(size=(3, 3)) * ((0.3,), (1.0,), (0.5,))

    def __call__(self, t: float) -> Entity:
        x, y, z, w = (Rotation.from_rotvec((t + t * t) * self.axis) * self.start).as_quat()
        pose = dq.from_rotation_translation(np.array([w, x, y, z]), self.at + t * self.speed + t * t * self.bend)
        return Entity(pose, np.r_[self.speed + 2 * t * self.bend, (1 + 2 * t) * self.axis])


def rate(distance: Any, h: float = 1e-4) -> Array:
    """Time derivative at t = 0 by central differences of order six.

    Over 6e-3 s one of the segments' closest points leaves an end, where the second derivative jumps: 4e-6 off.
    """
    terms = ((1, 0.75), (2, -0.15), (3, 1 / 60))
    return np.asarray(sum(w * (distance(k * h) - distance(-k * h)) for k, w in terms) / h)


PLACES: dict[str, tuple[dict[str, str], dict[str, str]]] = {
    "arm and world": ({"frame": "a/frame6"}, {}),
    "world and arm": ({}, {"frame": "b/frame7"}),
    "two arms": ({"frame": "a/frame5"}, {"frame": "b/frame7"}),
    "one arm twice": ({"frame": "b/frame7"}, {"frame": "b/frame2"}),
    "arm and entity": ({"frame": "a/frame6"}, {"entity": "vessel"}),
    "entity and arm": ({"entity": "vessel"}, {"frame": "b/frame6"}),
    "two entities": ({"entity": "vessel"}, {"entity": "probe"}),
    "entity and world": ({"entity": "probe"}, {}),
}


@pytest.mark.parametrize("keep", ["outside", "inside"])
@pytest.mark.parametrize("place", PLACES)
def test_margins_change_as_rows_and_residuals_say(place: str, keep: Any) -> None:
    """Everything moves at once: decided joints, joints whose velocity is given (a parked arm's), and entities."""
    rng = np.random.default_rng(21)
    entities = {"vessel": Moving(rng), "probe": Moving(rng)}
    on_first, on_second = PLACES[place]
    cases = []
    for name in NAMES:
        for i in range(5):
            first, second = some(pairs[name].first, rng, **on_first), some(pairs[name].second, rng, **on_second)
            cases.append(Constraint(f"{name}{i}", first, second, keep, 0.02, name))
    constraints, q0 = ConstraintSet(cases), random_q(TWO, rng)
    given, decided, bend = np.zeros(TWO.n), np.zeros(TWO.n), rng.normal(size=TWO.n)
    decided[TWO.group("a")], given[TWO.group("b")] = rng.normal(size=6), rng.normal(size=7)

    def at(t: float) -> Evaluation:
        q = q0 + t * (decided + given) + t * t * bend
        return evaluate(TWO, constraints, q, velocity=given, entities={n: e(t) for n, e in entities.items()})

    now = at(0.0)
    assert (now.status == OK).all()
    expected = rate(lambda t: at(t).margin)
    np.testing.assert_allclose(
        now.jacobian @ decided + now.residual, expected, atol=1e-8 * max(1, np.abs(expected).max())
    )
    np.testing.assert_array_equal(now.margin, (1 if keep == "outside" else -1) * (now.distance - 0.02))
    assert (np.abs(expected) > 1e-3).mean() > 0.9, "nearly everything has to move in this test"
    still = evaluate(TWO, constraints, q0, entities={n: Entity(e(0).pose, np.zeros(6)) for n, e in entities.items()})
    np.testing.assert_array_equal(still.residual, 0.0)
    np.testing.assert_array_equal(still.jacobian, now.jacobian)


@pytest.mark.parametrize("name", NAMES)
def test_a_joint_that_moves_nothing_has_an_exact_zero(name: str) -> None:
    rng = np.random.default_rng(22)
    on_arm, other = some(pairs[name].first, rng, frame="a/frame4"), some(pairs[name].second, rng)
    J = evaluate(TWO, distances(pairs[name], [on_arm], [other]), random_q(TWO, rng)).jacobian[0]
    assert (J[4:] == 0.0).all() and (J[:4] != 0.0).any()


@pytest.mark.parametrize("name", NAMES)
def test_a_given_velocity_is_a_residual_and_nothing_else(name: str) -> None:
    rng = np.random.default_rng(23)
    pair, q, v = pairs[name], random_q(TWO, rng), rng.normal(size=TWO.n)
    one = distances(pair, [some(pair.first, rng, frame="a/frame6")], [some(pair.second, rng, frame="b/frame7")])
    without, with_it = evaluate(TWO, one, q), evaluate(TWO, one, q, velocity=v)
    np.testing.assert_array_equal(with_it.jacobian, without.jacobian)
    np.testing.assert_array_equal(without.residual, 0.0)
    np.testing.assert_allclose(with_it.residual, without.jacobian @ v, atol=1e-14)


def pure(v: Array) -> DQ:
    return DQ(np.r_[0.0, v])


def test_residuals_of_moving_entities_agree_with_dq_robotics() -> None:
    """Its residuals are of the squared distance; of the plain one for planes, and of 2 - 2 cos(phi) for the angle.

    The angle's takes lines through the origin only: it is the primary part of a product that otherwise has a dual one.
    """
    K, rng, worst = DQ_Kinematics, np.random.default_rng(24), 0.0
    for _ in range(300):
        arm = (NEURO8, SIX, SEVEN)[rng.integers(3)]
        n, q = arm.robot.n, random_q(arm.robot, rng)
        x = arm.twin.fkm(q)
        t, z = x.translation(), x.rotation() * k_ * x.rotation().conj()
        l_z, pi = z + E_ * cross(t, z), z + E_ * float(t.vec3() @ z.vec3())
        vessel = Moving(rng)(0.0)
        P, L = rng.normal(size=(2, 3))
        L /= np.linalg.norm(L)
        o, v, w = dq.translation(vessel.pose), *np.split(np.asarray(vessel.twist), 2)
        p, l = o + dq.rotation_matrix(vessel.pose) @ P, dq.rotation_matrix(vessel.pose) @ L
        dp, dl = v + np.cross(w, p - o), np.cross(w, l)
        point, line = pure(p), pure(l) + E_ * pure(np.cross(p, l))
        d_line = pure(dl) + E_ * pure(np.cross(dp, l) + np.cross(p, dl))
        d_plane = pure(dl) + E_ * float(dp @ l + p @ dl)

        frame = f"frame{n}"
        tip, axis = Point.at([0, 0, 0], frame=frame), Line.z_axis(frame)
        floor = Plane.through([0, 0, 0], [0, 0, 1], frame=frame)
        e_point, e_line = Point.at(P, entity="vessel"), Line.through(P, L, entity="vessel")
        e_plane = Plane.through(P, L, entity="vessel")
        theirs = {
            "point_plane": (tip, e_plane, K.point_to_plane_residual(t, d_plane)),
            "plane_point": (e_point, floor, K.plane_to_point_residual(pi, pure(dp))),
            "point_point": (tip, e_point, K.point_to_point_residual(t, point, pure(dp))),
            "line_point": (axis, e_point, K.line_to_point_residual(l_z, point, pure(dp))),
            "point_line": (tip, e_line, K.point_to_line_residual(t, line, d_line)),
            "line_line": (axis, e_line, K.line_to_line_residual(l_z, line, d_line)),
            "line_line_angle": (axis, e_line, K.line_to_line_angle_residual(z, pure(l), pure(dl))),
        }
        chosen = ConstraintSet(
            Constraint(key, a, b, "outside", 0.0, key if key == "line_line_angle" else "")
            for key, (a, b, _) in theirs.items()
        )
        ours = evaluate(arm.robot, chosen, q, entities={"vessel": vessel})
        sine = np.linalg.norm(np.cross(z.vec3(), l))
        for key, d, residual in zip(ours.names, ours.distance, ours.residual, strict=True):
            factor = {"point_plane": 1.0, "plane_point": 1.0, "line_line_angle": 2 * np.sin(d)}.get(key, 2 * d)
            apart = abs(factor * residual - theirs[key][2]) * (sine**3 if key == "line_line" else 1.0)
            worst = max(worst, float(apart))
    assert worst < 1e-12


def test_a_plane_on_the_arm_agrees_with_dq_robotics() -> None:
    rng = np.random.default_rng(25)
    for arm in (NEURO8, SIX, SEVEN):
        n, q, p = arm.robot.n, random_q(arm.robot, rng), rng.normal(size=3)
        floor = Plane.through([0, 0, 0], [0, 0, 1], frame=f"frame{n}")
        J = evaluate(arm.robot, ConstraintSet([Constraint("c", Point.at(p), floor, "outside", 0.0)]), q).jacobian
        J_pi = DQ_Kinematics.plane_jacobian(arm.twin.pose_jacobian(q), arm.twin.fkm(q), k_)
        np.testing.assert_allclose(J, DQ_Kinematics.plane_to_point_distance_jacobian(J_pi, pure(p)), atol=1e-13)


def test_contact_gives_a_zero_row_that_says_so() -> None:
    q = random_q(SIX.robot, np.random.default_rng(26))
    tip = SIX.robot.kinematics(q).translation("frame6")
    one = ConstraintSet([Constraint("c", Point.at([0, 0, 0], frame="frame6"), Point.at(tip), "inside", 0.01)])
    result = evaluate(SIX.robot, one, q)
    assert (result.status[0], result.distance[0], result.margin[0]) == (DEGENERATE, 0.0, 0.01)
    np.testing.assert_array_equal(result.jacobian, 0.0)


def test_an_empty_set_has_no_rows() -> None:
    result = evaluate(SIX.robot, ConstraintSet(), np.zeros(6))
    assert result.jacobian.shape == (0, 6) and result.names == ()


def test_an_element_on_the_world_and_one_on_no_joint_are_the_same() -> None:
    fixed = SIX.robot.with_tool(
        "post", dq.from_rotation_translation(np.eye(4)[0], np.array([0.1, 0.2, 0.3])), on="world"
    )
    tip, q = Point.at([0, 0, 0], frame="frame6"), np.zeros(6)
    rows = [
        evaluate(fixed, ConstraintSet([Constraint("c", tip, p, "outside", 0.0)]), q)
        for p in (Point.at([0, 0, 0], frame="post"), Point.at([0.1, 0.2, 0.3]))
    ]
    np.testing.assert_array_equal(rows[0].jacobian, rows[1].jacobian)
    assert rows[0].distance == rows[1].distance


def test_a_table_holds_what_was_declared() -> None:
    tip, vessel = Point.at([0, 0, 0.1], frame="frame6"), Line.through([0, 0, 0], [1, 0, 0], entity="vessel")
    shaft = Line.z_axis("frame5")
    declared = ConstraintSet(
        [
            Constraint("a", tip, vessel, "outside", 0.005, safety_class="robot"),
            Constraint("b", shaft, vessel, "inside", 0.3, "line_line_angle", enforced=False),
            Constraint("c", tip, Segment.between([0, 0, 0], [0, 0, 0.2]), "outside", 0),
        ]
    )
    assert used_frames(declared) == ("world", "frame6", "frame5") and used_entities(declared) == ("vessel",)
    table = tabulate(declared, used_frames(declared), used_entities(declared))
    assert table.frame.tolist() == [[1, 3], [2, 3], [1, 0]]
    assert table.side.tolist() == [1.0, -1.0, 1.0] and table.safe.tolist() == [0.005, 0.3, 0.0]
    assert table.enforced.tolist() == [1, 0, 1] and table.angular.tolist() == [0, 1, 0]
    assert table.safety_class.tolist() == [1, 0, 0]
    assert len(set(table.address.tolist())) == 3
    np.testing.assert_array_equal(table.geometry[::2], [tip.geometry, shaft.geometry, tip.geometry])
    for field, empty in zip(table, tabulate(ConstraintSet(), ("world",), ()), strict=True):
        assert empty.dtype == field.dtype and empty.shape == (0, *field.shape[1:])
    with pytest.raises(UnknownNameError, match='unknown entity "vessel"'):
        tabulate(declared, used_frames(declared), ())
    with pytest.raises(UnknownNameError, match='unknown frame "frame5"'):
        tabulate(declared, ("world", "frame6"), ("vessel",))


ON_ENTITY = ConstraintSet(
    [Constraint("c", Point.at([0, 0, 0], frame="frame6"), Point.at([0, 0, 1], entity="vessel"), "outside", 0.0)]
)
STILL = Entity([1.0, 0, 0, 0, 0, 0, 0, 0], np.zeros(6))


def vessel(measured: Any) -> dict[str, Any]:
    return {"entities": {"vessel": measured}}


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"q": np.zeros(5)}, InputError, r"q: expected shape \(6\), got \(5,\)"),
        ({"q": [0, 0, np.nan, 0, 0, 0]}, InputError, "q: expected finite numbers"),
        ({"velocity": np.zeros(7)}, InputError, r"velocity: expected shape \(6\)"),
        ({"velocity": [np.inf] * 6}, InputError, "velocity: expected finite"),
        ({"entities": {}}, UnknownNameError, r'unknown entity "vessel"\. Known: none are declared'),
        ({"entities": None}, UnknownNameError, 'unknown entity "vessel"'),
        ({"entities": {"vesel": STILL}}, UnknownNameError, r'unknown entity "vessel"\. Did you mean "vesel"'),
        (vessel((STILL.pose, STILL.twist)), InputError, r'entity "vessel": expected an Entity\(pose, twist\)'),
        (vessel(STILL._replace(pose=np.zeros(8))), InputError, 'pose of entity "vessel": expected a unit dual'),
        (vessel(STILL._replace(twist=np.zeros(3))), InputError, 'twist of entity "vessel": expected shape'),
        (vessel(STILL._replace(twist=[np.nan] * 6)), InputError, 'twist of entity "vessel": expected finite'),
    ],
)
def test_bad_measurements_are_refused(changes: dict[str, Any], error: type[Exception], message: str) -> None:
    asked: dict[str, Any] = {"q": np.zeros(6), "entities": {"vessel": STILL}} | changes
    with pytest.raises(error, match=message):
        evaluate(SIX.robot, ON_ENTITY, **asked)


def test_an_unknown_frame_is_named() -> None:
    one = ConstraintSet([Constraint("c", Point.at([0, 0, 0], frame="frame66"), Point.at([0, 0, 1]), "outside", 0.0)])
    with pytest.raises(UnknownNameError, match=r'unknown frame "frame66"\. Did you mean "frame6"'):
        evaluate(SIX.robot, one, np.zeros(6))
