"""Videos of runs: what is on the stage, what a picture shows, and what happens where pictures cannot be made."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from primitives.constraint import Constraint
from primitives.elements import Line, Plane, Point, Segment
from primitives.errors import FileError, InputError, UnknownNameError
from scenarios.analysis.trace import Trace
from scenarios.cli import app
from scenarios.hands_on.run import run_hands_on
from scenarios.plants.obstacles import Cloud, Port
from scenarios.robots import robots
from scenarios.run import run
from scenarios.scene_file import load_any, load_scene
from scenarios.view import ViewError, canvas
from scenarios.view.canvas import BACKENDS, Canvas
from scenarios.view.film import CAMERAS, Film
from scenarios.view.stage import KEPT, VIOLATED, WATCHED, build_stage
from scenarios.view.video import record

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
SIZE = (160, 120)


@pytest.fixture(scope="module")
def trace() -> Trace:
    """S4 keeps C1 to C3 and violates C4, which it watches."""
    return run(load_scene("S4").with_changes(period=0.02))


@pytest.fixture
def needs_opengl() -> None:
    """Skips where no OpenGL library renders off screen, and says which packages would change that."""
    try:
        canvas.backend()
    except ViewError as error:
        pytest.skip(str(error))


@pytest.fixture
def needs_imageio() -> Any:
    pytest.importorskip("imageio_ffmpeg", reason='needs the extra "video"')
    return pytest.importorskip("imageio.v2", reason='needs the extra "video"')


def film(trace: Trace, camera: str = "tool", **options: Any) -> Film:
    return Film(trace, SIZE, CAMERAS[camera], options.get("port"), options.get("clouds", ()))


def colours(film: Film, name: str) -> set[tuple[float, ...]]:
    return {tuple(np.round(c[:3].astype(float), 6)) for c in film.model.geom_rgba[film._geoms[name]]}


# The stage


def test_the_arms_stand_as_in_the_trace(trace: Trace) -> None:
    shown = film(trace)
    robot = robots["neuro8-pair"].build()
    for k in (0, len(trace.records) // 2, len(trace.records) - 1):
        shown.scene(k)
        at = robot.kinematics(trace["q"][k])
        for frame in ("moving/tip", "moving/shaft", "parked/tip", "parked/base"):
            np.testing.assert_allclose(shown._data.body(frame).xpos, at.translation(frame), rtol=0.0, atol=1e-12)


def test_a_constraint_is_red_while_it_is_violated(trace: Trace) -> None:
    shown = film(trace)
    assert set(shown._geoms) == {"C2", "C3", "C4"}
    below = np.flatnonzero(trace.margin("C4") < -1e-5)
    assert 0 < len(below) < len(trace.records)
    shown.scene(0)
    assert colours(shown, "C2") == colours(shown, "C3") == {KEPT}
    assert colours(shown, "C4") == {WATCHED}
    for k in (below[0] - 1, below[0], below[-1]):
        shown.scene(int(k))
        assert colours(shown, "C4") == ({VIOLATED} if k in below else {WATCHED})
    heading, lines = shown.text(int(below[-1]))
    assert heading.splitlines() == ["S4", "time", "C1", "C2", "C3", "C4"]
    assert lines.splitlines()[0] == "active-set"
    assert lines.splitlines()[-1].endswith("mm violated")
    assert "violated" not in "".join(lines.splitlines()[:-1])
    assert shown.text(0)[1].splitlines()[-1].endswith("(watched)")


def test_the_path_grows_and_the_reference_is_there_from_the_beginning(trace: Trace) -> None:
    shown, last = film(trace), len(trace.records) - 1
    (path,), (wanted,) = (way for _, way in shown._paths), shown._wanted
    first, whole = shown.scene(0).ngeom, shown.scene(last).ngeom
    assert whole - first == len(path) - 1
    lines = [g for g in shown._scene.geoms[: shown._scene.ngeom] if g.type == mujoco.mjtGeom.mjGEOM_LINE]
    assert len(lines) == len(path) + len(wanted) - 2
    robot = robots["neuro8-pair"].build()
    np.testing.assert_allclose(path[-1], robot.kinematics(trace["q"][last]).translation("moving/tip"), atol=1e-12)
    np.testing.assert_allclose(wanted[-1], load_scene("S4").reference.waypoints[-1].position, atol=1e-9)


def test_each_of_two_tools_has_its_path_and_reference() -> None:
    scene = load_scene("two-arms").with_changes(duration=1.0)
    trace = run(scene)
    shown, kinematics = film(trace), scene.build_robot().kinematics(trace["q"][-1])
    for (_, path), wanted, task, reference in zip(
        shown._paths, shown._wanted, scene.tasks, scene.references, strict=True
    ):
        np.testing.assert_allclose(path[-1], kinematics.translation(task.frame), atol=1e-12)
        np.testing.assert_allclose(wanted[0], reference.waypoints[0].position, atol=1e-9)
    lines = [g for g in shown.scene(len(trace.records) - 1).geoms if g.type == mujoco.mjtGeom.mjGEOM_LINE]
    assert len(lines) >= sum(len(path) - 1 for _, path in shown._paths) + sum(len(w) - 1 for w in shown._wanted)


def test_enforced_is_what_the_run_enforced(trace: Trace) -> None:
    free = film(replace(trace, header={**trace.header, "enforced": []}))
    free.scene(0)
    assert colours(free, "C2") == {WATCHED}


@pytest.mark.parametrize("camera", CAMERAS)
def test_everything_of_interest_is_in_view(trace: Trace, camera: str) -> None:
    """The tool's path, the entry point and, for "arm", the bases project into the picture."""
    shown = film(trace, camera)
    scene = shown.scene(0)
    view = scene.camera[0]
    eye, forward, up = (np.array(v, dtype=float) for v in (view.pos, view.forward, view.up))
    right = np.cross(forward, up)
    points = [*shown._paths[0][1], np.zeros(3)]
    if camera == "arm":
        points += [shown._data.body(f"{arm}/base").xpos for arm in ("moving", "parked")]
    half = np.tan(0.5 * np.radians(shown.model.vis.global_.fovy))
    for point in points:
        away = np.asarray(point) - eye
        depth = away @ forward
        assert depth > 0.005
        assert abs(away @ up) < half * depth
        assert abs(away @ right) < half * depth * SIZE[0] / SIZE[1]


