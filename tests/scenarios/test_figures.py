"""The paper's figures: drawn from loaded traces, of any set of runs, and showing what they say."""

import numpy as np
import pytest

from primitives.errors import InputError
from scenarios.analysis import figures
from scenarios.analysis.trace import Trace
from scenarios.run import run
from scenarios.scene_file import load_scene


@pytest.fixture(scope="module")
def traces(tmp_path_factory):
    folder = tmp_path_factory.mktemp("traces")
    for name in ("S1", "S5"):
        run(load_scene(name), period=0.008, out=folder / f"{name}.mcap")
    return [Trace.load(folder / f"{name}.mcap") for name in ("S1", "S5")]


def test_margins_panel_shows_the_traces_extremes(traces):
    figure = figures.margins(traces)
    panel = figure.axes[1]
    assert panel.get_title(loc="left").startswith("C2")
    curve = next(line for line in panel.lines if line.get_label() == "S1")
    assert min(curve.get_ydata()) == pytest.approx(1e3 * traces[0].margin("C2").min(), abs=1e-9)
    assert panel.get_ylim()[0] < min(curve.get_ydata())


def test_thinning_keeps_extremes():
    values = np.zeros(100_000)
    values[54_321], values[77_777] = 5.0, -7.0
    kept = values[figures.thin(values)]
    assert len(kept) <= figures.POINTS + 2
    assert kept.max() == 5.0
    assert kept.min() == -7.0


def test_error_and_paths_are_those_of_the_trace(traces):
    _, bottom = figures.velocity_and_error(traces).axes
    curve = next(line for line in bottom.lines if line.get_label() == "S5")
    assert max(curve.get_ydata()) == pytest.approx(np.linalg.norm(traces[1]["error"], axis=1).max())
    (space,) = figures.tip_paths(traces).axes
    lowest = min(np.min(line.get_data_3d()[2]) for line in space.lines if line.get_label() == "S5")
    assert -80.0 < lowest < -79.0


def test_files_are_png_and_svg_and_repeat_to_the_byte(traces, tmp_path):
    first = {p.name: p.read_bytes() for p in figures.draw_all(traces, tmp_path)}
    assert len(first) == 6
    assert all(content.startswith((b"\x89PNG", b"<?xml")) for content in first.values())
    again = {p.name: p.read_bytes() for p in figures.draw_all(traces, tmp_path) if p.suffix == ".png"}
    assert all(first[name] == content for name, content in again.items())


def test_nothing_to_draw_is_said(tmp_path):
    with pytest.raises(InputError, match="at least one trace"):
        figures.draw_all([], tmp_path)
