"""The same declared port as a sphere's row, as an equality and softly: who keeps what, and against which oracle."""

import numpy as np
import pytest
import qpsolvers

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import Entity
from primitives.rcm import rcm
from tests.primitives.qps import cases
from tests.vfi.arms import START, pair, paper_constraints, pose, seven
from vfi.basis import eliminate
from vfi.controller import Controller
from vfi.forms import Soft
from vfi.messages import Measurement
from vfi.outcome import State
from vfi.tasks import PoseTask, ProjectionTask, VelocityTask

T, ETA = 0.004, 20.0
SEVEN = seven()
Q = np.array([0.3, 0.5, -0.2, -1.2, 0.1, 0.9, 0.0])


def port_on_axis(q=Q, back=0.2, aside=0.0):
    """A place of the world on the z axis of frame7, so far behind its origin, and so far aside."""
    k = SEVEN.kinematics(q)
    place = k.poses[k.place("frame7")]
    return place[9:] - back * place[:9].reshape(3, 3)[:, 2] + aside * place[:9].reshape(3, 3)[:, 0]


def controller(port, form, safe=0.0, task=None, more=(), **options):
    c = Constraint("port", Line.z_axis("frame7"), Point.at(port), "inside", safe)
    forms = {"port": form} if form else {}
    arguments = {"period": T, "eta": ETA, "forms": forms, **options}
    return Controller(SEVEN, ConstraintSet([c, *more]), task or VelocityTask(), **arguments)


def x_c(q, port):
    return rcm(SEVEN.kinematics(q), "frame7", port).x_c


def test_elimination_against_numpy():
    """The basis is orthonormal and spans the null space, the offset is the shortest solution; lost rank is said."""
    rng = np.random.default_rng(0)
    for _ in range(cases(300, 30)):
        d, p = int(rng.integers(3, 9)), int(rng.integers(1, 3)) * 2
        if p >= d:
            continue
        E, e = rng.normal(size=(p, d)) * rng.choice([1e-3, 1.0, 1e3]), rng.normal(size=p)
        basis, offset = np.empty((d, d - p)), np.empty(d)
        assert eliminate(E, e.copy(), np.empty((d, d)), np.empty((d, p)), basis, offset)
        np.testing.assert_allclose(E @ basis, 0.0, atol=1e-12 * np.abs(E).max())
        np.testing.assert_allclose(basis.T @ basis, np.eye(d - p), atol=1e-13)
        np.testing.assert_allclose(offset, np.linalg.pinv(E) @ e, rtol=1e-9, atol=1e-9 * np.abs(offset).max())
        E[1] = E[0]
        assert not eliminate(E, e.copy(), np.empty((d, d)), np.empty((d, p)), basis, offset)


def test_equality_is_kept_exactly_and_the_rest_is_optimal():
    """A v = -eta x_c; among those velocities the nearest to what is wanted, as a solver with equalities finds it."""
    rng = np.random.default_rng(1)
    for _ in range(cases(100, 10)):
        port, wish = port_on_axis(aside=2e-3 * rng.normal()), 0.5 * rng.normal(size=7)
        floor = Constraint(
            "floor", Point.at([0, 0, 0], frame="frame7"), Plane.through([0, 0, -9], [0, 0, 1]), "outside", 0
        )
        c = controller(port, "equality", more=[floor], guard="off")
        found = c.step(Measurement(0.0, Q, np.zeros(7)), wish)
        assert found.state in (State.RUN, State.DEGRADED)
        A = rcm(SEVEN.kinematics(Q), "frame7", port).A
        np.testing.assert_allclose(A @ found.qdot, -ETA * x_c(Q, port), atol=1e-12)
        twin = qpsolvers.solve_qp(
            np.eye(7), -wish, A=A, b=-ETA * x_c(Q, port), lb=-SEVEN.limits.velocity, ub=SEVEN.limits.velocity,
            solver="daqp", primal_tol=1e-11, dual_tol=1e-12,
        )  # fmt: skip
        np.testing.assert_allclose(found.qdot, twin, atol=1e-7)
        assert len(found.free) == 5


@pytest.mark.parametrize("form", ["rows", "equality", Soft(1e6)])
def test_port_error_shrinks_and_stays(form):
    """From 3 mm aside, with a motion that would take the shaft off its port: each form as it is meant."""
    port, q = port_on_axis(aside=3e-3), Q.copy()
    wish = np.array([0.2, -0.1, 0.1, 0.2, -0.2, 0.1, 0.3])
    safe = 1e-3
    c = controller(port, form, safe)
    error = []
    for i in range(500):
        found = c.step(Measurement(T * i, q, np.zeros(7)), wish)
        assert found.state <= State.DEGRADED, found.reason
        distance = found.record[c.columns["distance"]][0]
        assert distance == pytest.approx(np.linalg.norm(x_c(q, port)), abs=1e-12), "all forms log the port error"
        error.append(distance)
        q = q + T * found.qdot
    last = max(error[250:])
    if form == "rows":
        assert 0.5e-3 < last <= safe + 1e-5
    else:
        assert last < (3e-5 if form == "equality" else 1e-3)


def test_without_it_the_shaft_leaves():
    """So that what the forms keep is something: the same motion, the port watched."""
    port, q = port_on_axis(), Q.copy()
    for _ in range(500):
        q = q + T * np.array([0.2, -0.1, 0.1, 0.2, -0.2, 0.1, 0.3])
    assert np.linalg.norm(x_c(q, port)) > 0.02


