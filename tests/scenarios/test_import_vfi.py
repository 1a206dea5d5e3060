"""Constraints from VFI configurations of robot_constraint_manager, held to its rows by DQ Robotics."""

import numpy as np
import pytest
from dqrobotics import DQ, E_, k_
from dqrobotics.utils import DQ_Geometry
from typer.testing import CliRunner

from primitives import Robot
from primitives.dh import DHRow
from primitives.errors import FileError
from primitives.evaluate import Entity, evaluate
from scenarios.cli import app
from scenarios.imports.adorno_vfi import import_vfi, to_yaml
from scenarios.scene_file import load_any

V2 = """\
vfi_file_version: 2
zero_indexed: false
vfi_array:
    -
        vfi_type: "ENVIRONMENT_TO_ROBOT"
        cs_entity_environment: ["table"]
        cs_entity_robot: ["frame3"]
        entity_environment_primitive_type: "PLANE"
        entity_robot_primitive_type: "POINT"
        robot_index: 1
        joint_index: 3
        safe_distance: 0.05
        vfi_gain: 1.5
        direction: "RESTRICTED_ZONE"
        tag: "above table"
    -
        vfi_type: "ENVIRONMENT_TO_ROBOT"
        cs_entity_environment: ["axis"]
        cs_entity_robot: ["frame2"]
        entity_environment_primitive_type: "LINE_ANGLE"
        entity_robot_primitive_type: "LINE_ANGLE"
        robot_index: 1
        joint_index: 2
        safe_distance: 30
        vfi_gain: 2.0
        direction: "SAFE_ZONE"
        tag: "cone"
    -
        vfi_type: "ROBOT_TO_ROBOT"
        cs_entity_one: ["frame1"]
        cs_entity_two: ["frame3"]
        entity_one_primitive_type: "POINT"
        entity_two_primitive_type: "POINT"
        robot_index_one: 1
        robot_index_two: 1
        joint_index_one: 1
        joint_index_two: 3
        safe_distance: 0.1
        vfi_gain: 3.0
        direction: "RESTRICTED_ZONE"
        tag: "self"
"""
V3 = """\
vfi_file_version: 3
zero_indexed: false
metadata: {description: "by hand"}
robots:
  - {robot_index: 1, name: "arm", dim_configuration: 3}
environment_entities:
  - name: "table"
    pose:
      translation: [0.1, 0.2, -0.3]
      rotation: [0.9238795325112867, 0.3826834323650898, 0.0, 0.0]
    attached_direction: "-j_"
  - {name: "hole", pose: [1, 0, 0, 0, 0, 0.05, 0, 0.1]}
robot_entities:
  - {name: "probe", robot_index: 1, joint_index: 3, offset: {translation: [0.01, 0.02, 0.03], rotation: [0, 1, 0, 0]}}
vfi_array:
  - vfi_type: "ENVIRONMENT_TO_ROBOT"
    entity_environment: ["table"]
    entity_robot: ["probe"]
    entity_environment_primitive_type: "PLANE"
    entity_robot_primitive_type: "POINT"
    safe_distance: 0.02
    buffer: 0.01
    vfi_gain: 4.0
    direction: "RESTRICTED_ZONE"
    tag: "plane"
  - vfi_type: "ENVIRONMENT_TO_ROBOT"
    entity_environment: ["hole"]
    entity_robot: ["probe"]
    entity_environment_primitive_type: "LINE"
    entity_robot_primitive_type: "POINT"
    safe_distance: 0.4
    vfi_gain: 5.0
    direction: "SAFE_ZONE"
    tag: "cylinder"
"""
SEGMENT = """
  - vfi_type: "ENVIRONMENT_TO_ROBOT"
    cs_entity_environment: ["table"]
    cs_entity_robot: ["frame3", "frame2", "frame3"]
    entity_environment_primitive_type: "PLANE"
    entity_robot_primitive_type: "LINESEGMENT"
    robot_index: 1
    joint_index: 3
    safe_distance: 0.05
    vfi_gain: 1.0
    direction: "RESTRICTED_ZONE"
    tag: "rod"
"""


ROWS = [(0.0, 1.2, 0.3, 0.0), (0.25, -0.4, 0.0, 0.0), (0.2, 0.7, 0.05, 0.0)]


def arm():
    return Robot.from_dh([DHRow("revolute", *row) for row in ROWS])


