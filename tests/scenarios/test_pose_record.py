"""Recorded poses: at their times, between and beyond them, against Pinocchio; files that are refused."""

import numpy as np
import pinocchio as pin
import pytest

from primitives import dual_quaternion as dq
from primitives.errors import FileError, InputError
from scenarios.check import check_any
from scenarios.pose_record import COLUMNS, PoseRecord
from scenarios.run import run
from scenarios.scene_file import dump_scene, load_scene

HEADER = ",".join(COLUMNS) + "\n"
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def turned(axis, angle):
    return np.r_[np.cos(angle / 2), np.sin(angle / 2) * np.asarray(axis, dtype=float)]


POSES = [
    (0.5, (0.1, 0.0, 0.2), turned((0, 0, 1), 0.3)),
    (1.5, (0.2, -0.1, 0.2), -turned((1, 0, 0), 0.8)),  # the other sign of the same orientation
    (3.0, (0.2, 0.1, 0.1), turned((0, 1, 0), -1.2)),
]


def written(folder, rows=POSES, header=HEADER):
    lines = [",".join(map(repr, map(float, (t, *p, *r)))) for t, p, r in rows]
    (folder / "way.csv").write_text(header + "\n".join(lines) + "\n")
    return PoseRecord(str(folder / "way.csv"))


def se3(pose):
    return pin.SE3(dq.rotation_matrix(pose), dq.translation(pose))


def test_it_passes_the_records_and_moves_on_screws_between_them(tmp_path):
    x = written(tmp_path).sample(UPRIGHT, 0.1, 50)
    given = [dq.from_rotation_translation(np.array(r), np.array(p)) for _, p, r in POSES]
    for (t, *_), pose in zip(POSES, given, strict=True):
        assert np.abs(dq.nearest_sign(x[round(t / 0.1)], pose) - pose).max() < 1e-12
    np.testing.assert_allclose(x[:6], np.tile(x[0], (6, 1)), atol=1e-15)
    np.testing.assert_allclose(x[30:], np.tile(x[30], (20, 1)), atol=1e-12)
    for k in (7, 12, 20, 27):
        i = int(np.searchsorted([t for t, *_ in POSES], 0.1 * k)) - 1
        share = (0.1 * k - POSES[i][0]) / (POSES[i + 1][0] - POSES[i][0])
        moved = pin.exp6(pin.Motion(share * pin.log6(se3(given[i]).actInv(se3(given[i + 1]))).vector))
        np.testing.assert_allclose(se3(x[k]).homogeneous, (se3(given[i]) * moved).homogeneous, atol=1e-12)
    assert np.all(np.einsum("ki,ki->k", x[1:], x[:-1]) > 0.0), "the sign goes on"
    np.testing.assert_allclose(np.linalg.norm(x[:, :4], axis=1), 1.0, atol=1e-12)


def test_rounded_quaternions_are_normalised(tmp_path):
    (tmp_path / "way.csv").write_text(HEADER + "0,0,0,0,0.7071,0.7071,0,0\n")
    x = PoseRecord(str(tmp_path / "way.csv")).sample(UPRIGHT, 0.1, 3)
    assert np.abs(np.linalg.norm(x[:, :4], axis=1) - 1.0).max() < 1e-15
    np.testing.assert_allclose(dq.rotation_matrix(x[2]), pin.exp3(np.array([np.pi / 2, 0, 0])), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "an empty file"),
        ("t,x,y,z\n", "expected the header t,x,y,z,qw,qx,qy,qz"),
        (HEADER, "has no records"),
        (HEADER + "0,0,0,0,1,0,0\n", "way.csv:2: expected 8 fields, got 7"),
        (HEADER + "0,0,nan,0,1,0,0,0\n", "way.csv:2: y: expected a number"),
        (HEADER + "0,0,0,0,1,0,0,0\n0,0,0,0,1,0,0,0\n", "way.csv:3: t: expected more than 0.0"),
        (HEADER + "0,0,0,0,1,0,0,0\n2,0,0,0,0.5,0,0,0\n", "at t = 2 s: expected a unit quaternion"),
        (HEADER + "0,0,0,0,0,0,0,0\n", "got norm 0"),
    ],
)
def test_broken_records_are_refused(tmp_path, text, words):
    (tmp_path / "way.csv").write_text(text)
    with pytest.raises(FileError, match=r"way\.csv") as caught:
        PoseRecord(str(tmp_path / "way.csv")).sample(UPRIGHT, 0.1, 3)
    assert words in str(caught.value)


def test_missing_files_and_names_that_are_none(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        PoseRecord(str(tmp_path / "none.csv")).read()
    with pytest.raises(InputError, match="name of a CSV file"):
        PoseRecord("")
    assert PoseRecord("way.csv").located(tmp_path) == PoseRecord(str(tmp_path / "way.csv"))


def recorded_s5(folder):
    """S5 with what its waypoints give every 8 ms as a record."""
    scene = load_scene("S5").with_changes(duration=2.0)
    first = scene.build_robot().kinematics(np.array(scene.start)).pose("moving/tip")[:4]
    rows = [(0.008 * k, dq.translation(x), x[:4]) for k, x in enumerate(scene.reference.sample(first, 0.008, 251))]
    written(folder, rows)
    lines = dump_scene(scene).splitlines()
    kept, skipping = [], False
    for line in lines:
        skipping = line.startswith("reference:") or (skipping and line.startswith((" ", "-")))
        kept += [] if skipping else [line]
    (folder / "recorded.yaml").write_text("\n".join([*kept, "reference: {record: way.csv}", ""]))
    return scene, folder / "recorded.yaml"


def test_a_scene_may_follow_a_record(tmp_path):
    scene, file = recorded_s5(tmp_path)
    recorded = load_scene(file)
    assert recorded.reference == PoseRecord(str(tmp_path / "way.csv"))
    np.testing.assert_allclose(run(recorded)["q"], run(scene)["q"], atol=1e-9)
    again = tmp_path / "again.yaml"
    again.write_text(dump_scene(recorded))
    assert load_scene(again) == recorded
    report = check_any(recorded)
    assert report.ok
    (part,) = (p for p in report.parts if p.name == "reference")
    assert [row["name"] for row in part.rows][:2] == ["record at 0 s", "record at 0.184 s"] and len(part.rows) == 12


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        ("{record: way.csv, segment: 4 s}", "segment cannot go with a record"),
        ("{segment: 4 s}", "expected waypoints or a record, got neither"),
        ("{waypoints: [{position: [0, 0, 0]}]}", "waypoints need a segment"),
        ("{record: way.csv, segment: 4 s, waypoints: [{position: [0, 0, 0]}]}", "got waypoints and record"),
    ],
)
def test_references_that_are_neither_or_both(tmp_path, reference, words):
    _, file = recorded_s5(tmp_path)
    file.write_text(file.read_text().replace("{record: way.csv}", reference))
    with pytest.raises(FileError) as caught:
        load_scene(file)
    assert words in str(caught.value) and "recorded.yaml:" in str(caught.value)
