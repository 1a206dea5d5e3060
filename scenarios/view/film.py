"""What a run looks like at any of its cycles: arms, paths, port and anatomy, and constraints, red where violated."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NamedTuple

import mujoco
import numpy as np

from primitives import dual_quaternion as dq
from primitives.checks import Array
from primitives.elements import WORLD
from primitives.errors import InputError, ModelError
from primitives.kinematics import snapshot, world_first
from primitives.robot import Robot
from scenarios.analysis.metrics import VIOLATED as LEAST_MARGIN
from scenarios.analysis.trace import Trace
from scenarios.own_robot import ROBOT_FILES
from scenarios.plants.assembly import bodies_beyond
from scenarios.plants.obstacles import Cloud, Port
from scenarios.robots import RobotEntry, robots
from scenarios.view.shown import shown
from scenarios.view.stage import KEPT, VIOLATED, WATCHED, build_stage, is_fixed


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
"""By the names that videos and the command line take; all but "arm" look at the tool's tip and the port."""

SMALLEST = 0.02
"""Least radius of what is looked at, metres."""
MARGIN = 1.25
"""How much farther than necessary the camera stands."""
PATH_PIECES, SHORTEST = 400, 0.01
"""Pieces at most that a path is drawn with, and the length of the shortest as a share of what is looked at: a piece of
less than a pixel leaves a gap."""
PATH_PIXELS, REFERENCE_PIXELS = 5.0, 2.0
PATH_COLOUR, REFERENCE_COLOUR = (1.0, 0.55, 0.05, 1.0), (0.3, 0.35, 0.45, 1.0)
FAINT = 0.2
"""Opacity of what hangs beyond the end of a hands-on tool: forces and regions do not know of it."""
GLOW = 0.6
"""Share of a path's colour that no light is needed for."""


class Film:
    """The MuJoCo scene and the text of any cycle of a trace.

    Parameters
    ----------
    trace : of a run on a robot with MJCF files, see `scenarios.view.video.record`.
    size : width and height of the pictures, pixels.
    camera : where they are taken from. port, clouds : shown beside what the scene's constraints declare.

    Raises
    ------
    InputError, UnknownNameError : a trace without cycles, or of another robot than it says.
    ModelError : the robot has no MJCF.
    """

    def __init__(self, trace: Trace, size: tuple[int, int], camera: Camera, port: Port | None, clouds: Sequence[Cloud]):
        self._trace = trace
        name = trace.header["robot"]
        if name.endswith(ROBOT_FILES):
            raise ModelError(
                f'robot "{name}" is the scene\'s own, without pictures; register it with its MJCF to see it'
            )
        entry: RobotEntry = robots[name]
        robot = entry.build()
        if len(trace.records) == 0 or list(robot.joints) != list(trace.header["joints"]):
            raise InputError(
                f'trace of robot "{entry.name}": expected cycles of the joints {", ".join(robot.joints)}, got '
                f"{len(trace.records)} cycles of {', '.join(trace.header['joints'])}"
            )
        what = shown(trace, robot, port, clouds)
        q, port, clouds, constraints = what.q, what.port, what.clouds, what.constraints
        self._q, self._rows, self._method = q, what.rows, what.method
        self._enforced = {c.name: c.enforced for c in constraints}
        keep = np.unique(np.linspace(0, len(q) - 1, min(len(q), PATH_PIECES + 1)).astype(int))
        paths, wanted = [_path(robot, frame, q[keep]) for frame in what.frames], _wanted(trace, keep)
        seen = [*paths, *wanted]
        seen += [c.second.geometry[None, :3] for c in constraints if is_fixed(c.second) and c.second.kind == "point"]
        seen += [np.atleast_2d(np.array(port.centre, dtype=float))] if port is not None else []
        seen += [np.array(cloud.points, dtype=float) for cloud in clouds]
        centre, reach = _ball(np.vstack(seen))
        self._paths, self._wanted = [], [way[_spaced(way, SHORTEST * reach)] for way in wanted]
        """Of each tool: the cycles that its path is drawn through and where it was then; the same of its reference."""
        for path in paths:
            spaced = _spaced(path, SHORTEST * reach)
            self._paths.append((keep[spaced], path[spaced]))
        self.model, self._geoms = build_stage(
            entry,
            robot,
            constraints=constraints,
            centre=centre,
            reach=reach,
            port=port,
            clouds=clouds,
            size=size,
        )
        if what.tool_end is not None:
            beyond = np.isin(self.model.geom_bodyid, bodies_beyond(self.model, what.tool_end))
            self.model.geom_rgba[beyond, 3] = FAINT
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
        self._scene = mujoco.MjvScene(self.model, maxgeom=self.model.ngeom + 3 * PATH_PIECES * len(paths) + 100)

    def scene(self, k: int) -> Any:
        """The `mujoco.MjvScene` of cycle k."""
        self._data.qpos[self._places] = self._q[k]
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
        for way in self._wanted:
            self._draw(way, REFERENCE_COLOUR, REFERENCE_PIXELS)
        for cycles, path in self._paths:
            self._draw(path[: int(np.searchsorted(cycles, k, side="right"))], PATH_COLOUR, PATH_PIXELS)
        return self._scene

    def text(self, k: int) -> tuple[str, str]:
        """Two columns: what is measured, and how much of it there is at cycle k."""
        rows = [("time", f"{self._trace.t[k]:.2f} s"), *self._rows(k)]
        return (
            "\n".join([self._trace.header["scene"], *(name for name, _ in rows)]),
            "\n".join([self._method, *(value for _, value in rows)]),
        )

    def _draw(self, points: Array, colour: tuple[float, float, float, float], pixels: float) -> None:
        rgba = np.array(colour, dtype=np.float32)
        kind = mujoco.mjtGeom.mjGEOM_LINE
        for a, b in pairwise(points):
            geom = self._scene.geoms[self._scene.ngeom]
            mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba)
            mujoco.mjv_connector(geom, kind, pixels, a, b)
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


def _spaced(points: Array, apart: float) -> list[int]:
    """Indices of points (n, 3) of which each is that far from the one before, in metres, and of the last."""
    chosen: list[int] = []
    for i, point in enumerate(points):
        if not chosen or i == len(points) - 1 or np.linalg.norm(point - points[chosen[-1]]) >= apart:
            chosen.append(i)
    return chosen


def _wanted(trace: Trace, keep: np.ndarray) -> list[Array]:
    """Positions (k, 3) of each tool's reference where it is a pose; none where it is a velocity."""
    columns = trace.columns
    if not {"reference", "pose"} <= columns.keys() or trace["reference"].shape != trace["pose"].shape:
        return []
    tools = np.hsplit(trace["reference"], trace["reference"].shape[1] // 8)
    return [np.array([dq.translation(np.ascontiguousarray(poses[k])) for k in keep]) for poses in tools]
