"""Another hand than a scene's, from a file: told apart by its kind, and every mistake at its line."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from primitives.errors import FileError, InputError
from scenarios.analysis.trace import Trace
from scenarios.cli import app
from scenarios.comparison import Plan, prepare_comparison
from scenarios.hand_file import with_hand
from scenarios.hands_on.pull import Pull
from scenarios.hands_on.push import Push
from scenarios.jobs import Choices
from scenarios.scene_file import load_any
from tests.scenarios.comparisons import SCENE, hurried

RECORD = "t,fx,fy,fz,tx,ty,tz\n0,0,0,0,0,0,0\n0.2,0,1,-4,0,0,0\n0.4,0,0,0,0,0,0\n"


def store(place, name, text):
    file = place / name
    file.write_text(text)
    return file


def test_a_hand_at_the_handle_pulls_pushes_or_repeats_a_record(tmp_path):
    scene = load_any("bowl-tip")
    pull = with_hand(scene, store(tmp_path, "pull.yaml", "{most: 12 N, waypoints: [{t: 1, into: bowl, beyond: 5 mm}]}"))
    assert isinstance(pull.hand, Pull) and (pull.hand.most, pull.hand.waypoints[0].beyond) == (12.0, 0.005)
    push = with_hand(scene, store(tmp_path, "push.yaml", "wrenches: [{t: 0.1, force: [0, 2, -10]}]"))
    assert isinstance(push.hand, Push) and push.hand.wrenches[0][2] == -10.0
    record = store(tmp_path, "push.csv", RECORD)
    named = with_hand(scene, store(tmp_path, "named.yaml", "{record: push.csv, interpolate: true}"))
    direct = with_hand(scene, record)
    assert direct.hand == named.hand and direct.hand.file == str(record)
    assert direct.hand_on_files is None
    hand = direct.hand.hand(np.zeros(3), np.zeros(3), 0.4, {}, 0)
    np.testing.assert_allclose(hand.wrench(0.1, np.zeros(3), np.zeros(3)), [0, 0.5, -2, 0, 0, 0])


def test_a_hand_along_a_trajectory_is_a_spring(tmp_path):
    scene = with_hand(load_any("S5-hand"), store(tmp_path, "weak.yaml", "{most: 5 N, stiffness: 400 N/m}"))
    assert (scene.hand.most, scene.hand.stiffness, scene.hand.tremor) == (5.0, 400.0, 0.0)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        (
            "bowl-tip",
            "most: 12\nwaypoints:\n  - {t: 1, into: bowel}\n",
            r'hand\.yaml:3: .*"bowel".*Did you mean "bowl"',
        ),
        ("bowl-tip", "tremor: 0.1\n", "expected one of waypoints, wrenches, record, got none"),
        ("bowl-tip", "wrenches:\n  - {t: 0, force: [0, 0]}\n", r"hand\.yaml:2"),
        ("bowl-tip", "record: gone.csv\n", "gone.csv"),
        ("S5-hand", "stiffness: 400\nmosst: 3\n", r'hand\.yaml:2: unknown key "mosst".*Did you mean "most"'),
        ("S5-hand", "most: -3 N\n", r"hand\.yaml:1: most"),
        ("S5-hand", "waypoints: []\n", 'unknown key "waypoints"'),
    ],
)
def test_mistakes_are_told_at_their_line(tmp_path, name, text, words):
    with pytest.raises(FileError, match=words):
        with_hand(load_any(name), store(tmp_path, "hand.yaml", text))


def test_a_record_is_checked_before_anything_runs(tmp_path):
    broken = store(tmp_path, "hand.csv", RECORD.replace("0.2,0,1", "0.2,0,one"))
    with pytest.raises(FileError, match=r"hand\.csv:3"):
        with_hand(load_any("bowl-tip"), broken)
    with pytest.raises(FileError, match="a YAML file holds"):
        with_hand(load_any("S5-hand"), broken)
    with pytest.raises(InputError, match="no hand leads scene"):
        with_hand(load_any("S5"), broken)


def test_run_and_compare_take_it(tmp_path):
    hand = store(tmp_path, "weak.yaml", "most: 0.3 N")
    scene = hurried("S5-hand", tmp_path)
    done = CliRunner().invoke(app, ["run", scene, "--hand", str(hand), "--out", str(tmp_path / "out"), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)[0]["max_force_N"] == pytest.approx(0.3)
    assert "most: 0.3" in Trace.load(tmp_path / "out" / "S5-hand.mcap").header["resolved_scene"]
    push = store(tmp_path, "push.csv", RECORD)
    jobs = prepare_comparison(str(store(tmp_path, "short.yaml", SCENE)), Plan(["none", "vfi"]), Choices(hand=push))
    assert [job.scene.hand.file for job in jobs] == [str(push)] * 2
    refused = CliRunner().invoke(app, ["run", "S5", "--hand", str(hand)])
    assert refused.exit_code == 2 and "--hand: it is for scenes" in refused.stderr
