"""A report opened in headless Chromium: every figure is drawn, nothing complains, and nothing is asked of a network."""

import json
import shutil
from base64 import b64decode
from io import BytesIO

import numpy as np
import pytest
from matplotlib import image

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed: make install")
from selenium.webdriver.chrome.service import Service  # noqa: E402
from selenium.webdriver.support.ui import WebDriverWait  # noqa: E402

from tests.scenarios.comparisons import FIGURES, OF_KINDS, compared, compared_in_a_hurry  # noqa: E402

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = [
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="no chromium with its driver: make browser"),
    pytest.mark.slow,
]
LEGEND = 40
"""Pixels of a figure in space that its legend takes."""
SWITCHES = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=1200,1400",
)
DRAWN = """
return [...document.querySelectorAll('.plot')].map(plot => ({
  name: plot.id,
  curves: plot.querySelectorAll('.scatterlayer .trace').length,
  wanted: JSON.parse(document.querySelector(`[data-for="${plot.id}"]`).textContent).data.length,
  space: plot.querySelectorAll('.gl-container canvas').length,
  height: plot.getBoundingClientRect().height,
}))"""
PICTURE = """
const done = arguments[arguments.length - 1];
const plot = document.getElementById(arguments[0]);
Plotly.toImage(plot, {format: 'png', width: 500, height: 400}).then(done, error => done('error ' + error));"""
"""What a figure looks like, as the data of a PNG."""


@pytest.fixture(scope="module")
def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for switch in SWITCHES:
        options.add_argument(switch)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_page_load_timeout(180)
    driver.set_script_timeout(120)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """The browser with a report in it, all figures drawn."""
    browser.get((compared(tmp_path_factory.mktemp("report")) / "report.html").as_uri())
    _wait_for_the_last_figure(browser)
    return browser


def _wait_for_the_last_figure(browser):
    last = "const p = document.querySelectorAll('.plot'); return p[p.length - 1].querySelectorAll('.main-svg').length"
    WebDriverWait(browser, 120).until(lambda driver: driver.execute_script(last))


def test_every_figure_is_drawn_with_all_its_curves(page):
    drawn = page.execute_script(DRAWN)
    assert len(drawn) == len(FIGURES)
    for plot in drawn:
        assert plot["height"] > 200.0
        if plot["name"].endswith("-space"):
            assert plot["space"] > 0, "WebGL drew it"
        else:
            assert plot["curves"] == plot["wanted"] > 0, plot


def test_the_figure_in_space_shows_cloud_and_paths(page):
    """Not blank: the cloud's colour and those of the paths are in the picture."""
    data = page.execute_async_script(PICTURE, "plot-lwr4plus-space")
    assert data.startswith("data:image/png;base64,"), data[:200]
    pixels = image.imread(BytesIO(b64decode(data.split(",")[1])))[..., :3]
    coloured = np.ptp(pixels, axis=2) > 0.15
    assert np.count_nonzero(coloured) > 500


def test_nothing_complains_and_nothing_asks_a_network(page):
    complaints = [e for e in page.get_log("browser") if e["level"] == "SEVERE"]
    assert not complaints
    messages = [json.loads(entry["message"])["message"] for entry in page.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    outside = [url for url in asked if not url.startswith(("file:", "data:", "blob:"))]
    assert asked and not outside
    assert sum(url.startswith("file:") for url in asked) == 1, "the page is one file"


def test_a_click_on_a_name_hides_its_curves(page):
    script = "return document.querySelectorAll('#plot-lwr4plus-way .scatterlayer .trace').length"
    before = page.execute_script(script)
    page.execute_script("Plotly.restyle('plot-lwr4plus-way', {visible: 'legendonly'}, [0, 3, 6])")
    assert page.execute_script(script) == before - 3


def test_a_report_of_a_scene_by_hand(browser, tmp_path):
    folder = compared_in_a_hurry("S5-hand", tmp_path, "--enforcement", "none,vfi")
    browser.get_log("browser")
    browser.get((folder / "report.html").as_uri())
    _wait_for_the_last_figure(browser)
    drawn = browser.execute_script(DRAWN)
    assert [plot["name"] for plot in drawn] == [f"plot-neuro8-pair-{name}" for name in OF_KINDS["S5-hand"]]
    for plot in drawn:
        assert plot["space"] > 0 if plot["name"].endswith("-space") else plot["curves"] == plot["wanted"] > 0, plot
    assert not [e for e in browser.get_log("browser") if e["level"] == "SEVERE"]
    data = browser.execute_async_script(PICTURE, "plot-neuro8-pair-space")
    pixels = image.imread(BytesIO(b64decode(data.split(",")[1])))[..., :3]
    coloured = np.ptp(pixels[LEGEND:], axis=2) > 0.3
    assert np.count_nonzero(coloured) > 100, "the path of vfi is coloured"
    edges = coloured[-1], coloured[:, 0], coloured[:, -1]
    assert not any(edge.any() for edge in edges), "and within the picture"
