"""Named sets of constraints from other files: joined like sets in Python, mistakes at the line of their own file."""

import pytest

from primitives.constraint import ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.kinds import keep_above, rcm
from scenarios.scene_file import dump_scene, load_scene
from tests.primitives.broken_files import problems

SETS = """\
sets:
  port:
    - {kind: rcm, name: port, shaft: shaft, port: [0, 0, 0], tolerance: 2 mm}
  walls:
    - {kind: keep_above, name: floor, what: tip, point: [0, 0, -80 mm]}
"""
SCENE = """\
name: mine
summary: a tip above a table
robot: neuro8
group: all
start: [0, 0, 0, 0, 0.25, 0, 0, 0]
include: [sets.yaml]
use: [port, walls]
constraints:
  - {kind: keep_above, name: table, what: tip, point: [0, 0, -70 mm]}
enforce: [port, table]
task: {frame: tip}
reference: {segment: 2 s, waypoints: [{position: [0, 0, -60 mm]}]}
period: 4 ms
duration: 3 s
"""
TIP = Point.at([0, 0, 0], frame="tip")
PORT = ConstraintSet([rcm("port", Line.z_axis("shaft"), Point.at([0, 0, 0]), 0.002)])
WALLS = ConstraintSet([keep_above("floor", TIP, Plane.through([0, 0, -0.08], [0, 0, 1]))])
TABLE = ConstraintSet([keep_above("table", TIP, Plane.through([0, 0, -0.07], [0, 0, 1]))])


def written(folder, scene=SCENE, **files):
    for name, text in ({"sets": SETS} | files).items():
        (folder / f"{name}.yaml").write_text(text)
    (folder / "scene.yaml").write_text(scene)
    return folder / "scene.yaml"


def test_sets_are_joined_as_in_python(tmp_path):
    scene = load_scene(written(tmp_path))
    assert scene.constraints == (TABLE + PORT + WALLS).enforcing(["port", "table"])
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "one.yaml").write_text(dump_scene(scene))
    assert load_scene(tmp_path / "again" / "one.yaml") == scene


def test_included_files_may_include_and_a_scene_may_have_sets_of_its_own(tmp_path):
    deeper = {"sets": "include: [more.yaml]\n", "more": SETS}
    joined = (TABLE + PORT + WALLS).enforcing(["port", "table"])
    assert load_scene(written(tmp_path, **deeper)).constraints == joined
    twice = {"sets": "include: [more.yaml]\n", "other": "include: [more.yaml]\n", "more": SETS}
    both = SCENE.replace("[sets.yaml]", "[sets.yaml, other.yaml, more.yaml]")
    assert load_scene(written(tmp_path, both, **twice)).constraints == joined
    own = SCENE.replace("include: [sets.yaml]\n", SETS)
    assert load_scene(written(tmp_path, own)).constraints == joined


@pytest.mark.parametrize(
    ("scene", "files", "expected"),
    [
        (SCENE.replace("[port, walls]", "[port, wals]"), {}, ("scene.yaml", 7, 'unknown set of constraints "wals"')),
        (SCENE.replace("[sets.yaml]", "[set.yaml]"), {}, ("scene.yaml", 6, 'Did you mean "sets.yaml"?')),
        (SCENE.replace("name: table", "name: port"), {}, ("sets.yaml", 3, "scene.yaml:9 already; rename one")),
        (SCENE, {"sets": SETS.replace("2 mm", "2 deg")}, ("sets.yaml", 3, 'got the text "2 deg", an angle')),
        (SCENE, {"sets": SETS.replace("what: tip", "what: tp")}, ("sets.yaml", 5, 'unknown frame "tp"')),
        (SCENE, {"sets": "include: [sets.yaml]\n" + SETS}, ("sets.yaml", 1, "goes in a circle")),
        (SCENE, {"sets": SETS + "period: 1\n"}, ("sets.yaml", 6, 'unknown key of an included file "period"')),
        (SCENE.replace("[sets.yaml]", "[sets.yaml, b.yaml]"), {"b": SETS}, ("b.yaml", 2, "sets.yaml:2 already")),
        (SCENE.replace("[sets.yaml]", "[/etc/passwd]"), {}, ("scene.yaml", 6, "unknown file in this folder")),
    ],
)
def test_mistakes_name_the_file_that_they_are_in(tmp_path, scene, files, expected):
    found = problems(load_scene, written(tmp_path, scene, **files))
    file, line, words = expected
    assert any((f, at) == (file, line) and words in text for f, at, text in found), found
