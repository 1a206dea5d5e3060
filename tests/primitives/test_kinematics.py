"""The compiled tree against Pinocchio and central differences, on random trees and assembled arms."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from primitives import dual_quaternion as dq
from primitives.errors import InputError, UnknownNameError
from primitives.kinematics import world_first
from primitives.robot import Robot

Array = NDArray[np.float64]

AXES = [np.array(a) / np.linalg.norm(a) for a in ([1, 2, 3], [-1, 1e-9, 0], [1, 1, 1], [0.3, -0.3, -0.9])]
JOINTS = [
    *(f"JointModel{kind}{axis}" for kind in ("R", "P", "RUB") for axis in "XYZ"),
    *(f"JointModel{kind}Unaligned" for kind in ("Revolute", "RevoluteUnbounded", "Prismatic")),
]


def variable(kind: str, axis: Array) -> Any:
    """A joint type of Pinocchio; the unbounded one about any axis has no constructor in Python, only URDF makes it."""
    if "UnboundedUnaligned" in kind:
        xyz = " ".join(repr(float(x)) for x in axis)
        return pin.buildModelFromXML(
            f'<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous"><parent link="a"/>'
            f'<child link="b"/><axis xyz="{xyz}"/></joint></robot>'
        ).joints[1]
    return getattr(pin, kind)(*axis) if kind.endswith("Unaligned") else getattr(pin, kind)()


def random_model(seed: int, joints: int = 9) -> pin.Model:
    """A tree whose parents, joint types, placements and frames are random; some frames are fixed in the world."""
    rng = np.random.default_rng(seed)
    model = pin.Model()

    def placement() -> pin.SE3:
        if rng.random() < 0.2:
            return pin.SE3.Identity()
        q = rng.normal(size=4)
        rotation = pin.Quaternion(*(q / np.linalg.norm(q))).normalized().toRotationMatrix()
        return pin.SE3(rotation, rng.uniform(-1.0, 1.0, 3))

    for i in range(joints):
        joint = variable(JOINTS[(seed + i) % len(JOINTS)], AXES[int(rng.integers(len(AXES)))])
        parent = int(rng.integers(max(0, i - 2), i + 1))
        speed, bounds = np.array([2.0]), (np.full(joint.nq, x) for x in (-1.5, 2.5))
        model.addJoint(parent, joint, placement(), f"j{i}", speed, speed, *bounds)
    for i in range(joints + 4):
        model.addFrame(pin.Frame(f"f{i}", int(rng.integers(joints + 1)), 0, placement(), pin.FrameType.OP_FRAME))
    return model


def random_pose(rng: np.random.Generator) -> Array:
    r = rng.normal(size=4)
    return dq.from_rotation_translation(r / np.linalg.norm(r), rng.uniform(-1.0, 1.0, 3))


def build(name: str) -> Robot:
    if name.startswith("tree"):
        seed = int(name.removeprefix("tree"))
        return Robot.from_model(name, random_model(seed), "f0")
    rng = np.random.default_rng(99)
    arms = {f"arm{i}": (Robot.from_model("x", random_model(20 + i, 2 + i), "f1"), random_pose(rng)) for i in range(4)}
    return Robot.assemble("four arms", arms)


ROBOTS = [*(f"tree{seed}" for seed in range(len(JOINTS))), "four arms"]


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return build(request.param)


def configurations(robot: Robot) -> list[Array]:
    """q = 0, both ends of the ranges (several turns where there is none), a half turn and random ones."""
    rng = np.random.default_rng(4)
    ends = [np.where(np.isfinite(x), x, sign * 9.0) for x, sign in zip(robot.limits[:2], (-1.0, 1.0), strict=True)]
    return [np.zeros(robot.n), *ends, np.full(robot.n, np.pi), *(rng.uniform(-3.0, 3.0, robot.n) for _ in range(4))]


def pinocchio_frames(robot: Robot, q: Array) -> Any:
    """Per frame: rotation, translation and Jacobian, by Pinocchio."""
    model, data = robot.model, robot.model.createData()
    at = pin.integrate(model, pin.neutral(model), q)
    pin.computeJointJacobians(model, data, at)
    pin.updateFramePlacements(model, data)
    for frame in robot.frames[1:]:
        i = model.getFrameId(frame)
        J = pin.getFrameJacobian(model, data, i, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        yield frame, data.oMf[i].rotation, data.oMf[i].translation, J


def test_poses_and_jacobians_are_those_of_pinocchio(robot: Robot) -> None:
    count = 0
    for q in configurations(robot):
        k = robot.kinematics(q)
        for frame, R, t, J in pinocchio_frames(robot, q):
            np.testing.assert_allclose(k.rotation(frame), R, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(k.translation(frame), t, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(k.jacobian(frame), J, rtol=0.0, atol=1e-12)
            count += 1
    assert count == 8 * (len(robot.frames) - 1)


def test_jacobians_are_central_differences_of_the_poses(robot: Robot) -> None:
    h = 1e-5
    for q in configurations(robot)[3:5]:
        J = robot.kinematics(q).jacobians
        for joint in range(robot.n):
            step = np.zeros(robot.n)
            step[joint] = h
            after, before = robot.kinematics(q + step), robot.kinematics(q - step)
            for f, frame in enumerate(robot.frames):
                moved = (after.translation(frame) - before.translation(frame)) / (2.0 * h)
                turned = pin.log3(after.rotation(frame) @ before.rotation(frame).T) / (2.0 * h)
                np.testing.assert_allclose(J[f, :, joint], np.r_[moved, turned], rtol=0.0, atol=1e-9)


def test_joints_that_do_not_carry_a_frame_have_exact_zeros() -> None:
    robot = build("four arms")
    k = robot.kinematics(configurations(robot)[-1])
    for arm in (f"arm{i}" for i in range(4)):
        others = np.setdiff1d(robot.group("all"), robot.group(arm))
        own = k.jacobians[[k.place(f) for f in robot.frames if f.startswith(arm)]]
        assert not own[:, :, others].any()
        assert own[:, :, robot.group(arm)].any()


def test_the_world_is_frame_0_and_stands_still(robot: Robot) -> None:
    k = robot.kinematics(configurations(robot)[-1])
    assert k.frames[0] == "world"
    assert np.array_equal(k.rotation("world"), np.eye(3))
    assert not k.translation("world").any()
    assert not k.jacobian("world").any()


def test_the_pose_is_the_dual_quaternion_of_rotation_and_translation(robot: Robot) -> None:
    q = configurations(robot)[-1]
    k = robot.kinematics(q)
    assert np.array_equal(k.q, q)
    for frame in robot.frames:
        pose = k.pose(frame)
        np.testing.assert_allclose(dq.rotation_matrix(pose), k.rotation(frame), rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(dq.translation(pose), k.translation(frame), rtol=0.0, atol=1e-14)


def test_a_turn_of_a_continuous_joint_changes_nothing() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRUBY(), pin.SE3.Random(), "j")
    model.addFrame(pin.Frame("f", 1, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    robot = Robot.from_model("spinner", model)
    for angle in (0.3, -2.0):
        once, again = robot.kinematics([angle]), robot.kinematics([angle + 2.0 * np.pi])
        np.testing.assert_allclose(again.poses, once.poses, rtol=0.0, atol=1e-14)


def test_flat_takes_the_frames_asked_for_in_their_order() -> None:
    robot = build("tree0")
    whole, part = robot.flat(robot.frames), robot.flat(["f3", "f1", "world", "f3"])
    names = world_first(("f3", "f1", "world", "f3"))
    assert names == ("world", "f3", "f1")
    rows = [robot.frames.index(f) for f in names]
    assert np.array_equal(part.frame_joint, whole.frame_joint[rows])
    assert np.array_equal(part.frame_placement, whole.frame_placement[rows])
    assert np.array_equal(part.placement, whole.placement)


def test_an_aligned_axis_turns_by_a_permutation() -> None:
    """No rounding is brought in where the axis is one of the frame's: the numbers are zeros and ones."""
    for axis in "XYZ":
        model = pin.Model()
        model.addJoint(0, getattr(pin, f"JointModelR{axis}")(), pin.SE3.Identity(), "j")
        model.addFrame(pin.Frame("f", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
        k = Robot.from_model("one", model).kinematics([0.0])
        assert set(np.abs(k.rotation("f")).ravel()) == {0.0, 1.0}
        assert np.array_equal(k.rotation("f"), np.eye(3))


@pytest.mark.parametrize("q", [[0.0] * 8, [0.0] * 10, 0.0, [[0.0] * 9], "abc", None])
def test_q_of_another_shape_is_refused(q: Any) -> None:
    with pytest.raises(InputError, match=r"^q: expected"):
        build("tree0").kinematics(q)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_q_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(InputError, match=r"q: expected finite numbers"):
        build("tree0").kinematics([0.0] * 8 + [value])


def test_an_unknown_frame_is_named_with_the_nearest() -> None:
    robot = build("four arms")
    k = robot.kinematics(np.zeros(robot.n))
    for ask in (k.pose, k.jacobian, k.rotation, k.translation, lambda f: robot.flat([f])):
        with pytest.raises(UnknownNameError, match=r'unknown frame "arm1/f_1". Did you mean "arm1/f1"'):
            ask("arm1/f_1")
