"""A scene with a robot of its own: in YAML and in Python the same, with tool, frames and limits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from primitives.errors import FileError, InputError, ModelError, UnknownNameError
from scenarios.hands_on.scene_file import dump_hands_on
from scenarios.jobs import Choices
from scenarios.own_robot import OwnRobot, Placement
from scenarios.run import run
from scenarios.scene_file import dump_scene, load_any
from scenarios.session import prepare
from tests.primitives.broken_files import changed, problems

URDF = Path(__file__).parents[2] / "docs" / "examples" / "six_axis.urdf"

VALID = """\
name: mine
summary: one arm of my own above a table
robot:
  urdf: arm.urdf
  tip: tool_tip
  tool: {on: tool_tip, position: [0, 0, 5 cm], rotation: [0, 90 deg, 0]}
  frames:
    camera: {on: tool_tip, position: [1 cm, 0, 0]}
  limits: {}
  velocity_limits: {}
group: all
start: [0, 0.3, 0.9, 0.8, 0, 0.2]
constraints:
  - {kind: keep_above, name: table, what: tool, point: [0, 0, 0.1], distance: 1 cm}
task: {frame: tool}
reference: {segment: 1 s, waypoints: [{position: [0.4, 0, 0.3]}]}
period: 250 Hz
duration: 40 ms
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF.read_text().replace('name="tool"', 'name="gripper"'))
    return tmp_path


def written(folder, text=VALID, name="scene.yaml"):
    (folder / name).write_text(text)
    return folder / name


def own(folder):
    return OwnRobot(
        urdf=str(folder / "arm.urdf"),
        tip="tool_tip",
        tool=Placement("tool_tip", (0, 0, 0.05), (0, np.radians(90.0), 0)),
        frames={"camera": Placement("tool_tip", (0.01, 0, 0))},
    )


def test_file_and_python_are_equal_and_nothing_is_lost(folder, tmp_path_factory):
    scene = load_any(written(folder, VALID))
    assert scene.robot == own(folder)
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    assert load_any(written(elsewhere, dump_scene(scene))) == scene
    joint = scene.build_robot().joints[0]
    robot = replace(scene.robot, limits={joint: (-1 / 3, 1.0)}, velocity_limits={joint: 1 / 3})
    limited = scene.with_changes(robot=robot)
    assert load_any(written(elsewhere, dump_scene(limited))) == limited
    robot = limited.build_robot()
    assert (robot.limits.lower[0], robot.limits.upper[0], robot.limits.velocity[0]) == (-1 / 3, 1.0, 1 / 3)


def test_tool_and_frames_lie_where_they_are_said_to(folder):
    robot = own(folder).build()
    q = np.array([0.1, 0.3, 0.9, 0.8, -0.2, 0.2])
    at = robot.kinematics(q)
    R, t = at.rotation("tool_tip"), at.translation("tool_tip")
    np.testing.assert_allclose(at.translation("tool"), t + R @ [0, 0, 0.05], atol=1e-12)
    turned = R @ Rotation.from_rotvec([0, np.pi / 2, 0]).as_matrix()
    np.testing.assert_allclose(at.rotation("tool"), turned, atol=1e-12)
    np.testing.assert_allclose(at.translation("camera"), t + R @ [0.01, 0, 0], atol=1e-12)
    assert robot.tip == "tool"
    assert replace(own(folder), tool=None).build().tip == "tool_tip"
    by_name = replace(own(folder), tool=None, tip="camera").build()
    assert by_name.tip == "camera"


def test_such_a_scene_runs_and_its_trace_holds_the_whole_path(folder):
    scene = load_any(written(folder, VALID))
    trace = run(scene)
    assert trace.header["robot"] == "arm.urdf"
    assert f"urdf: {folder}/arm.urdf" in trace.header["resolved_scene"]
    assert len(trace.t) == 10
    from scenarios.view.film import CAMERAS, Film

    with pytest.raises(ModelError, match=r'robot "arm\.urdf" is the scene\'s own, without pictures'):
        Film(trace, (64, 64), CAMERAS["tool"], None, ())
    with pytest.raises(InputError, match='robot "lwr4plus" cannot run scene "mine": it has 7 joints'):
        prepare([str(written(folder, VALID))], Choices(robot="lwr4plus"))


def test_hands_on_scenes_take_one_too(folder):
    scene = load_any("bowl-tip").with_changes(
        robot=own(folder), shaft="tool", start=(0, 0.3, 0.9, 0.8, 0, 0.2), constraints=(), limits={}
    )
    assert scene.build_robot().n == 6
    assert load_any(written(folder, dump_hands_on(scene))) == scene


@pytest.mark.parametrize(
    ("changes", "line", "words"),
    [
        ({4: "  urdf: am.urdf"}, 3, "am.urdf: cannot be read as a"),
        ({4: "  urdf: arm.urdf\n  mjcf: arm.xml"}, 3, "expected the file of a URDF or of an MJCF, one of them"),
        ({4: "  urdf: arm.yaml"}, 3, "expected a file that ends in .urdf"),
        ({5: "  tip: tol_tip"}, 3, 'unknown frame "tol_tip". Did you mean "tool_tip"?'),
        ({6: "  tool: {on: nowhere}"}, 3, 'unknown frame "nowhere"'),
        ({6: "  tool: {on: tool_tip, position: [0, 0, 5 deg]}"}, 6, 'got the text "5 deg", an angle'),
        ({9: "  limts: {}"}, 9, 'unknown key "limts". Did you mean "limits"?'),
        (
            {14: VALID.splitlines()[13].replace("what: tool", "what: tol")},
            14,
            'unknown frame "tol". Did you mean "tool"?',
        ),
    ],
)
def test_mistakes_are_told_at_their_line(folder, changes, line, words):
    found = problems(load_any, written(folder, changed(VALID, changes)))
    assert any(at == line and words in message for _, at, message in found), found


def test_python_is_checked_too():
    with pytest.raises(InputError, match="one of them"):
        OwnRobot()
    with pytest.raises(InputError, match='velocity limit of joint "a"'):
        OwnRobot(urdf="a.urdf", velocity_limits={"a": 0.0})
    with pytest.raises(InputError, match="on of Placement"):
        Placement("")
    with pytest.raises(FileError, match="cannot be read as a URDF"):
        OwnRobot(urdf="none.urdf").build()
    with pytest.raises(UnknownNameError, match="unknown joint"):
        OwnRobot(urdf=str(URDF), velocity_limits={"a": 1.0}).build()
