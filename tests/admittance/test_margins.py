"""The barrier on margins: force, stiffness and potential against differences of the printed formula, both through the
robot's kinematics in plain NumPy; ranges; where a distance has no gradient."""

from dataclasses import replace

import numpy as np
import pytest

from admittance.controller import Admittance
from admittance.memory import Real
from admittance.outcome import State
from admittance.parameters import NEURO8
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from tests.admittance.cases import Array, bowl, column, covered, on_shaft, tip_region
from tests.admittance.near_pairs import ANGLE, EVERY, near, parallel_start, random_start
from tests.admittance.walls import (
    ARM,
    PAIR,
    S5,
    SHAFT,
    around,
    distance,
    free_map,
    margin,
    pair,
    potential,
    printed,
    reach,
    slope,
)


def assert_force_is_minus_the_gradient(constraints: ConstraintSet, q: Array, back: float, tolerance: float) -> float:
    """Force, stiffness, potential and margins of one configuration; returns the size of the force."""
    a = pair(constraints, back, start=q, sight=0.01, ring=4)
    # The first cycle moves by what the barrier pushes; its record is that of where it led to.
    a.step(a.period, np.zeros(6))
    q, port = a.q, on_shaft(PAIR, q, SHAFT, back)
    k, Z, h = PAIR.kinematics(q), free_map(q, port), 1e-7
    moved = around(PAIR, q, ARM, h)
    for name, found in zip(constraints.names, column(a, "margin")[0], strict=True):
        assert found == pytest.approx(margin(constraints[name], k), abs=1e-12)
    # Every constraint by itself: the sum of all sizes is what rounding is measured by.
    F, K, size = np.zeros(6), np.zeros((6, 6)), 0.0
    for c in constraints:
        d_0, m = reach(c, NEURO8), margin(c, k)
        f = -Z @ slope(lambda k, c=c, d_0=d_0: printed(margin(c, k), NEURO8.k, d_0), moved, h)
        row, e = Z @ slope(lambda k, c=c: margin(c, k), moved, h), 1e-4 * m
        ahead, here, behind = (printed(m + s * e, NEURO8.k, d_0) for s in (1, 0, -1))
        F, size = F + f, size + np.abs(f).max()
        K += (ahead - 2.0 * here + behind) / e**2 * np.outer(row, row)
    assert column(a, "potential")[0] == pytest.approx(potential(constraints, k, NEURO8), rel=1e-9, abs=1e-18)
    np.testing.assert_allclose(column(a, "free_repulsion")[0], F, atol=tolerance * (1e-3 + size))
    np.testing.assert_allclose(a._real[Real.STIFFNESS], K, atol=1e-4 * (1e-6 + np.abs(K).max()))
    return size


def test_force_is_minus_the_gradient_at_random_configurations():
    """-grad V by differences in q, through Z, to 1e-5 of the sum of all forces; the wrist's coordinates included."""
    rng, sizes = np.random.default_rng(1), []
    while len(sizes) < 20:
        q = random_start(rng)
        sizes.append(assert_force_is_minus_the_gradient(near(EVERY, q, rng), q, rng.uniform(0.03, 0.12), 1e-5))
    assert min(sizes) > 0.0


def test_force_is_minus_the_gradient_along_s5():
    """C1 to C4 of S5 as they are declared, where a hand has led the arm to."""
    a, rng = pair(EVERY, integrator="robust", ring=4), np.random.default_rng(2)
    touched = set()
    for k in range(1, 1201):
        if k % 40 == 1:
            wrench = np.r_[rng.normal(size=3) * 4.0, rng.normal(size=3) * 0.2]
        a.step(0.004 * k, wrench)
        if k % 60 == 0:
            held = a._real[Real.PUSH][:, 0] > 0.0
            touched |= {name for name, on in zip(EVERY.names, held, strict=True) if on}
            free = a._real[Real.F_RX].copy()
            # The port is where the start put it: the reduced form holds the shaft in it to micrometres.
            Z = free_map(a.q, on_shaft(PAIR, np.array(S5.start), SHAFT, 0.045))
            moved = around(PAIR, a.q, ARM, 1e-7)
            gradient = slope(lambda k: potential(EVERY, k, NEURO8), moved, 1e-7)
            np.testing.assert_allclose(free, -Z @ gradient, atol=2e-5 * (1e-2 + np.abs(free).max()))
    assert {"C1", "C2", "C3"} <= touched


