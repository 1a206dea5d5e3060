"""Hands-on scenes in YAML: loss-free both ways, and every mistake told at its line."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from admittance import NEURO8, TABLE_1, Admittance, Region
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Plane, Point, Segment
from primitives.errors import FileError, InputError, UnknownNameError
from scenarios.anatomy.parts import AnatomySource, build_parts, placed_cloud
from scenarios.hands_on.pull import Pull, Waypoint
from scenarios.hands_on.push import Push
from scenarios.hands_on.scene import HandsOnScene
from scenarios.hands_on.scene_file import dump_hands_on, hands_on_data
from scenarios.scene import MAX_CYCLES
from scenarios.scene_file import load_any, load_scene
from scenarios.scenes import scene_names, scene_path
from tests.primitives.broken_files import broken_data, broken_texts, changed, problems, survives

NAMES = ("hands-on-tip", "hands-on-tool", "bowl-tip", "bowl-tool")
ROBOTS = ("lwr4plus", "neuro8")
each = pytest.mark.parametrize(("name", "robot"), [(n, r) for n in NAMES for r in ROBOTS])

VALID = """\
# a hand, a kidney
name: by-hand
summary: the tip is led over a kidney
robot: lwr4plus
group: all
shaft: tip
start: [0.35, 0.87, 0, -1.22, 0, 1.05, 0]
port: [-0.605, -0.22, 0]
port_radius: 0.006
parameters: {set: table-1, k: 0.02, inertia: [1, 1, 1, 2]}
form: full
integrator: rk4
anatomy:
  kind: kidney
  cover: {organ: 0.005, vessels: 0.0035}
  at: [-0.035, 0, -0.2]
  turn: 0.5
constraints:
  - {name: vessels, first: {kind: point, frame: tip, position: [0, 0, 0]}, second: {kind: cloud, cloud: vessels}, keep: outside, safe_distance: 0}
  - {name: organ, first: {kind: segment, frame: tip, start: [0, 0, 0], end: [0, 0, -0.43]}, second: {kind: cloud, cloud: organ}, keep: outside, safe_distance: 0.003}
hand:
  stiffness: 200
  damping: 10
  most: 25
  tremor: 0.5
  delay: 0.1
  waypoints:
    - {t: 1, to: [0, 0, -0.13]}
    - {t: 2, into: vessels, beyond: 0.05}
    - {t: 3, across: organ}
