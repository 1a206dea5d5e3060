"""A small comparison with its report, for tests."""

from dataclasses import replace
from pathlib import Path

from typer.testing import CliRunner

from scenarios.cli import app
from scenarios.scene_file import dump_scene, load_any

SCENE = """
name: short
summary: "a push <into> a bowl & back"
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
duration: 1.6
"""

FIGURES = ("spread", "space", "margins", "forces", "force-clearance", "ledger", "way")
"""Of a report with several seeds, in its order."""


def compared(place: Path) -> Path:
    """The folder that `vfi compare` makes of three enforcements and two seeds."""
    (place / "short.yaml").write_text(SCENE)
    arguments = ["compare", str(place / "short.yaml"), "--enforcement", "none,admittance,vfi", "--seeds", "2"]
    done = CliRunner().invoke(app, [*arguments, "--out", str(place / "out")])
    assert done.exit_code == 0, done.output
    assert "report.html" in done.stdout
    return place / "out"


OF_KINDS = {
    "S5": ("margins", "tracking", "space", "motion"),
    "S5-hand": ("margins", "tracking", "space", "forces", "ledger", "motion"),
    "two-arms": ("margins", "tracking", "space", "motion"),
}
"""Figures of reports of scenes along a trajectory, with one seed, in their order."""


def hurried(name: str, place: Path) -> str:
    """A file with a scene of the project that is led through its first second four times as fast."""
    scene = load_any(name)
    references = tuple(replace(r, segment=r.segment / 4.0) for r in scene.references)
    changed = scene.with_changes(reference=references, duration=1.2)
    file = place / f"{name}.yaml"
    file.write_text(dump_scene(changed))
    return str(file)


def compared_in_a_hurry(name: str, place: Path, *options: str) -> Path:
    """The folder that `vfi compare` makes of such a scene."""
    done = CliRunner().invoke(app, ["compare", hurried(name, place), *options, "--out", str(place / "out")])
    assert done.exit_code == 0, done.output
    return place / "out"
