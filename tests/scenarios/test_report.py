"""The report: what it shows is what the traces hold, it needs no network, and a browser draws every figure."""

import json
import re
import shutil
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import plotly.graph_objects as go
import pytest
from typer.testing import CliRunner

from primitives.errors import FileError
from scenarios.analysis import draw_matplotlib, draw_plotly, hands_on_charts, ledger_chart
from scenarios.analysis.comparison_folder import load_comparison
from scenarios.analysis.hands_on_metrics import clearance
from scenarios.analysis.hands_on_view import view
from scenarios.analysis.look import looks
from scenarios.analysis.picture import Chart
from scenarios.analysis.spread_chart import spread
from scenarios.anatomy.parts import build_parts
from scenarios.cli import app
from scenarios.resolved import resolved_scene
from tests.scenarios.comparisons import FIGURES, compared

LARGEST = 8_000_000
"""Bytes that a report may have."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A comparison with its report, as the command line makes it."""
    return compared(tmp_path_factory.mktemp("comparison"))


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def runs(folder):
    """The first run of every cell as the figures see it, its scene and anatomy."""
    comparison = load_comparison(folder)
    traces = [comparison.trace(cell.runs[0]) for cell in comparison.cells]
    scene = resolved_scene(traces[0])
    parts = build_parts(scene.anatomy, np.array(scene.port))
    seen = zip(comparison.cells, looks(comparison.cells), traces, strict=True)
    return [view(cell, look, trace, scene, parts) for cell, look, trace in seen], scene, parts, comparison.cells


def test_the_folder_holds_everything(folder):
    names = {str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file()}
    cells = [f"{e}-watch-seed{s}" for e in ("none", "admittance", "vfi") for s in (0, 1)]
    traces = {f"traces/short-lwr4plus-kinematic-{cell}.mcap" for cell in cells}
    figures = {f"figures/lwr4plus-{name}.{kind}" for name in FIGURES for kind in ("png", "svg")}
    assert names == {"report.html", "comparison.json", *traces, *figures}
    for file in (folder / "figures").glob("*.svg"):
        ElementTree.parse(file)
    assert all(f.read_bytes().startswith(b"\x89PNG") for f in (folder / "figures").glob("*.png"))
    assert (folder / "report.html").stat().st_size < LARGEST


class _Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.links = [], []

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href", "data", "action")]
        if tag not in ("meta", "br", "link", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_whole_and_links_to_nothing_outside(page):
    tags = _Tags()
    tags.feed(page)
    assert not tags.open
    assert tags.links and all(link.startswith("#") for link in tags.links)
    assert "default-src 'none'" in page
    assert "a push &lt;into&gt; a bowl &amp; back" in page, "text of the scene is escaped"
    assert "vfi compare" in page and "--seeds 2" in page and "takes at least 6 seeds" in page
    targets = {link[1:] for link in tags.links}
    assert all(f'id="{target}"' in page for target in targets)


def test_every_figure_of_the_page_is_one_that_plotly_accepts(page):
    found = re.findall(r'class="figure" data-for="plot-lwr4plus-([a-z-]+)">(.*?)</script>', page, re.DOTALL)
    assert tuple(name for name, _ in found) == FIGURES
    for _, text in found:
        figure = go.Figure(json.loads(text))
        assert figure.data


def _curves(picture):
    """{(panel, label): (x, y)} of the lines of a chart."""
    return {(i, line.label): line for i, panel in enumerate(picture.panels) for line in panel.lines}


def test_curves_are_those_of_the_traces(runs):
    views, scene, parts, _ = runs
    curves = _curves(hands_on_charts.margins(views, scene))
    for seen in views:
        line = curves[0, seen.label]
        expected = 1e3 * clearance(scene, scene.build_robot(), parts, seen.trace["plant_q"])
        place = np.searchsorted(seen.trace.t, line.x)
        shown = expected[place] < 2e3 * scene.parameters.d_0
        np.testing.assert_allclose(line.y[shown], expected[place][shown], atol=1e-9)
        assert line.y.min() == pytest.approx(expected.min()), "thinning keeps the smallest"
    forces = _curves(hands_on_charts.forces(views))
    hand = np.linalg.norm(views[1].trace["hand_wrench"][:, :3], axis=1)
    assert forces[0, "admittance"].y.max() == pytest.approx(hand.max())
    assert forces[1, "none"].y.max() == 0.0 < 0.5 < forces[1, "vfi"].y.max()


def test_the_ledger_adds_up(runs):
    views, _, _, _ = runs
    for seen in views:
        terms = ledger_chart.ledger_terms(seen.trace)
        assert terms.keys() == ledger_chart.TERMS.keys()
        stored = terms.pop("stored")
        np.testing.assert_allclose(
            sum(terms.values()), stored - stored[0] + sum(v[0] for v in terms.values()), atol=1e-9
        )
    rows = ledger_chart.ledger_terms(views[-1].trace)["rows that keep"]
    assert rows.min() < -1e-4, "the rows stopped the tool"


def test_every_panel_has_units_and_every_figure_a_caption(runs):
    views, scene, parts, cells = runs
    for picture in [*hands_on_charts.pictures(views, scene, parts), spread(cells)]:
        assert len(picture.caption) > 40
        for panel in picture.panels if isinstance(picture, Chart) else ():
            assert panel.lines and re.search(r"\[.+\]$", panel.x_label)
            assert panel.rows or re.search(r"\[.+\]$", panel.y_label)


def test_both_drawings_show_the_same_numbers(runs):
    views, scene, _, _ = runs
    chart = hands_on_charts.way(views, scene)
    page_side, print_side = draw_plotly.figure(chart), draw_matplotlib.figure(chart)
    for i, panel in enumerate(chart.panels):
        for line, drawn in zip(panel.lines, print_side.axes[i].lines, strict=True):
            np.testing.assert_array_equal(drawn.get_ydata(), line.y)
        for line, drawn in zip(panel.lines, page_side["data"][3 * i : 3 * i + 3], strict=True):
            np.testing.assert_allclose(drawn["y"], line.y, rtol=1e-4)
            assert drawn["name"] == line.label


def test_a_report_is_made_again_from_the_folder_alone(folder, page, tmp_path):
    shutil.copytree(folder, tmp_path / "moved")
    (tmp_path / "moved" / "report.html").unlink()
    shutil.rmtree(tmp_path / "moved" / "figures")
    done = CliRunner().invoke(app, ["report", str(tmp_path / "moved")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "moved" / "report.html").read_text(encoding="utf-8") == page
    assert len(list((tmp_path / "moved" / "figures").iterdir())) == 2 * len(FIGURES)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "vfi compare --out"),
        ("no json", "expected JSON"),
        ("{}", "not results"),
        ('{"command": "", "results": []}', "no runs"),
        ('{"command": "", "results": [{"robot": 1}]}', "not results"),
    ],
)
def test_a_folder_that_is_none_is_refused_by_name(tmp_path, text, words):
    if text is not None:
        (tmp_path / "comparison.json").write_text(text)
    with pytest.raises(FileError, match=words):
        load_comparison(tmp_path)
    assert CliRunner().invoke(app, ["report", str(tmp_path)]).exit_code == 2


def test_names_in_the_results_do_not_lead_out_of_the_folder(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "moved")
    file = tmp_path / "moved" / "comparison.json"
    file.write_text(file.read_text().replace('"scene": "short"', '"scene": "../../../etc/short"'))
    with pytest.raises(FileError, match=r"traces/\.\._\.\._\.\._etc_short"):
        comparison = load_comparison(tmp_path / "moved")
        comparison.trace(comparison.results[0])
