"""The command `vfi`: what it prints, what it writes, and its exit codes."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from scenarios.analysis.trace import Trace
from scenarios.anatomy import Ellipsoid
from scenarios.cli import app
from scenarios.hands_on.scene_file import dump_hands_on
from scenarios.scene_file import load_any


def vfi(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def refused(*arguments):
    """The one line of an invocation that must exit with 2."""
    done = vfi(*arguments)
    assert done.exit_code == 2, done.output
    assert "Traceback" not in done.output
    return done.output


KEYS = {
    "scene",
    "robot",
    "solver",
    "period_s",
    "cycles",
    "violated",
    "min_margin_m",
    "infeasible_cycles",
    "guard_interventions",
    "task_error",
    "acceleration_rms_last_2s",
    "cycle_us",
    "seed",
    "versions",
}


def test_json_is_a_list_with_the_promised_keys():
    done = vfi("run", "S1", "S5", "--period", "0.008", "--seed", "7", "--json")
    assert done.exit_code == 0
    results = json.loads(done.stdout)
    assert [r["scene"] for r in results] == ["S1", "S5"]
    for r in results:
        assert r.keys() >= KEYS
        assert set(r["task_error"]) == {"max", "rms"}
        assert set(r["cycle_us"]) == {"p5", "median", "p99", "max"}
        assert set(r["min_margin_m"]) == {"C1", "C2", "C3", "C4"}
        assert r["seed"] == 7
    assert results[0]["violated"] == ["C1", "C2", "C3", "C4"]
    assert results[1]["violated"] == []


def test_runs_by_hand_have_the_keys_of_a_trajectory_and_of_the_hand(tmp_path):
    done = vfi("run", "S2-hand", "S2", "--seed", "7", "--json", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    by_hand, along = json.loads(done.stdout)
    assert by_hand.keys() > along.keys() >= KEYS
    assert by_hand["violated"] == along["violated"] == ["C2", "C3", "C4"]
    assert by_hand["seed"] == 7 and by_hand["enforcement"] == "vfi" and by_hand["guard"] == "act"
    assert by_hand["passivity_excess_J"] <= 1e-9 and by_hand["hand_work_J"] > 0.0
    assert {f.name for f in tmp_path.glob("*.mcap")} == {"S2.mcap", "S2-hand.mcap"}
    assert (tmp_path / "figure3-margins.png").stat().st_size > 10_000


def test_table_of_runs_by_hand_marks_what_is_violated():
    done = vfi("run", "S4-hand", "--enforcement", "none", "--period", "0.01")
    assert done.exit_code == 0, done.output
    (row,) = [line for line in done.output.splitlines() if line.lstrip().startswith("S4-hand") and "x" in line]
    assert row.count("x") == 4
    assert "by hand, none" in done.output and "the hand" in done.output


HANDS_ON_KEYS = {
    "scene",
    "robot",
    "plant",
    "enforcement",
    "integrator",
    "form",
    "period_s",
    "cycles",
    "port_error_m",
    "clearance_m",
    "passivity_excess_J",
    "hand_work_J",
    "contact_fraction",
    "slipped",
    "max_force_N",
    "seed",
    "versions",
}


@pytest.fixture
def brief_scene(tmp_path):
    """A tenth of a second of a hands-on scene, as a file."""
    scene = load_any("hands-on-tip").with_changes(name="brief", duration=0.1)
    file = tmp_path / "brief.yaml"
    file.write_text(dump_hands_on(scene), encoding="utf-8")
    return file


@pytest.mark.parametrize("robot", ["lwr4plus", "neuro8"])
def test_json_of_hands_on_runs_has_the_promised_keys(robot):
    done = vfi("run", "bowl-tip", "hands-on-tool", "--robot", robot, "--seed", "7", "--json")
    assert done.exit_code == 0, done.output
    results = json.loads(done.stdout)
    assert [(r["scene"], r["robot"], r["plant"]) for r in results] == [
        ("bowl-tip", robot, "kinematic"),
        ("hands-on-tool", robot, "kinematic"),
    ]
    for r in results:
        assert r.keys() >= HANDS_ON_KEYS
        assert set(r["port_error_m"]) == {"max", "rms"}
        assert set(r["clearance_m"]) == {"at_samples", "between_samples"}
        assert r["slipped"] in (True, False)
        assert r["seed"] == 7
    assert results[0]["contact_fraction"] > 0.5


def test_options_of_hands_on_scenes_reach_the_run(brief_scene):
    plain = ("run", brief_scene, "--json")
    chosen = (*plain, "--plant", "mujoco", "--integrator", "rk4", "--form", "full", "--period", "0.002")
    (usual,), (other,) = (json.loads(vfi(*arguments).stdout) for arguments in (plain, chosen))
    named = ("plant", "integrator", "form", "period_s", "cycles")
    assert [usual[k] for k in named] == ["kinematic", "semi-implicit", "reduced", 0.004, 25]
    assert [other[k] for k in named] == ["mujoco", "rk4", "full", 0.002, 50]
    assert set(other["contact_force_N"]) == {"port", "organ", "vessels"}


def test_files_of_anatomy_take_the_place_of_the_scenes(brief_scene, tmp_path):
    """An ellipsoid and a ball in millimetres, written as OBJ; and points with gaps, which are filled on request."""
    for name, axes, middle in (("organ", (0.03, 0.05, 0.02), (0, 0, 0)), ("vessels", (0.02,) * 3, (0.04, 0.0, 0.02))):
        surface = Ellipsoid(np.array(axes)).surface(0.004)
        vertices = 1e3 * (surface.vertices + middle)
        lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
        cloud = "\n".join(lines[::7])
        lines += [f"f {a} {b} {c}" for a, b, c in surface.faces + 1]
        (tmp_path / f"{name}.obj").write_text("\n".join(lines) + "\n")
        (tmp_path / f"{name}-points.obj").write_text(f"{cloud}\n")
    organ, vessels, points = (tmp_path / f"{n}.obj" for n in ("organ", "vessels", "vessels-points"))
    files = ("run", brief_scene, "--organ", organ, "--vessels", vessels)
    done = vfi(*files, "--unit", "mm", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    (header,) = (Trace.load(file).header for file in (tmp_path / "out").glob("*.mcap"))
    assert f"vessels: {vessels}" in header["resolved_scene"]
    text = refused(*files)
    assert "organ.obj" in text and "mm" in text
    gaps = ("run", brief_scene, "--organ", organ, "--vessels", points, "--unit", "mm")
    assert "--fill-gaps" in refused(*gaps)
    assert vfi(*gaps, "--fill-gaps").exit_code == 0


def test_out_of_hands_on_runs_holds_trace_summary_and_figures(brief_scene, tmp_path):
    out = tmp_path / "out"
    done = vfi("run", brief_scene, "S5", "--period", "0.008", "--out", out)
    assert done.exit_code == 0, done.output
    stem = "brief-lwr4plus-kinematic"
    names = {p.name for p in out.iterdir()}
    panels = ("figure7-traces", "figure7-time", "figure8-port", "figure9-damping")
    hands_on = {f"{stem}-{f}.{s}" for f in panels for s in ("png", "svg")}
    followed = {f"{f}.{s}" for f in ("figure3-margins", "figure4-error", "figure5-tip") for s in ("png", "svg")}
    assert names == {f"{stem}.mcap", "S5.mcap", "summary.json", *hands_on, *followed}
    assert [r["scene"] for r in json.loads((out / "summary.json").read_text())] == ["brief", "S5"]
    for words in ("hands-on: admittance, semi-implicit, T = 8 ms", "smallest margins in mm", str(out / f"{stem}.mcap")):
        assert words in done.stdout.replace("\n", " ")


def test_table_of_hands_on_runs_says_in_mm_what_the_json_says_in_m(brief_scene):
    (r,) = json.loads(vfi("run", brief_scene, "--json").stdout)
    row = next(line for line in vfi("run", brief_scene).stdout.splitlines() if "brief lwr4plus" in line)
    cells = row.split()
    assert cells[:3] == ["brief", "lwr4plus", "kinematic"]
    assert f"{1e3 * r['port_error_m']['max']:.3g}" in cells
    assert f"{1e3 * r['clearance_m']['between_samples']:.3f}" in cells
    assert f"{r['max_force_N']:.1f}" in cells


def test_table_marks_what_is_violated():
    done = vfi("run", "S4", "--period", "0.008")
    assert done.exit_code == 0
    row = next(line for line in done.stdout.splitlines() if "S4" in line)
    assert row.count(" x") == 1
    assert "-4.00 x" in row


def test_out_holds_traces_summary_and_figures(tmp_path):
    out = tmp_path / "a" / "b"
    done = vfi("run", "S1", "S5", "--period", "0.008", "--out", out)
    assert done.exit_code == 0
    names = {p.name for p in out.iterdir()}
    figures = {f"{f}.{s}" for f in ("figure3-margins", "figure4-error", "figure5-tip") for s in ("png", "svg")}
    assert names == {"S1.mcap", "S5.mcap", "summary.json", *figures}
    assert (out / "figure3-margins.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (out / "figure3-margins.svg").read_text()[:1000]
    assert [r["scene"] for r in json.loads((out / "summary.json").read_text())] == ["S1", "S5"]


def test_all_solvers_keep_the_margins_of_s5_within_a_tenth_of_a_millimetre(tmp_path):
    done = vfi("run", "S5", "--solver", "all", "--period", "0.008", "--out", tmp_path, "--json")
    assert done.exit_code == 0
    results = {r["solver"]: r for r in json.loads(done.stdout)}
    assert results.keys() >= {"active-set", "lp", "proxqp", "osqp", "piqp", "daqp"}
    ours = results["active-set"]["min_margin_m"]
    for name, r in results.items():
        assert r["violated"] == []
        assert r["infeasible_cycles"] == 0
        assert (tmp_path / f"S5-{name}.mcap").exists()
        if name != "lp":  # it minimises another norm
            assert r["min_margin_m"] == pytest.approx(ours, abs=1e-4)


def test_list_names_everything():
    done = vfi("list")
    assert done.exit_code == 0
    for name in ("S1", "S3-stiff-wrist", "neuro8-pair", "lwr4plus", "active-set", "lp", "line_line_angle"):
        assert name in done.stdout
    found = json.loads(vfi("list", "--json").stdout)
    assert set(found) == {"scenes", "robots", "solvers", "primitives"}
    assert all(text for entries in found.values() for text in entries.values())


def test_cite_and_version():
    assert "ctive Constraints using Vector Field Inequalities" in vfi("--cite").stdout
    assert vfi("--version").stdout.strip().count(".") == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "S6"), ('"S6"', "Known", "S5")),
        (("run", "s5"), ("Did you mean", '"S5"')),
        (("run", "nothing.yaml"), ("nothing.yaml",)),
        (("run", "S5", "--solver", "lpp"), ('"lpp"', "Did you mean", '"lp"')),
        (("run", "S5", "--period", "0"), ("period", "> 0", "got 0")),
        (("run", "S5", "--period", "-1"), ("period", "> 0", "got -1")),
        (("run", "S5", "--period", "nan"), ("period", "finite")),
        (("run", "S5", "--period", "0.1"), ("eta T <= 1",)),
        (("run", "S5", "--guard", "on"), ("on", "act")),
        (("run", "S3-stiff-wrist", "--robot", "lwr4plus"), ("lwr4plus", "cannot run", "moving/shaft")),
        (("run", "S5", "--robot", "lwr4"), ("Did you mean", "lwr4plus")),
        (("run", "S5", "S5"), ("twice",)),
        (("run", "bowl-tip", "--plant", "mujoko"), ("mujoko", "kinematic")),
        (("run", "bowl-tip", "--integrator", "rk5"), ("Did you mean", '"rk4"')),
        (("run", "bowl-tip", "--form", "printd"), ("Did you mean", '"printed"')),
        (("run", "bowl-tip", "--enforcement", "qp"), ('"qp"', "vfi")),
        (("run", "bowl-tip", "--enforcement", "vfi", "--integrator", "rk4"), ("semi-implicit", "rk4")),
        (("run", "bowl-tip", "--form", "full", "--integrator", "robust"), ("robust", "reduced")),
        (("run", "bowl-tip", "--robot", "neuro8-pair"), ("no variant", '"neuro8-pair"', "lwr4plus")),
        (("run", "bowl-tip", "--robot", "neuro"), ("Did you mean", "neuro8")),
        (("run", "bowl-tip", "--period", "0"), ("period", "> 0")),
        (("run", "bowl-tip", "--seed", "-1"), ("greater than or equal to 0",)),
        (("run", "hands-on-tip", "--unit", "mm"), ("--unit", "--organ or --vessels")),
        (("run", "hands-on-tip", "--fill-gaps"), ("--fill-gaps", "--organ or --vessels")),
        (("run", "hands-on-tip", "--organ", "no.ply"), ("vessels", "--vessels too")),
        (("run", "hands-on-tip", "--vessels", "no.ply"), ("no.ply",)),
        (("run", "hands-on-tip", "--vessels", "no.txt"), ("no.txt",)),
        (("run", "hands-on-tip", "--vessels", "no.ply", "--unit", "inch"), ('"inch"', "mm")),
        (("run", "bowl-tip", "--vessels", "no.ply"), ("bowl", "organ and vessels only")),
        (("run", "bowl-tip", "--solver", "lp"), ("--solver", "follow a trajectory")),
        (("run", "bowl-tip", "--guard", "on"), ("on", "watch")),
        (("run", "bowl-tip", "--integrator", "rk4", "--guard", "act"), ("rk4", "semi-implicit")),
        (("run", "bowl-tip", "--enforcement", "vfi", "--metric", "joint"), ('"joint"', "joints")),
        (("run", "S5", "--plant", "mujoko"), ("mujoko", "kinematic")),
        (("run", "S5-hand", "--plant", "mujoco"), ("--plant", "that follow a trajectory or led by a hand")),
        (("run", "S5", "--integrator", "rk4"), ("--integrator", "led by a hand")),
        (("run", "S5", "--vessels", "no.ply"), ("--vessels", "led by a hand")),
        (("run", "S5-hand", "--solver", "lp"), ("--solver", "that follow a trajectory,")),
        (("run", "S5-hand", "--enforcement", "bot"), ('"bot"', "admittance, both, none, vfi")),
        (("run", "S5", "--metric", "joints"), ("--metric", "by hand or led by a hand")),
        (("run", "S5-hand", "--robot", "neuro8"), ("neuro8", "8 joints")),
        (("run", "S5", "--enforcement", "both"), ('"both"', "the keys hand and admittance")),
        (("run",), ("scenes",)),
        (("play", "S5"), ("play",)),
    ],
)
def test_bad_usage_is_one_clear_line_and_exit_code_2(arguments, words):
    text = refused(*arguments)
    for word in words:
        assert word in text


def test_bad_input_writes_nothing(tmp_path):
    out = tmp_path / "out"
    refused("run", "S1", "S6", "--out", out)
    assert not out.exists()
    file = tmp_path / "file"
    file.write_text("mine")
    assert "expected a folder" in refused("run", "S1", "--out", file)
    assert file.read_text() == "mine"