def test_soft_is_a_term_of_the_cost():
    """|v - wish|^2 + weight |A v + eta x_c|^2, as least squares finds it."""
    port, wish, weight = port_on_axis(aside=1e-3), np.linspace(-0.1, 0.2, 7), 50.0
    found = controller(port, Soft(weight), guard="off").step(Measurement(0.0, Q, np.zeros(7)), wish)
    A = rcm(SEVEN.kinematics(Q), "frame7", port).A
    stacked, right = np.vstack([np.eye(7), np.sqrt(weight) * A]), np.r_[wish, -np.sqrt(weight) * ETA * x_c(Q, port)]
    np.testing.assert_allclose(found.qdot, np.linalg.lstsq(stacked, right, rcond=None)[0], atol=1e-9)


def test_port_that_moves_is_followed():
    """An entity's port: what it moves across the shaft the shaft follows at once."""
    where = Constraint("port", Line.z_axis("frame7"), Point.at([0, 0, 0], entity="trocar"), "inside", 0.0)
    c = Controller(SEVEN, ConstraintSet([where]), VelocityTask(), period=T, eta=ETA, forms={"port": "equality"})
    port, twist = port_on_axis(), np.array([0.01, -0.02, 0.005, 0.3, 0.0, 0.1])
    at = pose(port)
    found = c.step(Measurement(0.0, Q, np.zeros(7), entities={"trocar": Entity(at, twist)}), np.zeros(7))
    step = 1e-6
    ahead = x_c(Q + step * found.qdot, port + step * twist[:3])
    np.testing.assert_allclose((ahead - x_c(Q, port)) / step, 0.0, atol=1e-6)


def test_two_arms_two_ports_with_one_in_motion():
    """Equalities of the decided arm count what the other joints do; two ports take four of sixteen joints."""
    robot = pair()
    k = robot.kinematics(START)
    ports = []
    for arm in ("moving", "parked"):
        place = k.poses[k.place(f"{arm}/frame6")]
        at = Point.at(place[9:] - 0.04 * place[:9].reshape(3, 3)[:, 2])
        ports.append(Constraint(arm, Line.z_axis(f"{arm}/frame6"), at, "inside", 1e-3))
    forms = {"moving": "equality", "parked": "equality"}
    c = Controller(robot, ConstraintSet(ports), VelocityTask(), period=T, eta=ETA, forms=forms)
    found = c.step(Measurement(0.0, START, np.zeros(16)), np.full(16, 0.02))
    assert len(found.free) == 12
    for one in ports:
        A = rcm(k, one.first.frame, one.second.geometry[:3]).A
        np.testing.assert_allclose(
            A @ found.qdot, -ETA * rcm(k, one.first.frame, one.second.geometry[:3]).x_c, atol=1e-12
        )


def test_with_pose_tracking_and_all_constraints():
    """C2 to C4 with C2 as an equality: the port is reached, the others are kept."""
    robot, q = pair(), START.copy()
    c = Controller(
        robot, paper_constraints("C2 C3 C4"), PoseTask("moving/tip", 20.0), period=T, group="moving",
        eta={"C2": 2.0, "": 0.5}, forms={"C2": "equality"},
    )  # fmt: skip
    target = robot.kinematics(START).pose("moving/tip")
    for i in range(500):
        found = c.step(Measurement(T * i, q, np.zeros(16)), target)
        assert found.state <= State.DEGRADED
        q[:8] += T * found.qdot
    assert found.record[c.columns["distance"]][1] < 1e-3, "the shaft runs through the entry point"
    assert min(found.margins["C3"], found.margins["C4"]) > -1e-5


def test_what_is_no_port_is_refused():
    plane = Constraint("p", Point.at([0, 0, 0], frame="frame7"), Plane.through([0, 0, 0], [0, 0, 1]), "outside", 0)
    with pytest.raises(InputError, match="only a line that is kept inside"):
        controller([0, 0, 0], None, more=[plane], forms={"p": "equality"})
    with pytest.raises(UnknownNameError, match="port"):
        controller([0, 0, 0], None, forms={"prt": "equality"})
    with pytest.raises(UnknownNameError, match="equality, rows"):
        controller([0, 0, 0], "equal")
    tilted = Constraint("t", Line.through([0, 0, 0], [0, 1, 1], frame="frame7"), Point.at([0, 0, 0]), "inside", 0)
    with pytest.raises(InputError, match="z axis"):
        controller([0, 0, 0], None, more=[tilted], forms={"t": "equality"})
    with pytest.raises(InputError, match="weight of Soft"):
        Soft(0.0)
    with pytest.raises(InputError, match="active-set"):
        controller([0, 0, 0], "equality", solver="daqp")
    with pytest.raises(InputError, match="keeps its port already"):
        controller([0, 0, 0], "equality", task=ProjectionTask(5))


def test_two_ports_that_are_one_have_lost_rank():
    port = port_on_axis()
    twin = Constraint("again", Line.z_axis("frame7"), Point.at(port), "inside", 0.0)
    c = controller(port, "equality", more=[twin], forms={"port": "equality", "again": "equality"})
    found = c.step(Measurement(0.0, Q, np.zeros(7)), np.zeros(7))
    assert found.state == State.HOLD and "a port cannot be kept" in found.reason and not found.qdot.any()
