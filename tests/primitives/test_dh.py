"""Denavit-Hartenberg tables of both conventions against DQ Robotics, and what is refused."""

from typing import Any, Literal

import numpy as np
import pytest
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH
from numpy.typing import NDArray

from primitives import dual_jacobians as dj
from primitives.dh import DHRow
from primitives.errors import InputError, ModelError
from primitives.robot import Robot

Array = NDArray[np.float64]
Convention = Literal["standard", "modified"]
TWINS = {"standard": DQ_SerialManipulatorDH, "modified": DQ_SerialManipulatorMDH}

RIGHT = np.pi / 2


def table(seed: int) -> list[DHRow]:
    """Seven mixed joints; every other table has the right angles and zeros of real arms."""
    rng = np.random.default_rng(seed)
    kinds: list[Literal["revolute", "prismatic"]] = ["prismatic" if p else "revolute" for p in rng.random(7) < 0.35]
    kinds[seed % 7], kinds[(seed + 1) % 7] = "prismatic", "revolute"
    angles = rng.uniform(-3.0, 3.0, (7, 2)) if seed % 2 else RIGHT * rng.integers(-2, 3, (7, 2))
    lengths = rng.uniform(-0.6, 0.6, (7, 2)) * (rng.random((7, 2)) < 0.7)
    return [
        DHRow(kind, float(alpha), float(a), float(theta), float(d), -2.0, 1.5, 0.7)
        for kind, (alpha, theta), (a, d) in zip(kinds, angles, lengths, strict=True)
    ]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_every_frame_and_its_jacobian_are_those_of_dq_robotics(convention: Convention, seed: int) -> None:
    rows = table(seed)
    columns = [[r.theta, r.d, r.a, r.alpha, float(r.kind == "prismatic")] for r in rows]
    twin = TWINS[convention](np.array(columns).T)
    robot = Robot.from_dh(rows, convention=convention)
    rng = np.random.default_rng(seed)
    ends = [np.zeros(7), robot.limits.lower, robot.limits.upper]
    for q in [*ends, *(rng.uniform(-2.0, 1.5, 7) for _ in range(3))]:
        k = robot.kinematics(q)
        for i in range(7):
            frame = f"frame{i + 1}"
            expected, got = twin.raw_fkm(q, i).vec8(), k.pose(frame)
            sign = 1.0 if got @ expected > 0.0 else -1.0
            np.testing.assert_allclose(sign * got, expected, rtol=0.0, atol=1e-12)
            J = k.jacobian(frame)
            assert not J[:, i + 1 :].any()
            got = sign * dj.pose_jacobian(k.pose(frame), np.ascontiguousarray(J[:, : i + 1]))
            np.testing.assert_allclose(got, twin.raw_pose_jacobian(q, i), rtol=0.0, atol=1e-12)


def test_names_limits_and_tip() -> None:
    rows = [DHRow("prismatic", 0.1, 0.2, 0.3, 0.4, -0.1, 0.2, 0.3), DHRow("revolute", 0.1, 0.2, 0.3, 0.4)]
    robot = Robot.from_dh(rows, name="stub")
    assert (robot.name, robot.joints, robot.tip) == ("stub", ("joint1", "joint2"), "frame2")
    assert robot.frames == ("world", "frame1", "frame2")
    lower, upper, velocity, acceleration = robot.limits
    assert lower.tolist() == [-0.1, -np.inf]
    assert upper.tolist() == [0.2, np.inf]
    assert velocity.tolist() == [0.3, np.inf]
    assert acceleration.tolist() == [np.inf, np.inf]


def test_one_row_by_hand() -> None:
    """Rz(90) Tz(d) Tx(a) Rx(90), and in the other order Rx(90) Tx(a) Rz(90) Tz(d)."""
    row = DHRow("revolute", RIGHT, 0.2, 0.0, 0.5)
    standard = Robot.from_dh([row]).kinematics([RIGHT])
    modified = Robot.from_dh([row], convention="modified").kinematics([RIGHT])
    np.testing.assert_allclose(standard.translation("frame1"), [0.0, 0.2, 0.5], atol=1e-15)
    np.testing.assert_allclose(standard.rotation("frame1"), [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(modified.translation("frame1"), [0.2, -0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(modified.rotation("frame1"), [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-15)


GOOD = DHRow("revolute", 0.0, 0.0, 0.0, 0.0, -1.0, 1.0, 1.0)


@pytest.mark.parametrize("field", ["alpha", "a", "theta", "d"])
@pytest.mark.parametrize("value", [np.nan, np.inf, "wide", None])
def test_a_number_that_is_none_is_refused_by_joint_and_field(field: str, value: Any) -> None:
    with pytest.raises(InputError, match=rf"^joint2: {field}: expected"):
        Robot.from_dh([GOOD, GOOD._replace(**{field: value})])


@pytest.mark.parametrize(
    "change",
    [
        {"lower": 1.0},
        {"lower": np.nan},
        {"upper": -2.0},
        {"upper": np.nan},
        {"velocity": 0.0},
        {"velocity": -1.0},
        {"velocity": np.nan},
    ],
)
def test_an_empty_range_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"^joint2: expected lower < upper and velocity > 0, got "):
        Robot.from_dh([GOOD, GOOD._replace(**change)])


@pytest.mark.parametrize("field", ["lower", "upper", "velocity"])
def test_a_limit_that_is_no_number_is_refused(field: str) -> None:
    with pytest.raises(InputError, match=f"^joint1: {field}: expected numbers, got 'far'"):
        change: dict[str, Any] = {field: "far"}
        Robot.from_dh([GOOD._replace(**change)])


def test_other_joints_tables_and_conventions_are_refused() -> None:
    helical: Any = "helical"
    with pytest.raises(ModelError, match=r'joint2: expected "revolute" or "prismatic", got \'helical\''):
        Robot.from_dh([GOOD, GOOD._replace(kind=helical)])
    with pytest.raises(InputError, match=r"at least one row, got none"):
        Robot.from_dh([])
    with pytest.raises(InputError, match=r'expected "standard" or "modified", got \'craig\''):
        Robot.from_dh([GOOD], convention="craig")  # type: ignore[arg-type]
    for short in (("revolute", 0.0), 3.0):
        with pytest.raises(InputError, match=r"joint1: expected a DHRow, got"):
            Robot.from_dh([short])  # type: ignore[list-item]


def test_a_plain_tuple_is_a_row() -> None:
    row: Any = ("revolute", 0.1, 0.2, 0.3, 0.4)
    q = [0.5]
    assert np.array_equal(Robot.from_dh([row]).kinematics(q).poses, Robot.from_dh([DHRow(*row)]).kinematics(q).poses)
