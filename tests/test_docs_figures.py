"""The explanatory figures of the documentation: as the code draws them today, and what it draws is right."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from docs.figures import a2_forbidden_region as a2
from docs.figures import a3_potential as a3
from docs.figures import a5_damping as a5
from docs.figures import v1_inequality as v1
from docs.figures.__main__ import FIGURES
from docs.figures.drawing import FOLDER, recorded, write
from scenarios.anatomy import kidney

LARGEST = 200_000
"""Bytes of a picture."""


@cache
def drawn_by(figure):
    return figure.curves()


@pytest.fixture(params=FIGURES, ids=lambda figure: figure.NAME)
def figure(request):
    return request.param


def test_picture_shows_what_the_code_computes_today(figure):
    path = FOLDER / f"{figure.NAME}.svg"
    fresh, kept = drawn_by(figure), recorded(path)
    assert fresh.keys() == kept.keys()
    for name, values in fresh.items():
        np.testing.assert_allclose(kept[name], values, rtol=1e-5, atol=1e-9, err_msg=f"{name}: draw docs.figures anew")
    assert path.stat().st_size < LARGEST


def test_drawing_holds_its_numbers_and_units(figure, tmp_path):
    drawn, path = figure.draw(drawn_by(figure)), tmp_path / "figure.svg"
    assert isinstance(drawn, Figure)
    for axes in drawn.axes:
        labelled = [text for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
        assert labelled and all("[" in text for text in labelled), labelled
    write(drawn, drawn_by(figure), path)
    again = recorded(path)
    assert all(np.allclose(again[k], v, rtol=1e-5, equal_nan=True) for k, v in drawn_by(figure).items())
    first = path.read_bytes()
    write(figure.draw(drawn_by(figure)), drawn_by(figure), path)
    assert path.read_bytes() == first


def test_every_picture_stands_in_a_page():
    pages = "".join(page.read_text() for page in Path(FOLDER.parent).glob("*.md"))
    assert {p.name for p in FOLDER.glob("*.svg")} == {f"{f.NAME}.svg" for f in FIGURES}
    for picture in FIGURES:
        assert f"figures/{picture.NAME}.svg" in pages


def test_rims_lie_at_their_distance_from_the_points():
    """By brute force over all points of the cloud, and the force is the sum of (11) over them."""
    drawn, points = drawn_by(a2), kidney().vessels.cloud(a2.D_C).world_points
    d_0, k = 0.0115, 0.01
    for name, offset, slack in (("surface", 0.0, 1e-4), ("range_end", d_0, 2e-4)):
        rim = drawn[name][~np.isnan(drawn[name][:, 0])]
        away = np.linalg.norm(a2._in_space(rim)[:, None] - points, axis=2).min(axis=1) - a2.D_C
        assert len(rim) > 50 and (away <= offset + 1e-9).all() and (away >= offset - slack).all()
    offsets = a2._in_space(drawn["tips"])[:, None] - points
    apart = np.linalg.norm(offsets, axis=2)
    psi = (np.minimum(apart - (d_0 + a2.D_C), 0.0) / d_0) ** 2
    stiff = 2.0 * k / (d_0**2 * (1.0 - psi)) * np.log(1.0 / (1.0 - psi))
    force = ((stiff * (d_0 + a2.D_C - apart) / apart)[..., None] * offsets).sum(axis=1)
    np.testing.assert_allclose(drawn["forces"], force[:, 1:], rtol=1e-9)


def test_every_sphere_that_is_cut_is_drawn_or_hidden_by_one_that_is():
    drawn, points = drawn_by(a2), kidney().vessels.cloud(a2.D_C).world_points
    height = points[:, 0] - a2.CUT
    cut = points[np.abs(height) < a2.D_C]
    radius = np.sqrt(a2.D_C**2 - (cut[:, 0] - a2.CUT) ** 2)
    apart = np.linalg.norm(cut[:, None, 1:] - drawn["spheres"][None, :, :2], axis=2)
    assert (apart + radius[:, None] <= drawn["spheres"][None, :, 2] + 1e-12).any(axis=1).all()


def test_potential_and_force_are_9_and_11_to_13():
    drawn, d_0 = drawn_by(a3), 0.0115
    psi = np.minimum((drawn["distance"] - (d_0 + a3.D_C)) / d_0, 0.0) ** 2
    for k, potential, force in zip(a3.GAINS, drawn["potential"], drawn["force"], strict=True):
        logarithm = np.log(1.0 / (1.0 - psi))
        np.testing.assert_allclose(potential, 0.5 * k * logarithm**2, rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(force, 2.0 * k / (d_0 * (1.0 - psi)) * logarithm * np.sqrt(psi), rtol=1e-9)


def test_damping_is_44_and_45_with_table_1():
    drawn = drawn_by(a5)
    for name, expected in (
        ("D_v_along", 25.0 * np.exp(-22.0 * drawn["speed"])),
        ("D_v_about", 20.0 * np.exp(-19.0 * drawn["turn"])),
        ("D_r_along", 60.0 * (1.0 - np.exp(-0.01 * drawn["force"] ** 2))),
        ("D_r_about", 30.0 * (1.0 - np.exp(-0.2 * drawn["torque"] ** 2))),
    ):
        np.testing.assert_allclose(drawn[name], expected, rtol=1e-12, atol=1e-15)


def test_velocities_are_12_along_the_radius():
    drawn = drawn_by(v1)
    apart = np.linalg.norm(drawn["places"], axis=1)
    rate = np.minimum(-v1.ETA * (apart - v1.SAFE), v1.RECOVERY)
    np.testing.assert_allclose(drawn["velocity"], (rate / apart)[:, None] * drawn["places"], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(drawn["rate"], -v1.ETA * drawn["margin"], rtol=1e-12, atol=1e-15)
    assert (apart < v1.SAFE).any() and (apart > v1.SAFE).any()
