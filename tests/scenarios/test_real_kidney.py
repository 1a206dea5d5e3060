"""The hands-on scenes on a real left kidney and its vessels: files beside the project, no part of it."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from primitives import dual_quaternion as dq
from primitives.files.mesh_file import read_surface
from scenarios.analysis.trace import Trace
from scenarios.anatomy.parts import AnatomySource, build_parts
from scenarios.cli import app
from scenarios.scene_file import load_any

FOLDERS = [parent / "shared" / "data" / "kidney" for parent in Path(__file__).resolve().parents]
FOLDER = next((folder for folder in FOLDERS if folder.is_dir()), None)
pytestmark = pytest.mark.skipif(FOLDER is None, reason="no shared/data/kidney with a real kidney beside the checkout")
KIDNEY, VESSELS, STL, CLOUD = (
    (FOLDER or Path()) / name
    for name in (
        "kidney_left.ply",
        "renal_vessels_left.ply",
        "renal_vessels_left.stl",
        "renal_vessels_left_cloud.ply",
    )
)
PORT = np.array([-0.6053, -0.2203, 0.0])
DEPTH = 0.16


def source(organ=KIDNEY, vessels=VESSELS, **changes):
    files = {"organ": str(organ) if organ else "", "vessels": str(vessels) if vessels else ""}
    return AnatomySource("files", {"organ": 0.005, "vessels": 0.0035}, depth=DEPTH, **(files | changes))


def vfi(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_kidney_and_vessels_lie_under_the_port_as_they_lie_to_one_another():
    parts = build_parts(source(), PORT)
    assert list(parts) == ["organ", "vessels"]
    every = np.vstack([part.surface.vertices for part in parts.values()])
    assert every[:, 2].max() == pytest.approx(-DEPTH, abs=1e-9)
    assert parts["vessels"].surface.vertices[:, 2].mean() > parts["organ"].surface.vertices[:, 2].mean()
    (pose,) = {tuple(np.round(part.cloud.pose, 12)) for part in parts.values()}
    turn, shift = dq.rotation_matrix(np.array(pose)), dq.translation(np.array(pose))
    for file, name in ((KIDNEY, "organ"), (VESSELS, "vessels")):
        moved = read_surface(file).vertices @ turn.T + shift
        np.testing.assert_allclose(parts[name].surface.vertices, moved, atol=1e-10)


@pytest.mark.parametrize("name", ["organ", "vessels"])
def test_the_clouds_cover_the_real_surfaces(name):
    """Of 20 000 points anywhere on the surface, each lies in a sphere."""
    part = build_parts(source(), PORT)[name]
    rng, triangles = np.random.default_rng(3), part.surface.triangles
    areas = part.surface.areas
    corners = triangles[rng.choice(len(triangles), 20_000, p=areas / areas.sum())]
    shares = rng.dirichlet(np.ones(3), len(corners))
    points = np.einsum("ij,ijk->ik", shares, corners)
    assert part.cloud.distance(points).max() <= 0.0


def test_a_turn_turns_about_the_axis_of_the_port():
    still, turned = (build_parts(source(turn=turn), PORT)["vessels"].surface.vertices - PORT for turn in (0.0, 0.7))
    np.testing.assert_allclose(still[:, 2], turned[:, 2], atol=1e-12)
    np.testing.assert_allclose(np.hypot(*still[:, :2].T), np.hypot(*turned[:, :2].T), atol=1e-12)
    assert np.abs(still - turned).max() > 0.01


def test_the_same_vessels_from_ply_and_stl():
    """An STL has each corner once a triangle, in single precision: the same surface."""
    from_ply, from_stl = (build_parts(source(None, file), PORT)["vessels"].surface for file in (VESSELS, STL))
    assert from_stl.area == pytest.approx(from_ply.area, rel=1e-5)
    np.testing.assert_allclose(from_stl.bounds, from_ply.bounds, atol=1e-6)


def run_on(organ, vessels, *more):
    files = [*(("--organ", organ) if organ else ()), *(("--vessels", vessels) if vessels else ())]
    return vfi("run", "hands-on-tip", *files, *more, "--json")


@pytest.mark.parametrize("name", ["hands-on-tip", "hands-on-tool"])
def test_the_scenes_run_on_the_real_kidney(name):
    done = vfi("run", name, "--organ", KIDNEY, "--vessels", VESSELS, "--json")
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)
    assert found["guided_reference_port_error_m"] <= 5e-6
    assert found["clearance_m"]["between_samples"] > 0.0
    assert found["passivity_excess_J"] <= 1e-4
    assert found["contact_fraction"] > 0.0
    assert found["stopped_cycles"] == 0


def test_a_cloud_with_gaps_is_refused_with_its_name_or_filled():
    refused = run_on(KIDNEY, CLOUD)
    assert refused.exit_code == 2
    assert CLOUD.name in refused.output
    assert "gap" in refused.output and "--fill-gaps" in refused.output
    filled = run_on(KIDNEY, CLOUD, "--fill-gaps")
    assert filled.exit_code == 0, filled.output
    (found,) = json.loads(filled.stdout)
    assert found["clearance_m"]["between_samples"] > 0.0


def test_metres_taken_for_millimetres_are_refused():
    wrong = run_on(KIDNEY, VESSELS, "--unit", "mm")
    assert wrong.exit_code == 2
    assert KIDNEY.name in wrong.output and "m" in wrong.output
    assert "Traceback" not in wrong.output


def test_an_organ_alone_leaves_the_forbidden_vessels_out():
    alone = run_on(KIDNEY, None)
    assert alone.exit_code == 2
    assert 'is about its part "vessels", not among the files; give --vessels too' in alone.output
    vessels = run_on(None, VESSELS)
    assert vessels.exit_code == 0, vessels.output


def test_the_trace_of_such_a_run_names_the_files_by_their_whole_paths(tmp_path, monkeypatch):
    monkeypatch.chdir(FOLDER)
    out = tmp_path / "out"
    done = vfi("run", "hands-on-tip", "--organ", KIDNEY.name, "--vessels", VESSELS.name, "--out", out)
    assert done.exit_code == 0, done.output
    header = Trace.load(out / "hands-on-tip-lwr4plus-kinematic.mcap").header
    file = tmp_path / "resolved.yaml"
    file.write_text(header["resolved_scene"], encoding="utf-8")
    anatomy = load_any(file).anatomy
    for named, file in ((anatomy.organ, KIDNEY), (anatomy.vessels, VESSELS)):
        assert Path(named).is_absolute()
        assert Path(named).samefile(file)
