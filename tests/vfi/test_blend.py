"""Constraints that are switched and retuned while the controller runs: no jump in the command, no boundary crossed."""

import numpy as np
import pytest

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Line, Plane, Point
from primitives.errors import InactiveConstraintError, InputError, UnknownNameError
from primitives.point_cloud import PointCloud
from tests.vfi.arms import seven
from vfi.blend import eased
from vfi.controller import Controller
from vfi.messages import Measurement
from vfi.outcome import State
from vfi.tasks import VelocityTask

T = 0.004
SEVEN = seven()
Q = np.array([0.3, 0.5, -0.2, -1.2, 0.1, 0.9, 0.0])
END = SEVEN.kinematics(Q).translation("frame7")


class Loop:
    """An arm that is driven down at 40 mm/s towards a floor 50 mm below it; only the speed down counts."""

    def __init__(self, enforced=True, cloud=False, eta=2.0, safe=0.005):
        tip = Point.at([0.0, 0.0, 0.0], frame="frame7")
        if cloud:
            grid = np.mgrid[-80:81:4, -80:81:4].reshape(2, -1).T * 1e-3
            points = np.c_[END[:2] + grid, np.full(len(grid), END[2] - 0.05 - 1e-3)]
            floor, clouds = Cloud.named("floor"), {"floor": PointCloud(points, 1e-3)}
        else:
            floor, clouds = Plane.through(END - [0.0, 0.0, 0.05], [0.0, 0.0, 1.0]), {}
        c = Constraint("floor", tip, floor, "outside", safe, enforced=enforced)
        self.c = Controller(SEVEN, ConstraintSet([c]), VelocityTask(), period=T, eta=eta, clouds=clouds, reach=0.02)
        self.q, self.k, self.down, self.margin, self.height, self.states = Q.copy(), 0, [], [], [], []
        self.seen = SEVEN.kinematics(Q)

    def run(self, seconds: float) -> "Loop":
        for _ in range(round(seconds / T)):
            J, aside = self.seen.jacobian("frame7")[:3], self.seen.translation("frame7")[:2] - END[:2]
            wish = np.linalg.pinv(J) @ [*(-10.0 * aside), -0.04]
            found = self.c.step(Measurement(T * self.k, self.q, np.zeros(7)), wish)
            self.q, self.k = self.q + T * found.qdot, self.k + 1
            self.seen = SEVEN.kinematics(self.q)
            self.down.append(-(J @ found.qdot)[2])
            self.margin.append(found.margins["floor"])
            self.height.append(self.seen.translation("frame7")[2] - END[2] + 0.05)
            self.states.append(found.state)
        return self

    def jump(self, since: int) -> float:
        """Largest change of the speed down from one cycle to the next, m/s."""
        return float(np.abs(np.diff(self.down[since - 1 :])).max())


@pytest.mark.parametrize("cloud", [False, True])
def test_switching_on_and_off_does_not_jump(cloud):
    """Switched on 12 mm before the floor at full speed, with a row that would stop it to 24 mm/s at once."""
    loop = Loop(enforced=False, cloud=cloud).run(0.8)
    assert loop.down[-1] == pytest.approx(0.04, abs=1e-6) and 0.010 < loop.margin[-1] < 0.016
    loop.c.adjust("floor", enforced=True, over=0.4)
    loop.run(3.0)
    assert loop.jump(200) < 3e-3, "40 mm/s are given up over a hundred cycles"
    assert min(loop.margin) > -1e-6 and loop.down[-1] < 1e-3
    assert loop.c.constraints["floor"].enforced
    loop.c.adjust("floor", enforced=False, over=0.4)
    loop.run(0.8)
    assert loop.down[-1] == pytest.approx(0.04, abs=1e-6) and loop.jump(951) < 3e-3
    assert min(loop.margin) < 0.0, "and then nobody keeps it"
    at_once = Loop(enforced=False, cloud=cloud).run(0.8)
    at_once.c.adjust("floor", enforced=True, over=1e-9)
    assert at_once.run(0.1).jump(200) > 1e-2, "which is what the smooth change spares"


