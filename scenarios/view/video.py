"""A video of a run from its trace: the arms as they moved, the tool's path, and the constraints, red where violated."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, NamedTuple

import mujoco
import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array, known, number
from primitives.elements import WORLD
from primitives.errors import FileError, InputError
from primitives.kinematics import snapshot, world_first
from primitives.robot import Robot
from scenarios.analysis.metrics import VIOLATED as LEAST_MARGIN
from scenarios.analysis.trace import Trace
from scenarios.plants.obstacles import Cloud, Port
from scenarios.robots import RobotEntry, robots
from scenarios.scene import Scene
from scenarios.scene_file import load_scene
from scenarios.view import ViewError
from scenarios.view.canvas import Canvas
from scenarios.view.stage import KEPT, VIOLATED, WATCHED, build_stage


class Camera(NamedTuple):
    """Where pictures are taken from: angles in degrees as MuJoCo counts them, and whether all of the arm is in view."""

    azimuth: float
    elevation: float
    whole_arm: bool = False


CAMERAS: Mapping[str, Camera] = MappingProxyType(
    {
        "tool": Camera(120.0, -18.0),
        "side": Camera(90.0, 0.0),
        "front": Camera(180.0, 0.0),
        "top": Camera(90.0, -89.0),
        "arm": Camera(120.0, -18.0, whole_arm=True),
    }
)
"""By the names that `record` and the command line take; all but "arm" look at the tool's tip and the port."""

SMALLEST = 0.02
"""Least radius of what is looked at, metres."""
MARGIN = 1.25
"""How much farther than necessary the camera stands."""
PATH_PIECES = 400
"""Pieces that the tool's whole path is drawn with."""
PATH_PIXELS = 3.0
PATH_COLOUR, REFERENCE_COLOUR = (1.0, 0.55, 0.05, 1.0), (0.25, 0.3, 0.4, 0.5)
GLOW = 0.6
"""Share of a path's colour that no light is needed for."""
LARGEST = 4096
"""Pixels a side."""


def record(
    trace: Trace,
    out: str | Path,
    *,
    fps: float = 30.0,
    width: int = 1280,
    height: int = 720,
    camera: str = "tool",
    port: Port | None = None,
    clouds: Sequence[Cloud] = (),
    progress: Callable[[float], None] | None = None,
) -> int:
    """Write a video of a run in real time; returns the number of its frames.

    Parameters
    ----------
    trace : of a run on a robot with MJCF files. Its q are shown; nothing is simulated.
    out : file to write, .mp4; it appears when it is complete.
    fps : frames a second. width, height : pixels, even. camera : one of `CAMERAS`.
    port, clouds : shown beside what the constraints of the scene declare.
    progress : called with the share that is done, once a frame.

    Raises
    ------
    InputError, UnknownNameError : an option out of range, a trace without cycles or of another robot.
    FileError : the file cannot be written. ModelError : the robot has no MJCF.
    ViewError : no OpenGL library, or the extra "video" is not installed.
    """
    out = Path(out)
    fps = number(fps, "frames a second", positive=True)
    for name, value in (("width", width), ("height", height)):
        if not 16 <= value <= LARGEST or value % 2:
            raise InputError(f"{name} of the video: expected an even number from 16 to {LARGEST}, got {value}")
    known("camera", camera, CAMERAS)
    if out.suffix.lower() != ".mp4":
        raise InputError(f'video file: expected a name that ends in ".mp4", got "{out.name}"')
    if not out.parent.is_dir():
        raise FileError(str(out), "cannot be written: its folder does not exist; make it first")
    try:
        imageio = import_module("imageio.v2")
        import_module("imageio_ffmpeg")
    except ImportError as error:
        raise ViewError(f'a video takes the extra "video": pip install "active-constraints[video]" ({error})') from None
    film = _Film(trace, (width, height), CAMERAS[camera], port, clouds)
    moments = np.arange(trace.t[0], trace.t[-1] + 0.5 / fps, 1.0 / fps)
    part = out.with_name(f".{out.stem}.part.mp4")
    try:
        with (
            Canvas(film.model, width, height) as canvas,
            imageio.get_writer(part, fps=fps, codec="libx264", quality=8, macro_block_size=2) as writer,
        ):
            for i, t in enumerate(moments):
                k = int(np.searchsorted(trace.t, t + 1e-9, side="right")) - 1
                writer.append_data(canvas.draw(film.scene(k), *film.text(k)))
                if progress is not None:
                    progress((i + 1) / len(moments))
        part.replace(out)
    except OSError as error:
        raise FileError(str(out), f"the video cannot be written ({' '.join(str(error).split())})") from None
    finally:
        part.unlink(missing_ok=True)
    return len(moments)


def _resolved(trace: Trace) -> Scene:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "resolved.yaml"
        file.write_text(trace.header["resolved_scene"], encoding="utf-8")
        return load_scene(file)