def placed(constraint: Constraint) -> tuple[Any, Any, list[int]]:
    entry = robots["neuro8"]
    model, geoms = build_stage(
        entry,
        entry.build(),
        constraints=[constraint],
        centre=np.array([0.0, 0.0, -0.05]),
        reach=0.1,
        port=None,
        clouds=(),
        size=SIZE,
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data, geoms.get(constraint.name, [])


def test_elements_stand_where_the_constraint_acts() -> None:
    """A plane is a sheet at the safe distance on the side to keep, a line a cylinder, a point a ring or a sphere."""
    tip, shaft = Point.at([0, 0, 0], frame="tip"), Line.z_axis("shaft")
    normal = np.array([0.6, 0.0, 0.8])
    for keep, side in (("outside", 1.0), ("inside", -1.0)):
        c = Constraint("c", tip, Plane.through(-0.08 * normal, normal), keep, 0.01)  # type: ignore[arg-type]
        model, data, (sheet,) = placed(c)
        assert data.geom_xpos[sheet] @ normal == pytest.approx(-0.08 + side * 0.01, abs=1e-12)
        np.testing.assert_allclose(np.abs(data.geom_xmat[sheet].reshape(3, 3)[:, 2] @ normal), 1.0, atol=1e-12)
    model, data, (cylinder,) = placed(Constraint("c", tip, Line.through([0.01, 0, 0], [0, 0, 1]), "inside", 0.014))
    assert model.geom_type[cylinder] == mujoco.mjtGeom.mjGEOM_CYLINDER
    assert model.geom_size[cylinder, :2].tolist() == pytest.approx([0.014, 0.1])
    np.testing.assert_allclose(data.geom_xpos[cylinder], [0.01, 0.0, -0.05], atol=1e-12)
    model, data, chords = placed(Constraint("c", shaft, Point.at([0.01, 0.02, 0.0]), "inside", 0.014))
    assert len(chords) >= 12
    np.testing.assert_allclose(np.linalg.norm(data.geom_xpos[chords] - [0.01, 0.02, 0.0], axis=1), 0.014, rtol=1e-9)
    model, data, (sphere,) = placed(Constraint("c", tip, Point.at([0.01, 0.02, 0.0]), "outside", 0.014))
    assert model.geom_size[sphere, 0] == 0.014
    segment = Segment.between([0, 0, 0], [0, 0.03, 0])
    model, data, (capsule,) = placed(Constraint("c", tip, segment, "outside", 0.004))
    assert model.geom_size[capsule, :2].tolist() == pytest.approx([0.004, 0.015])
    np.testing.assert_allclose(data.geom_xpos[capsule], [0.0, 0.015, 0.0], atol=1e-12)
    assert placed(Constraint("c", shaft, Line.z_axis("base"), "outside", 0.004))[2] == []


def test_nothing_on_the_stage_is_touched_by_what_is_only_shown() -> None:
    model, _, geoms = placed(Constraint("c", Line.z_axis("shaft"), Point.at([0, 0, 0]), "inside", 0.014))
    assert not model.geom_contype[geoms].any() and not model.geom_conaffinity[geoms].any()


def test_port_and_clouds_are_on_the_stage(trace: Trace) -> None:
    points = np.random.default_rng(0).uniform(-0.01, 0.01, (50, 3)) - [0, 0, 0.09]
    shown = film(trace, port=Port([0, 0, 0.3], 0.01), clouds=[Cloud("organ", points, 0.002, (0.1, 0.8, 0.1, 1.0))])
    scene = shown.scene(0)
    green = [g for g in scene.geoms[: scene.ngeom] if np.allclose(g.rgba[:3], [0.1, 0.8, 0.1])]
    assert len(green) == 50
    np.testing.assert_allclose(shown._data.body("port").xpos, [0, 0, 0.3], atol=1e-12)
    plain = film(trace)
    assert shown._camera.distance > plain._camera.distance, "the port is in view too"


ONE_ARM = """
name: one-arm
summary: the tip goes down through the port
robot: lwr4plus
group: all
start: [0.3490658503988659, 0.8726646259971648, 0, -1.2217304763960306, 0, 1.0471975511965976, 0]
constraints:
  - name: port
    first: {kind: line, frame: tip}
    second: {kind: point, position: [-0.6053, -0.2203, 0]}
    keep: inside
    safe_distance: 0.004
task: {frame: tip, gain: 5}
reference: {segment: 0.4, waypoints: [{position: [-0.6053, -0.2203, -0.15]}]}
period: 0.02
duration: 0.4
"""


def test_a_single_arm_stands_on_the_stage_too(tmp_path: Path) -> None:
    file = tmp_path / "one-arm.yaml"
    file.write_text(ONE_ARM)
    trace = run(load_scene(file))
    shown = film(trace, "arm", port=Port([-0.6053, -0.2203, 0.0], 0.005))
    shown.scene(len(trace.records) - 1)
    at = robots["lwr4plus"].build().kinematics(trace["q"][-1])
    np.testing.assert_allclose(shown._data.body("tip").xpos, at.translation("tip"), rtol=0.0, atol=1e-12)
    assert colours(shown, "port") == {KEPT}
    ((_, path),) = shown._paths
    assert path[-1, 2] < path[0, 2]


# Pictures


@pytest.mark.usefixtures("needs_opengl")
def test_a_picture_shows_the_arm_and_what_is_violated(trace: Trace) -> None:
    """Pixels: teal before the plane is crossed, red after, more than a tenth of the picture each."""
    shown = film(trace)
    worst = int(np.argmin(trace.margin("C4")))
    with Canvas(shown.model, *SIZE) as drawn:
        before = drawn.draw(shown.scene(0), "", "").astype(int)
        after = drawn.draw(shown.scene(worst), "", "").astype(int)
        again = drawn.draw(shown.scene(0), "", "").astype(int)
    assert before.shape == (120, 160, 3)
    assert np.array_equal(before, again)

    def red(picture: NDArray[np.int_]) -> float:
        return float(np.mean((picture[..., 0] > 1.5 * picture[..., 1]) & (picture[..., 0] > 1.5 * picture[..., 2])))

    assert red(before) < 0.02
    assert red(after) > 0.1


@pytest.mark.usefixtures("needs_opengl")
def test_a_video_has_the_frames_and_the_size_that_were_asked_for(
    trace: Trace, tmp_path: Path, needs_imageio: Any
) -> None:
    out, shares = tmp_path / "s4.mp4", []
    count = record(trace, out, fps=1.0, width=320, height=180, progress=shares.append)
    assert count == 16  # the last cycle begins at 14.98 s, and the frame nearest to it shows it
    assert shares == pytest.approx(np.arange(1, 17) / 16.0)
    assert [p.name for p in tmp_path.iterdir()] == ["s4.mp4"]
    with needs_imageio.get_reader(out) as reader:
        frames = list(reader.iter_data())
        assert reader.get_meta_data()["fps"] == 1.0
    assert len(frames) == 16
    assert frames[0].shape == (180, 320, 3)
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 60


@pytest.mark.usefixtures("needs_opengl", "needs_imageio")
def test_the_command_makes_a_video(trace: Trace, tmp_path: Path) -> None:
    run(load_scene("S5").with_changes(duration=0.2), out=tmp_path / "S5.mcap")
    out = tmp_path / "run.mp4"
    options = ["--fps", "10", "--width", "64", "--height", "48", "--camera", "arm"]
    done = CliRunner().invoke(app, ["video", str(tmp_path / "S5.mcap"), "-o", str(out), *options])
    assert done.exit_code == 0, done.output
    assert "run.mp4: 3 frames, 64 x 48" in done.output.replace("\n", "")
    assert out.stat().st_size > 500


# Where it cannot be


def test_without_opengl_the_command_names_the_packages(
    trace: Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, needs_imageio: Any
) -> None:
    run(load_scene("S5").with_changes(duration=0.1), out=tmp_path / "S5.mcap")
    monkeypatch.setattr(canvas, "_failure", lambda name: f"no {name} here")
    done = CliRunner().invoke(app, ["video", str(tmp_path / "S5.mcap"), "-o", str(tmp_path / "run.mp4")])
    assert done.exit_code == 2
    for word in ("libegl1", "libgl1", "libosmesa6", "apt-get install", "no "):
        assert word in done.output
    assert "Traceback" not in done.output
    assert not (tmp_path / "run.mp4").exists()


@pytest.mark.parametrize(
    ("environment", "tried"),
    [
        ({}, BACKENDS),
        ({"MUJOCO_GL": "osmesa"}, ("osmesa",)),
        ({"MUJOCO_GL": "glfw"}, BACKENDS),
        ({"MUJOCO_GL": "egl", "PYOPENGL_PLATFORM": "osmesa"}, ("osmesa",)),
    ],
)
def test_back_ends_are_tried_in_order(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], tried: tuple[str, ...]
) -> None:
    for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(canvas, "BACKENDS", ("egl", "osmesa"))
    asked: list[str] = []
    monkeypatch.setattr(canvas, "_failure", lambda name: asked.append(name) or "no")  # type: ignore[func-returns-value]
    with pytest.raises(ViewError, match="no OpenGL library renders off screen here"):
        canvas.backend()
    expected = ("egl", "osmesa") if tried is BACKENDS else tried
    assert tuple(asked) == expected
    monkeypatch.setattr(canvas, "_failure", lambda name: "" if name == expected[-1] else "no")
    assert canvas.backend() == expected[-1]