@pytest.mark.parametrize("tilt", [0.1, 1e-2, 1e-3, 3e-4])
def test_force_is_minus_the_gradient_of_lines_that_are_nearly_parallel(tilt):
    """Outside of the pair's declared band (1e-4) the gradient grows like 1/tilt; a step must be that much smaller."""
    rng = np.random.default_rng(3)
    only = EVERY.enforcing(["C1"])
    for _ in range(4):
        q = parallel_start(tilt, rng)
        c = near(ConstraintSet([only["C1"]]), q, rng)
        a = pair(c, start=q, ring=4)
        Z = free_map(q, on_shaft(PAIR, q, SHAFT, 0.045))
        h = 1e-5 * tilt
        row = Z @ slope(lambda k, c=c: margin(c["C1"], k), around(PAIR, q, ARM, h), h)
        m = margin(c["C1"], PAIR.kinematics(q))
        e = 1e-4 * m
        force = -(printed(m + e, NEURO8.k, NEURO8.d_0) - printed(m - e, NEURO8.k, NEURO8.d_0)) / (2.0 * e)
        np.testing.assert_allclose(a._real[Real.F_RX], force * row, atol=1e-4 * (1e-9 + np.abs(force * row).max()))


def test_lines_within_the_band_of_parallel_push_and_stay_finite():
    rng = np.random.default_rng(4)
    for tilt in (0.0, 1e-9, 1e-6, 5e-5):
        q = parallel_start(tilt, rng)
        c = ConstraintSet([S5.constraints["C1"]])
        for integrator in ("semi-implicit", "robust"):
            a = pair(c, start=q, ring=64, integrator=integrator)
            for k in range(1, 60):
                m = a.step(0.004 * k, [2.0, -3.0, 1.0, 0.0, 0.0, 0.1])
                assert np.isfinite([*m.q, *m.v, *m.qdot, *m.margin]).all()
            assert integrator != "robust" or column(a, "margin").min() > 0.0


@pytest.mark.parametrize("radius", [0.014, 0.002, 1e-4])
@pytest.mark.parametrize("integrator", ["semi-implicit", "robust", "euler"])
def test_on_the_axis_of_a_keep_inside_there_is_no_force(radius, integrator):
    """d = 0 has no gradient. The range is at most the radius, so the potential has faded there, whatever the radius."""
    end = PAIR.kinematics(np.array(S5.start)).translation(SHAFT)
    port = on_shaft(PAIR, np.array(S5.start), SHAFT, 0.045)
    axis, along, against = Line.z_axis(SHAFT), Line.through(end, end - port), Line.through(end, port - end)
    inside = ConstraintSet(
        [
            Constraint("pipe", Point.at([0, 0, 0], frame=SHAFT), Line.through(end, [0, 0, 1]), "inside", radius),
            Constraint("ring", axis, Point.at(port), "inside", radius),
            Constraint("cone", axis, along, "inside", radius, "line_line_angle"),
            Constraint("away", axis, against, "outside", np.pi - radius, "line_line_angle"),
        ]
    )
    a = pair(inside, integrator=integrator, ring=8)
    for k in range(1, 4):
        m = a.step(0.004 * k, np.zeros(6))
        assert m.state == State.RUN
        assert column(a, "potential")[-1] <= 1e-25 and np.abs(column(a, "free_repulsion")).max() <= 1e-12
        np.testing.assert_allclose(m.margin, radius, rtol=1e-6)
    assert not np.isnan(a.ring).any()


