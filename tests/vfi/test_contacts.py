"""Clouds as inequalities: every point within reach has its row, and what is carried out keeps all of them."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Point, Segment
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import Entity
from primitives.point_cloud import PointCloud
from tests.primitives.qps import cases
from tests.vfi.arms import START, pair, pose, seven
from vfi.controller import Controller
from vfi.memory import Real, Whole
from vfi.messages import Measurement
from vfi.outcome import Option, State
from vfi.tasks import PoseTask, VelocityTask

T = 0.004
SEVEN, PAIR = seven(), pair()
Q = np.array([0.3, 0.5, -0.2, -1.2, 0.1, 0.9, 0.0])
ETA = 20.0
PARTS = {
    "tip": Point.at([0.0, 0.0, 0.01], frame="frame7"),
    "tool": Segment.between([0.0, 0.0, 0.0], [0.0, 0.0, -0.3], frame="frame7"),
}


def around(center, count=400, size=0.05, seed=0, radius=0.003, pose_of=None) -> PointCloud:
    """A cloud of random spheres in a box about a place of the world."""
    points = np.asarray(center) + np.random.default_rng(seed).uniform(-size, size, (count, 3))
    return PointCloud(points, radius, **({} if pose_of is None else {"pose": pose_of}))


def end(q=Q):
    return SEVEN.kinematics(q).translation("frame7")


def controller(part="tool", cloud=None, where=None, robot=SEVEN, safe=0.002, **options) -> Controller:
    second = where or Cloud.named("bone")
    one = Constraint("bone", PARTS[part], second, "outside", safe)
    arguments = {"period": T, "eta": ETA, "clouds": {"bone": cloud}, "guard": "act", "reach": 0.05}
    return Controller(robot, ConstraintSet([one]), VelocityTask(), **{**arguments, **options})


def rows(c: Controller):
    """Rows of the points of the last cycle: Jacobians, margins, and places among the cloud's sorted points."""
    seen = c._memory.whole[Whole.OPTIONS][Option.CONTACTS]
    fixed = c._memory.whole[Whole.OPTIONS][Option.FIXED]
    real = c._memory.real
    return (
        real[Real.A][fixed : fixed + seen].copy(),
        real[Real.CLEARANCE][:seen].copy(),
        c._memory.whole[Whole.POINT][:seen].copy(),
        real[Real.DEMAND][fixed : fixed + seen].copy(),
    )


def margins(part: str, points, q, radius, safe):
    """(N,) margin of every point by its own closest point."""
    kinematics = SEVEN.kinematics(q)
    g, place = PARTS[part].geometry, kinematics.poses[kinematics.place("frame7")]
    R, t = place[:9].reshape(3, 3), place[9:]
    base, along, length = R @ g[:3] + t, R @ g[3:6], g[6]
    s = np.clip((points - base) @ along, 0.0, length)
    return np.linalg.norm(points - base - s[:, None] * along, axis=1) - radius - safe


@pytest.mark.parametrize("part", list(PARTS))
def test_as_many_rows_as_points_are_within_reach(part):
    """Counted by brute force; margins and Jacobians by differences of that."""
    rng, seen = np.random.default_rng(1), 0
    for k in range(cases(20, 3)):
        q = Q + 0.2 * rng.normal(size=7)
        cloud = around(end(q) + 0.08 * rng.normal(size=3), seed=k)
        c = controller(part, cloud)
        c.step(Measurement(0.0, q, np.zeros(7)), np.zeros(7))
        A, margin, point, demand = rows(c)
        points = cloud.grid.points
        expected = margins(part, points, q, 0.003, 0.002)
        assert sorted(point) == sorted(np.flatnonzero(expected <= 0.05))
        seen += len(point)
        np.testing.assert_allclose(margin, expected[point], atol=1e-12)
        np.testing.assert_allclose(demand, np.minimum(-ETA * margin, 0.05), atol=1e-12)
        step = 1e-6
        for j in range(7):
            ahead, back = (margins(part, points, q + s * step * np.eye(7)[j], 0.003, 0.002) for s in (1, -1))
            difference = (ahead - back)[point] / (2 * step)
            usable = margin > -0.0045  # at the axis itself the distance has no gradient
            np.testing.assert_allclose(A[usable, j], difference[usable], atol=2e-6)
        tree = cKDTree(points)
        if part == "tip":
            where = end(q) + SEVEN.kinematics(q).poses[SEVEN.kinematics(q).place("frame7")][:9].reshape(3, 3) @ [
                0,
                0,
                0.01,
            ]
            assert c.ring[0][c.columns["margin"]][0] == pytest.approx(tree.query(where)[0] - 0.005, abs=1e-12)
    assert seen > 100