def test_a_back_end_that_does_not_exist_says_why() -> None:
    assert "nothing" in canvas._failure("nothing")


@pytest.mark.parametrize("module", ["imageio.v2", "imageio_ffmpeg"])
def test_without_the_extra_the_command_says_how_to_get_it(
    trace: Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ViewError, match=r'a video takes the extra "video": pip install "active-constraints\[video\]"'):
        record(trace, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "options", "error", "words"),
    [
        ("a.mp4", {"fps": 0.0}, InputError, "frames a second: expected a number > 0"),
        ("a.mp4", {"width": 641}, InputError, "width of the video: expected an even number from 16 to 4096, got 641"),
        ("a.mp4", {"height": 8192}, InputError, "height of the video: expected an even number"),
        ("a.mp4", {"camera": "tip"}, UnknownNameError, 'unknown camera "tip".* Known: arm, front, side, tool, top'),
        ("a.gif", {}, InputError, r'expected a name that ends in ".mp4", got "a.gif"'),
        ("no/a.mp4", {}, FileError, "its folder does not exist"),
    ],
)
def test_bad_options_are_refused_before_anything_is_drawn(
    trace: Trace, tmp_path: Path, name: str, options: dict[str, Any], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        record(trace, tmp_path / name, **options)
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("needs_imageio")
def test_traces_that_cannot_be_shown_are_refused(trace: Trace, tmp_path: Path) -> None:
    other = replace(trace, header={**trace.header, "robot": "neuro8"})
    with pytest.raises(InputError, match='trace of robot "neuro8": expected cycles of the joints joint1'):
        record(other, tmp_path / "a.mp4")
    with pytest.raises(InputError, match="got 0 cycles"):
        record(replace(trace, records=trace.records[:0]), tmp_path / "a.mp4")
    with pytest.raises(UnknownNameError, match='unknown robot "arm"'):
        record(replace(trace, header={**trace.header, "robot": "arm"}), tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_no_trace_is_one_clear_line(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    file.write_text("nothing")
    done = CliRunner().invoke(app, ["video", str(file), "-o", str(tmp_path / "a.mp4")])
    assert done.exit_code == 2
    assert "not a trace of this project" in done.output.replace("\n", " ")
    done = CliRunner().invoke(app, ["video", str(tmp_path / "b.mcap"), "-o", str(tmp_path / "a.mp4")])
    assert done.exit_code == 2 and "cannot be read" in done.output.replace("\n", " ")


def test_help_of_the_command_loads_nothing_heavy() -> None:
    code = (
        "import sys\nfrom scenarios.cli import app\nfrom typer.testing import CliRunner\n"
        "assert 'RUN.mcap' in CliRunner().invoke(app, ['video', '--help']).output\n"
        "heavy = {'numba', 'mujoco', 'imageio', 'numpy', 'OpenGL'} & set(sys.modules)\nassert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, env=dict(os.environ))
    assert done.returncode == 0, done.stderr


# Hands-on runs


@pytest.fixture(scope="module", params=["lwr4plus", "neuro8"])
def led(request: pytest.FixtureRequest) -> Trace:
    """A short pull on MuJoCo, where the joints are not where the admittance wants them."""
    scene = load_any("hands-on-tip", request.param).with_changes(duration=0.3)
    return run_hands_on(scene, plant="mujoco")


def test_the_plants_joints_are_replayed_and_the_path_is_that_of_the_shafts_end(led: Trace) -> None:
    shown, shaft = film(led), led.header["shaft"]
    robot = robots[led.header["robot"]].build()
    assert not np.array_equal(led["plant_q"], led["q"])
    for k in (0, len(led.records) - 1):
        shown.scene(k)
        end = robot.kinematics(led["plant_q"][k]).translation(shaft)
        np.testing.assert_allclose(shown._data.body(shaft).xpos, end, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(shown._paths[0][1][-1], end, atol=1e-12)


def test_port_and_anatomy_stand_where_the_scene_has_them(led: Trace) -> None:
    shown = film(led)
    shown.scene(0)
    np.testing.assert_allclose(shown._data.body("port").xpos, led.header["port"], atol=1e-12)
    found = {}
    for name in ("organ", "vessels"):
        geoms = shown.model.geom_bodyid == shown.model.body(name).id
        assert np.count_nonzero(geoms) > 100
        (found[name],) = {tuple(np.round(c, 6)) for c in shown.model.geom_rgba[geoms].astype(float)}
    assert found["vessels"][0] > 2.0 * found["vessels"][1], "what is forbidden is red"
    assert found["organ"][1] > found["organ"][0], "the rest is green"


def test_only_what_hangs_beyond_the_shafts_end_is_faint(led: Trace) -> None:
    shown = film(led)
    faint = {shown.model.body(b).name for b in shown.model.geom_bodyid[shown.model.geom_rgba[:, 3] < 0.5]}
    wrist = faint - {""}
    if led.header["robot"] == "lwr4plus":
        assert not wrist
    else:
        robot = robots["neuro8"].build()
        moved, still = np.zeros(robot.n), robot.kinematics(np.zeros(robot.n))
        moved[6:] = 0.3
        turned = robot.kinematics(moved)
        assert wrist
        for body in wrist:
            assert np.abs(turned.rotation(body) - still.rotation(body)).max() > 0.1


def test_the_video_of_a_hands_on_run_by_the_command(
    led: Trace, tmp_path: Path, needs_opengl: None, needs_imageio: Any
) -> None:
    scene = load_any("hands-on-tip", led.header["robot"]).with_changes(duration=0.1)
    run_hands_on(scene, out=tmp_path / "run.mcap")
    options = ["--fps", "10", "--width", "160", "--height", "120"]
    done = CliRunner().invoke(app, ["video", str(tmp_path / "run.mcap"), "-o", str(tmp_path / "run.mp4"), *options])
    assert done.exit_code == 0, done.output
    frames = [np.asarray(frame, dtype=int) for frame in needs_imageio.get_reader(tmp_path / "run.mp4")]
    assert len(frames) >= 1
    picture = frames[0][:, 60:]
    red = (picture[..., 0] > 1.5 * picture[..., 1]) & (picture[..., 0] > 1.5 * picture[..., 2])
    assert np.count_nonzero(red) > 20, "the vessels are in the picture"
