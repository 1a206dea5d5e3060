"""Constraints in YAML: loss-free both ways, and every mistake told at its line."""

import subprocess
import sys

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.constraint import KEEPS, SAFETY_CLASSES, Constraint, ConstraintSet
from primitives.elements import Element, Line, Plane, Point, Segment
from primitives.errors import FileError, InputError
from primitives.files.elements import element_data
from primitives.files.yaml_file import parse
from primitives.registry import pairs
from primitives.spec import constraints_from_data, dump_constraints, load_constraints
from tests.primitives.broken_files import broken_data, broken_texts, changed, problems, survives

FRAMES = ("world", "moving/shaft", "moving/tip", "parked/shaft")

VALID = """\
constraints:
  - name: C1
    first: {kind: line, frame: moving/shaft}
    second: {kind: line, frame: parked/shaft, point: [0, 0, 0.1], direction: [0, 0, 1e-3]}
    keep: outside
    safe_distance: 5e-3
  - name: cone
    first: {kind: line, frame: moving/shaft}
    second: {kind: line}
    keep: inside
    safe_distance: 0.5
    pair: line_line_angle
    safety_class: task
    enforced: false
  - name: C4
    first:
      kind: point
      position: [0, 0, 0.01]
      frame: moving/tip
    second:
      kind: plane
      point: [0, 0, -0.08]
      normal: [0, 0, 2]
    keep: outside
    safe_distance: 0
  - name: vessel
    first: {kind: segment, frame: moving/shaft, start: [0, 0, -0.1], end: [0, 0, 0]}
    second:
      kind: segment
      entity: vessel
      dual_quaternion: [1, 0, 0, 0, 0, 0.5, 0, 0]
      length: 0.25
    keep: outside
    safe_distance: 0.003
    safety_class: robot
"""


def load(file):
    return load_constraints(file, frames=FRAMES)


def load_text(folder, text):
    file = folder / "c.yaml"
    file.write_text(text)
    return load(file)


def test_the_file_says_what_the_same_python_says(tmp_path):
    shaft = Line.z_axis("moving/shaft")
    expected = ConstraintSet(
        [
            Constraint("C1", shaft, Line.through([0, 0, 0.1], [0, 0, 1], frame="parked/shaft"), "outside", 0.005),
            Constraint("cone", shaft, Line.z_axis("world"), "inside", 0.5, "line_line_angle", "task", enforced=False),
            Constraint(
                "C4",
                Point.at([0, 0, 0.01], frame="moving/tip"),
                Plane.through([0, 0, -0.08], [0, 0, 1]),
                "outside",
                0.0,
            ),
            Constraint(
                "vessel",
                Segment.between([0, 0, -0.1], [0, 0, 0], frame="moving/shaft"),
                Segment(np.array([1, 0, 0, 0, 0, 0.5, 0, 0]), entity="vessel", length=0.25),
                "outside",
                0.003,
                safety_class="robot",
            ),
        ]
    )
    assert load_text(tmp_path, VALID) == expected


def test_the_dump_is_readable_where_it_can_be(tmp_path):
    text = dump_constraints(load_text(tmp_path, VALID))
    data = yaml.safe_load(text)["constraints"]
    assert data[0]["first"] == {
        "kind": "line",
        "frame": "moving/shaft",
        "point": [0.0, 0.0, 0.0],
        "direction": [0.0, 0.0, 1.0],
    }
    assert data[2]["second"] == {"kind": "plane", "point": [0.0, 0.0, -0.08], "normal": [0.0, 0.0, 1.0]}
    assert data[3]["second"].keys() == {"kind", "entity", "dual_quaternion", "length"}


def test_data_gives_the_same_as_a_file(tmp_path):
    data = yaml.load(VALID.replace("5e-3", "0.005").replace("1e-3", "0.001"), Loader=yaml.SafeLoader)
    assert constraints_from_data(data["constraints"], frames=FRAMES) == load_text(tmp_path, VALID)
    assert constraints_from_data([]) == ConstraintSet()
    with pytest.raises(FileError, match=r"^mine: constraints\[0\]: expected keys and values, got the number 5$"):
        constraints_from_data([5], name="mine")


# Round trips

COORDINATE = st.floats(-1e3, 1e3) | st.sampled_from((0.0, -0.0, 5e-324, 1e-17, 0.1))
VECTOR = st.tuples(COORDINATE, COORDINATE, COORDINATE)
DIRECTION = VECTOR.filter(lambda v: np.linalg.norm(v) > 1e-6)
TEXT = st.text(min_size=1, max_size=20).filter(str.isprintable)
PLACE = st.fixed_dictionaries({"frame": st.just("world") | TEXT}) | st.fixed_dictionaries({"entity": TEXT})