period: 0.002
duration: 3.5
"""  # noqa: E501


def written(folder, text, name="scene.yaml"):
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def elements(scene):
    """What of the tool the built-in scenes keep out: the end of the shaft, or all of it up to the handle."""
    end = [0.0, 0.0, -scene.parameters.shaft_length]
    return {
        "tip": Point.at([0, 0, 0], frame=scene.shaft),
        "tool": Segment.between([0, 0, 0], end, frame=scene.shaft),
    }


# What the files say


@each
def test_every_built_in_scene_has_a_variant_for_both_arms(name, robot):
    scene = load_any(name, robot)
    assert isinstance(scene, HandsOnScene)
    assert (scene.name, scene.robot) == (name, robot)
    assert scene.parameters.k == (TABLE_1 if robot == "lwr4plus" else NEURO8).k
    assert {c.first for c in scene.regions} == {elements(scene)[name.rsplit("-", 1)[1]]}
    assert set(scene.forbidden_parts) == {c.name for c in scene.constraints} <= set(scene.anatomy.parts)
    assert scene.shaft == ("tip" if robot == "lwr4plus" else "shaft")


@each
def test_the_port_lies_on_the_shaft_at_the_start(name, robot):
    scene = load_any(name, robot)
    at = scene.build_robot().kinematics(np.array(scene.start))
    along = at.rotation(scene.shaft)[:, 2]
    away = np.array(scene.port) - at.translation(scene.shaft)
    assert np.linalg.norm(away - (away @ along) * along) < 1e-9
    assert away @ along < 0.0


def test_the_first_configuration_is_the_papers():
    scene = load_any("hands-on-tip")
    assert np.degrees(scene.start) == pytest.approx([20, 50, 0, -70, 0, 60, 0], abs=1e-12)
    assert scene.port == pytest.approx((-0.6053, -0.2203, 0.0), abs=5e-5)
    assert scene.parameters == TABLE_1
    assert scene.period == 0.004


def test_a_robot_without_a_variant_gives_the_scene_as_it_is():
    assert load_any("hands-on-tip", "neuro8-pair") == load_any("hands-on-tip")
    assert scene_path("bowl-tip", "neuro8").name == "bowl-tip.neuro8.yaml"
    assert set(NAMES) < set(scene_names())
    with pytest.raises(InputError, match="led by a hand, expected one that follows a trajectory"):
        load_scene("hands-on-tip")


def test_a_file_of_ones_own(tmp_path):
    scene = load_any(written(tmp_path, VALID))
    assert scene == HandsOnScene(
        name="by-hand",
        summary="the tip is led over a kidney",
        robot="lwr4plus",
        start=(0.35, 0.87, 0.0, -1.22, 0.0, 1.05, 0.0),
        port=(-0.605, -0.22, 0.0),
        port_radius=0.006,
        parameters=replace(TABLE_1, k=0.02, inertia=(1.0, 1.0, 1.0, 2.0)),
        form="full",
        integrator="rk4",
        anatomy=AnatomySource("kidney", {"organ": 0.005, "vessels": 0.0035}, (-0.035, 0.0, -0.2), 0.5),
        constraints=ConstraintSet(
            [
                Constraint("vessels", Point.at([0, 0, 0], frame="tip"), Cloud.named("vessels"), "outside", 0.0),
                Constraint(
                    "organ",
                    Segment.between([0, 0, 0], [0, 0, -0.43], frame="tip"),
                    Cloud.named("organ"),
                    "outside",
                    0.003,
                ),
            ]
        ),
        hand=Pull(
            (Waypoint(1, (0, 0, -0.13)), Waypoint(2, "vessels", 0.05, "into"), Waypoint(3, "organ", 0.0, "across")),
            stiffness=200,
            damping=10,
            most=25,
            tremor=0.5,
            delay=0.1,
        ),
        period=0.002,
        duration=3.5,
    )


def test_what_a_file_leaves_out_is_the_default_of_python(tmp_path):
    left_out = (5, 6, 9, 10, 11, 12, 16, 17, 20, 22, 23, 24, 25, 26, 31)
    scene = load_any(written(tmp_path, changed(VALID, dict.fromkeys(left_out))))
    for field in ("group", "shaft", "port_radius", "parameters", "form", "integrator", "period"):
        assert getattr(scene, field) == HandsOnScene.__dataclass_fields__[field].default
    assert scene.hand == Pull(scene.hand.waypoints)
    assert scene.anatomy == AnatomySource("kidney", scene.anatomy.cover)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("neuro8", NEURO8),
        ("{set: neuro8, shaft_length: 0.335}", replace(NEURO8, shaft_length=0.335)),
        ("{G: [1, 2, 3, 4], implicit_damping: true}", replace(TABLE_1, G=(1, 2, 3, 4), implicit_damping=True)),
        ("{W: 2.5}", replace(TABLE_1, W=2.5)),
        ("{W: [1, 1, 1, 1, 1, 1, 2]}", replace(TABLE_1, W=(1, 1, 1, 1, 1, 1, 2))),
        ("{}", TABLE_1),
    ],
)
def test_parameters_are_a_set_and_changes_of_it(tmp_path, text, expected):
    assert load_any(written(tmp_path, changed(VALID, {10: f"parameters: {text}"}))).parameters == expected


# Round trips


@each
def test_dump_and_load_lose_nothing(tmp_path, name, robot):
    scene = load_any(name, robot)
    again = load_any(written(tmp_path, dump_hands_on(scene)))
    assert again == scene
    assert np.array(again.start).tobytes() == np.array(scene.start).tobytes()
    assert dump_hands_on(again) == dump_hands_on(scene)


def test_dump_and_load_lose_nothing_of_a_scene_with_everything(tmp_path):
    scene = load_any(written(tmp_path, VALID))
    third = scene.with_changes(
        start=np.full(7, 1 / 3),
        parameters=replace(NEURO8, W=np.ones(7) / 3, d_0=np.float64(0.1)),
        hand=replace(scene.hand, waypoints=[Waypoint(1 / 3, np.full(3, -1 / 3)), *scene.hand.waypoints[1:]]),
    )
    for one in (scene, third):
        assert load_any(written(tmp_path, dump_hands_on(one))) == one


def test_files_are_looked_for_beside_the_scene_and_kept_as_whole_paths(tmp_path, monkeypatch):
    text = changed(VALID, {14: "  kind: files", 16: "  organ: a/kidney.ply", 17: "  vessels: vessels.stl"})
    scene = load_any(written(tmp_path, text))
    assert (scene.anatomy.organ, scene.anatomy.vessels) == (f"{tmp_path}/a/kidney.ply", f"{tmp_path}/vessels.stl")
    (elsewhere := tmp_path / "elsewhere").mkdir()
    assert load_any(written(elsewhere, dump_hands_on(scene))) == scene
    monkeypatch.chdir(tmp_path)
    assert load_any("scene.yaml") == scene
    pushed = changed(text, {22: "  record: a/hand.csv", **dict.fromkeys(range(23, 31))})
    assert load_any(written(elsewhere, pushed)).hand == Push(file=f"{elsewhere}/a/hand.csv")


def test_wrenches_that_are_given(tmp_path):
    rows = ["    - {t: 0.5, force: [0, 0, -3]}", "    - {t: 1, torque: [0.1, 0, 0]}"]
    lines = {22: "  wrenches:", 23: rows[0], 24: rows[1], 25: "  interpolate: true", 26: "  tremor: 0.2"}
    scene = load_any(written(tmp_path, changed(VALID, lines | dict.fromkeys(range(27, 31)))))
    assert scene.hand == Push((0.5, 1.0), ((0, 0, -3, 0, 0, 0), (0, 0, 0, 0.1, 0, 0)), interpolate=True, tremor=0.2)
    assert load_any(written(tmp_path, dump_hands_on(scene))) == scene


def test_what_a_file_cannot_hold_is_not_dumped():
    with pytest.raises(InputError, match="printable"):
        dump_hands_on(load_any("bowl-tip").with_changes(summary="two\nlines"))


# Broken files: {line: its new text} of VALID, and every line with a problem and words of its message.

BROKEN = {
    "unknown key": ({32: "duraton: 3"}, [(1, 'missing key "duration"'), (32, 'Did you mean "duration"?')]),
    "name with a path": ({2: "name: ../../x"}, [(2, "expected 1 to 64 letters")]),
    "misspelt robot": ({4: "robot: lwr4"}, [(4, 'unknown robot "lwr4". Did you mean "lwr4plus"?')]),
    "misspelt group": ({5: "group: al"}, [(5, 'unknown joint group "al". Did you mean "all"?')]),
    "misspelt shaft": ({6: "shaft: tp"}, [(6, 'unknown frame "tp". Did you mean "tip"?')]),
    "start too short": ({7: "start: [0, 0]"}, [(7, "expected 7 numbers, one a joint from")]),
    "start with NaN": ({7: "start: [0, 0, .NaN, 0, 0, 0, 0]"}, [(7, "start[2]: expected a finite number")]),
    "port as text": ({8: "port: left of the navel"}, [(8, 'port: expected a list, got the text "left of the navel"')]),
    "port of two": ({8: "port: [0, 0]"}, [(8, "port: expected 3 numbers (x, y, z), got 2")]),
    "port missing": ({8: None}, [(1, 'missing key "port"; needed here: name, summary, robot, start, port')]),
    "port radius": ({9: "port_radius: 5 deg"}, [(9, 'got the text "5 deg", an angle')]),
    "unknown set": (
        {10: "parameters: table-2"},
        [(10, 'parameters.set: unknown set of parameters "table-2". Did you mean "table-1"?')],
    ),
    "set no text": ({10: "parameters: {set: [table-1]}"}, [(10, "parameters.set: expected one of table-1, neuro8")]),
    "parameters a number": ({10: "parameters: 5"}, [(10, "expected a set (table-1, neuro8), or keys and values")]),
    "unknown parameter": (
        {10: "parameters: {set: table-1, inertias: 1}"},
        [(10, 'parameters: unknown key "inertias". Did you mean "inertia"?')],
    ),
    "parameter as text": ({10: 'parameters: {k: "1e-3"}'}, [(10, "parameters.k: expected an energy: a number in J")]),
    "parameter as nothing": ({10: "parameters: {k: }"}, [(10, "parameters.k: expected a number, got nothing")]),
    "parameter out of range": ({10: "parameters:\n  k: 0.1\n  d_0: 0"}, [(12, "d_0 of Parameters: expected a number")]),
    "three of four": ({10: "parameters: {G: [1, 1, 1]}"}, [(10, "G of Parameters: expected shape (4), got (3,)")]),
    "two parameters": (
        {10: "parameters:\n  W: -1\n  inertia: [0, 1, 1, 1]"},
        [(11, "W of Parameters: expected a number > 0"), (12, "inertia and D_c of Parameters: expected > 0")],
    ),
    "switch as text": (
        {10: 'parameters: {implicit_damping: "false"}'},
        [(10, "parameters.implicit_damping: expected true or false")],
    ),
    "misspelt form": ({11: "form: reduce"}, [(11, 'unknown form "reduce". Did you mean "reduced"?')]),
    "misspelt integrator": ({12: "integrator: rk5"}, [(12, 'unknown integrator "rk5". Did you mean "rk4"?')]),
    "unknown anatomy": ({14: "  kind: liver"}, [(14, 'anatomy.kind: unknown kind of anatomy "liver"')]),
    "missing cover": (
        {15: "  cover: {organ: 0.005}"},
        [(13, 'anatomy: cover of the anatomy: expected a radius for "vessels"')],
    ),
    "cover of nothing": (
        {15: "  cover: {organ: 0.005, vessels: 0.0035, liver: 1}"},
        [(13, 'anatomy: unknown part of the anatomy "liver". Known: bowl, organ, vessels')],
    ),
    "cover below zero": (
        {15: "  cover: {organ: 0.005, vessels: -1}"},
        [(15, "anatomy.cover.vessels: expected a number > 0, got -1")],
    ),
    "a file of a procedural kind": (
        {16: "  organ: kidney.ply"},
        [(13, 'anatomy: anatomy "kidney": files (organ, vessels) go with the kind "files", and need it')],
    ),
    "no file": (
        {14: "  kind: files"},
        [
            (13, 'go with the kind "files", and need it'),
            (19, 'unknown cloud "vessels". Known: none are declared'),
            (20, 'unknown cloud "organ"'),
        ],
    ),
    "unknown unit": ({17: "  unit: inch"}, [(17, 'anatomy.unit: unknown unit of length "inch". Known: cm, m, mm')]),
    "unknown way of gaps": ({17: "  gaps: ignore"}, [(17, "anatomy.gaps: unknown way to treat gaps")]),
    "unknown part": (
        {19: VALID.splitlines()[18].replace("cloud: vessels", "cloud: vesels")},
        [(19, 'constraints[0].second.cloud: unknown cloud "vesels". Did you mean "vessels"?')],
    ),
    "unknown frame": (
        {19: VALID.splitlines()[18].replace("frame: tip", "frame: handle")},
        [(19, 'constraints[0].first.frame: unknown frame "handle". Known: ')],
    ),
    "radius below zero": (
        {20: VALID.splitlines()[19].replace("safe_distance: 0.003", "safe_distance: -0.1")},
        [(20, "constraints[1].safe_distance: expected a number >= 0, got -0.1")],
    ),
    "inside of a cloud": (
        {20: VALID.splitlines()[19].replace("outside", "inside")},
        [(20, 'constraint "organ": a cloud is a surface to stay outside of; got keep "inside"')],
    ),
    "no anatomy": (
        {13: None, 14: None, 15: None, 16: None, 17: None, 29: "    - {t: 2, to: [0, 0, -0.2]}", 30: None},
        [(14, 'unknown cloud "vessels". Known: none are declared'), (15, 'unknown cloud "organ"')],
    ),
    "no waypoints": ({27: "  waypoints: []", 28: None, 29: None, 30: None}, [(21, "expected at least one")]),
    "waypoint with two ways": (
        {29: "    - {t: 2, to: [0, 0, -0.1], into: vessels}"},
        [(29, "hand.waypoints[1]: expected one of to, into, across, got to and into")],
    ),
    "waypoint with no way": ({28: "    - {t: 1}"}, [(28, "expected one of to, into, across, got none")]),
    "waypoint at the port": (
        {28: "    - {t: 1, to: [0, 0, 0]}"},
        [(28, "hand.waypoints[0]: at of Waypoint: expected")],
    ),
    "waypoint before the start": ({28: "    - {t: -1, to: [0, 0, 1]}"}, [(28, "expected a number >= 0, got -1")]),
    "two unknown parts of waypoints": (
        {29: "    - {t: 2, into: vessel}", 30: "    - {t: 3, across: bowl}"},
        [
            (29, 'hand.waypoints[1].into: unknown part of the anatomy "vessel". Did you mean "vessels"?'),
            (30, 'hand.waypoints[2].across: unknown part of the anatomy "bowl"'),
        ],
    ),
    "times that do not grow": (
        {29: "    - {t: 1, into: vessels}"},
        [(21, "hand: waypoints of a pull: expected at least one, with growing times, got [1.0, 1.0, 3.0]")],
    ),
    "two hands": (
        {22: "  record: hand.csv"},
        [(21, "hand: expected one of waypoints, wrenches, record, got waypoints and")],
    ),
    "no hand": (
        {**dict.fromkeys(range(22, 31)), 22: "  tremor: 0"},
        [(21, "hand: expected one of waypoints, wrenches, record, got none")],
    ),
    "a stiff record": (
        {23: "  record: hand.csv", **dict.fromkeys(range(24, 31))},
        [(21, "hand: stiffness cannot go with record")],
    ),
    "an interpolated pull": ({23: "  interpolate: true"}, [(21, "hand: interpolate cannot go with waypoints")]),
    "a hand without force": ({24: "  most: 0"}, [(24, "hand.most: expected a number > 0, got 0")]),
    "period": ({31: "period: 0"}, [(31, "period: expected a number > 0, got 0")]),
    "too long": ({32: f"duration: {0.002 * (MAX_CYCLES + 1)}"}, [(32, "duration: ")]),
    "mistakes everywhere": (
        {4: "robot: x", 8: "port: [0]", 14: "  kind: x", 24: "  most: -1", 32: "duration: x"},
        [(4, ""), (8, ""), (14, ""), (24, ""), (32, "")],
    ),
}


def test_the_file_that_is_broken_below_is_right(tmp_path):
    assert problems(load_any, written(tmp_path, VALID)) == []


@pytest.mark.parametrize("case", BROKEN)
def test_every_mistake_is_told_at_its_line(tmp_path, case):
    changes, expected = BROKEN[case]
    found = problems(load_any, written(tmp_path, changed(VALID, changes)))
    assert [(file, line) for file, line, _ in found] == [("scene.yaml", line) for line, _ in expected]
    for (_, _, message), (_, words) in zip(found, expected, strict=True):
        assert words in message


def test_a_mistake_in_a_base_is_told_there(tmp_path):
    written(tmp_path, changed(VALID, {8: "port: [0, 0]"}), "base.yaml")
    mine = written(tmp_path, "base: base.yaml\nname: mine\nintegrator: rk5\n", "mine.yaml")
    assert {(file, line) for file, line, _ in problems(load_any, mine)} == {("mine.yaml", 3), ("base.yaml", 8)}


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=broken_texts(VALID))
def test_no_broken_text_gets_past_our_errors(tmp_path, text):
    survives(load_any, tmp_path / "scene.yaml", text)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=broken_data(hands_on_data(load_any("hands-on-tip"))))
def test_no_broken_data_gets_past_our_errors(tmp_path, text):
    survives(load_any, tmp_path / "scene.yaml", text)


# The scene in Python


def test_a_region_is_an_enforced_constraint_of_a_part_and_is_lowered_to_the_bit():
    """What the admittance does is what it does with the region written out by hand."""
    scene = load_any("bowl-tool", "neuro8")
    robot, parts = scene.build_robot(), build_parts(scene.anatomy, np.array(scene.port))
    cloud, shaft = parts["bowl"].cloud, Segment.between([0, 0, 0], [0, 0, -0.335], frame="shaft")
    by_hand = Admittance(
        robot,
        port=scene.port,
        start=scene.start,
        shaft="shaft",
        parameters=NEURO8,
        period=0.004,
        regions=[Region("bowl", cloud, shaft, 0.00175, cloud.pose)],
    )
    declared = scene.build(robot, parts)
    for k in range(400):
        for admittance in (by_hand, declared):
            admittance.step(0.004 * k, np.array([4.0, 0.0, -6.0, 0.0, 0.0, 0.0]))
    names = [slice_ for name, slice_ in declared.columns.items() if name != "cycle_us"]
    assert all(by_hand.ring[:, s].tobytes() == declared.ring[:, s].tobytes() for s in names)
    assert np.abs(declared.ring[:, declared.columns["repulsion"]]).max() > 0.1, "it was pushed against the bowl"


def test_what_is_watched_or_of_another_pair_makes_no_region():
    scene = load_any("bowl-tip")
    wall = Constraint("floor", Point.at([0, 0, 0], frame="tip"), Plane.through([0, 0, -1], [0, 0, 1]), "outside", 0.0)
    more = scene.with_changes(constraints=scene.constraints + wall)
    robot, parts = more.build_robot(), build_parts(more.anatomy, np.array(more.port))
    assert list(more.build(robot, parts).regions) == ["bowl"]
    watched = more.with_changes(constraints=more.constraints.enforcing(["floor"]))
    assert (watched.regions, watched.forbidden_parts) == ((), ())
    assert not watched.build(robot, parts).regions
    with pytest.raises(UnknownNameError, match='unknown frame "tips"'):
        stray = replace(wall, first=Point.at([0, 0, 0], frame="tips"))
        more.with_changes(constraints=[stray]).build_robot()


def test_a_scene_needs_no_anatomy(tmp_path):
    pushed = "hand: {wrenches: [{t: 0, force: [0, 0, 1]}]}"
    lines = [*VALID.splitlines()[:12], "constraints: []", pushed, "duration: 1"]
    scene = load_any(written(tmp_path, "\n".join(lines)))
    assert (scene.anatomy, build_parts(None, np.zeros(3))) == (None, {})
    assert load_any(written(tmp_path, dump_hands_on(scene))) == scene


def test_a_clouds_element_may_move_it():
    scene = load_any("bowl-tip")
    up = Cloud(np.array([1, 0, 0, 0, 0, 0, 0, 0.005]), name="bowl")
    (bowl,) = scene.constraints
    parts = build_parts(scene.anatomy, np.array(scene.port))
    moved = placed_cloud(replace(bowl, second=up), parts)
    shift = moved.world_points - parts["bowl"].cloud.world_points
    np.testing.assert_allclose(shift, np.tile([0, 0, 0.01], (len(shift), 1)), atol=1e-15)
    raised = scene.with_changes(constraints=[replace(bowl, second=up)]).build(scene.build_robot(), parts)
    np.testing.assert_array_equal(raised.regions["bowl"].pose, moved.pose)
    assert placed_cloud(bowl, parts) is parts["bowl"].cloud
    for carried in (Cloud.named("bowl", frame="tip"), Cloud.named("bowl", entity="organ")):
        with pytest.raises(InputError, match="expected a cloud that stands still"):
            placed_cloud(replace(bowl, second=carried), parts)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robot": "lwr4"}, 'Did you mean "lwr4plus"'),
        ({"port": (0, 0)}, "port of scene bowl-tip: expected shape"),
        ({"period": 0.0}, "period of scene bowl-tip: expected a number > 0"),
        ({"duration": np.nan}, "duration of scene bowl-tip: expected a finite number"),
        ({"constraints": load_any("hands-on-tip").constraints}, 'unknown part of the anatomy "vessels"'),
        ({"anatomy": None}, 'unknown part of the anatomy "bowl"'),
        ({"constraints": "none"}, "expected a Constraint, got 'n'"),
        ({"start": "home"}, "start of scene bowl-tip: expected numbers"),
    ],
)
def test_bad_values_stop_at_the_constructor(changes, words):
    with pytest.raises(InputError, match=words):
        load_any("bowl-tip").with_changes(**changes)


def test_what_does_not_fit_the_robot_is_said():
    scene = load_any("bowl-tip")
    with pytest.raises(InputError, match='start of scene bowl-tip for robot "neuro8": expected shape'):
        scene.with_changes(robot="neuro8").build_robot()
    for change, kind in (({"group": "wrist"}, "joint group"), ({"shaft": "tips"}, "frame")):
        with pytest.raises(UnknownNameError, match=kind):
            scene.with_changes(**change).build_robot()


def test_a_start_inside_a_region_names_point_and_depth():
    scene = load_any("bowl-tip")
    deep = scene.with_changes(anatomy=replace(scene.anatomy, at=(0.0, 0.0, -0.0952)))
    robot = deep.build_robot()
    with pytest.raises(InputError, match=r'mm inside the sphere of point \d+ of region "bowl"'):
        deep.build(robot, build_parts(deep.anatomy, np.array(deep.port)))


def test_a_missing_file_of_anatomy_is_named(tmp_path):
    text = changed(VALID, {14: "  kind: files", 16: "  organ: none.ply", 17: "  vessels: none.stl"})
    scene = load_any(written(tmp_path, text))
    with pytest.raises(FileError, match=r"none\.ply"):
        build_parts(scene.anatomy, np.array(scene.port))