class _Film:
    """The MuJoCo scene of any cycle of a trace."""

    def __init__(self, trace: Trace, size: tuple[int, int], camera: Camera, port: Port | None, clouds: Sequence[Cloud]):
        self._trace = trace
        entry: RobotEntry = robots[trace.header["robot"]]
        robot, q = entry.build(), trace["q"]
        if len(q) == 0 or list(robot.joints) != list(trace.header["joints"]):
            raise InputError(
                f'trace of robot "{entry.name}": expected cycles of the joints {", ".join(robot.joints)}, got {len(q)} '
                f"cycles of {', '.join(trace.header['joints'])}"
            )
        scene = _resolved(trace)
        self._enforced = {c.name: c.enforced for c in scene.constraints}
        self._keep = np.unique(np.linspace(0, len(q) - 1, min(len(q), PATH_PIECES + 1)).astype(int))
        self._path = _path(robot, scene.task.frame or robot.tip, q[self._keep])
        self._wanted = _wanted(trace, self._keep)
        seen = [self._path, *([self._wanted] if len(self._wanted) else [])]
        seen += [c.second.geometry[None, :3] for c in scene.constraints if c.second.kind == "point"]
        seen += [np.atleast_2d(np.array(port.centre, dtype=float))] if port is not None else []
        seen += [np.array(cloud.points, dtype=float) for cloud in clouds]
        centre, reach = _ball(np.vstack(seen))
        self.model, self._geoms = build_stage(
            entry,
            robot,
            constraints=scene.constraints,
            centre=centre,
            reach=reach,
            port=port,
            clouds=clouds,
            size=size,
        )
        self._data = mujoco.MjData(self.model)
        self._places = [int(self.model.joint(joint).qposadr[0]) for joint in robot.joints]
        self._camera, self._options = mujoco.MjvCamera(), mujoco.MjvOption()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._camera.azimuth, self._camera.elevation = camera.azimuth, camera.elevation
        if camera.whole_arm:
            k = robot.kinematics(q[0])
            centre, reach = _ball(np.vstack([*seen, *(k.translation(f) for f in robot.frames if f != WORLD)]))
        self._camera.lookat[:] = centre
        half = 0.5 * np.radians(float(self.model.vis.global_.fovy))
        self._camera.distance = MARGIN * reach / np.sin(half) / min(1.0, size[0] / size[1])
        self._scene = mujoco.MjvScene(self.model, maxgeom=self.model.ngeom + 3 * PATH_PIECES + 100)

    def scene(self, k: int) -> Any:
        """The `mujoco.MjvScene` of cycle k."""
        self._data.qpos[self._places] = self._trace["q"][k]
        for name, geoms in self._geoms.items():
            kept = KEPT if self._enforced[name] else WATCHED
            self.model.geom_rgba[geoms, :3] = VIOLATED if self._trace.margin(name)[k] < LEAST_MARGIN else kept
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_camlight(self.model, self._data)
        mujoco.mjv_updateScene(
            self.model,
            self._data,
            self._options,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        self._draw(self._wanted, REFERENCE_COLOUR)
        self._draw(self._path[: int(np.searchsorted(self._keep, k, side="right"))], PATH_COLOUR)
        return self._scene

    def text(self, k: int) -> tuple[str, str]:
        """Two columns: what is measured, and how much of it there is at cycle k."""
        header, rows = self._trace.header, [("time", f"{self._trace.t[k]:.2f} s")]
        for name, unit in header["constraints"].items():
            value = self._trace.margin(name)[k]
            shown = f"{1e3 * value:.2f} mm" if unit == "m" else f"{np.degrees(value):.2f} deg"
            mark = " violated" if value < LEAST_MARGIN else "" if self._enforced[name] else " (watched)"
            rows.append((name, shown + mark))
        return (
            "\n".join([header["scene"], *(name for name, _ in rows)]),
            "\n".join([header["solver"], *(value for _, value in rows)]),
        )

    def _draw(self, points: Array, colour: tuple[float, float, float, float]) -> None:
        rgba = np.array(colour, dtype=np.float32)
        kind = mujoco.mjtGeom.mjGEOM_LINE
        for a, b in pairwise(points):
            geom = self._scene.geoms[self._scene.ngeom]
            mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba)
            mujoco.mjv_connector(geom, kind, PATH_PIXELS, a, b)
            geom.emission = GLOW
            self._scene.ngeom += 1


def _ball(points: Array) -> tuple[Array, float]:
    """Middle and radius of a ball around points (n, 3), metres."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return centre, max(float(np.linalg.norm(points - centre, axis=1).max()), SMALLEST)


def _path(robot: Robot, frame: str, q: Array) -> Array:
    """Positions (k, 3) of a frame at configurations (k, n)."""
    flat, names = robot.flat((frame,)), world_first((frame,))
    return np.array([snapshot(flat, names, np.ascontiguousarray(row)).translation(frame) for row in q])


def _wanted(trace: Trace, keep: np.ndarray) -> Array:
    """Positions (k, 3) of the reference where it is a pose; none where it is a velocity."""
    poses = trace["reference"]
    if poses.shape[1] != 8 or "pose" not in trace.columns:
        return np.zeros((0, 3))
    return np.array([dq.translation(np.ascontiguousarray(poses[k])) for k in keep])
