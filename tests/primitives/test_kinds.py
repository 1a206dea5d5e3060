"""Kinds: in files and in Python the same plain constraints, and dumped as such."""

import numpy as np
import pytest

from primitives import kinds
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Cloud, Line, Plane, Point, Segment
from primitives.errors import FileError, InputError
from primitives.spec import dump_constraints, load_constraints

FRAMES = ("world", "tip", "shaft")

FILE = """\
constraints:
  - {kind: forbidden_region, name: ball, what: tip, around: {kind: point, position: [1 cm, 0, 0]}, radius: 5 mm, tool_radius: 1.5 mm}
  - {kind: forbidden_region, name: vessel, what: {kind: line, frame: shaft}, around: {kind: point, position: [0, 0, 0]}, radius: 0}
  - {kind: stay_inside, name: tube, what: tip, around: {kind: line}, radius: 14 mm, tool_radius: 1.75 mm}
  - {kind: keep_above, name: floor, what: tip, point: [0, 0, -80 mm], safety_class: robot}
  - {kind: keep_below, name: roof, what: {kind: point, frame: tip, position: [0, 0, 1 cm]}, point: [0, 0, 0.1], distance: 2 mm}
  - {kind: cone, name: tilt, axis: shaft, around: [0, 0, -2], angle: 30 deg, enforced: false}
  - {kind: rcm, name: port, shaft: shaft, port: [0, 0, 1 mm], tolerance: 2 mm}
  - {kind: cloud, name: organ, what: {kind: segment, frame: tip, start: [0, 0, 0], end: [0, 0, -43 cm]}, cloud: kidney, tool_radius: 3.5 mm}
"""  # noqa: E501

TIP = Point.at([0, 0, 0], frame="tip")
EXPECTED = ConstraintSet(
    [
        Constraint("ball", TIP, Point.at([0.01, 0, 0]), "outside", 0.005 + 0.0015),
        Constraint("vessel", Line.z_axis("shaft"), Point.at([0, 0, 0]), "outside", 0.0),
        Constraint("tube", TIP, Line.z_axis("world"), "inside", 0.014 - 0.00175),
        Constraint("floor", TIP, Plane.through([0, 0, -0.08], [0, 0, 1]), "outside", 0.0, safety_class="robot"),
        Constraint(
            "roof", Point.at([0, 0, 0.01], frame="tip"), Plane.through([0, 0, 0.1], [0, 0, -1]), "outside", 0.002
        ),
        Constraint(
            "tilt",
            Line.z_axis("shaft"),
            Line.through([0, 0, 0], [0, 0, -1]),
            "inside",
            np.radians(30.0),
            "line_line_angle",
            enforced=False,
        ),
        Constraint("port", Line.z_axis("shaft"), Point.at([0, 0, 0.001]), "inside", 0.002),
        Constraint(
            "organ",
            Segment.between([0, 0, 0], [0, 0, -0.43], frame="tip"),
            Cloud.named("kidney"),
            "outside",
            0.0035,
        ),
    ]
)


def load(folder, text):
    file = folder / "c.yaml"
    file.write_text(text)
    return load_constraints(file, frames=FRAMES)


def test_kinds_in_a_file_are_plain_constraints(tmp_path):
    assert load(tmp_path, FILE) == EXPECTED


def test_what_is_written_is_the_plain_form_and_equal(tmp_path):
    text = dump_constraints(load(tmp_path, FILE))
    assert load(tmp_path, text) == EXPECTED
    assert all(f"kind: {kind}" not in text for kind in ("forbidden_region", "keep_below", "rcm", "cone"))


def test_the_same_in_python():
    roof = Plane.through([0, 0, 0.1], [0, 0, 1])
    shaft = Line.z_axis("shaft")
    made = [
        kinds.forbidden_region("ball", TIP, Point.at([0.01, 0, 0]), 0.005, tool_radius=0.0015),
        kinds.forbidden_region("vessel", shaft, Point.at([0, 0, 0]), 0.0),
        kinds.stay_inside("tube", TIP, Line.z_axis("world"), 0.014, tool_radius=0.00175),
        kinds.keep_above("floor", TIP, Plane.through([0, 0, -0.08], [0, 0, 1]), safety_class="robot"),
        kinds.keep_below("roof", Point.at([0, 0, 0.01], frame="tip"), roof, distance=0.002),
        kinds.cone("tilt", shaft, Line.through([0, 0, 0], [0, 0, -1]), np.radians(30.0), enforced=False),
        kinds.rcm("port", shaft, Point.at([0, 0, 0.001]), 0.002),
        kinds.cloud("organ", EXPECTED["organ"].first, "kidney", tool_radius=0.0035),
    ]
    assert ConstraintSet(made) == EXPECTED


def test_elements_are_put_in_the_order_of_their_pair():
    vessel = Segment.between([0, 0, 0], [0, 0, 1], frame="tip")
    ball = kinds.forbidden_region("ball", vessel, Point.at([1, 0, 0]), 0.1)
    assert (ball.first.kind, ball.second.kind) == ("point", "segment")


def test_a_tool_wider_than_its_room_is_refused():
    with pytest.raises(InputError, match=r"a tool of radius 0\.02 m has no room in 0\.01 m"):
        kinds.stay_inside("tube", TIP, Line.z_axis("world"), 0.01, tool_radius=0.02)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{kind: forbiden_region, name: a}", 'unknown kind of constraint "forbiden_region". Did you mean "forbidden'),
        ("{kind: 5, name: a}", "unknown kind of constraint"),
        ("{kind: rcm, name: a, shaft: shaf, port: [0, 0, 0], tolerance: 1}", 'unknown frame "shaf". Did you mean'),
        ("{kind: rcm, name: a, shaft: shaft, port: [0, 0, 0], tolerance: 2 deg}", 'got the text "2 deg", an angle'),
        ("{kind: rcm, name: a, shaft: shaft, port: [0, 0, 0]}", 'missing key "tolerance"'),
        ("{kind: cone, name: a, axis: shaft, around: [0, 0, 0], angle: 1}", "expected a direction"),
        ("{kind: keep_above, name: a, what: {kind: line}, point: [0, 0, 0]}", "what: expected a point, got a line"),
        ("{kind: cloud, name: a, what: {kind: line, frame: tip}, cloud: b}", "line_cloud"),
        ("{kind: joint_limits, limits: {j: [0, 1]}}", "joint_limits belong to a robot"),
    ],
)
def test_mistakes_are_told_at_their_line(tmp_path, entry, words):
    with pytest.raises(FileError) as caught:
        load(tmp_path, f"constraints:\n  - {entry}\n")
    assert words in str(caught.value)
    assert "c.yaml:" in str(caught.value)
