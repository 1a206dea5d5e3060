"""Scenes in YAML: S1-S5 equal to their Python, loss-free both ways, and every mistake told at its line."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings

import scenarios.scenes
from primitives import dual_quaternion as dq
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Point
from primitives.errors import FileError, InputError, UnknownNameError
from primitives.evaluate import evaluate
from scenarios import neurosurgery
from scenarios.enforcement import Enforcement
from scenarios.includes import MAX_FILES
from scenarios.scene import MAX_CYCLES, Scene
from scenarios.scene_file import dump_scene, load_scene
from scenarios.scenes import FOLDER, register_scene, scene_names, scene_path
from scenarios.trajectory import PoseTrajectory, Waypoint
from tests.primitives.broken_files import broken_data, broken_texts, changed, problems, survives
from vfi.forms import Soft
from vfi.tasks import PoseTask

SCENES = ("S1", "S2", "S3", "S3-stiff-wrist", "S4", "S5")
BY_HAND = ("S1-hand", "S2-hand", "S3-hand", "S4-hand", "S5-hand")
ALL_SCENES = tuple(
    sorted((*SCENES, *BY_HAND, "bowl-path", "bowl-tip", "bowl-tool", "hands-on-tip", "hands-on-tool", "two-arms"))
)

VALID = """\
# one arm, a wall
name: wall
summary: one arm and a wall
robot: neuro8
group: all
start: [0, 0, 0, 0, 0.2, 0, 0.1, 0.1]
constraints:
  - name: floor
    first: {kind: point, position: [0, 0, 0], frame: tip}
    second: {kind: plane, point: [0, 0, -0.08], normal: [0, 0, 1]}
    keep: outside
    safe_distance: 0.001
  - name: port
    first: {kind: line, frame: shaft}
    second: {kind: point, position: [0, 0, 0]}
    keep: inside
    safe_distance: 0.01
enforce: [floor]
task:
  frame: tip
  gain: 20
  weight: [1, 1, 1, 1, 2, 2, 2, 2]
reference:
  segment: 2
  waypoints:
    - {position: [0, 0, -0.06]}
    - {position: [0, 0, -0.1], rotation: [0, 0, 0.1]}
