"""The JSON Schemas of files: valid themselves, true to what is loaded, and with every mistake of form at its place."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Annotated

import pytest
import yaml
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from pydantic import TypeAdapter, ValidationError
from typer.testing import CliRunner

from primitives.constraint import ConstraintSet
from primitives.elements import Line
from primitives.errors import FileError, InputError
from primitives.files.document import in_words
from primitives.files.quantities import UNITS, of
from primitives.files.yaml_file import read
from primitives.kinds import cone
from primitives.spec import dump_constraints, load_constraints
from scenarios.cli import app
from scenarios.hands_on.scene_file import dump_hands_on
from scenarios.robots import RobotEntry, robots
from scenarios.scene import Scene
from scenarios.scene_file import dump_scene, load_any
from scenarios.scenes import FOLDER
from scenarios.schema import constraints_schema, scene_schema
from tests.scenarios.test_broken_scenes import FILES, printed

BASES = {"bowl.yaml", "hands-on.yaml", "neurosurgery.lwr4plus.yaml", "neurosurgery.yaml", "small.yaml"}
"""Shipped files that others build on, and so no whole scenes."""
WHOLE = sorted(file for file in FOLDER.glob("*.yaml") if file.name not in BASES)

OF_FORM = {
    "many_mistakes": {"robot", "start", "task.gain", "period", "duration"},
    "negative_distance": {"constraints[0].distance"},
    "unknown_kind": {"constraints[1].kind"},
    "unknown_robot": {"robot"},
    "unknown_unit": {"period"},
    "wrong_key": {""},
    "wrong_unit": {"reference.segment", "reference.waypoints[0].position[2]"},
}
"""Broken scenes whose mistakes a schema can see, and where it must see them; "" is the file itself."""
NOT_OF_FORM = {
    "circle": "files",
    "circle_too": "files",
    "contradictory_limits": "order of numbers",
    "duplicate_constraint": "names",
    "limits_twice": "names",
    "missing_base": "files",
    "pair_that_there_is_not": "names",
    "robot_file_missing": "files",
    "start_too_short": "the robot's joints",
    "turning_joint_in_metres": "the robot's joints",
    "unknown_cloud": "names",
    "unknown_frame": "names",
    "unknown_group": "names",
    "unknown_joint": "names",
}
"""The others, and what a schema would have to know."""
NOT_YAML = {"key_twice", "not_a_number", "tab"}
"""Those that are refused before there is anything to compare with a schema."""


@pytest.fixture(scope="module")
def scenes():
    return Draft202012Validator(scene_schema())


def places(validator, data):
    """Where a schema sees mistakes."""
    return {in_words(tuple(error.absolute_path)) for error in validator.iter_errors(data)}


@pytest.mark.parametrize("schema", [scene_schema, constraints_schema])
def test_the_schemas_are_schemas(schema):
    Draft202012Validator.check_schema(schema())
    assert schema()["$schema"] == Draft202012Validator.META_SCHEMA["$id"]


@pytest.mark.parametrize("file", WHOLE, ids=lambda file: file.stem)
def test_shipped_scenes_and_their_dumps_are_valid(scenes, file):
    assert places(scenes, read(file).data) == set()
    scene = load_any(file)
    text = dump_scene(scene) if isinstance(scene, Scene) else dump_hands_on(scene)
    assert places(scenes, yaml.safe_load(text)) == set()


@pytest.mark.parametrize("name", sorted(file for file in BASES if "base" not in read(FOLDER / file).data))
def test_what_others_build_on_lacks_keys_and_nothing_else(scenes, name):
    found = list(scenes.iter_errors(read(FOLDER / name).data))
    assert {error.validator for error in found} == {"required"}
    assert places(scenes, read(FOLDER / name).data) == {""}


def test_every_broken_scene_is_accounted_for():
    named = [*OF_FORM, *NOT_OF_FORM, *NOT_YAML]
    assert sorted(named) == sorted(file.stem for file in FILES)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_mistakes_of_form_are_seen_where_the_loader_sees_them(scenes, file):
    if file.stem in NOT_YAML:
        with pytest.raises(FileError):
            if read(file).problems:
                raise FileError(file.name, "what was read is not all right")
        return
    document = read(file)
    found = places(scenes, document.data)
    assert found == OF_FORM.get(file.stem, set())
    paths = [tuple(error.absolute_path) for error in scenes.iter_errors(document.data)]
    told = {int(line.split(":")[1]) for line in printed(file).splitlines()}
    assert {document.mark(path).line for path in paths} <= told


WALL = yaml.safe_load((Path(__file__).parent / "broken" / "unknown_frame.yaml").read_text(encoding="utf-8"))
WALL["task"]["frame"] = "tip"
Z_AXIS = [0, 0, 0, 1, 0, 0, 0, 0]
SHAFT = {"kind": "line", "frame": "shaft"}
HANDS_ON = yaml.safe_load(dump_hands_on(load_any("bowl-tip")))
CONE = {"kind": "cone", "name": "cone", "axis": "shaft", "around": [0, 0, 1], "angle": "30 deg"}
PORT = {"kind": "rcm", "name": "port", "shaft": "shaft", "port": [0, 0, 0], "tolerance": "1 mm"}
CONES = WALL | {"constraints": [CONE, CONE | {"name": "other", "axis": SHAFT}], "limits": {"joint7": [-0.2, 0.2]}}
BY_HAND = yaml.safe_load(dump_scene(load_any("S5-hand")))
RIGHT = {
    "as it is": {},
    "SI numbers": {"period": 0.004, "duration": 3},
    "a rate": {"period": "250 Hz", "enforcement": {"eta": {"table": "2 1/s", "": 1}}},
    "an enforcement by name": {"enforcement": "none", "plant": "mujoco", "seed": 7},
    "an enforcement": {"enforcement": {"method": "vfi", "guard": "watch", "reach": "5 mm", "limit_eta": "2 Hz"}},
    "an anatomy": {"anatomy": {"kind": "bowl", "cover": {"bowl": "3 mm"}, "turn": "20 deg"}},
    "forms of a port": {"constraints": [PORT], "enforcement": {"forms": {"port": {"soft": 100}}}},
    "a form by name": {"constraints": [PORT], "enforcement": {"forms": {"port": "equality"}}},
    "joints": {"start": [0, 0, "1 deg", 0, "25 cm", 0, 0, "0.1 rad"], "limits": {"joint7": ["-10 deg", 0.2]}},
    "a cone": {"constraints": [CONE]},
    "an element as axis": {"constraints": [CONE | {"axis": SHAFT}]},
    "joint limits": {"constraints": [{"kind": "joint_limits", "limits": {"joint7": ["-10 deg", "10 deg"]}}]},
    "a dual quaternion": {"constraints": [CONE | {"axis": {"kind": "line", "dual_quaternion": Z_AXIS}}]},
    "sets": {"sets": {"walls": [CONE]}, "use": ["walls"]},
    "nothing enforced": {"enforce": None},
    "tasks": {"task": [WALL["task"]], "reference": [WALL["reference"]], "coordination": "central"},
    "by hand": {"hand": {"most": "5 N"}, "admittance": "neuro8"},
    "parameters of joints": {"hand": {}, "admittance": {"inertia": 1, "damping": [1.0] * 8}},
}
WRONG = {
    "key": ({"colour": "red"}, ""),
    "key of a task": ({"task": {"fram": "tip"}}, "task"),
    "key of the second task": ({"task": [{}, {"fram": "tip"}]}, "task[1]"),
    "key of a kind": ({"constraints": [CONE | {"distance": 1}]}, "constraints[0]"),
    "key of an element": ({"constraints": [CONE | {"axis": SHAFT | {"start": [0, 0, 0]}}]}, "constraints[0].axis"),
    "an element of another kind": ({"constraints": [CONE | {"axis": {"kind": "plane"}}]}, "constraints[0].axis.kind"),
    "missing key of a kind": ({"constraints": [{"kind": "cone", "name": "cone"}]}, "constraints[0]"),
    "neither kind nor elements": ({"constraints": [{"name": "cone"}]}, "constraints[0]"),
    "a length as angle": ({"constraints": [CONE | {"angle": "3 mm"}]}, "constraints[0].angle"),
    "two numbers": ({"constraints": [CONE | {"around": [0, 1]}]}, "constraints[0].around"),
    "one limit": ({"limits": {"joint7": [1]}}, "limits.joint7"),
    "no list": ({"use": "walls"}, "use"),
    "a set that is no list": ({"sets": {"walls": CONE}}, "sets.walls"),
    "a mistake in a set": ({"sets": {"walls": [CONE | {"angle": "x"}]}, "use": ["walls"]}, "sets.walls[0].angle"),
    "text for a truth": ({"constraints": [CONE | {"enforced": "no"}]}, "constraints[0].enforced"),
    "no waypoint": ({"reference": {"segment": 1, "waypoints": []}}, "reference.waypoints"),
    "negative gain": ({"enforcement": {"eta": -1}}, "enforcement.eta"),
    "unknown method": ({"enforcement": "qp"}, "enforcement"),
    "unknown guard": ({"enforcement": {"guard": "wacht"}}, "enforcement.guard"),
    "key of an enforcement": ({"enforcement": {"gain": 2}}, "enforcement"),
    "unknown form": (
        {"constraints": [PORT], "enforcement": {"forms": {"port": "row"}}},
        "enforcement.forms.port",
    ),
    "weight of nothing": (
        {"constraints": [PORT], "enforcement": {"forms": {"port": {"soft": -1}}}},
        "enforcement.forms.port.soft",
    ),
    "unknown plant": ({"plant": "gazebo"}, "plant"),
    "half a seed": ({"seed": 0.5}, "seed"),
    "a name with spaces": ({"name": "my scene"}, "name"),
    "an own robot without file": ({"robot": {"tip": "hand"}}, "robot"),
    "a number in a set": ({"hand": {}, "admittance": {"inertia": 1, "damping": [1, "x"]}}, "admittance.damping[1]"),
    "unknown set of parameters": ({"hand": {}, "admittance": "lwr5"}, "admittance"),
    "a port beside a reference": ({"port": [0, 0, 0]}, ""),
}
HANDS_ON_WRONG = {
    "unknown integrator": ({"integrator": "magic"}, "integrator"),
    "unknown kind of anatomy": ({"anatomy": {"kind": "liver", "cover": {}}}, "anatomy.kind"),
    "unknown set": ({"parameters": {"set": "table-2"}}, "parameters.set"),
    "unknown metric": ({"enforcement": {"metric": "free joints"}}, "enforcement.metric"),
    "a way nowhere": ({"hand": {"waypoints": [{"t": 1}]}}, "hand.waypoints[0]"),
    "a hand that does nothing": ({"hand": {"tremor": 0}}, "hand"),
    "no port": ({"port": None}, "port"),
    "a task": ({"task": {}}, ""),
}


def refusal(folder, data):
    """What loading the data says; empty where they are loaded."""
    file = folder / "scene.yaml"
    file.write_text(json.dumps(data), encoding="utf-8")
    try:
        load_any(file)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("case", RIGHT)
def test_what_is_loaded_is_valid(scenes, tmp_path, case):
    data = WALL | RIGHT[case]
    assert not refusal(tmp_path, data)
    assert places(scenes, data) == set()


@pytest.mark.parametrize(
    ("data", "place"),
    [
        *(pytest.param(WALL | changes, place, id=name) for name, (changes, place) in WRONG.items()),
        *(pytest.param(HANDS_ON | changes, place, id=name) for name, (changes, place) in HANDS_ON_WRONG.items()),
    ],
)
def test_what_is_wrong_in_form_is_neither_loaded_nor_valid(scenes, tmp_path, data, place):
    assert refusal(tmp_path, data)
    assert places(scenes, data) == {place}


@pytest.mark.parametrize("whole", [WALL, HANDS_ON], ids=["trajectory", "hands-on"])
def test_each_key_that_must_be_there_must_be_unless_a_base_may_have_it(scenes, tmp_path, whole):
    (tmp_path / "base.yaml").write_text(json.dumps(whole), encoding="utf-8")
    for key in whole:
        rest = {k: v for k, v in whole.items() if k != key}
        missing = f'missing key "{key}"' in refusal(tmp_path, rest)
        assert places(scenes, rest) == ({""} if missing else set()), key
        for based in (rest | {"base": "base.yaml"}, {key: whole[key], "base": "base.yaml"}):
            assert not refusal(tmp_path, based)
            assert places(scenes, based) == set(), key


QUANTITIES = ("5 mm", "0.1 rad", "2 deg", "4 ms", "250 Hz", "1e1 N", " 3  1/s ", "2 N s/m", "1 mJ", "-1 cm", "-0 m")
PLAIN = (0, 1, 0.5, 1e300, -1, None, True, "tip", "neuro8", "", [], {}, [0, 0, 1], {"": 1})
OTHERS = st.sampled_from((*QUANTITIES, *PLAIN))


@st.composite
def changed_data(draw, data):
    """Data with one value, anywhere, left out or replaced by what might stand there."""
    at = data = deepcopy(data)
    while True:
        key = draw(st.sampled_from(sorted(at) if isinstance(at, dict) else range(len(at))))
        if not isinstance(at[key], dict | list) or not at[key] or draw(st.integers(0, 4)) == 0:
            break
        at = at[key]
    if draw(st.integers(0, 5)) == 0:
        del at[key]
    else:
        at[key] = draw(OTHERS)
    return data


@settings(deadline=None, max_examples=60, suppress_health_check=list(HealthCheck))
@given(st.sampled_from([WALL, CONES, HANDS_ON, BY_HAND]).flatmap(changed_data))
def test_of_changed_scenes_those_that_are_loaded_are_valid(scenes, tmp_path, data):
    assume(not refusal(tmp_path, data))
    assert places(scenes, data) == set(), data


NUMBERS = st.from_regex(r"[-+]?([0-9]{1,3}\.?[0-9]{0,2}|\.[0-9]{1,2})([eE][-+]?[0-9]{1,2})?", fullmatch=True)
ALL_UNITS = sorted({unit for units in UNITS.values() for unit in units})
UNIT = st.sampled_from(ALL_UNITS) | st.text("msNrad/1 kHzegµ", max_size=4)


@settings(deadline=None, max_examples=2000)
@given(st.sampled_from(sorted(UNITS)), NUMBERS | st.just(""), st.sampled_from(["", " ", "  ", "\t"]), UNIT)
def test_a_text_is_valid_where_it_is_taken_as_a_quantity(dimension, number, space, unit):
    text = number + space + unit
    if number and not float(number):
        return  # no period is the inverse of zero, which a pattern need not know
    adapter = TypeAdapter(Annotated[float, of(dimension)])
    try:
        adapter.validate_python(text)
        taken = True
    except (ValidationError, InputError):
        taken = False
    assert Draft202012Validator(adapter.json_schema()).is_valid(text) == taken, text


def test_every_key_is_described():
    for schema in (scene_schema(), constraints_schema()):
        models = [*schema["$defs"].values(), schema]
        for model in models:
            for key, value in model.get("properties", {}).items():
                assert key == "kind" or value["description"].strip(), key
    described = scene_schema()["$defs"]["_ConstraintModel"]["properties"]
    assert described["safe_distance"]["description"].startswith("metres or radians, >= 0.")
    assert described["second"]["description"] == "the elements, in the order of the pair."


def test_a_registered_robot_is_known(monkeypatch):
    monkeypatch.setattr(robots, "_things", dict(robots._things))
    data = WALL | {"robot": "mine"}
    assert places(Draft202012Validator(scene_schema()), data) == {"robot"}
    robots.register(RobotEntry("mine", "one of my own", lambda: None))
    assert places(Draft202012Validator(scene_schema()), data) == set()


def test_files_of_constraints(tmp_path):
    validator = Draft202012Validator(constraints_schema())
    written = dump_constraints(ConstraintSet([cone("cone", Line.z_axis("shaft"), Line.z_axis("world"), 0.5)]))
    assert places(validator, yaml.safe_load(written)) == set()
    file = tmp_path / "constraints.yaml"
    for entry, place in (
        (CONE, None),
        ({"kind": "joint_limits", "limits": {}}, "constraints[0].kind"),
        (CONE | {"angel": 1}, "constraints[0]"),
    ):
        data = {"constraints": [entry]}
        file.write_text(json.dumps(data), encoding="utf-8")
        if place is None:
            load_constraints(file)
            assert places(validator, data) == set()
        else:
            assert places(validator, data) == {place}


def test_the_command_prints_them():
    scene, constraints = scene_schema(), constraints_schema()
    for words, schema in (([], scene), (["scene"], scene), (["constraints"], constraints)):
        done = CliRunner().invoke(app, ["schema", *words])
        assert done.exit_code == 0
        assert json.loads(done.stdout) == schema
    assert CliRunner().invoke(app, ["schema", "robots"]).exit_code == 2
