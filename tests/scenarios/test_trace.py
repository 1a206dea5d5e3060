"""The trace file: what is written comes back, also after a kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from primitives.errors import FileError, UnknownNameError
from scenarios.analysis.trace import Event, Trace, TraceWriter

ROOT = Path(__file__).parents[2]
COLUMNS = {"t": slice(0, 1), "q": slice(1, 3), "margin": slice(3, 5)}
HEADER = {"scene": "demo", "constraints": {"C1": "m", "C2": "rad"}}


def write(path: Path, records: np.ndarray, block: int = 7) -> None:
    with TraceWriter(path, COLUMNS, HEADER) as writer:
        for start in range(0, len(records), block):
            writer.write(records[start : start + block])


@pytest.fixture
def records():
    values = np.random.default_rng(3).normal(size=(50, 5))
    values[:, 0] = np.arange(50) * 0.004
    return values


def test_what_is_written_comes_back_to_the_bit(tmp_path, records):
    write(tmp_path / "a.mcap", records)
    trace = Trace.load(tmp_path / "a.mcap")
    assert trace.complete
    assert np.array_equal(trace.records, records)
    assert trace.header == HEADER
    assert trace["t"].shape == (50,)
    assert trace["q"].shape == (50, 2)
    assert np.array_equal(trace.margin("C2"), records[:, 4])


def test_events_come_back_beside_the_records(tmp_path, records):
    path, events = tmp_path / "a.mcap", [Event(0.004, "DEGRADED", "why"), Event(0.1, "RUN", "")]
    with TraceWriter(path, COLUMNS, HEADER) as writer:
        writer.write(records[:20])
        writer.note(events[0])
        writer.write(records[20:])
        writer.note(events[1])
    trace = Trace.load(path)
    assert trace.events == tuple(events)
    assert np.array_equal(trace.records, records)


def test_unknown_names_are_proposed(tmp_path, records):
    write(tmp_path / "a.mcap", records)
    trace = Trace.load(tmp_path / "a.mcap")
    with pytest.raises(UnknownNameError, match="margin"):
        trace["margins"]
    with pytest.raises(UnknownNameError, match="C1"):
        trace.margin("c1")


@pytest.mark.parametrize("lost", [1, 10, 100, 333, 1000])
def test_truncated_file_loads_up_to_its_last_whole_block(tmp_path, records, lost):
    path = tmp_path / "a.mcap"
    write(path, records)
    whole = path.read_bytes()
    path.write_bytes(whole[:-lost])
    trace = Trace.load(path)
    assert not trace.complete
    assert len(trace.records) % 7 == 0 or len(trace.records) == 50
    assert len(trace.records) >= 50 - 7 * (1 + lost // (7 * 5 * 8))
    assert np.array_equal(trace.records, records[: len(trace.records)])


@pytest.mark.parametrize("content", [b"", b"not a trace", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + b"\x00" * 40])
def test_other_files_are_refused_by_name(tmp_path, content):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"a\.mcap"):
        Trace.load(path)


def test_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(FileError, match=r"nothing\.mcap"):
        Trace.load(tmp_path / "nothing.mcap")


def test_killed_run_leaves_its_last_50_ms_readable(tmp_path):
    """A run that is killed loses at most what was not yet drained."""
    path = tmp_path / "S5.mcap"
    code = (
        "from pathlib import Path\nfrom scenarios.run import run\nfrom scenarios.scene_file import load_scene\n"
        "scene = load_scene('S5')\nrun(scene.with_changes(duration=0.1))\nprint('go', flush=True)\n"
        f"run(scene.with_changes(duration=3000.0), period=0.001, out=Path({str(path)!r}))"
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen([sys.executable, "-c", code], env=env, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == "go"
        deadline = time.monotonic() + 120.0
        while (not path.exists() or path.stat().st_size < 500_000) and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    trace = Trace.load(path)
    assert not trace.complete
    assert len(trace.records) > 100
    assert np.all(np.diff(trace.t) > 0.0)
    assert json.dumps(dict(trace.header))
