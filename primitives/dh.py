"""Denavit-Hartenberg tables as Pinocchio models."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from primitives.checks import array, number
from primitives.errors import InputError, ModelError

if TYPE_CHECKING:
    import pinocchio as pin


class DHRow(NamedTuple):
    """One joint of a Denavit-Hartenberg table; lengths in metres, angles in radians.

    Attributes
    ----------
    kind : "revolute" or "prismatic".
    alpha, a, theta, d : the row; the joint's variable is added to theta (revolute) or d (prismatic).
    lower, upper : range of the variable, rad or m.
    velocity : largest speed, rad/s or m/s.
    """

    kind: Literal["revolute", "prismatic"]
    alpha: float
    a: float
    theta: float
    d: float
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf


def model_from_dh(rows: Sequence[DHRow], convention: Literal["standard", "modified"]) -> "pin.Model":
    """A chain of joints "joint1".. with frames "frame1"..; standard: Rz Tz Tx Rx, modified (Craig): Rx Tx Rz Tz.

    Raises
    ------
    InputError : no rows, an unknown convention, numbers that are not finite, a range that is empty.
    ModelError : a joint that is neither revolute nor prismatic.
    """
    import pinocchio as pin

    if convention not in ("standard", "modified"):
        raise InputError(f'convention: expected "standard" or "modified", got {convention!r}')
    if not rows:
        raise InputError("a Denavit-Hartenberg table needs at least one row, got none")
    model = pin.Model()
    before, parent = pin.SE3.Identity(), 0
    for i, values in enumerate(rows, 1):
        try:
            row = DHRow(*values)
        except TypeError:
            raise InputError(f"joint{i}: expected a DHRow, got {values!r}") from None
        if row.kind not in ("revolute", "prismatic"):
            raise ModelError(f'joint{i}: expected "revolute" or "prismatic", got {row.kind!r}')
        alpha, a, theta, d = (number(getattr(row, field), f"joint{i}: {field}") for field in DHRow._fields[1:5])
        lower, upper, velocity = (
            array(getattr(row, field), (), f"joint{i}: {field}", finite=False) for field in DHRow._fields[5:]
        )
        if not lower < upper or not velocity > 0.0:
            raise InputError(f"joint{i}: expected lower < upper and velocity > 0, got {lower}, {upper} and {velocity}")
        link = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0.0, 0.0]))
        motion = pin.SE3(pin.utils.rotate("z", theta), np.array([0.0, 0.0, d]))
        placement = link * motion if convention == "modified" else before * motion
        joint = pin.JointModelPZ() if row.kind == "prismatic" else pin.JointModelRZ()
        bounds = (bound.reshape(1) for bound in (velocity, lower, upper))
        parent = model.addJoint(parent, joint, placement, f"joint{i}", np.array([np.inf]), *bounds)
        before = pin.SE3.Identity() if convention == "modified" else link
        model.addFrame(pin.Frame(f"frame{i}", parent, 0, before, pin.FrameType.OP_FRAME))
    return model