def file(tmp_path, text, name="theirs.yaml"):
    path = tmp_path / name
    path.write_text(text)
    return path


def dq_of(kinematics, frame):
    return DQ(kinematics.pose(frame))


def test_version_2_has_the_distances_of_dq_robotics_to_objects_that_move(tmp_path):
    robot, q = arm(), np.array([0.3, -0.8, 1.1])
    imported = import_vfi(file(tmp_path, V2), frames=robot.frames)
    assert imported.eta == {"above table": 1.5, "cone": 2.0, "self": 3.0} and not imported.left_out
    r, t = DQ([np.cos(0.3), np.sin(0.3), 0, 0]), DQ([0, 0.1, -0.2, 0.15])
    table = r + 0.5 * E_ * t * r
    entities = {name: Entity(table.vec8(), np.zeros(6)) for name in ("table", "axis")}
    found = evaluate(robot, imported.constraints, q, entities=entities)
    kinematics = robot.kinematics(q)
    normal = table.P() * k_ * table.P().conj()
    plane = normal + E_ * float(table.translation().vec4() @ normal.vec4())
    points = {f: dq_of(kinematics, f).translation() for f in ("frame1", "frame3")}
    above = DQ_Geometry.point_to_plane_distance(points["frame3"], plane)
    assert found.margin[0] == pytest.approx(above - 0.05)
    z = dq_of(kinematics, "frame2").P() * k_ * dq_of(kinematics, "frame2").P().conj()
    assert found.margin[1] == pytest.approx(np.radians(30) - np.arccos(float(z.vec4() @ normal.vec4())))
    square = DQ_Geometry.point_to_point_squared_distance(points["frame1"], points["frame3"])
    assert found.margin[2] == pytest.approx(np.sqrt(square) - 0.1)


def test_version_3_has_the_places_of_its_file(tmp_path):
    robot, q = arm(), np.array([-0.4, 0.6, 0.2])
    imported = import_vfi(file(tmp_path, V3), frames=robot.frames)
    assert imported.eta == {"plane": 4.0, "cylinder": 5.0} and not imported.left_out
    r, t = DQ([0, 1, 0, 0]), DQ([0, 0.01, 0.02, 0.03])
    probe = (dq_of(robot.kinematics(q), "frame3") * (r + 0.5 * E_ * t * r)).translation().vec3()
    angle = np.pi / 4
    normal = -np.array([0.0, np.cos(angle), np.sin(angle)])
    found = evaluate(robot, imported.constraints, q)
    assert found.margin[0] == pytest.approx(normal @ (probe - [0.1, 0.2, -0.3]) - 0.02)
    assert found.margin[1] == pytest.approx(0.4 - np.hypot(*(probe - [0.1, 0.0, 0.2])[:2]))


def test_a_segment_above_a_plane_is_its_two_ends(tmp_path):
    imported = import_vfi(file(tmp_path, V2 + SEGMENT.replace("\n  ", "\n    ")), frames=arm().frames)
    made = [c for c in imported.constraints if c.name.startswith("rod")]
    assert [(c.name, c.first.frame, c.safe_distance) for c in made] == [
        ("rod-start", "frame2", 0.05),
        ("rod-end", "frame3", 0.05),
    ]
    assert any(n.tag == "rod" and "two constraints" in n.text for n in imported.changed)


def test_the_gain_agrees_with_theirs_at_the_boundary():
    """Theirs: d/dt d^2 >= -gain (d^2 - d_safe^2); near d_safe this is our d/dt d >= -gain (d - d_safe)."""
    safe, gain = 0.1, 3.0
    for d in (safe + 1e-6, safe - 1e-6):
        theirs = -gain * (d * d - safe * safe) / (2.0 * d)
        assert theirs == pytest.approx(-gain * (d - safe), rel=1e-4)


def test_what_cannot_be_carried_over_is_named_with_its_line(tmp_path):
    text = V2.replace('["frame3"]', '["gripper"]', 1).replace(
        'direction: "RESTRICTED_ZONE"\n        tag: "self"',
        ('direction: "SAFE_ZONE"\n        colour: "red"\n        buffer: 0.02\n        tag: "self"'),
    )
    imported = import_vfi(file(tmp_path, text), frames=arm().frames)
    assert imported.constraints.names == ("cone", "self")
    (left,) = imported.left_out
    assert left.place.endswith("theirs.yaml:5") and left.tag == "above table" and 'no frame "gripper"' in left.text
    said = [n.text for n in imported.changed if n.tag == "self"]
    assert any("buffer 0.02" in t for t in said) and any('"colour"' in t for t in said)
    assert any("keeps inside" in t for t in said)
    assert not [n for n in imported.changed if n.tag == "cone" and ("buffer" in n.text or "inside" in n.text)]


