"""A robot's MJCF files and what its tools can touch as one MuJoCo model, whose names are the robot's."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from primitives import dual_quaternion as dq
from primitives.errors import FileError, InputError, ModelError
from primitives.robot import Robot
from scenarios.plants.obstacles import Cloud, Port
from scenarios.robots import RobotEntry


def robot_spec(entry: RobotEntry, robot: Robot) -> Any:
    """The arms of a robot as a `mujoco.MjSpec`, each at its base, names prefixed as the robot's frames are.

    Raises
    ------
    ModelError : the entry names no MJCF, or one whose joints are not those of the robot.
    FileError : a file that MuJoCo cannot read.
    """
    if not entry.mjcf:
        raise ModelError(
            f'robot "{entry.name}" has no MJCF file, so MuJoCo cannot run it; give its entry one (mjcf=...)'
        )
    still = robot.kinematics(np.zeros(robot.n))
    arms = {prefix: _read(path) for prefix, path in entry.mjcf.items()}
    spec = mujoco.MjSpec() if any(arms) else arms[""]
    for prefix, arm in arms.items():
        roots = arm.worldbody.bodies
        if len(roots) != 1:
            raise ModelError(
                f"{entry.mjcf[prefix]}: expected one body in the world, the base of the arm, got {len(roots)}"
            )
        root = roots[0]
        pose = still.pose(f"{prefix}/{root.name}" if prefix else root.name)
        root.pos, root.quat = dq.translation(pose), pose[:4]
        if arm is not spec:
            spec.option = arm.option
            spec.worldbody.add_frame().attach_body(root, f"{prefix}/", "")
    joints = sorted(joint.name for joint in spec.joints)
    if joints != sorted(robot.joints):
        raise ModelError(
            f'the MJCF of robot "{entry.name}" has the joints {", ".join(joints)}; expected {", ".join(robot.joints)}'
        )
    return spec


def assemble(
    entry: RobotEntry, robot: Robot, *, port: Port | None, clouds: Sequence[Cloud], physics_step: float
) -> Any:
    """A `mujoco.MjModel` of a robot, its port and the anatomy.

    Raises
    ------
    ModelError, FileError : see `robot_spec`; InputError : two clouds of one name, or the name of a body of the robot.
    """
    spec = robot_spec(entry, robot)
    taken = {body.name for body in spec.bodies}
    for cloud in clouds:
        if cloud.name in taken:
            raise InputError(f'cloud "{cloud.name}": something has this name already; give the cloud another one')
        taken.add(cloud.name)
    spec.option.timestep = physics_step
    # A state that has become unusable is to be seen, not replaced by the first one.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if port is not None:
        port.add_to(spec)
    for cloud in clouds:
        cloud.add_to(spec)
    return spec.compile()


def named(model: Any, kind: mujoco.mjtObj, name: str) -> int:
    """The index of what has a name in a `mujoco.MjModel`; raises ModelError."""
    index = int(mujoco.mj_name2id(model, kind, name))
    if index < 0:
        raise ModelError(f'the MJCF has no {kind.name.removeprefix("mjOBJ_").lower()} "{name}"; add it')
    return index


def bodies_beyond(model: Any, frame: str) -> list[int]:
    """Bodies that hang on joints beyond a frame, which is a body's name; raises ModelError where there is none."""
    last = named(model, mujoco.mjtObj.mjOBJ_BODY, frame)
    while model.body_jntnum[last] == 0:
        last = int(model.body_parentid[last])
    beyond: set[int] = set()
    for body in range(last + 1, model.nbody):
        parent = int(model.body_parentid[body])
        if parent in beyond or (parent == last and model.body_jntnum[body] > 0):
            beyond.add(body)
    return sorted(beyond)


def _read(path: Path) -> Any:
    try:
        return mujoco.MjSpec.from_file(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise FileError(str(path), f"MuJoCo cannot read this MJCF file: {' '.join(str(error).split())}") from None
