"""URDF and MJCF files as Pinocchio models.

URDF is read by Pinocchio. MJCF is compiled by MuJoCo itself and its tree copied over: Pinocchio's own MJCF reader drops
the pose of the root body, `<include>`, every second body of the world and the Euler sequence without a word.
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from primitives.checks import Array
from primitives.errors import FileError, ModelError

_one_at_a_time = threading.Lock()


def _read(path: Path, root: str, format_name: str) -> tuple[str, ElementTree.Element]:
    """Text and root element of an XML file."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(str(path), f"cannot be read as a {format_name} file ({error})") from None
    if "<!ENTITY" in text:
        raise FileError(str(path), "XML entities are not expanded here; write the values out")
    try:
        element = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        line = getattr(error, "position", (1, 0))[0]
        raise FileError(f"{path}:{line}", f"not a well-formed XML file ({error})") from None
    if element.tag != root:
        raise FileError(str(path), f"expected a {format_name} file, whose root is <{root}>, got <{element.tag}>")
    return text, element


@contextmanager
def _native_errors() -> Iterator[list[str]]:
    """Lines that C++ code writes to file descriptor 2 meanwhile; they are in the list when the block is left."""
    lines: list[str] = []
    with _one_at_a_time, TemporaryFile() as file:
        try:
            kept = os.dup(2)
        except OSError:
            yield lines
            return
        if sys.stderr is not None:
            sys.stderr.flush()
        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            lines += file.read().decode(errors="replace").splitlines()


def model_from_urdf(path: str | Path) -> pin.Model:
    """The tree of a URDF file.

    Raises
    ------
    FileError : missing, no XML, no URDF, or refused by Pinocchio; says why.
    """
    path = Path(path)
    text, root = _read(path, "robot", "URDF")
    if any("xacro" in str(element.tag) for element in root.iter()):
        raise FileError(str(path), "it has xacro macros, which are not expanded here; expand them with xacro first")
    model, failure = None, None
    with _native_errors() as said:
        try:
            model = pin.buildModelFromXML(text, mimic=True)
        except (ValueError, RuntimeError) as error:
            failure = " ".join(str(error).split())
    if failure is not None:
        reasons = [line.removeprefix("Error:").strip() for line in said if line.startswith("Error:")]
        raise FileError(str(path), f"Pinocchio cannot read this URDF file: {(reasons or [failure])[0]}")
    for line in said:
        print(line, file=sys.stderr)
    return model


def _pose(quaternion: Array, position: Array) -> pin.SE3:
    return pin.SE3(pin.Quaternion(*(float(x) for x in quaternion)).toRotationMatrix(), np.array(position))


def model_from_mjcf(path: str | Path) -> pin.Model:
    """The tree of a MuJoCo XML file; q is MuJoCo's qpos, and named bodies and sites become frames.

    Equality constraints, tendons and actuators are no part of the tree: their joints are independent here.

    Raises
    ------
    FileError : missing, no XML, no MJCF, or refused by MuJoCo; says why.
    ModelError : a free or ball joint; names it.
    """
    import mujoco

    path = Path(path)
    _, root = _read(path, "mujoco", "MJCF")
    try:
        source = mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise FileError(str(path), f"MuJoCo cannot read this MJCF file: {' '.join(str(error).split())}") from None
    model = pin.Model()
    model.name = root.get("model", "")
    carried: list[tuple[int, pin.SE3]] = []
    for body in range(source.nbody):
        joint, placement = 0, pin.SE3.Identity()
        if body:
            joint, placement = carried[source.body_parentid[body]]
            placement = placement * _pose(source.body_quat[body], source.body_pos[body])
            first = source.body_jntadr[body]
            for j in range(first, first + source.body_jntnum[body]):
                joint, placement = _add_joint(model, source, j, joint, placement)
            _add_frame(model, source.body(body).name, joint, placement, pin.FrameType.BODY)
        carried.append((joint, placement))
        for site in np.flatnonzero(source.site_bodyid == body):
            local = _pose(source.site_quat[site], source.site_pos[site])
            _add_frame(model, source.site(site).name, joint, placement * local, pin.FrameType.OP_FRAME)
    return model


def _add_frame(model: pin.Model, name: str, joint: int, placement: pin.SE3, kind: pin.FrameType) -> None:
    if name:
        model.addFrame(pin.Frame(name, joint, 0, placement, kind))


def _add_joint(model: pin.Model, source: Any, j: int, parent: int, placement: pin.SE3) -> tuple[int, pin.SE3]:
    """Add MuJoCo's joint j of a body at a placement; returns the new joint and the body's placement in its frame."""
    import mujoco

    name = source.joint(j).name or f"joint{j}"
    kind = mujoco.mjtJoint(source.jnt_type[j])
    axis, reference = np.array(source.jnt_axis[j]), source.qpos0[source.jnt_qposadr[j]]
    anchor = pin.SE3(np.eye(3), np.array(source.jnt_pos[j]))
    if kind == mujoco.mjtJoint.mjJNT_HINGE:
        variable = pin.JointModelRevoluteUnaligned(axis)
        at_zero = pin.SE3(pin.AngleAxis(-reference, axis).toRotationMatrix(), np.zeros(3))
    elif kind == mujoco.mjtJoint.mjJNT_SLIDE:
        variable = pin.JointModelPrismaticUnaligned(axis)
        at_zero = pin.SE3(np.eye(3), -reference * axis)
    else:
        raise ModelError(
            f'joint "{name}" is of type {kind.name.removeprefix("mjJNT_").lower()}; hinges and slides are supported. '
            "Replace it by these, or remove it from the robot's file."
        )
    lower, upper = source.jnt_range[j] if source.jnt_limited[j] else (-np.inf, np.inf)
    none = np.array([np.inf])
    joint = model.addJoint(
        parent, variable, placement * anchor * at_zero, name, none, none, np.array([lower]), np.array([upper])
    )
    return joint, anchor.inverse()
