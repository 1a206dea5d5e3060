"""Comparisons: the same hand for everybody, one row for each arm and enforcement."""

import json

import pytest
from typer.testing import CliRunner

from primitives.errors import InputError, UnknownNameError
from scenarios.analysis.cells import gather
from scenarios.analysis.measures import OF_HANDS_ON
from scenarios.cli import app
from scenarios.comparison import TREMOR, Plan, prepare_comparison, run_comparison
from scenarios.jobs import Choices

SCENE = """
name: short
summary: "a push into a bowl"
robot: lwr4plus
start: [0.3490658503988659, 0.8726646259971648, 0, -1.2217304763960306, 0, 1.0471975511965976, 0]
port: [-0.6053196198834375, -0.22031832385490333, 0]
anatomy: {kind: bowl, radius: 0.04, at: [0, 0, -0.126], cover: {bowl: 0.0035}}
constraints:
  - name: bowl
    first: {kind: point, frame: tip, position: [0, 0, 0]}
    second: {kind: cloud, cloud: bowl}
    keep: outside
    safe_distance: 0
hand: {wrenches: [{t: 0.1, force: [0, 2, -10]}]}
duration: 1.2
"""


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "short.yaml"
    file.write_text(SCENE)
    return str(file)


def test_every_cell_has_the_same_seeds_and_hand(scene):
    jobs = prepare_comparison(scene, Plan(["admittance", "vfi"], seeds=3), Choices(seed=5))
    cells = [(e, s) for e in ("admittance", "vfi") for s in (5, 6, 7)]
    assert [(j.scene.in_force.method, j.scene.seed) for j in jobs] == cells
    first = jobs[0].scene
    alike = [j.scene.with_changes(seed=first.seed, enforcement=first.enforcement) for j in jobs]
    assert all(j.parts is jobs[0].parts for j in jobs) and alike == [first] * len(jobs)
    assert jobs[0].scene.hand.tremor == TREMOR
    assert prepare_comparison(scene, Plan(["vfi"]), Choices())[0].scene.hand.tremor == 0.0


def test_rows_say_the_worst_and_the_median(scene):
    jobs = prepare_comparison(scene, Plan(["none", "vfi"], seeds=3), Choices())
    labels = []
    results = run_comparison(jobs, lambda label, share: labels.append((label, share)))
    assert len(labels) == 6 and labels[0][1] == 0.0
    assert len({json.dumps(r["hand_work_J"]) for r in results[:3]}) == 3, "each seed is another hand"
    cells, by_key = gather(results), {m.key: m for m in OF_HANDS_ON}
    assert [(c.robot, c.enforcement, len(c.runs)) for c in cells] == [("lwr4plus", "none", 3), ("lwr4plus", "vfi", 3)]
    for cell, runs in zip(cells, (results[:3], results[3:]), strict=True):
        nearest = [r["clearance_m"]["between_samples"] for r in runs]
        assert cell.worst(by_key["clearance_m.between_samples"]) == min(nearest)
        assert cell.interval(by_key["hand_work_J"]).median == sorted(r["hand_work_J"] for r in runs)[1]
        assert cell.worst(by_key["passivity_excess_J"]) == max(r["passivity_excess_J"] for r in runs)
    assert [c.entered for c in cells] == [3, 0]
    again = run_comparison(prepare_comparison(scene, Plan(["none", "vfi"], seeds=3), Choices()))
    assert [r["hand_work_J"] for r in again] == [r["hand_work_J"] for r in results]


@pytest.mark.parametrize(
    ("plan", "error", "words"),
    [
        ({"enforcements": ["vfi", "vfi"]}, InputError, "expected different names, got vfi, vfi"),
        ({"enforcements": ["wall"]}, UnknownNameError, "admittance, both, none, vfi"),
        ({"robots": ["neuro8"]}, InputError, 'no variant for robot "neuro8"'),
        ({"guards": ["watch", "watch"]}, InputError, "expected different names, got watch, watch"),
        ({"guards": ["on"]}, UnknownNameError, "act, off, watch"),
        ({"seeds": 0}, InputError, "expected at least 1, got 0"),
        ({"solvers": ["lp"]}, InputError, "--solver: it is for scenes that follow a trajectory by themselves"),
        ({"coordinations": ["static"]}, InputError, "--coordination: it is for scenes with several arms"),
    ],
)
def test_what_cannot_be_compared(scene, plan, error, words):
    with pytest.raises(error, match=words):
        prepare_comparison(scene, Plan(**{"enforcements": ["vfi"]} | plan), Choices())


def test_on_the_command_line(scene):
    table = CliRunner().invoke(app, ["compare", scene, "--enforcement", "admittance,vfi"])
    assert table.exit_code == 0 and "clearance" in table.stdout and "vfi" in table.stdout
    printed = CliRunner().invoke(app, ["compare", scene, "--enforcement", "vfi", "--seeds", "2", "--json"])
    runs = json.loads(printed.stdout)
    assert [(r["enforcement"], r["seed"], r["robot"]) for r in runs] == [("vfi", 0, "lwr4plus"), ("vfi", 1, "lwr4plus")]
    refused = CliRunner().invoke(app, ["compare", scene, "--enforcement", "vfy"])
    assert refused.exit_code == 2 and 'Did you mean "vfi"' in refused.stderr