@pytest.mark.parametrize("clouds", [4, pytest.param(12, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("part", list(PARTS))
def test_driven_into_a_cloud_it_stays_outside(part, clouds):
    """A velocity that would go right through: kept at every sample and between, whatever the direction."""
    rng = np.random.default_rng(2)
    nearest = []
    for k in range(clouds):
        below = end() + np.array([0.0, 0.0, -0.15])
        cloud = around(below, seed=10 + k)
        c = controller(part, cloud, eta=0.25 / T)
        q, wobble, at = Q.copy(), 0.05 * rng.normal(size=7), np.inf
        for i in range(400):
            seen = SEVEN.kinematics(q)
            way = below - seen.translation("frame7")
            towards = 0.3 * way / np.linalg.norm(way)
            wish = np.linalg.pinv(seen.jacobian("frame7")[:3]) @ towards + wobble
            command = c.step(Measurement(T * i, q, np.zeros(7)), wish)
            assert command.state <= State.DEGRADED, command.reason
            for share in (0.25, 0.5, 0.75, 1.0):
                at = margins(part, cloud.points, q + share * T * command.qdot, 0.003, 0.002).min()
                assert at >= -1e-6 / (0.25 / T) - 1e-9, "verification lets 1e-6 m/s pass, which eta leads back from"
            q = q + T * command.qdot
        nearest.append(at)
    assert min(nearest) < 1e-3, "it got there"


def test_a_point_that_comes_from_beyond_reach_is_not_overlooked():
    """The reach is a millimetre and the period long: the guard scales down what rows could not foresee."""
    cloud = around(end() - np.array([0.0, 0.0, 0.05]), size=0.02, seed=3)
    wish = np.linalg.pinv(SEVEN.kinematics(Q).jacobian("frame7")[:3]) @ [0.0, 0.0, -1.0]
    unseen = {}
    for guard in ("off", "act"):
        c = controller("tip", cloud, reach=0.001, guard=guard, period=0.05, eta=5.0)
        q = Q.copy()
        least = np.inf
        for i in range(20):
            command = c.step(Measurement(0.05 * i, q, np.zeros(7)), wish)
            q = q + 0.05 * command.qdot
            least = min(least, margins("tip", cloud.points, q, 0.003, 0.002).min())
        unseen[guard] = least
    assert unseen["off"] < 0.0 < unseen["act"]


def test_cloud_on_the_other_arm_moves_with_it():
    """A cloud on the parked arm's frame: rows of all sixteen joints, by differences."""
    cloud = around([0.0, 0.0, -0.01], count=60, size=0.01, radius=0.001)
    part = Segment.between([0, 0, 0], [0, 0, -0.1], frame="moving/frame6")
    one = Constraint("x", part, Cloud.named("c", frame="parked/frame6"), "outside", 0.001)
    c = Controller(PAIR, ConstraintSet([one]), VelocityTask(), period=T, clouds={"c": cloud}, reach=0.1)

    def all_margins(q):
        k = PAIR.kinematics(q)
        at = {f: k.poses[k.place(f)] for f in ("moving/frame6", "parked/frame6")}
        R, t = at["parked/frame6"][:9].reshape(3, 3), at["parked/frame6"][9:]
        world = cloud.grid.points @ R.T + t
        R, t = at["moving/frame6"][:9].reshape(3, 3), at["moving/frame6"][9:]
        along = R @ [0.0, 0.0, -1.0]
        s = np.clip((world - t) @ along, 0.0, 0.1)
        return np.linalg.norm(world - t - s[:, None] * along, axis=1) - 0.002

    c.step(Measurement(0.0, START, np.zeros(16)), np.zeros(16))
    A, margin, point, _ = rows(c)
    assert len(point) > 20
    np.testing.assert_allclose(margin, all_margins(START)[point], atol=1e-12)
    for j in range(16):
        d = 1e-6 * np.eye(16)[j]
        np.testing.assert_allclose(A[:, j], (all_margins(START + d) - all_margins(START - d))[point] / 2e-6, atol=1e-6)


def test_cloud_that_moves_asks_for_more():
    """An entity's own motion is the residual: the demand grows by the speed at which it comes nearer."""
    cloud = PointCloud(np.array([[0.0, 0.0, 0.0]]), 0.003)
    where = Cloud.named("bone", entity="organ")
    c = controller("tip", cloud, where)
    tip = end() + SEVEN.kinematics(Q).poses[SEVEN.kinematics(Q).place("frame7")][:9].reshape(3, 3) @ [0, 0, 0.01]
    below = pose(tip - [0.0, 0.0, 0.03])
    for t, speed in enumerate((0.0, 0.02)):
        entities = {"organ": Entity(below, [0.0, 0.0, speed, 0.0, 0.0, 0.0])}
        c.step(Measurement(T * t, Q, np.zeros(7), entities=entities), np.zeros(7))
        _, margin, _, demand = rows(c)
        np.testing.assert_allclose(margin, [0.025], atol=1e-12)
        np.testing.assert_allclose(demand, [-ETA * 0.025 + speed], atol=1e-9)


def test_watched_cloud_is_measured_without_rows():
    cloud = around(end(), seed=5)
    watched = ConstraintSet([Constraint("bone", PARTS["tool"], Cloud.named("bone"), "outside", 0.002, enforced=False)])
    c = Controller(SEVEN, watched, VelocityTask(), period=T, clouds={"bone": cloud})
    found = c.step(Measurement(0.0, Q, np.zeros(7)), np.full(7, 0.1))
    assert not len(rows(c)[0]) and found.state == State.RUN
    assert found.margins["bone"] == pytest.approx(margins("tool", cloud.points, Q, 0.003, 0.002).min(), abs=1e-12)
    np.testing.assert_allclose(found.qdot, 0.1, atol=1e-9)


def test_far_cloud_and_the_axis_on_a_point():
    far = controller("tip", around(end() + 3.0))
    assert far.step(Measurement(0.0, Q, np.zeros(7)), np.zeros(7)).margins["bone"] > 4.0
    kinematics = SEVEN.kinematics(Q)
    tip = end() + kinematics.poses[kinematics.place("frame7")][:9].reshape(3, 3) @ [0, 0, 0.01]
    on = controller("tip", PointCloud(tip[None], 0.003))
    found = on.step(Measurement(0.0, Q, np.zeros(7)), np.zeros(7))
    assert found.state == State.FAULT and "no row can be written" in found.reason and not found.qdot.any()


def test_no_row_is_lost_when_their_number_changes():
    """From many to none to many: each cycle is that of a controller that has never seen another."""
    cloud = around(end() - np.array([0.0, 0.0, 0.1]), seed=6)
    c = controller("tool", cloud)
    rng = np.random.default_rng(6)
    for i in range(12):
        q = Q if i % 3 else Q + 1.5 * np.eye(7)[0]
        q, wish = q + 0.02 * rng.normal(size=7), rng.normal(size=7)
        one = c.step(Measurement(T * i, q, np.zeros(7)), wish)
        other = controller("tool", cloud).step(Measurement(T * i, q, np.zeros(7)), wish)
        np.testing.assert_allclose(one.qdot, other.qdot, atol=1e-9)
        assert one.state == other.state and one.reason == other.reason


def test_what_is_not_given_or_no_cloud_is_refused():
    with pytest.raises(UnknownNameError, match="bone"):
        controller("tip", where=Cloud.named("bones"), cloud=around(end()))
    with pytest.raises(InputError, match="expected a PointCloud, got list"):
        controller("tip", cloud=[1, 2])
    for reach in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="reach"):
            controller("tip", cloud=around(end()), reach=reach)
    with pytest.raises(InputError, match="active-set"):
        one = Constraint("bone", PARTS["tip"], Cloud.named("bone"), "outside", 0.0)
        Controller(SEVEN, ConstraintSet([one]), PoseTask(), period=T, clouds={"bone": around(end())}, solver="daqp")