def test_the_range_is_at_most_the_largest_margin():
    """Potential along a chord through a thin pipe: smooth in the middle, and the printed one with the pipe's radius."""
    end = PAIR.kinematics(np.array(S5.start)).translation(SHAFT)
    radius = 0.002
    values, forces = [], []
    shifts = np.linspace(-0.9, 0.9, 37) * radius
    for x in shifts:
        axis = Line.through(end + np.array([x, 0.0, 0.0]), [0, 0, 1])
        pipe = Constraint("pipe", Point.at([0, 0, 0], frame=SHAFT), axis, "inside", radius)
        a = pair(ConstraintSet([pipe]), ring=1)
        values.append(a.ledger["potential"])
        forces.append(a._real[Real.PUSH][0, 0])
    expected = [printed(radius - abs(x), NEURO8.k, radius) for x in shifts]
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-20)
    middle = np.abs(shifts) < 0.11 * radius
    assert np.max(np.array(forces)[middle]) < 1e-3 * max(forces)


def test_watched_constraints_are_measured_and_push_nothing():
    a = pair(S5.constraints.enforcing(()), ring=4)
    m = a.step(0.004, np.zeros(6))
    k = PAIR.kinematics(a.q)
    np.testing.assert_allclose(m.margin, [margin(c, k) for c in S5.constraints], atol=1e-12)
    np.testing.assert_allclose(column(a, "distance")[0], [distance(c, k) for c in S5.constraints], atol=1e-12)
    assert column(a, "constraint")[0] == -1.0
    assert column(a, "potential")[0] == 0.0 and not m.v.any() and not column(a, "free_repulsion").any()


def test_the_nearest_constraint_is_named_and_the_others_range_counts():
    a = pair(ring=4)
    a.step(0.004, np.zeros(6))
    shares = column(a, "margin")[0] / NEURO8.d_0
    assert column(a, "constraint")[0] == np.argmin(shares)


def test_constraints_and_regions_add_up():
    """Potential and force of both are the sum of each alone."""
    end = PAIR.kinematics(np.array(S5.start)).translation(SHAFT)
    region = tip_region(covered(bowl(end, 0.003, 0.0005), 0.001), SHAFT)
    none = ConstraintSet()
    both, first, second = (pair(c, regions=r, ring=4) for c, r in ((EVERY, [region]), (EVERY, []), (none, [region])))
    for block in (Real.F_RX, Real.STIFFNESS):
        np.testing.assert_allclose(both._real[block], first._real[block] + second._real[block], rtol=1e-12, atol=1e-15)
    assert both.ledger["potential"] == pytest.approx(first.ledger["potential"] + second.ledger["potential"], rel=1e-12)
    assert second.ledger["potential"] > 0.0 and first.ledger["potential"] > 0.0


def test_linear_below_goes_on_linearly_below_the_same_share_of_each_range():
    """At a margin of 1 % of the range, linear below 5 % of it: the force is that at 5 %, without stiffness."""
    q = np.array(S5.start)
    k = PAIR.kinematics(q)
    flat = Constraint("flat", Point.at([0, 0, 0], frame=SHAFT), S5.constraints["C4"].second, "outside", 0.0)
    z = distance(flat, k) - 0.08
    flat = replace(flat, second=Plane.through([0, 0, z - 0.01 * NEURO8.d_0], [0, 0, 1]))
    cone = replace(ANGLE, safe_distance=distance(ANGLE, k) - 0.01 * NEURO8.d_0_angle)
    a: Admittance = pair(ConstraintSet([flat, cone]), linear_below=0.05 * NEURO8.d_0, ring=2)
    for i, d_0 in enumerate((NEURO8.d_0, NEURO8.d_0_angle)):
        e = 1e-4 * 0.05 * d_0
        at = -(printed(0.05 * d_0 + e, NEURO8.k, d_0) - printed(0.05 * d_0 - e, NEURO8.k, d_0)) / (2.0 * e)
        assert a._real[Real.PUSH][i, 0] == pytest.approx(at, rel=1e-6)
        assert a._real[Real.PUSH][i, 1] == 0.0