def elements(kind):
    vectors = {
        "point": (Point.at, VECTOR),
        "line": (Line.through, VECTOR, DIRECTION),
        "plane": (Plane.through, VECTOR, DIRECTION),
        "segment": (lambda a, d, **place: Segment.between(a, np.add(a, d), **place), VECTOR, DIRECTION),
    }
    make, *arguments = vectors[kind]
    return st.builds(lambda place, *values: make(*values, **place), PLACE, *arguments)


@st.composite
def constraints(draw, name):
    pair = pairs[draw(st.sampled_from(pairs.names()))]
    plain = f"{pair.first}_{pair.second}" == pair.name
    return Constraint(
        name,
        draw(elements(pair.first)),
        draw(elements(pair.second)),
        draw(st.sampled_from(KEEPS)),
        draw(st.floats(0.0, 1e6)),
        draw(st.sampled_from(("", pair.name))) if plain else pair.name,
        draw(st.sampled_from(SAFETY_CLASSES)),
        draw(st.booleans()),
    )


SETS = st.lists(TEXT, max_size=4, unique=True).flatmap(lambda names: st.tuples(*map(constraints, names)))


def bits(items):
    return [
        (
            *(c.name, c.keep, float(c.safe_distance).hex(), c.pair, c.safety_class, c.enforced),
            *(e.kind, e.frame, e.entity, e.length.hex(), e.dual_quaternion.tobytes()),
        )
        for c in items
        for e in (c.first, c.second)
    ]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(SETS)
def test_dump_and_load_lose_nothing(tmp_path, items):
    declared = ConstraintSet(items)
    file = tmp_path / "c.yaml"
    file.write_text(dump_constraints(declared), encoding="utf-8")
    loaded = load_constraints(file)
    assert loaded == declared
    assert bits(loaded) == bits(declared)
    assert dump_constraints(loaded) == dump_constraints(declared)


def reloaded(items):
    return constraints_from_data(parse(dump_constraints(items), "c.yaml").data["constraints"])


def test_numbers_of_every_size_are_kept():
    plane = Plane(np.array([0, 0.6, 0.8, 0, -1.7e150, 0, 0, 0]))
    line = Line(np.array([0, 0.6, 0.8, 0, 0, 0, 0, 1.7e150]), frame="tip")
    point = Point(np.array([0, 1.7e150, -0.0, 5e-324, 0, 0, 0, 0]))
    items = ConstraintSet(
        [
            Constraint("a", point, plane, "outside", 5e-324),
            Constraint("b", point, line, "outside", 1.7e308),
            Constraint("c", Point(point.dual_quaternion, length=2.0), plane, "outside", 0),
        ]
    )
    assert bits(reloaded(items)) == bits(items)


def test_dual_quaternions_with_rounding_errors_are_kept():
    rng, items = np.random.default_rng(2), []
    for i in range(200):
        pose = dq.normalized(rng.normal(size=8)) * (1.0 + rng.normal() * 10.0 ** rng.uniform(-16, -10))
        line = conversions.line(rng.normal(size=3), rng.normal(size=3)) * (
            1.0 + rng.normal() * 10.0 ** rng.uniform(-16, -11)
        )
        items.append(Constraint(f"s{i}", Segment(pose, length=1 / 3), Segment(-pose, length=1e-9), "outside", 0.1))
        items.append(Constraint(f"l{i}", Line(line, frame="tip"), Line(-line, entity="e"), "outside", 0.1))
    assert bits(reloaded(ConstraintSet(items))) == bits(items)


def test_what_a_file_cannot_hold_is_not_dumped():
    first, second = Point.at([0, 0, 0], frame="tip"), Plane.through([0, 0, 0], [0, 0, 1])
    for name in ("a\nb", "\x1b[2J", "x" * 201, "\ud800"):
        with pytest.raises(InputError, match="printable"):
            dump_constraints(ConstraintSet([Constraint(name, first, second, "outside", 0.0)]))
    with pytest.raises(InputError, match="cannot write Element"):
        element_data(Element(np.zeros(8)))
    many = ConstraintSet(Constraint(f"C{i}", first, second, "outside", 0.0) for i in range(1001))
    with pytest.raises(InputError, match="more than 1000 items"):
        dump_constraints(many)
    assert len(constraints_from_data(yaml.safe_load(dump_constraints(ConstraintSet(list(many)[:1000])))["constraints"]))


# Broken files: {line: its new text} of VALID, and every line with a problem and words of its message.

