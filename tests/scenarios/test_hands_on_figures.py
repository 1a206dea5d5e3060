"""The admittance paper's figures: what is drawn is what the trace holds, and no panel stays empty."""

from functools import cache

import numpy as np
import pytest

from primitives.constraint import ConstraintSet
from scenarios.analysis import hands_on_figures as figures
from scenarios.analysis.hands_on_metrics import clearance, port_offset
from scenarios.analysis.tool_poses import shaft_lines
from scenarios.anatomy.parts import build_parts
from scenarios.hands_on.run import run_hands_on
from scenarios.scene_file import load_any

each = pytest.mark.parametrize(("name", "robot"), [("bowl-tip", "lwr4plus"), ("hands-on-tool", "neuro8")])


@cache
def done(name, robot):
    """A run that ends in contact, its scene and its anatomy."""
    scene = load_any(name, robot).with_changes(duration=8.5)
    parts = build_parts(scene.anatomy, np.array(scene.port))
    return run_hands_on(scene, parts=parts), scene, parts


def curve(axes, label):
    return next(line for line in axes.lines if line.get_label() == label)


def assert_drawn(line, t, values):
    """The curve's points are samples of these values, the extremes and both ends among them."""
    x, y = line.get_xdata(), line.get_ydata()
    place = np.searchsorted(t, x)
    np.testing.assert_array_equal(t[place], x)
    np.testing.assert_allclose(values[place], y, rtol=1e-9, atol=1e-9)
    assert (min(y), max(y)) == (pytest.approx(values.min(), abs=1e-9), pytest.approx(values.max(), abs=1e-9))
    assert (x[0], x[-1]) == (t[0], t[-1])


def panels_with_data(figure):
    return [any(len(line.get_xdata()) > 2 for line in axes.lines) for axes in figure.axes]


@each
def test_the_curves_over_time_are_those_of_the_trace(name, robot):
    trace, scene, parts = done(name, robot)
    figure = figures.over_time(trace, scene, parts)
    offset, distance, repulsion, hand = figure.axes
    assert panels_with_data(figure) == [True] * 4
    ends, axes = shaft_lines(scene, scene.build_robot(), trace)
    assert_drawn(offset.lines[0], trace.t, 1e6 * port_offset(np.array(scene.port), ends, axes))
    for region in scene.regions:
        safe = parts[region.second.name].cloud.radius + region.safe_distance
        alone = scene.with_changes(constraints=ConstraintSet([region]))
        from_points = 1e3 * (clearance(alone, scene.build_robot(), parts, trace["plant_q"]) + safe)
        assert_drawn(curve(distance, f"to {region.name}"), trace.t, from_points)
        assert curve(distance, f"limit of {region.name}").get_ydata()[0] == pytest.approx(1e3 * safe)
    reach = curve(distance, "repulsion begins").get_ydata()[0]
    assert reach == pytest.approx(1e3 * (safe + scene.parameters.d_0))
    assert distance.get_ylim()[1] > reach, "the range is in view"
    assert_drawn(curve(repulsion, "force along the tool [N]"), trace.t, trace["free_repulsion"][:, 0])
    assert_drawn(curve(repulsion, "y [Nm]"), trace.t, trace["free_repulsion"][:, 2])
    assert_drawn(curve(hand, "force, z [N]"), trace.t, trace["hand_wrench"][:, 2])
    assert np.abs(trace["free_repulsion"]).max() > 0.0


@each
def test_the_port_error_of_the_reference_is_drawn_in_micrometres(name, robot):
    trace, _, _ = done(name, robot)
    (axes,) = figures.port_reference(trace).axes
    assert_drawn(axes.lines[0], trace.t, 1e6 * np.linalg.norm(trace["x_c"], axis=1))


