"""What `vfi check` finds in scenes that follow a trajectory: the shipped ones, and broken ones made here."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.evaluate import evaluate
from scenarios.check.feasibility import Program, conflict, shortfall
from scenarios.check.finding import Severity, amount
from scenarios.check.reference import follow
from scenarios.check.relations import contradiction
from scenarios.check.report import RECOVERY, check_scene
from scenarios.check.search import Search
from scenarios.check.space import Space
from scenarios.enforcement import Enforcement
from scenarios.neurosurgery import scene
from scenarios.run import run
from scenarios.trajectory import PoseTrajectory, Waypoint
from vfi.controller import Controller

UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
TIP = Point.at((0.0, 0.0, 0.0), frame="moving/tip")
NAMES = ["S1", "S2", "S3", "S4", "S5", "S3-stiff-wrist"]


def above(name, z, normal=UP, **changes):
    return Constraint(name, TIP, Plane.through((0.0, 0.0, z), normal), "outside", 0.0, **changes)


def within(name, centre, radius, **changes):
    return Constraint(name, TIP, Point.at(centre), "inside", radius, **changes)


def scene_with(*constraints, **changes):
    return replace(scene("S5"), constraints=ConstraintSet(constraints), **changes)


def space_of(s):
    return Space(s.build_robot(), s.constraints, s.group, np.array(s.start))


def found(report, check, where=None):
    return [f for f in report.findings if f.check == check and where in (None, f.where)]


def rows(report, name):
    return {row["name"]: row for part in report.parts if part.name == name for row in part.rows}


def tip_of(s):
    return s.build_robot().kinematics(np.array(s.start)).translation("moving/tip")


@pytest.mark.parametrize("name", NAMES)
def test_the_shipped_scenes_have_no_errors_and_say_which_constraints_the_reference_leaves(name):
    report = check_scene(scene(name))
    assert report.ok
    assert [f.where for f in found(report, "reference") if f.where.startswith("C")] == ["C1", "C2", "C3", "C4"]
    assert not found(report, "relations") and not found(report, "feasibility") and not found(report, "start")
    margins = [row["margin"] for row in rows(report, "constraints").values()]
    np.testing.assert_allclose(margins, [8.0e-3, 1.93e-3, 3.0e-3, 19.47e-3], atol=5e-6)


def test_where_the_reference_leaves_the_constraints_is_where_a_run_without_them_does():
    s = scene("S1")
    trace = run(s, guard="off")
    said = {f.where: f.numbers for f in found(check_scene(s), "reference") if f.where.startswith("C")}
    for i, name in enumerate(s.constraints.names):
        margin = trace["margin"][:, i]
        assert said[name]["margin_m"] == pytest.approx(margin.min(), abs=1e-6)
        assert said[name]["first_s"] == pytest.approx(np.flatnonzero(margin < 0.0)[0] * s.period, abs=1.5 * s.period)


def test_margins_and_rows_of_a_space_are_those_of_evaluate():
    s = scene("S5")
    space, rng = space_of(s), np.random.default_rng(3)
    for x in rng.uniform(space.low, space.high, (20, len(space.low))):
        sight = space.at(x)
        expected = evaluate(space.robot, s.constraints, space.all_joints(x))
        np.testing.assert_array_equal(sight.margin, expected.margin)
        np.testing.assert_array_equal(sight.row, expected.jacobian[:, space.decided])


def test_a_violated_start_is_a_warning_where_enforced_and_a_note_where_watched():
    z = float(tip_of(scene("S5"))[2])
    report = check_scene(scene_with(above("A", z + 0.002), above("B", z + 0.003, enforced=False)))
    (a,), (b,) = found(report, "start", "A"), found(report, "start", "B")
    assert a.severity == Severity.WARNING and b.severity == Severity.NOTE
    assert a.numbers["margin_m"] == pytest.approx(-0.002) and "2.00 mm" in a.what
    assert b.numbers["margin_m"] == pytest.approx(-0.003)
    assert report.ok


def test_a_start_where_no_row_can_be_written_is_an_error_outside_and_none_inside():
    s = scene("S5")
    tip = tip_of(s)
    for keep, count in (("outside", 1), ("inside", 0)):
        touching = Constraint("A", TIP, Point.at(tip), keep, 0.0 if keep == "outside" else 0.01)
        report = check_scene(replace(s, constraints=ConstraintSet([touching])))
        assert len([f for f in found(report, "start", "A") if "no gradient" in f.what]) == count


def test_joints_outside_and_near_their_limits():
    s = scene("S5")
    q = s.start[0]
    for lower, severity, count in ((q + 0.001, Severity.ERROR, 1), (q - 0.0001, Severity.NOTE, 1), (q - 0.03, None, 0)):
        changed = replace(s, limits={"moving/joint1": (lower, 0.06)})
        said = found(check_scene(changed), "start", "moving/joint1")
        assert len(said) == count and all(f.severity == severity for f in said)


@pytest.mark.parametrize(("eta", "severity"), [(126.0, Severity.ERROR), (70.0, Severity.NOTE), (60.0, None)])
def test_gains_times_the_period(eta, severity):
    report = check_scene(replace(scene("S5"), enforcement=Enforcement(eta={"": 0.5, "C2": eta})))
    said = found(report, "gains")
    assert [f.severity for f in said] == ([] if severity is None else [severity])
    assert all(f.where == "C2" for f in said)
    assert report.ok == (severity != Severity.ERROR)
    assert rows(report, "gains")["C2"]["gain_T"] == pytest.approx(eta * 0.008)


def test_a_task_and_limits_with_too_high_a_gain():
    s = scene("S5")
    report = check_scene(
        replace(s, task=replace(s.task, gain=130.0), enforcement=Enforcement(eta=0.5, limit_eta=200.0))
    )
    assert [f.where for f in found(report, "gains") if f.severity == Severity.ERROR] == ["joint limits", "task"]
    assert not found(report, "build")


def test_a_constraint_without_an_eta_is_said_by_the_controller_and_left_out_elsewhere():
    report = check_scene(replace(scene("S5"), enforcement=Enforcement(eta={"C1": 0.5})))
    (said,) = found(report, "build")
    assert 'no eta for constraint "C2"' in said.what and not report.ok
    assert list(rows(report, "approach")) == ["C1"]


def test_the_numbers_of_the_documentation():
    c4 = rows(check_scene(scene("S5")), "approach")["C4"]
    assert c4["reference_speed"] == pytest.approx(3.9e-3, abs=5e-5)
    assert c4["acts_from"] == pytest.approx(7.7e-3, abs=5e-5)


def test_what_the_controller_refuses_is_an_error():
    still = Constraint("A", Point.at((0, 0, 0), frame="parked/tip"), Plane.through((0, 0, -1), UP), "outside", 0.0)
    (said,) = found(check_scene(scene_with(above("C4", -0.08), still)), "build")
    assert said.severity == Severity.ERROR and '"A"' in said.what


def test_a_constraint_on_an_entity_cannot_be_run():
    moving = Constraint("A", TIP, Point.at((0, 0, 0), entity="needle"), "outside", 0.001)
    report = check_scene(scene_with(above("C4", -0.08), moving))
    (said,) = found(report, "entities")
    assert said.where == "A" and '"needle"' in said.what and not report.ok
    assert list(rows(report, "constraints")) == ["C4"]


def test_the_speeds_that_the_feasibility_program_assumes_are_the_controllers():
    defaults = inspect.signature(Controller).parameters
    assert tuple(defaults[name].default for name in ("recovery_linear", "recovery_angular")) == RECOVERY


def test_two_violated_planes_that_face_each_other_are_named_and_the_third_is_not():
    z = float(tip_of(scene("S5"))[2])
    report = check_scene(scene_with(above("A", z + 0.001), above("B", z - 0.001, DOWN), within("D", (0, 0, z), 0.1)))
    (said,) = found(report, "feasibility")
    assert said.severity == Severity.ERROR and "together: A, B;" in said.what
    assert said.numbers["shortfall_per_s"] == pytest.approx(0.5 * 0.001)
    assert not found(check_scene(scene_with(above("A", z + 0.001), within("D", (0, 0, z), 0.1))), "feasibility")


def test_a_conflict_is_minimal_and_names_the_limit_that_is_part_of_it():
    A = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    p = Program(("a", "b", "c"), ("m",) * 3, A, np.array([2.0, -1.0, -5.0]), -np.ones(3), np.ones(3))
    assert conflict(p) == ([0], [], [0])
    assert shortfall(p, [0, 1, 2], [0, 1, 2], [0, 1, 2]) == pytest.approx(1.0)


def test_a_conflict_of_random_programs_is_one_and_no_part_of_it_is():
    rng, conflicts = np.random.default_rng(1), 0
    for _ in range(30):
        A = rng.normal(size=(6, 3))
        p = Program(tuple("abcdef"), ("m",) * 6, A, rng.normal(size=6) + 0.8, -np.ones(3), np.ones(3))
        feasible = linprog(np.zeros(3), A_ub=-A, b_ub=-p.b, bounds=[(-1, 1)] * 3).status == 0
        assert feasible == (shortfall(p, list(range(6)), [0, 1, 2], [0, 1, 2]) <= 1e-9)
        if feasible:
            continue
        conflicts += 1
        parts = conflict(p)
        assert shortfall(p, *parts) > 1e-9
        for k, items in enumerate(parts):
            for item in items:
                fewer = [[i for i in s if i != item] if n == k else s for n, s in enumerate(parts)]
                assert shortfall(p, *fewer) <= 1e-9
    assert conflicts > 5


def test_spheres_that_do_not_meet_contradict_and_those_that_do_not_matter_are_not_named():
    tip = tip_of(scene("S5"))
    beside = tip + np.array([0.03, 0.0, 0.0])
    apart = [within("A", tip, 0.010), within("B", beside, 0.010), above("C4", -0.08)]
    report = check_scene(scene_with(*apart))
    (said,) = [f for f in found(report, "relations") if "keeps them all" in f.what]
    assert said.where == "A, B" and said.severity == Severity.ERROR and not report.ok
    assert said.numbers["largest_smallest_margin"] == pytest.approx(-0.005, abs=1e-5)
    meet = [within("A", tip, 0.016), within("B", beside, 0.016), above("C4", -0.08)]
    assert not [f for f in found(check_scene(scene_with(*meet)), "relations") if "keeps them all" in f.what]


def test_planes_that_leave_no_room_contradict_even_where_the_start_violates_both():
    space = space_of(scene_with(above("A", -0.05), above("B", -0.06, DOWN)))
    assert contradiction(Search(space), range(2)) == [0, 1]
    space = space_of(scene_with(above("A", -0.06), above("B", -0.05, DOWN)))
    assert contradiction(Search(space), range(2)) == []


def test_a_constraint_out_of_reach_cannot_act():
    report = check_scene(scene_with(above("far", -1.0), above("near", -0.08)))
    said = found(report, "relations", "far")
    assert [f.severity for f in said] == [Severity.WARNING] and "cannot act" in said[0].what
    assert not [f for f in found(report, "relations", "near") if "cannot act" in f.what]
    space, rng = space_of(scene_with(above("far", -1.0))), np.random.default_rng(5)
    sampled = min(space.at(x).margin[0] for x in rng.uniform(space.low, space.high, (20_000, len(space.low))))
    assert 0.0 < said[0].numbers["smallest_margin_m"] <= sampled


def test_a_plane_below_another_is_redundant_by_what_lies_between_them():
    report = check_scene(scene_with(above("C4", -0.08), above("lower", -0.09)))
    (said,) = found(report, "relations")
    assert said.where == "lower" and said.severity == Severity.NOTE and "holds wherever C4 hold" in said.what
    assert said.numbers["smallest_margin_m"] == pytest.approx(0.01, abs=1e-5)
    assert report.ok


def test_a_reference_that_begins_elsewhere_ends_too_late_or_lies_out_of_reach():
    s = scene("S5")
    first, second, *_ = s.reference.waypoints
    jump = PoseTrajectory((replace(first, position=(0.01, -0.008618, -0.060532)), second), 4.0)
    assert len([f for f in found(check_scene(replace(s, reference=jump)), "reference") if "begins" in f.what]) == 1
    far = replace(s, reference=PoseTrajectory((first, Waypoint((0.5, 0.0, -0.06))), 4.0))
    report = check_scene(far)
    said = found(report, "reference", "waypoint 2")
    assert len(said) == 1 and said[0].numbers["position_m"] > 0.1
    assert any("position limits hold" in f.what for f in found(report, "reference"))
    late = found(check_scene(replace(s, duration=6.0)), "reference")
    assert [f.where for f in late if "after the scene's end" in f.what] == ["waypoint 3", "waypoint 4"]
    assert not [f for f in found(check_scene(s), "reference") if f.where.startswith(("waypoint", "moving"))]


def test_the_speed_of_approach_is_the_largest_of_all_corners_of_the_velocity_limits():
    s = scene("S5")
    space = space_of(s)
    limits, jacobian = space.robot.limits.velocity[space.decided], space.at(space.first).row
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * len(limits))).reshape(len(limits), -1).T * limits
    said = rows(check_scene(s), "approach")
    for i, c in enumerate(s.constraints):
        top = float((-corners @ jacobian[i]).max())
        assert said[c.name]["top_speed"] == pytest.approx(top)
        assert said[c.name]["acts_from_at_top_speed"] == pytest.approx(top / 0.5)
        assert said[c.name]["time_constant_s"] == pytest.approx(2.0)


def test_the_drift_along_a_cylinder_is_that_of_the_shafts_end_across_its_axis():
    slow = replace(scene("S5"), enforcement=Enforcement(eta={"": 0.5, "C3": 0.01}))
    space = space_of(slow)
    followed = follow(slow, space)
    ends = np.array([space.robot.kinematics(space.all_joints(x)).translation("moving/shaft")[:2] for x in followed.x])
    speed = np.linalg.norm(np.diff(ends, axis=0), axis=1).max() / followed.period
    report = check_scene(slow)
    expected = speed**2 * 0.008 / (2 * 0.014 * 0.01)
    assert rows(report, "approach")["C3"]["drift_m"] == pytest.approx(expected, rel=1e-6)
    assert [f.where for f in found(report, "approach")] == ["C3"]
    assert not found(check_scene(scene("S5")), "approach")
    assert "drift_m" not in rows(report, "approach")["C1"]


def test_lines_that_start_nearly_parallel_are_warned_of():
    s = scene("S5")
    shaft = Line.z_axis("moving/shaft")
    axis = s.build_robot().kinematics(np.array(s.start)).rotation("moving/shaft")[:, 2]
    parallel = Constraint("A", shaft, Line.through((0.03, 0.0, 0.0), axis), "outside", 0.001)
    report = check_scene(replace(s, constraints=ConstraintSet([parallel])))
    assert [f for f in found(report, "start") if "parallel" in f.what]


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.0081, "m", "8.10 mm"), (-2e-6, "m", "-0.002 mm"), (np.pi, "rad/s", "180.00 deg/s"), (0.0, "m", "0.00 mm")],
)
def test_amounts_are_read_in_millimetres_and_degrees(value, unit, text):
    assert amount(value, unit) == text
