"""The text of a first scene, with a comment at everything that somebody will want to change."""

import re
from collections.abc import Sequence

import numpy as np

from primitives.checks import Array
from primitives.robot import Robot
from scenarios.starter.motion import Motion

PORT_RADIUS = 0.005
"""Metres within which the shaft passes the port."""
PERIOD, GAIN, ETA = 0.005, 50.0, 5.0
"""Of a scene that follows a trajectory: seconds and 1/s."""
FORCE = 10.0
"""N, the most that the hand pulls."""
LEG = 3.0
"""Seconds from one waypoint of the hand to the next."""


def scene_name(robot: Robot) -> str:
    """A name for the scene, of the characters that one may have."""
    return re.sub("[^A-Za-z0-9._-]+", "-", robot.name).strip("-._")[:50] + "-first"


def trajectory_scene(robot: Robot, declared: str, motion: Motion, segment: float) -> str:
    """A scene whose tip is led through the port, beyond a plane, and about the port; segment in seconds.

    declared : what the file says under "robot".
    """
    waypoints = [
        f"    - {{position: {_row(p)}, rotation: {_row(r)}}}{_why(i)}"
        for i, (p, r) in enumerate(zip(motion.positions, motion.rotations, strict=True))
    ]
    return "\n".join(
        [
            f"# A first scene for {_plain(robot.name)}. Metres, radians, seconds; rotations are rotation vectors.",
            "# Look at it with `vfi check` before it runs; what it says of each constraint depends on these numbers.",
            f"name: {scene_name(robot)}",
            'summary: "the tool goes in through a port, meets a plane and pivots about the port"',
            *_arm(robot, declared, motion),
            "",
            "constraints:",
            f"  - name: port  # the shaft passes within {PORT_RADIUS * 1e3:g} mm of the entry port",
            f"    first: {{kind: line, frame: {quoted(robot.tip)}}}  # the z axis of that frame",
            f"    second: {{kind: point, position: {_row(motion.port)}}}",
            "    keep: inside",
            f"    safe_distance: {PORT_RADIUS:g}",
            *_plane(robot, motion),
            "",
            f"task: {{frame: {quoted(robot.tip)}, gain: {GAIN:g}, damping: 1e-3}}  # gain in 1/s",
            "",
            "reference:",
            f"  segment: {segment:g}  # s from one waypoint to the next",
            "  waypoints:  # in the world; rotations are from the first orientation",
            *waypoints,
            "",
            f"period: {PERIOD:g}",
            f"duration: {segment * len(waypoints):g}",
            "enforcement:  # how the constraints are kept",
            "  method: vfi  # inequalities; none: all are only watched",
            f"  eta: {ETA:g}  # 1/s: a margin h may shrink by eta h a second",
            f"  limit_eta: {ETA:g}  # 1/s, of the joint limits",
            "  guard: act  # on commands that would leave a boundary; watch: only count them; off",
            "  # forms: {port: equality}  # the shaft runs through the port itself; or {port: {soft: 1e4}}",
            "# plant: kinematic  # joints that move exactly as commanded; mujoco: servos, for a robot with an MJCF",
            "# seed: 0  # of everything random",
            "",
        ]
    )


def hands_on_scene(robot: Robot, declared: str, motion: Motion) -> str:
    """A scene whose shaft a hand leads through the port, against a plane and about the port; declared as above."""
    ends = motion.positions[1:]
    waypoints = [
        f"    - {{t: {LEG * (i + 1):g}, to: {_row(end - motion.port)}}}{_why(i + 1)}" for i, end in enumerate(ends)
    ]
    return "\n".join(
        [
            f"# A first scene for {_plain(robot.name)}, led by a hand. Metres, radians, seconds, N.",
            "# Look at it with `vfi check` before it runs.",
            f"name: {scene_name(robot)}-hand",
            'summary: "a hand leads the tool through a port, against a plane and about the port"',
            *_arm(robot, declared, motion),
            "",
            f"shaft: {quoted(robot.tip)}  # its z axis is the shaft, its origin the end",
            f"port: {_row(motion.port)}  # on the shaft at the start",
            "parameters:  # of the target admittance; see the table in the documentation before changing them",
            "  set: table-1",
            f"  shaft_length: {_number(motion.tool)}  # from the shaft's end to the handle",
            "",
            "constraints:",
            *_plane(robot, motion),
            "",
            "hand:  # a spring and a damper that pull the handle along",
            f"  most: {FORCE:g}",
            "  stiffness: 300",
            "  damping: 20",
            "  waypoints:  # of the shaft's end, from the port",
            *waypoints,
            "",
            "period: 0.004",
            f"duration: {LEG * len(waypoints) + 0.5:g}",
            "# enforcement: vfi  # inequalities; admittance: potentials, as without this key; both; none",
            "# seed: 0  # of everything random, the hand's tremor among it",
            "",
        ]
    )


def _arm(robot: Robot, declared: str, motion: Motion) -> list[str]:
    flat = robot.flat(("world",))
    width = max(len(_number(x)) for x in motion.start) + 1
    rows = []
    for j, x in enumerate(motion.start):
        unit = "m" if flat.prismatic[j] else "rad"
        low, high, speed = (float(limit[j]) for limit in robot.limits[:3])
        span = f"from {low:.4g} to {high:.4g} {unit}" if np.isfinite(high - low) else "without limits"
        text = f"{_number(x)},"
        rows.append(f"  {text:<{width}}  # {_plain(robot.joints[j])}, {span}, at most {speed:.4g} {unit}/s")
    return [declared, "group: all", "start: [", *rows, "]"]


def _plane(robot: Robot, motion: Motion) -> list[str]:
    return [
        "  - name: plane  # the tip stays on this side of it; the motion would go beyond",
        f"    first: {{kind: point, frame: {quoted(robot.tip)}, position: [0, 0, 0]}}",
        f"    second: {{kind: plane, point: {_row(motion.plane)}, normal: {_row(-motion.axis)}}}",
        "    keep: outside",
        "    safe_distance: 0",
    ]


def _why(i: int) -> str:
    words = ("where the tip starts", "in along the shaft, beyond the plane", "to one side about the port", "back")
    return f"  # {words[i]}"


def _number(value: float) -> str:
    return f"{round(float(value), 6) + 0.0:.6g}" if abs(value) < 1.0 else f"{round(float(value), 6):.8g}"


def _row(values: Sequence[float] | Array) -> str:
    return f"[{', '.join(_number(v) for v in values)}]"


def quoted(name: str) -> str:
    """A text as YAML."""
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _plain(name: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in name)[:60]