def test_switched_on_too_late_to_be_gentle_it_is_not_crossed():
    """A millimetre before the floor, with half a second to go over: the floor counts more than the smooth command."""
    loop = Loop(enforced=False, safe=0.0).run(1.22)
    assert 0.0 < loop.margin[-1] < 0.002
    loop.c.adjust("floor", enforced=True, over=0.5)
    assert min(loop.run(2.0).margin) > -1e-6


def test_switched_on_inside_it_leads_out():
    loop = Loop(enforced=False).run(1.3)
    assert loop.margin[-1] < -0.005
    loop.c.adjust("floor", enforced=True, over=0.4)
    loop.run(3.0)
    assert loop.margin[-1] > -1e-4 and loop.jump(325) < 5e-3, "80 mm/s are turned round over a hundred cycles"
    assert State.DEGRADED in loop.states, "it says that it is leaving a violation"


@pytest.mark.parametrize("cloud", [False, True])
def test_safe_distance_and_gain_go_over(cloud):
    """The boundary comes up by 10 mm while the tool rests on it: it is lifted along, and nothing is violated."""
    loop = Loop(cloud=cloud).run(4.0)
    assert loop.height[-1] == pytest.approx(0.005, abs=5e-4)
    loop.c.adjust("floor", safe_distance=0.015, over=0.5)
    loop.run(2.5)
    assert loop.height[-1] == pytest.approx(0.015, abs=5e-4)
    assert min(loop.margin) > -2e-5, "the speed of the boundary is part of the row"
    assert loop.jump(1000) < 1.5e-3
    loop.c.adjust("floor", eta=20.0)
    loop.c.adjust("floor", safe_distance=0.005, eta=20.0, over=0.5)
    loop.run(1.5)
    between = 0.006 - np.sqrt(0.006**2 - 2 * 0.002**2)
    assert -(between if cloud else 0.0) - 1e-4 < loop.height[-1] - 0.005 < 1e-4, "it may sink in between four spheres"
    assert min(loop.margin) > -2e-5
    assert loop.c.constraints["floor"].safe_distance == 0.005


def test_force_of_a_row():
    """Nothing at 0, all at 1, continuous and growing between; never past the boundary while it rises."""
    force = np.linspace(0.0, 1.0, 1001)
    rate = np.array([eased(-0.01, f, 0.0, 0.005, 0.05, T) for f in force])
    assert rate[0] == -np.inf and rate[-1] == -0.01 and (np.diff(rate[1:]) > 0.0).all()
    rising = np.array([eased(-0.01, f, 1.0, 1e-4, 0.05, T) for f in force[1:]])
    assert (rising >= -1e-4 / T).all() and rising[-1] == -0.01


def test_change_of_mind_begins_where_it_is():
    loop = Loop().run(0.4)
    loop.c.adjust("floor", enforced=False, over=0.4)
    loop.run(0.2)
    loop.c.adjust("floor", enforced=True, over=0.4)
    loop.run(3.0)
    assert loop.jump(100) < 2e-3 and min(loop.margin) > -1e-6


def test_what_cannot_be_changed_is_refused():
    c = Loop().c
    with pytest.raises(UnknownNameError, match="floor"):
        c.adjust("flor", enforced=False)
    for bad in ({"eta": 0.0}, {"eta": 1e4}, {"safe_distance": -1.0}, {"over": 0.0}, {"over": np.nan}):
        with pytest.raises(InputError):
            c.adjust("floor", **bad)
    fixed = Constraint(
        "still", Point.at([0, 0, 0]), Plane.through([0, 0, -1], [0, 0, 1]), "outside", 0.0, enforced=False
    )
    other = Controller(SEVEN, ConstraintSet([fixed]), VelocityTask(), period=T)
    with pytest.raises(InactiveConstraintError, match="still"):
        other.adjust("still", enforced=True)
    port = Constraint("port", Line.z_axis("frame7"), Point.at(END), "inside", 0.001)
    equal = Controller(SEVEN, ConstraintSet([port]), VelocityTask(), period=T, forms={"port": "equality"})
    with pytest.raises(InputError, match="equality cannot be switched"):
        equal.adjust("port", enforced=False)
    assert c.constraints["floor"].enforced and c.step(Measurement(0.0, Q, np.zeros(7)), np.zeros(7)).state == State.RUN
