"""What `vfi check` finds in scenes that a hand leads, and how the command says it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from admittance import NEURO8, TABLE_1
from admittance.potential import barrier
from primitives.constraint import Constraint, ConstraintSet
from primitives.coverage import Gap
from primitives.elements import Cloud, Plane, Point
from primitives.point_cloud import PointCloud
from scenarios.anatomy.parts import build_parts
from scenarios.check import check_any
from scenarios.check.clouds import check_clouds
from scenarios.check.cue import balance
from scenarios.check.feasibility import feasible_at_start, program
from scenarios.check.finding import Severity
from scenarios.check.hand import follow_pull, steady_speeds
from scenarios.check.led import check_led
from scenarios.check.report import RECOVERY
from scenarios.check.space import Port, Space
from scenarios.cli import app
from scenarios.enforcement import Enforcement
from scenarios.hands_on.pull import Pull, Waypoint
from scenarios.hands_on.push import Push
from scenarios.neurosurgery import scene as s_scene
from scenarios.scene_file import dump_scene, load_any

SHIPPED = [
    (name, robot) for name in ("bowl-tip", "bowl-tool", "hands-on-tip", "hands-on-tool") for robot in (None, "neuro8")
]


@pytest.fixture(scope="module")
def bowl():
    """The smallest scene, its clouds and its space."""
    scene = load_any("bowl-tip", "neuro8")
    clouds = {name: part.cloud for name, part in build_parts(scene.anatomy, np.array(scene.port)).items()}
    port = Port(scene.shaft, scene.port)
    return scene, clouds, Space(scene.build_robot(), scene.constraints, "all", np.array(scene.start), clouds, port)


def found(report, check, where=None):
    return [f for f in report.findings if f.check == check and where in (None, f.where)]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "robot"), SHIPPED)
def test_the_shipped_scenes_have_neither_errors_nor_warnings(name, robot):
    report = check_any(load_any(name, robot))
    assert report.ok and not [f for f in report.findings if f.severity == Severity.WARNING]
    entered = [f for f in found(report, "hand") if "leads into it" in f.what]
    assert entered, "every scene's hand pushes into something"
    json.dumps(report.data())


def test_margins_from_a_cloud_are_its_distances_and_rows_their_derivatives(bowl):
    scene, clouds, space = bowl
    tool = load_any("bowl-tool", "neuro8")
    for s in (scene, tool):
        inside = Space(s.build_robot(), s.constraints, "all", np.array(s.start), clouds, space.port)
        for x in space.first + np.random.default_rng(2).uniform(-0.01, 0.01, (10, len(space.first))):
            sight, k = inside.at(x), inside.robot.kinematics(inside.all_joints(x))
            end, axis = k.translation(s.shaft), k.rotation(s.shaft)[:, 2]
            back = s.parameters.shaft_length if s is tool else 0.0
            expected = clouds["bowl"].segment_distance(end, end - back * axis) - s.constraints["bowl"].safe_distance
            assert sight.margin[0] == pytest.approx(expected, abs=1e-12)
            step = 1e-7
            ahead = [inside.at(x + step * e).margin[0] - inside.at(x - step * e).margin[0] for e in np.eye(len(x))]
            np.testing.assert_allclose(sight.row[0], np.array(ahead) / (2 * step), atol=1e-6)


def test_the_port_of_a_space_is_the_shafts_distance_from_it(bowl):
    scene, _, space = bowl
    x = space.first + 0.01
    k = space.robot.kinematics(space.all_joints(x))
    away, axis = k.translation(scene.shaft) - scene.port, k.rotation(scene.shaft)[:, 2]
    assert np.linalg.norm(space.at(x).port) == pytest.approx(np.linalg.norm(np.cross(away, axis)))


def test_at_the_balanced_clearance_the_potential_pushes_as_hard_as_the_hand():
    for parameters, force in ((TABLE_1, 20.0), (NEURO8, 10.0)):
        c, step = balance(parameters, force), 1e-9
        ahead, behind = (barrier(c + s, parameters.k, parameters.d_0, 0.0)[0] for s in (step, -step))
        assert -(ahead - behind) / (2 * step) == pytest.approx(force, rel=1e-4)
    assert balance(replace(TABLE_1, k=0.0), 20.0) == 0.0


def test_table_1_is_unusable_on_the_small_arm(bowl):
    """readings: 2 N ask for twice the joint speed there; its own set stays near the limits at 10 N."""
    _, _, space = bowl
    with_table_1 = steady_speeds(space, space.port, replace(TABLE_1, shaft_length=NEURO8.shaft_length), 2.0)
    assert with_table_1.share > 2.0
    assert steady_speeds(space, space.port, NEURO8, 2.0).share < 1.0


def test_steady_speeds_balance_the_damping(bowl):
    _, _, space = bowl
    speeds = steady_speeds(space, space.port, NEURO8, 7.0)
    p = NEURO8
    assert (p.D_c[0] + p.Q[0] * np.exp(-p.M[0] * speeds.along)) * speeds.along == pytest.approx(7.0)
    lever = p.shaft_length - np.linalg.norm(
        space.robot.kinematics(space.all_joints(space.first)).translation("shaft") - space.port.at
    )
    torque = (p.D_c[1] + p.Q[1] * np.exp(-p.M[1] * speeds.about)) * speeds.about
    assert torque == pytest.approx(7.0 * lever)


def test_a_waypoint_within_and_one_out_of_reach(bowl):
    scene, _, space = bowl
    pull = Pull((Waypoint(1.0, (0.002, 0.0, -0.052)), Waypoint(2.0, (0.0, 0.0, -0.3))), stiffness=500.0, most=10.0)
    targets = np.array(scene.port) + [w.at for w in pull.waypoints]
    near, far = follow_pull(pull, space, space.port, targets, 0.335)
    assert near.short < 1e-9 and near.force < 1e-5
    assert far.short > 0.05 and far.force == 10.0
    tips = np.random.default_rng(0).uniform(space.low, space.high, (4000, len(space.low)))
    reach = [space.robot.kinematics(space.all_joints(x)).translation("shaft") for x in tips]
    assert far.short <= min(np.linalg.norm(end - targets[1]) for end in reach) + 0.05
    report = check_led(scene.with_changes(hand=pull))
    assert [f.where for f in found(report, "hand") if "beyond the arm's reach" in f.what] == ["waypoint 2"]


def test_a_hand_that_stays_away_leads_into_nothing(bowl):
    scene, _, _ = bowl
    still = Pull((Waypoint(1.0, (0.0005, 0.0, -0.05)),), most=0.1)
    report = check_led(scene.with_changes(hand=still))
    assert not found(report, "hand") and not found(report, "cue") and report.ok


def test_a_push_has_no_way(bowl):
    scene, _, _ = bowl
    push = Push(times=(0.0,), wrenches=((0.0, 3.0, -4.0, 0.0, 0.0, 0.0),))
    (part,) = [p for p in check_led(scene.with_changes(hand=push)).parts if p.name == "hand"]
    assert "5 N" in part.method and "no way" in part.method and not part.rows


@pytest.mark.parametrize(("off", "warned", "refused"), [(0.0, 0, 0), (0.002, 1, 0), (0.008, 1, 1)])
def test_a_shaft_that_misses_its_port(bowl, off, warned, refused):
    scene, _, _ = bowl
    x, y, z = scene.port
    report = check_led(scene.with_changes(port=(x + off, y, z)))
    assert len(found(report, "port")) == warned
    said = [f for f in found(report, "build") if "passes the port at" in f.what]
    assert len(said) == refused and report.ok == (not refused)


def test_a_start_inside_a_region_and_one_outside(bowl):
    scene, _, _ = bowl
    inside = scene.with_changes(anatomy=replace(scene.anatomy, at=(0.0, 0.0, -0.0385)))
    report = check_led(inside)
    assert [f.where for f in found(report, "start") if "violated" in f.what] == ["bowl"]
    assert found(report, "build") and not report.ok


@pytest.mark.parametrize(("period", "severity"), [(0.03, Severity.ERROR), (0.012, Severity.WARNING), (0.01, None)])
def test_damping_that_is_too_strong_for_the_period(bowl, period, severity):
    scene, _, _ = bowl
    explicit = scene.with_changes(parameters=replace(TABLE_1, port_gain=10.0), period=period)
    said = found(check_led(explicit), "cue", "damping")
    assert [f.severity for f in said] == ([] if severity is None else [severity])
    if said:
        assert said[0].numbers["T_D_over_M"] == pytest.approx(period * (10 + 25 + 60))


def test_a_port_gain_that_oversteps(bowl):
    scene, _, _ = bowl
    fast = scene.with_changes(parameters=replace(scene.parameters, port_gain=300.0))
    assert [f.where for f in found(check_led(fast), "gains") if f.severity == Severity.ERROR] == ["port"]
    assert not found(check_led(scene), "gains")


def test_a_constraint_that_asks_for_a_motion_across_the_port_conflicts_with_it(bowl):
    scene, _, space = bowl
    x, y, z = scene.port
    for back, conflicts in ((0.05, True), (0.0, False)):
        place = Point.at((0.0, 0.0, -back), frame=scene.shaft)
        aside = Constraint("aside", place, Plane.through((x + 0.001, y, z), (1.0, 0.0, 0.0)), "outside", 0.0)
        with_it = Space(space.robot, ConstraintSet([aside]), "all", np.array(scene.start), {}, space.port)
        said = feasible_at_start(with_it, program(with_it, {"aside": 10.0}, 5.0, 0.004, RECOVERY)).findings
        assert ["together: aside, port;" in f.what for f in said] == ([True] if conflicts else [])


def test_clouds_that_do_not_cover():
    points = np.array([[0.0, 0, 0], [0.01, 0, 0]])
    clouds = {
        "open": PointCloud(points, 0.003, gap=Gap(0.005, points[0])),
        "unknown": PointCloud(points, 0.003),
        "closed": PointCloud(points, 0.006, gap=Gap(0.005, points[0]), added=1),
    }
    said = {(f.where, f.severity) for f in check_clouds(clouds).findings}
    assert said == {("open", Severity.ERROR), ("unknown", Severity.WARNING), ("closed", Severity.NOTE)}


def test_an_anatomy_that_cannot_be_built_is_an_error(bowl, tmp_path):
    scene, _, _ = bowl
    grid = [(0.01 * i, 0.01 * j, 0.0) for i in range(8) for j in range(8)]
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {len(grid)}\nproperty float x\nproperty float y\nproperty float z\n"
    )
    file = tmp_path / "sparse.ply"
    file.write_text(header + "end_header\n" + "".join(f"{x} {y} {z}\n" for x, y, z in grid))
    anatomy = replace(scene.anatomy, kind="files", cover={"organ": 0.002}, organ=str(file))
    (bowl_,) = scene.constraints
    organ = ConstraintSet([replace(bowl_, name="organ", second=Cloud.named("organ"))])
    report = check_led(scene.with_changes(anatomy=anatomy, constraints=organ))
    (said,) = report.findings
    assert said.check == "clouds" and "gap" in said.what and not report.ok


def vfi(*arguments):
    return CliRunner().invoke(app, ["check", *map(str, arguments)])


def test_the_exit_code_says_what_was_found(tmp_path):
    fine = vfi("S5")
    assert fine.exit_code == 0 and "0 errors, 0 warnings, 4 notes" in fine.stdout
    broken = tmp_path / "broken.yaml"
    broken.write_text(dump_scene(replace(s_scene("S5"), enforcement=Enforcement(eta=200.0))))
    done = vfi(broken)
    assert done.exit_code == 1 and "take eta <= 125 1/s" in done.stdout.replace("\n", " ")
    unknown = vfi("S55")
    assert unknown.exit_code == 2 and 'Did you mean "S5"?' in unknown.stderr and "Traceback" not in unknown.output


def test_findings_say_where_in_the_files_they_stand(tmp_path):
    text = dump_scene(s_scene("S5")).replace("name: S5", "name: mine")
    (tmp_path / "base.yaml").write_text(text)
    (tmp_path / "mine.yaml").write_text("base: base.yaml\nlimits:\n  moving/joint1: [-0.0111, 0.06]\n")
    data = json.loads(vfi(tmp_path / "mine.yaml", "--json").stdout)
    places = {f["where"]: f["place"] for f in data["findings"]}
    line = next(i for i, words in enumerate(text.splitlines(), 1) if words.startswith("- name: C3"))
    assert places["C3"] == f"{tmp_path}/base.yaml:{line}"
    assert places["moving/joint1"] == f"{tmp_path}/mine.yaml:3"
    assert "C3 (neurosurgery.yaml:" in vfi("S5").stdout.replace("\n", " ")


def test_json_says_the_same_as_the_text():
    done = vfi("S5", "--json")
    data = json.loads(done.stdout)
    assert data["scene"] == "S5" and data["robot"] == "neuro8-pair" and data["ok"] is True
    assert {f["severity"] for f in data["findings"]} == {"note"}
    assert [c["name"] for c in data["constraints"]] == ["C1", "C2", "C3", "C4"]
    assert {"joints", "gains", "feasibility", "relations", "reference", "approach", "methods"} <= data.keys()
    assert "seed 0" in data["methods"]["relations"]