period: 0.004
duration: 3
enforcement: {eta: {port: 2, "": 0.5}, limit_eta: 4}
seed: 3
limits: {joint7: [-0.2, 0.2]}
"""


@pytest.fixture(autouse=True)
def no_scenes_left_behind(monkeypatch):
    monkeypatch.setattr(scenarios.scenes, "_registered", {})


def written(folder, text, name="scene.yaml"):
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


# What the files say


@pytest.mark.parametrize("name", SCENES)
def test_file_and_python_are_equal(name):
    assert load_scene(name) == neurosurgery.scene(name)
    assert load_scene(FOLDER / f"{name}.yaml").name == name


def test_the_scenes_differ_in_what_they_enforce():
    assert scene_names() == ALL_SCENES
    enforced = {n: [c.name for c in load_scene(n).constraints if c.enforced] for n in SCENES}
    assert enforced == {
        "S1": [],
        "S2": ["C1"],
        "S3": ["C1", "C2"],
        "S3-stiff-wrist": ["C1", "C2"],
        "S4": ["C1", "C2", "C3"],
        "S5": ["C1", "C2", "C3", "C4"],
    }
    scenes = [load_scene(n) for n in SCENES]
    for scene in scenes:
        like_s1 = scene.with_changes(name="S1", summary=scenes[0].summary, constraints=scenes[0].constraints, limits={})
        assert like_s1 == scenes[0]
        assert scene.constraints.enforcing([]) == scenes[0].constraints
    limits = {"moving/joint7": (-0.17, 0.17), "moving/joint8": (-0.17, 0.17)}
    assert [s.limits for s in scenes] == [limits if s.name == "S3-stiff-wrist" else {} for s in scenes]


def test_the_start_is_solved_to_full_precision():
    scene = load_scene("S1")
    kinematics = scene.build_robot().kinematics(np.array(scene.start))
    shafts = {"moving": ([-5, -11, 0], [0, -11, -45]), "parked": ([7, 2, 0], [2, 2, -62])}  # mm
    for arm, (through, end) in shafts.items():
        pose = kinematics.pose(f"{arm}/shaft")
        t6, z = dq.translation(pose), dq.rotation_matrix(pose)[:, 2]
        assert np.abs(t6 - 1e-3 * np.array(end)).max() < 1e-12
        assert np.linalg.norm(np.cross(1e-3 * np.array(through) - t6, z)) < 1e-12
        assert z[2] < 0.0
    assert scene.start[5:8] == (0.0, 0.15, 0.1)
    assert scene.start[13:] == (0.0, 0.15, -0.1)


def test_the_starting_margins_are_those_of_the_readings():
    scene = load_scene("S5")
    margin = evaluate(scene.build_robot(), scene.constraints, scene.start).margin
    assert 1e3 * margin == pytest.approx([8.0, 1.93, 3.0, 19.47], abs=0.006)


def test_a_file_of_ones_own(tmp_path):
    scene = load_scene(written(tmp_path, VALID))
    port = Constraint("port", Line.z_axis("shaft"), Point.at([0, 0, 0]), "inside", 0.01, enforced=False)
    assert scene.constraints["port"] == port
    assert scene.constraints["floor"].enforced
    assert scene.task == PoseTask("tip", 20.0, 1e-3, (1.0,) * 4 + (2.0,) * 4)
    assert scene.reference.waypoints[1] == Waypoint((0, 0, -0.1), (0, 0, 0.1))
    assert (scene.enforcement, scene.seed) == (Enforcement(eta={"port": 2, "": 0.5}, limit_eta=4), 3)
    assert scene.limits == {"joint7": (-0.2, 0.2)}
    assert (scene.period, scene.duration, scene.reference.segment) == (0.004, 3.0, 2.0)


def test_what_a_file_leaves_out_is_the_default_of_python(tmp_path):
    text = changed(VALID, {18: None, 20: None, 21: None, 22: None, 19: "task: {}", 30: None, 31: None, 32: None})
    scene = load_scene(written(tmp_path, text))
    assert scene.task == PoseTask()
    assert (scene.enforcement, scene.plant, scene.seed, scene.limits) == (Enforcement(), "kinematic", 0, {})
    assert scene.in_force == ("vfi", 0.5, 5.0, "act", "free", 0.02, {})
    assert all(c.enforced for c in scene.constraints)


# Round trips


@pytest.mark.parametrize("name", SCENES)
def test_dump_and_load_lose_nothing(tmp_path, name):
    scene = load_scene(name)
    again = load_scene(written(tmp_path, dump_scene(scene)))
    assert again == scene
    assert np.array(again.start).tobytes() == np.array(scene.start).tobytes()
    assert dump_scene(again) == dump_scene(scene)


def test_dump_and_load_lose_nothing_of_a_scene_with_everything(tmp_path):
    scene = load_scene(written(tmp_path, VALID))
    assert load_scene(written(tmp_path, dump_scene(scene))) == scene
    how = Enforcement(eta=np.float64(0.1), reach=np.float64(0.03), forms={"port": Soft(np.float64(2e3))})
    third = scene.with_changes(start=np.full(8, 1 / 3), enforcement=how, task=PoseTask(weight=np.ones(8) / 3))
    text = dump_scene(third)
    assert dump_scene(load_scene(written(tmp_path, text))) == text
    assert load_scene(written(tmp_path, text)).start == (1 / 3,) * 8


def test_what_a_file_cannot_hold_is_not_dumped():
    with pytest.raises(InputError, match="printable"):
        dump_scene(load_scene("S1").with_changes(summary="two\nlines"))


# Names and places


def test_names_are_told_from_files(tmp_path, monkeypatch):
    written(tmp_path, VALID)
    monkeypatch.chdir(tmp_path)
    assert load_scene("scene.yaml").name == "wall"
    for name, hint in (("s5", '"S5"'), ("S3-stif-wrist", '"S3-stiff-wrist"'), ("s3-STIFF-wrist", '"S3-stiff-wrist"')):
        with pytest.raises(UnknownNameError, match=f"Did you mean {hint}"):
            load_scene(name)
    with pytest.raises(UnknownNameError, match="Known: S1"):
        load_scene("neurosurgery")
    with pytest.raises(FileError, match=r"S5\.yaml: there is no such file"):
        load_scene("S5.yaml")


def test_a_scene_can_be_registered_by_its_file(tmp_path):
    file = written(tmp_path, VALID)
    assert register_scene(file) == "wall"
    assert register_scene(str(file)) == "wall"
    assert load_scene("wall") == load_scene(file)
    assert scene_path("wall") == file
    assert scene_names() == (*ALL_SCENES, "wall")
    with pytest.raises(InputError, match=r'scene "wall" of .*other\.yaml is registered already'):
        register_scene(written(tmp_path, VALID, "other.yaml"))
    with pytest.raises(InputError, match=r'"S1" of .*mine\.yaml is registered already'):
        register_scene(written(tmp_path, VALID.replace("wall", "S1"), "mine.yaml"))
    with pytest.raises(FileError, match=r'nameless.yaml:1: missing key "name"'):
        register_scene(written(tmp_path, "robot: neuro8\n", "nameless.yaml"))
    with pytest.raises(FileError, match=r"broken.yaml:2: a: this key stands in line 1"):
        register_scene(written(tmp_path, "a: 1\na: 2\n", "broken.yaml"))


def test_a_plug_in_adds_a_scene(tmp_path, monkeypatch):
    class Plugin(EntryPoint):
        def load(self):
            if self.value == "broken":
                raise ImportError("no such module")
            return self.value

    def install(value):
        plugin = Plugin("theirs", str(value), "active_constraints.scenes")
        monkeypatch.setattr(scenarios.scenes, "entry_points", lambda group: [plugin])
        scenarios.scenes._load_plugins.cache_clear()

    try:
        install(written(tmp_path, VALID))
        assert "wall" in scene_names()
        install("broken")
        with pytest.raises(InputError, match=r'"theirs" of active_constraints\.scenes: .* ImportError: no such module'):
            scene_names()
    finally:
        monkeypatch.undo()
        scenarios.scenes._load_plugins.cache_clear()


def test_listing_the_scenes_loads_no_heavy_library():
    code = (
        "import sys; from scenarios.scenes import scene_names; scene_names();"
        "sys.exit(any(m in sys.modules for m in ('numpy', 'numba', 'pinocchio', 'pydantic')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# Broken files: {line: its new text} of VALID, and every line with a problem and words of its message.

BROKEN = {
    "unknown key": ({29: "duraton: 3"}, [(1, 'missing key "duration"'), (29, 'Did you mean "duration"?')]),
    "name with a path": ({2: "name: ../../x"}, [(2, "expected 1 to 64 letters")]),
    "name a number": ({2: "name: 5"}, [(2, "put it in quotes")]),
    "summary with a colon": ({3: "summary: one arm: a wall"}, [(3, "in quotes")]),
    "misspelt robot": ({4: "robot: neuro-8"}, [(4, 'unknown robot "neuro-8". Did you mean "neuro8"?')]),
    "robot a list": ({4: "robot: [neuro8]"}, [(4, "neuro8-pair, or keys of an own one, got a list")]),
    "robot missing": ({4: None}, [(1, 'missing key "robot"')]),
    "misspelt group": ({5: "group: al"}, [(5, 'unknown joint group "al". Did you mean "all"?')]),
    "start too short": ({6: "start: [0, 0]"}, [(6, "expected 8 numbers, one a joint from joint1 to joint8, got 2")]),
    "start with a text": ({6: "start: [0, 0, 0, 0, 0.2, 0, 1 mm, 0]"}, [(6, 'start[6]: expected an angle: a')]),
    "start with NaN": ({6: "start: [0, 0, 0, 0, .NaN, 0, 0, 0]"}, [(6, "start[4]: expected a finite number")]),
    "start with true": ({6: "start: [0, 0, 0, 0, 0.2, 0, 0, true]"}, [(6, "start[7]: expected a number, got true")]),
    "misspelt frame": (
        {9: "    first: {kind: point, position: [0, 0, 0], frame: tp}"},
        [(9, 'constraints[0].first.frame: unknown frame "tp". Did you mean "tip"?')],
    ),
    "frame of another robot": (
        {14: "    first: {kind: line, frame: moving/shaft}"},
        [(14, 'unknown frame "moving/shaft". Known: base, frame1')],
    ),
    "enforce unknown": ({18: "enforce: [flor]"}, [(18, 'enforce[0]: unknown constraint "flor". Did you mean "floor"')]),
    "enforce the others": ({18: 'enforce: [""]'}, [(18, 'unknown constraint ""')]),
    "enforce no list": ({18: "enforce: floor"}, [(18, 'enforce: expected a list, got the text "floor"')]),
    "task frame": ({20: "  frame: shft"}, [(20, 'task.frame: unknown frame "shft". Did you mean "shaft"?')]),
    "task gain": ({21: "  gain: 0"}, [(21, "task.gain: expected a number > 0, got 0")]),
    "task weight of seven": ({22: "  weight: [1, 1, 1, 1, 1, 1, 1]"}, [(22, "expected 8 numbers >= 0, got")]),
    "task weight negative": ({22: "  weight: [1, 1, 1, 1, 1, 1, 1, -1]"}, [(22, "expected 8 numbers >= 0, got")]),
    "task no mapping": ({19: "task: 5", 20: None, 21: None, 22: None}, [(19, "task: expected keys and values")]),
    "segment": ({24: "  segment: -4"}, [(24, "reference.segment: expected a number > 0, got -4")]),
    "waypoint": ({26: "    - {positon: [0, 0, 1]}"}, [(26, 'key "position"; needed'), (26, 'mean "position"?')]),
    "waypoint of two": ({27: "    - {position: [0, 0]}"}, [(27, "waypoints[1].position: expected 3 numbers")]),
    "no waypoints": ({25: "  waypoints: []", 26: None, 27: None}, [(25, "expected at least one waypoint, got none")]),
    "period zero": ({28: "period: 0"}, [(28, "period: expected a number > 0, got 0")]),
    "period with a unit": ({28: "period: 4 mm"}, [(28, 'got the text "4 mm", a length')]),
    "duration without end": ({29: "duration: 1e9"}, [(29, f"at most {MAX_CYCLES} periods of 0.004 s")]),
    "eta of nothing": (
        {30: "enforcement: {eta: {prt: 2}}"},
        [(30, 'enforcement.eta.prt: unknown constraint "prt". Did you mean "port"?')],
    ),
    "eta negative": ({30: "enforcement: {eta: {port: -2}}"}, [(30, "eta.port: expected a number > 0, got -2")]),
    "eta a list": ({30: "enforcement: {eta: [1]}"}, [(30, "eta: expected a number, or a number a constraint")]),
    "eta true": ({30: "enforcement: {eta: true}"}, [(30, "eta: expected a number, got true")]),
    "eta of the scene": ({30: "eta: 2"}, [(30, 'unknown key "eta". Known: admittance, anatomy')]),
    "no such method": ({30: "enforcement: vif"}, [(30, 'unknown enforcement "vif". Did you mean "vfi"?')]),
    "method in keys": ({30: "enforcement: {method: vif}"}, [(30, 'method: unknown enforcement "vif". Did you mean')]),
    "method a list": ({30: "enforcement: [vfi]"}, [(30, "expected one of none, admittance, vfi, both, or keys")]),
    "method without a hand": ({30: "enforcement: both"}, [(30, "give it the keys hand and admittance")]),
    "metric without a hand": ({30: "enforcement: {metric: joints}"}, [(30, "no hand leads this scene")]),
    "guard": ({30: "enforcement: {guard: wach}"}, [(30, 'guard: unknown guard "wach". Did you mean "watch"?')]),
    "form": ({30: "enforcement: {forms: {port: eqality}}"}, [(30, 'port: unknown form of a port "eqality". Did you')]),
    "form of no port": ({30: "enforcement: {forms: {floor: soft}}"}, [(30, "only a line that is kept inside a")]),
    "form of nothing": ({30: "enforcement: {forms: {prt: soft}}"}, [(30, 'unknown constraint "prt". Did you mean')]),
    "form without weight": ({30: "enforcement: {forms: {port: {soft: 0}}}"}, [(30, "soft: expected a number > 0")]),
    "form a list": ({30: "enforcement: {forms: {port: [1]}}"}, [(30, "rows, equality, soft, or {soft: weight}, got")]),
    "reach a time": ({30: "enforcement: {reach: 5 ms}"}, [(30, "reach: expected a length")]),
    "plant": ({31: "plant: mujoko"}, [(31, 'plant: unknown plant "mujoko". Did you mean "mujoco"?')]),
    "seed": ({31: "seed: 1.5"}, [(31, "seed: expected a whole number, got the number 1.5")]),
    "seed true": ({31: "seed: true"}, [(31, "seed: expected a whole number, got true")]),
    "seed negative": ({31: "seed: -1"}, [(31, "seed: expected a number >= 0, got -1")]),
    "limits of no joint": ({32: "limits: {joint9: [0, 1]}"}, [(32, 'limits.joint9: unknown joint "joint9". Did you')]),
    "limits the wrong way": ({32: "limits: {joint7: [1, -1]}"}, [(32, "limits.joint7: expected two numbers, lower")]),
    "limits of three": ({32: "limits: {joint7: [1, 2, 3]}"}, [(32, "limits.joint7: expected two numbers, lower")]),
    "key twice": ({31: "period: 4"}, [(31, "period: this key stands in line 28 already")]),
    "tab": ({24: "\tsegment: 2"}, [(24, "a tab indents this line")]),
    "all at once": (
        {4: "robot: neuro9", 11: "    keep: outsid", 18: "enforce: [walls]", 21: "  gain: high", 28: "period: .inf"},
        [(4, "neuro9"), (11, "outsid"), (18, "walls"), (21, "high"), (28, "finite")],
    ),
    "frames at once": (
        {5: "group: arm", 9: "    first: {kind: point, position: [0, 0], frame: top}", 20: "  frame: top"},
        [(5, "arm"), (9, "top"), (9, "3 numbers"), (20, "top")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_say_where_and_what(tmp_path, case):
    changes, expected = BROKEN[case]
    found = problems(load_scene, written(tmp_path, changed(VALID, changes)))
    assert [(f, line) for f, line, _ in found] == [("scene.yaml", line) for line, _ in expected], found
    for (_, _, message), (_, words) in zip(found, expected, strict=True):
        assert words in message


def test_what_only_the_scene_itself_refuses_names_the_file(tmp_path, monkeypatch):
    def refuse(**_):
        raise InputError("a reason")

    monkeypatch.setattr("scenarios.scene_model.Scene", refuse)
    assert problems(load_scene, written(tmp_path, VALID)) == [("scene.yaml", 1, "a reason")]
    assert problems(load_scene, written(tmp_path, "5\n")) == [
        ("scene.yaml", 1, "expected keys and values, got the number 5")
    ]


# Bases


def based(folder, text, base="base.yaml"):
    written(folder, VALID, "base.yaml")
    return written(folder, f"base: {base}\n{text}")


def test_a_file_overrides_the_keys_of_its_base(tmp_path):
    scene = load_scene(based(tmp_path, "name: mine\nperiod: 0.001\nenforce: []\nlimits: {}\n"))
    below = load_scene(tmp_path / "base.yaml")
    watched = below.constraints.enforcing([])
    assert scene == below.with_changes(name="mine", period=0.001, constraints=watched, limits={})


@pytest.mark.parametrize(
    ("text", "base", "expected"),
    [
        ("period: 0\n", "base.yaml", [("scene.yaml", 2, "expected a number > 0")]),
        ("enforce: [C9]\n", "base.yaml", [("scene.yaml", 2, 'unknown constraint "C9"')]),
        ("robot: lwr4plus\n", "base.yaml", [("base.yaml", 6, "expected 7 numbers"), ("base.yaml", 14, '"shaft"')]),
        ("preiod: 1\n", "base.yaml", [("scene.yaml", 2, 'Did you mean "period"?')]),
        (
            "",
            "bas.yaml",
            [("scene.yaml", 1, 'base: unknown file in this folder "bas.yaml". Did you mean "base.yaml"?')],
        ),
        ("", "../base.yaml", [("scene.yaml", 1, "unknown file in this folder")]),
        ("", "/etc/passwd", [("scene.yaml", 1, "unknown file in this folder")]),
        ("", "scene.yaml", [("scene.yaml", 1, "scene.yaml -> scene.yaml goes in a circle")]),
        ("", "5", [("scene.yaml", 1, "expected the name of a file in the same folder, got the number 5")]),
        ("a: 1\na: 2\n", "bas.yaml", [("scene.yaml", 1, "unknown file"), ("scene.yaml", 3, "a: this key stands")]),
    ],
)
def test_mistakes_with_bases_name_the_right_file(tmp_path, text, base, expected):
    found = problems(load_scene, based(tmp_path, text, base))
    assert [m[:2] for m in found][: len(expected)] == [m[:2] for m in expected], found
    for (_, _, message), (_, _, words) in zip(found, expected, strict=False):
        assert words in message


def test_a_mistake_in_the_base_names_the_base(tmp_path):
    file = based(tmp_path, "period: 0\n")
    written(
        tmp_path, changed(VALID, {11: "    keep: out", 12: "    safe_distance: .nan", 28: "period: 0"}), "base.yaml"
    )
    found = problems(load_scene, file)
    assert sorted(m[:2] for m in found) == [("base.yaml", 11), ("base.yaml", 12), ("scene.yaml", 2)]
    written(tmp_path, "- 1\n", "base.yaml")
    assert problems(load_scene, file) == [("base.yaml", 1, "expected keys and values, got a list of 1")]
    written(tmp_path, "a: [1\n", "base.yaml")
    assert [m[:2] for m in problems(load_scene, file)] == [("base.yaml", 1)]


def test_chains_of_bases_end(tmp_path):
    written(tmp_path, VALID, "b0.yaml")
    for i in range(1, MAX_FILES + 1):
        written(tmp_path, f"base: b{i - 1}.yaml\nname: b{i}\n", f"b{i}.yaml")
    assert load_scene(tmp_path / f"b{MAX_FILES - 1}.yaml").name == f"b{MAX_FILES - 1}"
    assert problems(load_scene, tmp_path / f"b{MAX_FILES}.yaml") == [
        ("b1.yaml", 1, "base: b4.yaml -> b3.yaml -> b2.yaml -> b1.yaml -> b0.yaml: expected at most 4 files; join some")
    ]
    written(tmp_path, "base: b2.yaml\n", "b0.yaml")
    assert [m[:2] for m in problems(load_scene, tmp_path / "b2.yaml")] == [("b0.yaml", 1)]


def test_a_base_may_not_be_a_link_out_of_the_folder(tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "link.yaml").symlink_to(written(tmp_path, VALID, "secret.yaml"))
    file = written(inside, "base: link.yaml\n")
    assert "is a link out of this folder" in problems(load_scene, file)[0][2]


# Python


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": "a/b"}, "1 to 64 letters"),
        ({"robot": "neuro9"}, "unknown robot"),
        ({"start": (0.0, float("nan"))}, "finite"),
        ({"start": 5}, "shape"),
        ({"period": 0.0}, "period of scene S1: expected a number > 0"),
        ({"duration": -1.0}, "duration of scene S1: expected a number > 0"),
        ({"duration": 1e6}, "at most 10000000 periods"),
        ({"enforcement": Enforcement(eta={"C9": 1.0})}, 'unknown constraint "C9"'),
        ({"enforcement": Enforcement(forms={"C1": "equality"})}, 'form of constraint "C1"'),
        ({"enforcement": Enforcement("both")}, "hand and admittance"),
        ({"plant": "mujoko"}, 'unknown plant "mujoko"'),
        ({"seed": 0.5}, "seed of scene S1: expected a whole number"),
        ({"seed": -1}, "seed of scene S1: expected a number >= 0"),
        ({"limits": {"moving/joint7": (1.0, 1.0)}}, "expected lower < upper"),
    ],
)
def test_a_scene_in_python_is_checked_too(changes, words):
    with pytest.raises(InputError, match=words):
        load_scene("S1").with_changes(**changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"group": "arm"}, "unknown joint group"),
        ({"start": (0.0,) * 8}, r"expected shape \(16\), got \(8,\)"),
        ({"limits": {"joint7": (0.0, 1.0)}}, "unknown joint"),
    ],
)
def test_a_scene_that_does_not_fit_its_robot_is_told_so(changes, words):
    with pytest.raises(InputError, match=words):
        load_scene("S1").with_changes(**changes).build_robot()


def test_a_scene_without_a_file():
    scene = Scene(
        name="bare",
        summary="no constraints",
        robot="neuro8",
        group="all",
        start=np.array([0, 0, 0, 0, 0.2, 0, 0, 0]),
        constraints=ConstraintSet(),
        task=PoseTask(),
        reference=PoseTrajectory((Waypoint((0, 0, 0)),), 1.0),
        period=0.01,
        duration=1.0,
    )
    assert scene.start == (0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0)
    assert scene.build_robot().n == 8
    with pytest.raises(UnknownNameError, match="Known: S1, S2"):
        neurosurgery.scene("S6")


# Fuzz

FUZZ = settings(suppress_health_check=list(HealthCheck), deadline=None, max_examples=200)
DATA = yaml.safe_load(VALID)
BROKEN_TEXTS = broken_texts(VALID) | broken_texts("base: base.yaml\n" + VALID[:200]) | broken_data(DATA)


@FUZZ
@given(BROKEN_TEXTS)
def test_mutated_files_raise_nothing_foreign(tmp_path, text):
    written(tmp_path, VALID, "base.yaml")
    survives(load_scene, tmp_path / "scene.yaml", text)


@pytest.mark.campaign
@settings(FUZZ, max_examples=10_000)
@given(BROKEN_TEXTS)
def test_ten_thousand_mutated_files_raise_nothing_foreign(tmp_path, text):
    written(tmp_path, VALID, "base.yaml")
    survives(load_scene, tmp_path / "scene.yaml", text)


@pytest.mark.parametrize(
    "text",
    [
        "start: [" + "a, " * 999 + "]\n",
        "enforcement: {eta: {" + ", ".join(f"k{i}: 1" for i in range(999)) + "}}\n"
        "constraints:\n" + "  - {name: c}\n" * 999,
        "robot: neuro8-pair\nlimits: {" + ", ".join(f"k{i}: [2, 1]" for i in range(999)) + "}\n",
        "enforce: [" + ", ".join(f"k{i}" for i in range(999)) + "]\nconstraints:\n"
        + "".join(f"  - {{name: k{i}k}}\n" for i in range(999)),
        "reference:\n  waypoints:\n" + "    - {a: 1, b: 2, c: 3, position: [1]}\n" * 999,
    ],
    ids=range(5),
)  # fmt: skip
def test_many_mistakes_are_told_within_two_seconds(tmp_path, text):
    load_scene("S1")
    survives(load_scene, tmp_path / "scene.yaml", text)
