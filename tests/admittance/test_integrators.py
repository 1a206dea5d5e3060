"""Where the plain method steps across the barrier, that the robust integrator does not, and orders of convergence."""

import dataclasses
from itertools import product

import numpy as np
import pytest

from admittance.parameters import TABLE_1
from primitives.elements import Point
from tests.admittance.cases import (
    Q0,
    Array,
    below_tip,
    bowl,
    column,
    covered,
    lwr4plus,
    on_shaft,
    paper,
    plane_below_tip,
    push,
    tip_region,
    tool_region,
)

GAPS = np.arange(23.0, 31.5) * 1e-3
TIP = Point.at([0.0, 0.0, 0.0], frame="tip")
ROBOT = lwr4plus()
AXIS = ROBOT.kinematics(Q0).rotation("tip")[:, 2]


def axial(force: float) -> Array:
    return np.r_[force * AXIS, 0.0, 0.0, 0.0]


def crossings(make, integrator: str, force: float) -> int:
    count = 0
    for gap in GAPS:
        a = paper(regions=[tip_region(make(ROBOT, gap))], integrator=integrator, sensor=TIP)
        count += push(a, axial(force), 2.0) <= 0.0
    return count


@pytest.mark.parametrize(
    ("make", "integrator", "force", "expected"),
    [
        (below_tip, "euler", 10.0, 9),
        (below_tip, "semi-implicit", 20.0, 9),
        (plane_below_tip, "semi-implicit", 20.0, 8),
        (below_tip, "robust", 20.0, 0),
        (plane_below_tip, "robust", 20.0, 0),
    ],
)
def test_the_plain_method_crosses_where_readings_says_and_the_robust_one_does_not(make, integrator, force, expected):
    """An axial step force at the tip, 4 ms, nine starting gaps between 23 and 31 mm."""
    assert crossings(make, integrator, force) == expected


def scene(name: str, whole: bool, gap: float):
    """One of the campaign's four scenes, whose nearest sphere is about `gap` from tip or tool."""
    tip, radius = on_shaft(ROBOT, Q0, "tip", 0.0), 0.0035 + (0.0035 if whole else 0.0)
    region = tool_region if whole else tip_region
    match name:
        case "point":
            return region(below_tip(ROBOT, gap + radius - 0.0035))
        case "plane":
            return region(plane_below_tip(ROBOT, gap + radius - 0.0035))
        case "bowl":
            return region(covered(bowl(tip, gap + radius, 0.003), 0.0035))
        case _:
            ball = bowl(on_shaft(ROBOT, Q0, "tip", -(0.025 + gap + radius)), 0.025, 0.003, np.pi)
            return region(covered(ball, 0.0035))


def robust_run(name: str, whole: bool, gap: float, force: float):
    a = paper(regions=[scene(name, whole, gap)], integrator="robust", sensor=TIP, ring=600)
    smallest = push(a, axial(force), 2.0)
    return a, smallest


SCENES, FORCES = ("point", "plane", "bowl", "ball"), (10.0, 20.0, 40.0, 60.0)


@pytest.mark.parametrize(("name", "whole"), list(product(SCENES, (False, True))))
def test_robust_sample(name, whole):
    for gap, force in ((GAPS[0], 60.0), (GAPS[4], 20.0)):
        a, smallest = robust_run(name, whole, gap, force)
        assert smallest > 0.0 and column(a, "excess")[-1] <= 1e-9
        assert 1.0 <= column(a, "substeps").mean() <= 1.25


@pytest.mark.campaign
def test_robust_campaign():
    """288 runs: 10 to 60 N, tip and tool, four scenes, nine gaps. None crosses, none hands energy in."""
    means = []
    for name, whole, gap, force in product(SCENES, (False, True), GAPS, FORCES):
        a, smallest = robust_run(name, whole, gap, force)
        assert smallest > 0.0, (name, whole, gap, force)
        assert column(a, "excess")[-1] <= 1e-9
        means.append(column(a, "substeps").mean())
    assert len(means) == 288 and max(means) <= 1.25


def end(integrator: str, form: str, steps: int) -> Array:
    """q after 0.4 s of a wrench that is held, in so many steps, without the variable damping's kink at rest."""
    parameters = dataclasses.replace(TABLE_1, Q=(0.0, 0.0, 0.0, 0.0))
    a = paper(integrator=integrator, form=form, period=0.4 / steps, parameters=parameters, sensor=TIP)
    for k in range(1, steps + 1):
        m = a.step(k * a.period, [2.0, 3.0, 4.0, 0.2, -0.1, 0.1])
    return m.q


@pytest.mark.parametrize(
    ("integrator", "form", "order"),
    [
        ("euler", "reduced", 1),
        ("semi-implicit", "reduced", 1),
        ("robust", "reduced", 1),
        ("rk4", "reduced", 4),
        ("rk4", "full", 4),
        ("semi-implicit", "full", 1),
        ("semi-implicit", "printed", 1),
    ],
)
def test_order_of_convergence_to_one_solution(integrator, form, order):
    """All of them converge, at their order, to what Runge-Kutta gives at a fine step."""
    fine = end("rk4", "reduced", 800)
    coarse, finer = (np.abs(end(integrator, form, n) - fine).max() for n in (50, 100))
    assert coarse / finer == pytest.approx(2.0**order, rel=0.3)


def test_clearance_between_samples_is_positive_where_the_robust_one_holds():
    """Sampled 20 times between the cycles' configurations, on the straight line in joint space."""
    a = paper(regions=[tip_region(plane_below_tip(ROBOT, 0.027))], integrator="robust", sensor=TIP, ring=600)
    cloud = plane_below_tip(ROBOT, 0.027)
    push(a, axial(60.0), 0.8)
    q, clearance = column(a, "q"), column(a, "clearance")
    closest = int(np.argmin(clearance))
    for k in range(max(1, closest - 3), closest + 2):
        for s in np.linspace(0.0, 1.0, 20):
            tip = ROBOT.kinematics(q[k - 1] + s * (q[k] - q[k - 1])).translation("tip")
            assert np.linalg.norm(cloud.grid.points - tip, axis=1).min() > 0.0035
