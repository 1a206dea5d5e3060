"""The command `vfi`: what it prints, what it writes, and its exit codes."""

import json

import pytest
from typer.testing import CliRunner

from scenarios.cli import app


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
        (("run", "S5", "--robot", "lwr4plus"), ("lwr4plus", "cannot run", "moving/shaft")),
        (("run", "S5", "--robot", "lwr4"), ("Did you mean", "lwr4plus")),
        (("run", "S5", "S5"), ("twice",)),
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
