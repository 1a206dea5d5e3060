"""Comparisons of scenes along a trajectory: by themselves, by hand, with two arms."""

import json
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from primitives import dual_quaternion as dq
from primitives.errors import InputError, SolverError, UnknownNameError
from scenarios.analysis.cells import gather
from scenarios.analysis.comparison_folder import load_comparison, trace_file
from scenarios.analysis.followed_charts import followed_pictures
from scenarios.analysis.followed_view import WINDOW, followed_view
from scenarios.analysis.look import looks
from scenarios.analysis.measures import measures
from scenarios.analysis.metrics import VIOLATED
from scenarios.analysis.picture import Chart
from scenarios.cli import app
from scenarios.comparison import TREMOR_ALONG, Plan, prepare_comparison, run_comparison
from scenarios.enforcement import METHODS
from scenarios.jobs import Choices
from scenarios.scene_file import load_any
from tests.scenarios.comparisons import OF_KINDS, compared_in_a_hurry, hurried

OPTIONS = {
    "S5": ("--solver", "active-set,lp"),
    "S5-hand": ("--enforcement", "none,vfi"),
    "two-arms": ("--coordination", "central,static", "--guard", "act"),
}
CELLS = {
    "S5": ["none, active-set", "vfi, active-set", "none, lp", "vfi, lp"],
    "S5-hand": ["none", "vfi"],
    "two-arms": ["none, central", "vfi, central", "none, static", "vfi, static"],
}


@pytest.fixture(scope="module", params=sorted(CELLS))
def kind(request, tmp_path_factory):
    """Name of a scene, and the folder of its comparison."""
    name = request.param
    return name, compared_in_a_hurry(name, tmp_path_factory.mktemp(name), *OPTIONS[name])


def test_a_cell_is_named_by_what_differs(kind):
    name, folder = kind
    cells = load_comparison(folder).cells
    assert [cell.name for cell in cells] == CELLS[name]
    assert len(set(looks(cells))) == len(cells), "each has a look of its own"


def test_nobody_keeps_the_constraints_under_none_and_all_are_watched(kind):
    _, folder = kind
    comparison = load_comparison(folder)
    for r in comparison.results:
        trace = comparison.trace(r)
        smallest = {n: trace.margin(n).min() for n in trace.header["constraints"]}
        assert trace.header["enforced"] == ([] if r["enforcement"] == "none" else r["to_keep"])
        assert r["clearance_m"]["at_samples"] == min(smallest[n] for n in r["to_keep"])
        assert r["clearance_m"]["between_samples"] <= r["clearance_m"]["at_samples"]
        assert r["penetration_depth_m"] == max(0.0, -r["clearance_m"]["between_samples"])
        inside = np.any([trace.margin(n) < VIOLATED for n in r["to_keep"]], axis=0)
        assert r["time_inside_s"] == pytest.approx(inside.sum() * 0.008)
    assert all(cell.entered == (cell.enforcement == "none") for cell in comparison.cells if "lp" not in cell.name)


def test_a_run_prints_the_keys_of_vfi_run(kind):
    name, folder = kind
    options = ["--coordination", "static"] if name == "two-arms" else []
    done = CliRunner().invoke(app, ["run", str(folder.parent / f"{name}.yaml"), *options, "--json"])
    assert done.exit_code == 0, done.output
    alone, compared = json.loads(done.stdout)[0], load_comparison(folder).results[-1]
    assert alone.keys() == compared.keys()
    assert all(measure.of(alone) is not None for measure in measures([alone]) if "between" in measure.key)


def test_errors_are_those_of_poses_told_otherwise(kind):
    _, folder = kind
    comparison = load_comparison(folder)
    trace = comparison.trace(comparison.results[-1])
    seen = followed_view(comparison.cells[-1], looks(comparison.cells)[-1], trace)
    for i in range(len(trace.header["tasks"])):
        place = slice(8 * i, 8 * i + 8)
        x, wanted = trace["pose"][:, place], trace["reference"][:, place]
        off = [
            np.linalg.norm(dq.translation(a.copy()) - dq.translation(b.copy())) for a, b in zip(x, wanted, strict=True)
        ]
        np.testing.assert_allclose(seen.off[i], off, atol=1e-12)
        r, r_d = (Rotation.from_quat(pose[:, [1, 2, 3, 0]]) for pose in (x, wanted))
        np.testing.assert_allclose(seen.turned[i], (r_d * r.inv()).magnitude(), atol=1e-9)
    jumps = np.linalg.norm(np.diff(trace["qdot"], axis=0), axis=1) / 0.008
    window = round(WINDOW / 0.008)
    for k in (1, 10, window, 100, len(trace.records) - 1):
        last = np.concatenate([[0.0], jumps])[max(0, k + 1 - window) : k + 1]
        assert seen.acceleration[k] == pytest.approx(np.sqrt(np.mean(last**2)), rel=1e-9, abs=1e-12)


def test_figures_hold_the_margins_of_the_traces(kind):
    name, folder = kind
    comparison = load_comparison(folder)
    cells = comparison.cells
    traces = [comparison.trace(cell.runs[0]) for cell in cells]
    views = [followed_view(*run) for run in zip(cells, looks(cells), traces, strict=True)]
    drawn = followed_pictures(views, cells[0].runs[0]["to_keep"])
    assert tuple(picture.name for picture in drawn) == OF_KINDS[name]
    for panel, constraint in zip(drawn[0].panels, traces[0].header["constraints"], strict=True):
        assert panel.title == constraint
        for line, trace in zip(panel.lines, traces, strict=True):
            assert line.y.min() == pytest.approx(1e3 * trace.margin(constraint).min())
    for picture in drawn:
        assert len(picture.caption) > 40
        for panel in picture.panels if isinstance(picture, Chart) else ():
            assert panel.lines and panel.x_label.endswith("]") and panel.y_label.endswith("]")
    space = next(picture for picture in drawn if picture.name == "space")
    middle, half = space.box()
    for _, points, _, _ in space.paths:
        assert np.all(np.abs(points - middle) <= half + 1e-9)