BROKEN = {
    "unknown top key": ({1: "constrains:"}, [(1, 'missing key "constraints"'), (1, 'Did you mean "constraints"?')]),
    "unknown key": ({6: "    safe_distnce: 1"}, [(2, 'missing key "safe_distance"'), (6, 'mean "safe_distance"?')]),
    "misspelt frame": (
        {3: "    first: {kind: line, frame: moving/shfat}"},
        [(3, 'constraints[0].first.frame: unknown frame "moving/shfat". Did you mean "moving/shaft"?')],
    ),
    "frame in another case": ({19: "      frame: Moving/TIP"}, [(19, 'Did you mean "moving/tip"?')]),
    "misspelt element key": (
        {4: "    second: {kind: line, dirction: [0, 0, 1]}"},
        [(4, 'constraints[0].second: unknown key "dirction". Did you mean "direction"?')],
    ),
    "misspelt kind": ({17: "      kind: piont"}, [(17, 'constraints[2].first.kind: unknown kind of element "piont".')]),
    "kind missing": ({17: None}, [(16, "first.kind: expected one of cloud, line, plane, point, segment")]),
    "kind no text": ({17: "      kind: 5"}, [(17, "cloud, line, plane, point, segment, got the number 5")]),
    "element no mapping": ({3: "    first: moving/shaft"}, [(3, 'expected keys and values, e.g. {kind: line')]),
    "position missing": ({18: None}, [(16, 'constraints[2].first: missing key "position"')]),
    "two coordinates": ({18: "      position: [0, 0]"}, [(18, "expected 3 numbers (x, y, z), got 2")]),
    "coordinate a boolean": ({18: "      position: [0, yes, true]"}, [(18, 'text "yes"'), (18, "number, got true")]),
    "coordinate with a wrong unit": (
        {18: "      position: [0, 0, 5 deg]"},
        [(18, 'constraints[2].first.position[2]: expected a length: a number in m, or a text with m, cm, mm, um, got')],
    ),
    "unknown unit": ({18: "      position: [0, 0, 5 Mm]"}, [(18, 'unknown unit "Mm". Did you mean "m"? Known')]),
    "a length for an angle": (
        {11: "    safe_distance: 5 mm"},
        [(11, 'expected an angle: a number in rad, or a text with rad, mrad, deg, got the text "5 mm", a length')],
    ),
    "coordinate NaN": ({18: "      position: [0, 0, .nan]"}, [(18, "position[2]: expected a finite number")]),
    "coordinate too large": ({18: "      position: [0, 0, 1e400]"}, [(18, "expected a finite number, got 1e400")]),
    "coordinates no list": ({18: "      position: 0"}, [(18, "position: expected a list, got the number 0")]),
    "normal zero": ({23: "      normal: [0, 0, 0]"}, [(23, "normal: expected a direction")]),
    "direction zero": (
        {4: "    second: {kind: line, direction: [0, 0, 1e-10]}"},
        [(4, "constraints[0].second.direction: expected a direction")],
    ),
    "direction too long": (
        {4: "    second: {kind: line, direction: [0, 0, 1e200]}"},
        [(4, "constraints[0].second.direction: expected a direction")],
    ),
    "point too far": (
        {22: "      point: [1.7e308, 1.7e308, 1.7e308]", 23: "      normal: [1, 1, 1]"},
        [(20, "finite")],
    ),
    "segment without length": (
        {27: "    first: {kind: segment, start: [0, 0, 1], end: [0, 0, 1]}"},
        [(27, "constraints[3].first: expected a direction")],
    ),
    "dual quaternion not unit": (
        {31: "      dual_quaternion: [2, 0, 0, 0, 0, 0, 0, 0]"},
        [(31, "second.dual_quaternion: pose of Segment: expected a unit dual quaternion")],
    ),
    "dual quaternion of seven": (
        {31: "      dual_quaternion: [1, 0, 0, 0, 0, 0, 0]"},
        [(31, "expected shape (8), got (7,)")],
    ),
    "two geometries": (
        {18: "      position: [0, 0, 0]\n      dual_quaternion: [0, 0, 0, 0, 0, 0, 0, 0]"},
        [(18, 'unknown key "position"')],
    ),
    "frame and entity": (
        {30: "      entity: vessel\n      frame: moving/tip"},
        [(32, 'got frame "moving/tip" and entity "vessel"')],
    ),
    "negative safe distance": ({6: "    safe_distance: -1"}, [(6, "expected a number >= 0, got -1")]),
    "safe distance a text": ({6: "    safe_distance: 5 N"}, [(6, 'expected a length: a number in m, or a text with')]),
    "safe distance nothing": ({6: "    safe_distance:"}, [(6, "expected a number, got nothing")]),
    "misspelt side": ({5: "    keep: outsde"}, [(5, 'unknown side to keep "outsde". Did you mean "outside"?')]),
    "misspelt class": ({13: "    safety_class: pateint"}, [(13, 'Did you mean "patient"?')]),
    "misspelt pair": ({12: "    pair: line_lin_angle"}, [(12, 'unknown pair "line_lin_angle". Did you mean')]),
    "pair of other elements": (
        {12: "    pair: line_point"},
        [(7, 'pair "line_point" takes a line and a point, in this order; got a line and a line')],
    ),
    "no such pair": (
        {3: "    first: {kind: plane, point: [0, 0, 0], normal: [0, 0, 1]}"},
        [(2, 'unknown pair "plane_line"')],
    ),
    "enforced a text": ({14: "    enforced: yes"}, [(14, 'expected true or false, got the text "yes"')]),
    "name a number": ({2: "  - name: 1"}, [(2, "expected text, got the number 1; put it in quotes")]),
    "name empty": ({2: '  - name: ""'}, [(2, "expected 1 to 200 printable characters")]),
    "name not printable": ({2: '  - name: "a\\e[2Jb"'}, [(2, "expected 1 to 200 printable characters")]),
    "name twice": ({15: "  - name: C1"}, [(15, 'constraint 1 is called "C1" already')]),
    "key twice": ({6: "    keep: inside"}, [(2, 'missing key "safe_distance"'), (6, "stands in line 5 already")]),
    "constraint no mapping": ({7: "  - 5\n  - name: cone"}, [(7, "constraints[1]: expected keys and values, got the")]),
    "no list": ({1: "constraints: 5\nmine:"}, [(1, "expected a list, got the number 5"), (2, 'unknown key "mine"')]),
    "alias": ({3: "    first: *shaft"}, [(3, "constraints[0].first: alias *shaft is not allowed")]),
    "tab": ({5: "\tkeep: outside"}, [(5, "a tab")]),
    "bracket": ({4: "    second: {kind: line"}, [(5, "not YAML")]),
    "everything at once": (
        {
            3: "    first: {kind: line, frame: nowhere}",
            5: "    keep: both",
            13: "    safety_class: 1",
            23: "      normal: [0, .inf, 0]",
            30: "      entity: 5",
        },
        [(3, "nowhere"), (5, "both"), (13, "patient, robot, task"), (23, "finite"), (30, "in quotes")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_say_where_and_what(tmp_path, case):
    changes, expected = BROKEN[case]
    file = tmp_path / "c.yaml"
    file.write_text(changed(VALID, changes))
    found = problems(load, file)
    assert [(f, line) for f, line, _ in found] == [("c.yaml", line) for line, _ in expected], found
    for (_, _, message), (_, words) in zip(found, expected, strict=True):
        assert words in message


def test_a_missing_file_says_so(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        load(tmp_path / "c.yaml")


def test_any_frame_is_taken_where_none_are_known(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text(VALID.replace("moving/shaft", "any/frame"))
    assert load_constraints(file)["C1"].first.frame == "any/frame"


FUZZ = settings(suppress_health_check=list(HealthCheck), deadline=None, max_examples=300)
DATA = {"constraints": yaml.safe_load(VALID.replace("5e-3", "0.005").replace("1e-3", "0.001"))["constraints"]}


@FUZZ
@given(broken_texts(VALID) | broken_data(DATA))
def test_mutated_files_raise_nothing_foreign(tmp_path, text):
    survives(load, tmp_path / "c.yaml", text)


@pytest.mark.campaign
@settings(FUZZ, max_examples=10_000)
@given(broken_texts(VALID) | broken_data(DATA))
def test_ten_thousand_mutated_files_raise_nothing_foreign(tmp_path, text):
    survives(load, tmp_path / "c.yaml", text)


ITEM = "  - {name: C%d, first: {kind: line}, second: {kind: %s}, keep: %s, safe_distance: 1}\n"


@pytest.mark.parametrize(
    "text",
    [
        "  - {}\n" * 1000,
        ITEM % (1, "line", "inside") * 1000,
        "".join(ITEM % (i, "lin", "insied") for i in range(1000)),
        "  - {" + ", ".join(f"k{i}: 1" for i in range(999)) + "}\n",
        ("  - {" + ", ".join(f"k{i}: 1" for i in range(49)) + "}\n") * 999,
        "  - {name: " + "n" * 900_000 + "}\n",
    ],
    ids=range(6),
)
def test_many_mistakes_are_told_within_two_seconds(tmp_path, text):
    survives(load, tmp_path / "c.yaml", "constraints:\n" + text)


def test_reading_a_file_needs_no_optional_library():
    heavy = "numpy", "numba", "pydantic"
    code = f"import sys, primitives.files.yaml_file; sys.exit(any(m in sys.modules for m in {heavy}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