@each
def test_the_damping_drawn_is_that_of_the_run(name, robot):
    """D_c + D_v + D_r of the figure is the diagonal that damped each cycle."""
    trace, scene, _ = done(name, robot)
    figure = figures.damping(trace, scene)
    assert panels_with_data(figure) == [True, True]
    for i, axes in enumerate(figure.axes):
        speed, near = (curve(axes, label) for label in ("at low speed, D_v", "near the region, D_r"))
        at = np.intersect1d(speed.get_xdata(), near.get_xdata())
        total = sum(np.interp(at, line.get_xdata(), line.get_ydata()) for line in (speed, near))
        k = np.searchsorted(trace.t, at)
        np.testing.assert_allclose(total, trace["damping"][k, i] - scene.parameters.D_c[i], rtol=1e-9)
        assert max(near.get_ydata()) > 0.0


@each
def test_the_tools_traces_stand_above_the_anatomy(name, robot):
    trace, scene, parts = done(name, robot)
    (space,) = figures.traces_in_space(trace, scene, parts).axes
    port = np.array(scene.port)
    assert len(space.lines) == figures.SHOWN_TRACES + 1
    ends, _ = shaft_lines(scene, scene.build_robot(), trace)
    path = np.array(space.lines[-1].get_data_3d()).T
    relative = 1e3 * (ends - port)
    np.testing.assert_allclose(path[[0, -1]], relative[[0, -1]], atol=1e-9)
    assert path[:, 2].min() == pytest.approx(relative[:, 2].min())
    for line in space.lines[:-1]:
        first, last = np.array(line.get_data_3d()).T
        assert np.linalg.norm(relative - first, axis=1).min() < 1e-9
        away = np.linalg.norm(np.cross(first, last - first)) / np.linalg.norm(last - first)
        assert away < 0.1, "the tool goes through the port"
    shown = {c.get_label(): np.array(c._offsets3d).T for c in space.collections}
    forbidden = {region.second.name for region in scene.regions}
    labels = {f"{part} (forbidden)" if part in forbidden else part for part in parts}
    assert set(shown) == {*labels, "port"}
    for part in parts:
        label = f"{part} (forbidden)" if part in forbidden else part
        points = 1e3 * (parts[part].cloud.world_points - port)
        assert 0 < len(shown[label]) <= figures.SHOWN_POINTS + 1
        assert np.linalg.norm(points[None] - shown[label][:20, None], axis=2).min(axis=1).max() < 1e-9
    limits = np.array([space.get_xlim(), space.get_ylim(), space.get_zlim()])
    every = np.vstack([path, *shown.values()])
    assert (every.min(axis=0) >= limits[:, 0]).all() and (every.max(axis=0) <= limits[:, 1]).all()


@each
def test_files_are_png_and_svg_and_repeat_to_the_byte(tmp_path, name, robot):
    trace, scene, parts = done(name, robot)
    files = figures.draw_hands_on(trace, scene, parts, tmp_path)
    numbers = ("figure7-traces", "figure7-time", "figure8-port", "figure9-damping")
    if name.endswith("tool"):
        numbers = ("figure10-traces", "figure10-time", "figure8-port", "figure11-damping")
    stem = f"{name}-{robot}-kinematic"
    assert {f.name for f in files} == {f"{stem}-{number}.{s}" for number in numbers for s in ("png", "svg")}
    assert all(f.read_bytes().startswith((b"\x89PNG", b"<?xml")) for f in files)
    first = {f: f.read_bytes() for f in files if f.suffix == ".png"}
    figures.draw_hands_on(trace, scene, parts, tmp_path)
    assert all(f.read_bytes() == content for f, content in first.items())


def test_a_scene_in_which_nothing_is_forbidden_is_drawn_too(tmp_path):
    _, scene, parts = done("bowl-tip", "lwr4plus")
    free = scene.with_changes(constraints=scene.constraints.enforcing([]), duration=0.1)
    trace = run_hands_on(free, parts=parts)
    assert len(figures.draw_hands_on(trace, free, parts, tmp_path)) == 8
    distance = figures.over_time(trace, free, parts).axes[1]
    assert not distance.lines
    assert [text.get_text() for text in distance.texts] == ["nothing is forbidden"]