@pytest.mark.parametrize(("robot", "other"), [("PLANE", "POINT"), ("LINESEGMENT", "POINT"), ("LINE_ANGLE", "LINE")])
def test_primitives_without_a_pair_are_left_out(tmp_path, robot, other):
    text = V2.replace('"PLANE"', f'"{other}"', 1)
    own = 'entity_robot_primitive_type: "POINT"'
    text = text.replace(own, own.replace("POINT", robot), 1)
    imported = import_vfi(file(tmp_path, text))
    (left,) = imported.left_out
    assert left.tag == "above table" and f"{robot} of the robot" in left.text


def test_joints_can_be_given_frames_of_ours(tmp_path):
    imported = import_vfi(file(tmp_path, V3), joint_frames=["a", "b", "c"])
    assert {c.first.frame for c in imported.constraints} == {"c"}
    short = import_vfi(file(tmp_path, V3), joint_frames=["a", "b"])
    assert len(short.left_out) == 2 and "joint 3 has no frame" in short.left_out[0].text
    zero = import_vfi(file(tmp_path, V3.replace("zero_indexed: false", "zero_indexed: true")))
    assert {c.first.frame for c in zero.constraints} == {"frame4"}


@pytest.mark.parametrize(
    ("change", "line", "text"),
    [
        (("vfi_file_version: 2", "vfi_file_version: 1"), 1, "vfi_file_version 2 or 3"),
        (("vfi_gain: 1.5", "vfi_gain: -1"), 13, "expected a number > 0"),
        (("RESTRICTED_ZONE", "RESTRICTED"), 14, 'Did you mean "RESTRICTED_ZONE"?'),
        (('tag: "cone"', 'tag: "self"'), 41, '"self" is taken'),
        (("ENVIRONMENT_TO_ROBOT", "ENVIRONMENT"), 5, "unknown vfi_type"),
    ],
)
def test_a_broken_file_is_refused_with_its_line(tmp_path, change, line, text):
    with pytest.raises(FileError, match=f"theirs.yaml:{line}: .*") as refused:
        import_vfi(file(tmp_path, V2.replace(*change, 1)))
    assert text in str(refused.value)


def test_version_3_with_a_name_that_it_does_not_define(tmp_path):
    (left,) = import_vfi(file(tmp_path, V3.replace('["hole"]', '["whole"]'))).left_out
    assert left.tag == "cylinder" and '"whole" is none of its environment_entities' in left.text


SCENE = """\
base: ours.yaml
name: imported
summary: "constraints of another program"
robot: lwr4plus
group: all
start: [0.35, 0.87, 0, -1.22, 0, 1.05, 0]
task: {frame: tip}
reference: {segment: 1, waypoints: [{position: [-0.5, -0.2, 0.1]}]}
period: 0.01
duration: 1
"""


def test_what_is_written_is_the_base_of_a_scene_with_the_same_constraints(tmp_path):
    path = file(tmp_path, V3)
    out = tmp_path / "ours.yaml"
    done = CliRunner().invoke(app, ["import", str(path), "-o", str(out), "--joint-frames", "a,b,tip"])
    assert done.exit_code == 0, done.output
    assert "2 constraints" in done.stdout and "buffer 0.01" in done.stderr
    scene = load_any(file(tmp_path, SCENE, "scene.yaml"))
    imported = import_vfi(path, joint_frames=["a", "b", "tip"])
    assert scene.constraints == imported.constraints and scene.enforcement.eta == imported.eta
    assert out.read_text() == to_yaml(imported)


def test_the_command_refuses_what_is_no_such_file(tmp_path):
    done = CliRunner().invoke(app, ["import", str(tmp_path / "none.yaml"), "-o", str(tmp_path / "out.yaml")])
    assert done.exit_code == 2 and "there is no such file" in done.stderr and not (tmp_path / "out.yaml").exists()
