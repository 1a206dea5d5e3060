"""`vfi diff`: equal runs are equal to the bit, and every change of a run is told where it is."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

from scenarios.analysis.difference import compare_traces, flat
from scenarios.analysis.trace import Event, Trace, TraceWriter
from scenarios.cli import app
from scenarios.run import run
from scenarios.scene_file import load_scene


@cache
def done(name="S5", period=0.008):
    return run(load_scene(name).with_changes(duration=1.6), period=period)


def changed(trace, quantity, cycle, column, by):
    records = trace.records.copy()
    records[cycle, trace.columns[quantity].start + column] += by
    return replace(trace, records=records)


def store(trace, path):
    with TraceWriter(path, trace.columns, trace.header) as writer:
        writer.write(trace.records)
        for event in trace.events:
            writer.note(event)
    return path


def test_the_same_run_again_is_equal_but_for_its_times():
    again = run(load_scene("S5").with_changes(duration=1.6), period=0.008)
    assert not np.array_equal(again["cycle_us"], done()["cycle_us"])
    found = compare_traces(done(), again)
    assert found.equal and found.first is None and not found.metrics
    assert all(size["max"] == 0.0 for size in found.apart.values())


def test_the_first_command_that_differs_is_named():
    other = changed(changed(done(), "qdot", 40, 3, 1e-3), "qdot", 90, 1, -0.5)
    found = compare_traces(done(), other)
    assert not found.equal
    assert found.first["cycle"] == 40 and found.first["t"] == pytest.approx(0.32)
    assert found.first["joint"] == done().header["decided"][3]
    assert found.first["by"] == pytest.approx(1e-3)
    assert found.differing == ["qdot"]
    size = found.apart["qdot"]
    assert size["max"] == pytest.approx(0.5) and size["at_cycle"] == 90
    count = done()["qdot"].size
    assert size["rms"] == pytest.approx(np.sqrt((1e-6 + 0.25) / count))
    assert found.apart["q"]["max"] == 0.0


def test_one_bit_is_a_difference():
    records = done().records.copy()
    place = done().columns["q"].start
    records[7, place] = np.nextafter(records[7, place], np.inf)
    found = compare_traces(done(), replace(done(), records=records))
    assert found.differing == ["q"] and not found.equal


def test_margins_are_told_by_name_and_metrics_side_by_side():
    found = compare_traces(done("S4"), done("S5"))
    assert found.header["scene"] == ("S4", "S5")
    assert any(line.startswith(("-", "+")) for line in found.scene)
    expected = np.abs(done("S5").margin("C2") - done("S4").margin("C2")).max()
    assert found.apart["margin C2"]["max"] == expected
    for key, (a, b) in found.metrics.items():
        assert a != b and not key.startswith("cycle_us"), key


def test_lengths_events_and_columns_that_differ_are_told():
    trace = done()
    shorter = replace(trace, records=trace.records[:100], events=(Event(0.1, "HOLD", "why"),))
    found = compare_traces(trace, shorter)
    assert found.cycles == (200, 100) and not found.equal and not found.differing
    assert found.events[1] == [{"t": 0.1, "state": "HOLD", "reason": "why"}]
    lean = replace(trace, columns={k: v for k, v in trace.columns.items() if k != "slack"})
    assert compare_traces(trace, lean).columns == (["slack"], [])


def test_traces_of_scenes_that_cannot_be_built_are_compared_all_the_same():
    strange = replace(done(), header={**done().header, "resolved_scene": "name: gone"})
    found = compare_traces(done(), strange)
    assert not found.equal and not found.differing and found.scene
    assert "missing key" in found.without_metrics and not found.metrics


def test_nested_keys_are_joined():
    assert flat({"a": {"b": 1, "c": {"d": 2}}, "e": [3]}) == {"a.b": 1, "a.c.d": 2, "e": [3]}


def test_on_the_command_line(tmp_path):
    a, b = store(done(), tmp_path / "a.mcap"), store(changed(done(), "qdot", 40, 3, 1e-3), tmp_path / "b.mcap")
    same = CliRunner().invoke(app, ["diff", str(a), str(a)])
    assert (same.exit_code, same.stdout.split()[0]) == (0, "equal")
    other = CliRunner().invoke(app, ["diff", str(a), str(b)])
    assert other.exit_code == 1 and "cycle 40" in other.stdout
    told = CliRunner().invoke(app, ["diff", str(a), str(b), "--json"])
    assert told.exit_code == 1
    found = json.loads(told.stdout)
    assert found["first"]["cycle"] == 40 and found["equal"] is False
    missing = CliRunner().invoke(app, ["diff", str(a), str(tmp_path / "c.mcap")])
    assert missing.exit_code == 2 and "c.mcap" in missing.output


def test_hands_on_runs_differ_in_enforcement(tmp_path):
    from tests.scenarios.comparisons import compared

    traces = compared(tmp_path) / "traces"
    a, b = (traces / f"short-lwr4plus-kinematic-{e}-watch-seed0.mcap" for e in ("admittance", "vfi"))
    found = compare_traces(Trace.load(a), Trace.load(b))
    assert found.header["enforcement"] == ("admittance", "vfi")
    assert all("enforcement" in line for line in found.scene) and "tangential_freedom" in found.metrics
    assert found.apart["margin bowl"]["max"] > 1e-4
    assert CliRunner().invoke(app, ["diff", str(a), str(b)]).exit_code == 1