def test_the_report_is_made_again_and_says_what_is_random(kind):
    name, folder = kind
    page = (folder / "report.html").read_text(encoding="utf-8")
    (folder / "report.html").unlink()
    done = CliRunner().invoke(app, ["report", str(folder)])
    assert done.exit_code == 0, done.output
    assert (folder / "report.html").read_text(encoding="utf-8") == page
    assert all(f'id="plot-neuro8-pair-{figure}"' in page for figure in OF_KINDS[name])
    assert all((folder / "figures" / f"neuro8-pair-{figure}.svg").exists() for figure in OF_KINDS[name])
    assert ("Nothing in these runs is random" in page) == (name != "S5-hand")
    assert ("bootstrap" in page) == (name == "S5-hand")
    assert f"vfi compare {folder.parent / name}.yaml" in page
    assert all(f"{option} {value}" in page for option, value in pairwise(OPTIONS[name]) if option.startswith("--"))


def test_two_runs_differ_in_their_enforcement(kind):
    _, folder = kind
    first, second = load_comparison(folder).results[:2]
    done = CliRunner().invoke(app, ["diff", *(str(folder / trace_file(r)) for r in (first, second)), "--json"])
    assert done.exit_code == 1, done.output
    found = json.loads(done.stdout)
    assert found["header"]["enforcement"] == ["none", "vfi"]
    assert all("method" in line for line in found["scene"]), "the scenes are the same but for their enforcement"
    assert found["metrics"]["clearance_m.at_samples"] == [r["clearance_m"]["at_samples"] for r in (first, second)]
    if first["kind"] == "by-hand":
        assert found["metrics"]["hand_work_J"] == [first["hand_work_J"], second["hand_work_J"]]


def test_a_scene_that_enforces_nothing_is_compared_in_all_that_it_watches(tmp_path):
    jobs = prepare_comparison(hurried("S1", tmp_path), Plan(), Choices())
    none, vfi = run_comparison(jobs)
    assert none["to_keep"] == vfi["to_keep"] == ["C1", "C2", "C3", "C4"]
    assert none["clearance_m"] == vfi["clearance_m"], "nothing is enforced in either"


def test_seeds_make_a_still_hand_tremble(tmp_path):
    scene = load_any("S5-hand")
    assert scene.hand.tremor == TREMOR_ALONG
    file = tmp_path / "still.yaml"
    file.write_text((tmp_path / hurried("S5-hand", tmp_path)).read_text().replace("tremor: 0.2", "tremor: 0.0"))
    plan = Plan(["none", "vfi"], seeds=2)
    results = run_comparison(prepare_comparison(str(file), plan, Choices()))
    assert len({r["hand_work_J"] for r in results}) == 4
    again = run_comparison(prepare_comparison(str(file), plan, Choices()))
    assert [r["hand_work_J"] for r in again] == [r["hand_work_J"] for r in results]
    alone = prepare_comparison(str(file), Plan(["vfi"]), Choices())
    assert alone[0].scene.hand.tremor == 0.0


def test_by_hand_there_are_all_enforcements(tmp_path):
    jobs = prepare_comparison(hurried("S2-hand", tmp_path), Plan(), Choices())
    assert [job.scene.in_force.method for job in jobs] == list(METHODS)
    cells = gather(run_comparison(jobs))
    assert [cell.name for cell in cells] == list(METHODS)
    assert [cell.entered for cell in cells] == [1, 0, 0, 0]


@pytest.mark.parametrize(
    ("name", "plan", "error", "words"),
    [
        ("S1", {"enforcements": ["admittance"]}, InputError, "a hand has to lead the tool: take S1-hand"),
        ("two-arms", {"enforcements": ["none", "both"]}, InputError, "give it the keys hand and admittance"),
        ("S5", {"enforcements": ["vif"]}, UnknownNameError, 'Did you mean "vfi"'),
        ("S5", {"solvers": ["activeset"]}, UnknownNameError, 'Did you mean "active-set"'),
        ("S5", {"guards": ["acts"]}, UnknownNameError, 'Did you mean "act"'),
        ("S5", {"coordinations": ["static"]}, InputError, "--coordination: it is for scenes with several arms"),
        ("two-arms", {"coordinations": ["statik"]}, UnknownNameError, 'Did you mean "static"'),
        ("S5-hand", {"solvers": ["lp"]}, InputError, "--solver: it is for scenes that follow a trajectory"),
        ("S5-hand", {"enforcements": ["admitance"]}, UnknownNameError, 'Did you mean "admittance"'),
        ("S5", {"seeds": 6}, InputError, 'nothing in "S5" is random'),
        ("S5", {"robots": ["neuro8-pair", "neuro8"]}, InputError, "cannot run scene"),
        ("S6", {}, UnknownNameError, 'unknown scene "S6"'),
    ],
)
def test_what_cannot_be_compared(name, plan, error, words):
    with pytest.raises((error, SolverError), match=words):
        prepare_comparison(name, Plan(**plan), Choices())


def test_on_a_terminal(tmp_path):
    done = CliRunner().invoke(app, ["compare", hurried("S2", tmp_path)])
    assert done.exit_code == 0, done.output
    head, _, none, vfi = [line for line in done.stdout.splitlines() if line.strip()][1:5]
    assert head.split()[:6] == ["robot", "run", "C1", "C2", "C3", "C4"]
    assert none.split()[2:4][1] == "x" and vfi.split()[3].startswith("("), "violated; watched"
