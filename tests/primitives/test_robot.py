"""Reading robots from files, changing and assembling them, and every way in which a file can be wrong."""

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from primitives import dual_quaternion as dq
from primitives.dh import DHRow
from primitives.errors import FileError, InputError, ModelError, UnknownNameError
from primitives.robot import Robot

Array = NDArray[np.float64]

LIMIT = '<limit lower="-1" upper="1.5" effort="1" velocity="2"/>'


def joint(name: str, kind: str, parent: str, child: str, inside: str = "") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def urdf(*joints: str, links: str = "base a b c", name: str = "thing", inside: str = "") -> str:
    return (
        f'<?xml version="1.0"?><robot name="{name}">'
        + "".join(f'<link name="{link}">{inside}</link>' for link in links.split())
        + "".join(joints)
        + "</robot>"
    )


TURN = joint("turn", "revolute", "base", "a", f'<axis xyz="0 0 1"/>{LIMIT}')

JOINTS = [
    joint(
        "lift", "prismatic", "base", "a", f'<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/><axis xyz="0 2 0"/>{LIMIT}'
    ),
    joint("arm", "revolute", "a", "b", f'<origin xyz="0 0.1 0.3" rpy="1 2 3"/><axis xyz="1 2 -3"/>{LIMIT}'),
    joint("spin", "continuous", "b", "c", '<origin xyz="0.3 0 0"/><axis xyz="-1 0 0"/>'),
    joint("weld", "fixed", "c", "tool", '<origin xyz="0 0 0.25" rpy="0 1.5707963267948966 0"/>'),
    joint("other", "revolute", "a", "d", f'<origin xyz="0 0 -0.2"/><axis xyz="0 0 -1"/>{LIMIT}'),
    joint("finger", "continuous", "d", "e", '<origin rpy="0 0 1"/><axis xyz="0.6 0.8 0"/>'),
]
TREE = urdf(*JOINTS, links="base a b c tool d e")

BODIES = ["base", "a", "b", "c", "tool", "d", "e"]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Path]:
    """Writes a file and gives its path; MuJoCo's log, if any, lands beside it."""
    monkeypatch.chdir(tmp_path)

    def to_file(text: str) -> Path:
        path = tmp_path / "robot.xml"
        path.write_text(text, encoding="utf-8")
        return path

    return to_file


def random_q(robot: Robot, count: int = 5) -> list[Array]:
    rng = np.random.default_rng(3)
    return [np.zeros(robot.n), *(rng.uniform(-2.0, 2.0, robot.n) for _ in range(count))]


def agrees_with_mujoco(robot: Robot, model: Any, bodies: list[str], sites: list[str]) -> None:
    """Poses and Jacobians of bodies and sites at random q, by MuJoCo; q is its qpos by joint name."""
    data = mujoco.MjData(model)
    order = [model.joint(j).qposadr[0] for j in robot.joints]
    columns = [model.joint(j).dofadr[0] for j in robot.joints]
    for q in random_q(robot):
        data.qpos[order] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        k = robot.kinematics(q)
        for names, view in ((bodies, data.body), (sites, data.site)):
            for name in names:
                there = view(name)
                R = k.rotation(name)
                np.testing.assert_allclose(k.translation(name), there.xpos, rtol=0.0, atol=1e-12)
                np.testing.assert_allclose(R, there.xmat.reshape(3, 3), rtol=0.0, atol=1e-12)
                linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
                body = model.body(name).id if names is bodies else model.site(name).bodyid[0]
                mujoco.mj_jac(model, data, linear, angular, there.xpos, body)
                J = np.vstack([linear, angular])[:, columns]
                np.testing.assert_allclose(k.jacobian(name), J, rtol=0.0, atol=1e-12)


# URDF


def test_urdf_agrees_with_pinocchio(write: Callable[[str], Path]) -> None:
    robot, model = Robot.from_urdf(write(TREE)), pin.buildModelFromXML(TREE)
    data = model.createData()
    assert set(robot.joints) == {"lift", "arm", "spin", "other", "finger"}
    assert {*robot.frames} == {"world", *BODIES, *robot.joints, "weld"}
    for q in random_q(robot):
        at = pin.integrate(model, pin.neutral(model), q)
        assert np.allclose(robot.configuration(q), at, rtol=0.0, atol=1e-15)
        pin.computeJointJacobians(model, data, at)
        pin.updateFramePlacements(model, data)
        k = robot.kinematics(q)
        for i, frame in enumerate(list(model.frames)[1:], 1):
            J = pin.getFrameJacobian(model, data, i, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(k.rotation(frame.name), data.oMf[i].rotation, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(k.translation(frame.name), data.oMf[i].translation, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(k.jacobian(frame.name), J, rtol=0.0, atol=1e-12)


def test_urdf_agrees_with_mujoco(write: Callable[[str], Path]) -> None:
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    keep = '<mujoco><compiler fusestatic="false"/></mujoco>'
    text = urdf(keep, *JOINTS, links=" ".join(BODIES), inside=mass)
    agrees_with_mujoco(Robot.from_urdf(write(text)), mujoco.MjModel.from_xml_string(text), BODIES, [])


def test_urdf_limits_names_and_tip(write: Callable[[str], Path]) -> None:
    robot = Robot.from_urdf(write(TREE), tip="tool")
    by_joint = {j: tuple(row[i] for row in robot.limits) for i, j in enumerate(robot.joints)}
    inf = np.inf
    assert by_joint["lift"] == by_joint["arm"] == (-1.0, 1.5, 2.0, inf)
    assert by_joint["spin"] == (-inf, inf, inf, inf)
    assert (robot.name, robot.tip, robot.n) == ("thing", "tool", 5)
    assert robot.groups == {"all": robot.joints}
    assert Robot.from_urdf(write(TREE), name="other").name == "other"
    assert Robot.from_urdf(str(write(urdf(TURN, links="base a")))).tip == "a"


def test_a_limit_on_one_side_is_kept() -> None:
    model = pin.Model()
    one = np.ones(1)
    for i, (low, high) in enumerate([(0.0, np.inf), (-1e308, 0.5), (-1e31, 1e31)]):
        model.addJoint(i, pin.JointModelRX(), pin.SE3.Identity(), f"j{i}", one, one, low * one, high * one)
        model.addFrame(pin.Frame(f"f{i}", i + 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    limits = Robot.from_model("r", model).limits
    assert limits.lower.tolist() == [0.0, -np.inf, -np.inf]
    assert limits.upper.tolist() == [np.inf, 0.5, np.inf]


def test_a_link_and_a_joint_of_one_name_are_told_apart(write: Callable[[str], Path]) -> None:
    """Joint "b" moves link "c": the name means the link, wherever it is looked up."""
    robot = Robot.from_urdf(
        write(
            urdf(
                joint("a", "revolute", "base", "a", f'<axis xyz="0 0 1"/>{LIMIT}'),
                joint("BODY:c", "revolute", "a", "b", f'<origin xyz="1 0 0"/><axis xyz="0 0 1"/>{LIMIT}'),
                joint("b", "revolute", "b", "c", f'<origin xyz="0 2 0"/><axis xyz="0 0 1"/>{LIMIT}'),
            )
        ),
        tip="b",
    )
    assert robot.frames == ("world", "base", "a", "BODY:c", "b", "c")
    k = robot.kinematics(np.zeros(3))
    assert k.translation("b").tolist() == [1.0, 0.0, 0.0]
    assert k.translation("c").tolist() == [1.0, 2.0, 0.0]
    assert [int(k.jacobian(f)[5].sum()) for f in "abc"] == [1, 2, 3]
    shift = dq.from_rotation_translation(np.array([1.0, 0, 0, 0]), np.array([0.0, 0.0, 3.0]))
    tooled = robot.with_tool("tool", shift)
    assert tooled.kinematics(np.zeros(3)).translation("tool").tolist() == [1.0, 0.0, 3.0]
    pair = Robot.assemble("pair", {"l": (robot, shift), "r": (tooled, shift)})
    assert pair.kinematics(np.zeros(6)).translation("r/tool").tolist() == [1.0, 0.0, 6.0]
    assert pair.kinematics(np.zeros(6)).translation("l/b").tolist() == [1.0, 0.0, 3.0]
    assert sorted(pair.frames) == sorted(["world", *(f"{p}/{f}" for p in "lr" for f in robot.frames[1:]), "r/tool"])
    assert pair.joints == ("l/a", "l/BODY:c", "l/b", "r/a", "r/BODY:c", "r/b")


def test_world_is_the_name_of_the_origin(write: Callable[[str], Path]) -> None:
    fixed = joint("bolt", "fixed", "world", "base", '<origin xyz="1 2 3"/>')
    robot = Robot.from_urdf(write(urdf(fixed, TURN, links="world base a")))
    assert robot.frames == ("world", "bolt", "base", "turn", "a")
    assert robot.kinematics([0.0]).translation("base").tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(ModelError, match=r'frame "world" is the fixed origin of everything'):
        Robot.from_urdf(write(urdf(TURN.replace('"a"', '"world"'), links="base world")))


UNSUPPORTED = [
    ("floating", "", "FreeFlyer"),
    ("planar", '<axis xyz="0 0 1"/>', "Planar"),
    ("revolute", f'<axis xyz="0 0 1"/>{LIMIT}<mimic joint="turn" multiplier="2"/>', "Mimic"),
]


@pytest.mark.parametrize(("kind", "inside", "said"), UNSUPPORTED, ids=lambda x: str(x)[:12])
def test_an_unsupported_urdf_joint_is_named(write: Callable[[str], Path], kind: str, inside: str, said: str) -> None:
    path = write(urdf(TURN, joint("odd one", kind, "a", "b", inside), links="base a b"))
    with pytest.raises(ModelError, match=f'joint "odd one" is of type {said}; revolute, continuous, prismatic and'):
        Robot.from_urdf(path)


def composite() -> Any:
    both = pin.JointModelComposite(pin.JointModelRX())
    both.addJoint(pin.JointModelRY(), pin.SE3.Identity())
    return both


VARIABLES = [
    pin.JointModelHX(0.1),
    pin.JointModelHZ(2.0),
    pin.JointModelSpherical(),
    pin.JointModelSphericalZYX(),
    pin.JointModelTranslation(),
    pin.JointModelPlanar(),
    pin.JointModelFreeFlyer(),
    pin.JointModelComposite(pin.JointModelRX()),
    composite(),
]


@pytest.mark.parametrize("variable", VARIABLES, ids=lambda j: j.shortname())
def test_an_unsupported_pinocchio_joint_is_named(variable: Any) -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "fine")
    model.addJoint(1, variable, pin.SE3.Identity(), "odd")
    model.addFrame(pin.Frame("f", 2, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with pytest.raises(ModelError, match=f'joint "odd" is of type {variable.shortname()[10:]}; '):
        Robot.from_model("r", model)


def test_an_axis_that_is_not_of_unit_length_is_refused() -> None:
    """Pinocchio takes it as it is and then computes rotations that are none."""
    for variable in (pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned):
        model = pin.Model()
        model.addJoint(0, variable(np.array([1.0, 1.0, 0.0])), pin.SE3.Identity(), "long")
        with pytest.raises(ModelError, match=r'joint "long": expected an axis of unit length, got'):
            Robot.from_model("r", model)


FIXED = joint("bolt", "fixed", "base", "a")

MODEL_ERRORS = [
    (urdf(FIXED, links="base a"), 'robot "thing" has no movable joint'),
    (urdf(links="base"), 'robot "thing" has no movable joint'),
    (urdf(TURN.replace('velocity="2"', 'velocity="0"'), links="base a"), '"turn": expected limits of velocity .* > 0'),
    (urdf(TURN.replace('upper="1.5"', 'upper="-1"'), links="base a"), '"turn": expected lower < upper, got -1.0 and'),
]


@pytest.mark.parametrize(("text", "message"), MODEL_ERRORS)
def test_a_urdf_that_no_controller_can_use(write: Callable[[str], Path], text: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(write(text))


DOCTYPE = '<!DOCTYPE robot [<!ENTITY a "1"><!ENTITY b "&a;&a;&a;&a;">]>'

FILE_ERRORS = [
    ("", ":1: not a well-formed XML file (no element found"),
    ("\n\n<robot name='t'>\n<link name='a'>\n", ":5: not a well-formed XML file (no element found"),
    (TREE[: len(TREE) // 2], ":1: not a well-formed XML file ("),
    ("<robot name='t'></mujoco>", ":1: not a well-formed XML file (mismatched tag"),
    (DOCTYPE + TREE.split("?>")[1], ": XML entities are not expanded here; write the values out"),
    ("<mujoco/>", ": expected a URDF file, whose root is <robot>, got <mujoco>"),
    ("<!-- <robot/> --><sdf/>", ": expected a URDF file, whose root is <robot>, got <sdf>"),
    (
        '<robot name="t" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>',
        ": it has xacro macros, which are not expanded here; expand them with xacro first",
    ),
    ("<robot name='t'/>", ": Pinocchio cannot read this URDF file: No link elements found in urdf file"),
    (urdf(TURN, links="base a b"), "Failed to find root link: Two root links found: [b] and [base]"),
    (urdf(TURN, links="base"), "Failed to build tree: child link [a] of joint [turn] not found"),
    (urdf(TURN.replace('velocity="2"', 'velocity="-3"'), links="base a"), "velocity"),
    (urdf(joint("ball", "spherical", "base", "a"), links="base a"), "Joint [ball] has no known type [spherical]"),
    (urdf(TURN.replace(LIMIT, ""), links="base a"), "Joint [turn] is of type REVOLUTE but it does not specify limits"),
    (urdf(TURN.replace(' velocity="2"', ""), links="base a"), "joint [turn]: limit has no velocity"),
    (urdf(TURN.replace("0 0 1", "0 0 nan"), links="base a"), "Malformed axis element for joint [turn]"),
    (urdf(TURN.replace("0 0 1", "0 1"), links="base a"), "Malformed axis element for joint [turn]"),
    (urdf(TURN, TURN.replace('"a"', '"b"'), links="base a b"), "joint 'turn' is not unique"),
]


@pytest.mark.parametrize(("text", "message"), FILE_ERRORS)
def test_a_file_that_is_no_urdf(
    write: Callable[[str], Path], capfd: pytest.CaptureFixture[str], text: str, message: str
) -> None:
    path = write(text)
    with pytest.raises(FileError) as caught:
        Robot.from_urdf(path)
    assert str(caught.value).startswith(f"{path}:")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    latin = tmp_path / "latin.urdf"
    latin.write_bytes(urdf(TURN, links="base a", name="Käthe").encode("latin-1"))
    for path in (tmp_path / "missing.urdf", tmp_path, latin):
        for read, kind in ((Robot.from_urdf, "URDF"), (Robot.from_mjcf, "MJCF")):
            with pytest.raises(FileError, match=f"cannot be read as a {kind} file") as caught:
                read(path)
            assert str(path) in str(caught.value)


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "bom.urdf"
    path.write_bytes(b"\xef\xbb\xbf" + urdf(TURN, links="base a").encode())
    assert Robot.from_urdf(path).joints == ("turn",)


def test_what_pinocchio_says_of_a_usable_file_is_passed_on(
    write: Callable[[str], Path], capfd: pytest.CaptureFixture[str]
) -> None:
    odd = urdf(TURN, links="base a").replace(
        '<link name="a"></link>', '<link name="a"><visual><geometry><blob/></geometry></visual></link>'
    )
    assert Robot.from_urdf(write(odd)).joints == ("turn",)
    assert "Unknown geometry type 'blob'" in capfd.readouterr().err


def test_threads_that_read_files_leave_stderr_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard error is turned aside by one thread at a time, or one would put back what another had put there."""
    (tmp_path / "good").write_text(TREE)
    (tmp_path / "bad").write_text(urdf(TURN, links="base"))
    before, seen, inside, most = os.fstat(2), [], 0, 0
    build = pin.buildModelFromXML

    def slowly(*arguments: Any, **options: Any) -> Any:
        nonlocal inside, most
        inside += 1
        most = max(most, inside)
        time.sleep(0.02)
        inside -= 1
        return build(*arguments, **options)

    def read(file: str) -> None:
        try:
            seen.append(Robot.from_urdf(tmp_path / file).n)
        except FileError as error:
            seen.append("child link [a] of joint [turn] not found" in str(error))

    monkeypatch.setattr(pin, "buildModelFromXML", slowly)
    threads = [threading.Thread(target=read, args=(file,)) for file in ("good", "bad", "good", "bad")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (sorted(seen), most) == ([True, True, 5, 5], 1)
    after = os.fstat(2)
    assert (before.st_dev, before.st_ino) == (after.st_dev, after.st_ino)


@pytest.mark.parametrize("tip", ["tol", "TOOL"])
def test_an_unknown_tip_is_named_with_the_nearest(write: Callable[[str], Path], tip: str) -> None:
    with pytest.raises(UnknownNameError, match=f'unknown frame "{tip}". Did you mean "tool"'):
        Robot.from_urdf(write(TREE), tip=tip)


# MJCF

MASS = '<geom size="0.1"/>'

MJCF = f"""<mujoco model="bench">
<compiler angle="degree" eulerseq="XYZ"/>
<default><joint range="-50 60"/><default class="loose"><joint axis="0 1 0" limited="false"/></default></default>
<worldbody>
  <site name="corner" pos="1 2 3" euler="10 20 30"/>
  <frame pos="0.5 0 0" euler="0 0 40">
    <body name="base" pos="0 0 0.1" euler="30 20 10">{MASS}
      <body name="a" pos="0.1 0.2 0.3" euler="10 20 30">{MASS}
        <joint name="hinge" axis="1 2 3" pos="0.01 0.02 0.03"/>
        <site name="on a" pos="0.1 0 0" zaxis="1 1 1"/>
        <body name="b" quat="0.5 0.5 -0.5 0.5">{MASS}
          <joint name="slide" type="slide" range="-0.1 0.2" pos="0.1 0.2 0.3" axis="0 -2 0"/>
          <body name="c" pos="0 0 0.3">{MASS}
            <joint name="turned" class="loose" ref="35" pos="0 0.1 0"/>
            <joint name="shifted" type="slide" axis="1 0 1" ref="0.2" range="0 1"/>
            <joint name="third" axis="0 0 1" pos="0.2 0 0"/>
            <site name="tip" pos="0 0 0.2" euler="0 90 0"/>
          </body>
        </body>
      </body>
    </body>
  </frame>
  <include file="second.xml"/>
</worldbody></mujoco>"""

SECOND = f"""<mujocoinclude><body name="second" pos="0 -1 0">{MASS}<joint name="included"/>
<body name="" pos="0 0 1">{MASS}<site name="free end"/></body></body></mujocoinclude>"""


@pytest.fixture
def bench(write: Callable[[str], Path]) -> Path:
    path = write(MJCF)
    (path.parent / "second.xml").write_text(SECOND)
    return path


def test_mjcf_agrees_with_mujoco(bench: Path) -> None:
    """Pinocchio's own reader loses the pose of "base", the included body, the frame and the Euler sequence."""
    robot, model = Robot.from_mjcf(bench), mujoco.MjModel.from_xml_path(str(bench))
    assert robot.joints == ("hinge", "slide", "turned", "shifted", "third", "included")
    bodies, sites = ["base", "a", "b", "c", "second"], ["corner", "on a", "tip", "free end"]
    assert {*robot.frames} == {"world", *bodies, *sites}
    agrees_with_mujoco(robot, model, bodies, sites)
    assert np.array_equal(robot.kinematics(model.qpos0).q, model.qpos0)


def test_mjcf_limits_names_and_tip(bench: Path) -> None:
    robot = Robot.from_mjcf(bench)
    assert (robot.name, robot.tip) == ("bench", "free end")
    inf, fifty, sixty = np.inf, np.deg2rad(50.0), np.deg2rad(60.0)
    np.testing.assert_allclose(robot.limits.lower, [-fifty, -0.1, -inf, 0.0, -fifty, -fifty], atol=1e-15)
    np.testing.assert_allclose(robot.limits.upper, [sixty, 0.2, inf, 1.0, sixty, sixty], atol=1e-15)
    assert np.isinf(robot.limits.velocity).all()
    assert Robot.from_mjcf(bench, tip="tip", name="n").tip == "tip"
    with pytest.raises(UnknownNameError, match=r'unknown frame "on b". Did you mean "on a"'):
        Robot.from_mjcf(bench, tip="on b")


def test_the_name_of_a_body_and_a_site_means_the_body(write: Callable[[str], Path]) -> None:
    robot = Robot.from_mjcf(
        write(
            f'<mujoco><worldbody><body name="a">{MASS}<joint name="j"/><site name="a" pos="0 0 1"/></body>'
            "</worldbody></mujoco>"
        )
    )
    assert robot.frames == ("world", "a")
    assert robot.kinematics([0.0]).translation("a").tolist() == [0.0, 0.0, 0.0]


def test_joints_without_a_name_are_numbered(write: Callable[[str], Path]) -> None:
    robot = Robot.from_mjcf(
        write(f'<mujoco><worldbody><body name="a">{MASS}<joint/><joint axis="1 0 0"/></body></worldbody></mujoco>')
    )
    assert (robot.joints, robot.name) == (("joint0", "joint1"), "robot")


@pytest.mark.parametrize(("kind", "said"), [("ball", "ball"), ("free", "free")])
def test_an_unsupported_mjcf_joint_is_named(write: Callable[[str], Path], kind: str, said: str) -> None:
    path = write(
        f'<mujoco><worldbody><body name="a">{MASS}<joint name="odd" type="{kind}"/></body></worldbody></mujoco>'
    )
    with pytest.raises(ModelError, match=f'joint "odd" is of type {said}; hinges and slides are supported'):
        Robot.from_mjcf(path)


def body(inside: str, attributes: str = "") -> str:
    return f'<mujoco><worldbody>\n<body name="a" {attributes}>{inside}</body></worldbody></mujoco>'


MJCF_ERRORS = [
    (TREE, ": expected a MJCF file, whose root is <mujoco>, got <robot>"),
    (MJCF[:-20], "not a well-formed XML file"),
    (DOCTYPE.replace("robot", "mujoco") + body(MASS), "XML entities are not expanded here"),
    (body("<joint name='j'/>"), "MuJoCo cannot read this MJCF file: Error: mass and inertia of moving bodies must be"),
    (body(MASS + "<joint name='j' type='screw'/>"), "MuJoCo cannot read this MJCF file: XML Error: invalid keyword"),
    (body(MASS + "<include file='nowhere.xml'/>"), "nowhere.xml"),
    (body(MASS + "<joint name='j'/><joint name='j'/>"), "repeated name 'j' in joint"),
]


@pytest.mark.parametrize(("text", "message"), MJCF_ERRORS)
def test_a_file_that_is_no_mjcf(write: Callable[[str], Path], text: str, message: str) -> None:
    path = write(text)
    with pytest.raises(FileError) as caught:
        Robot.from_mjcf(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{path}:")
    assert "\n" not in str(caught.value)


def test_an_mjcf_that_no_controller_can_use(write: Callable[[str], Path]) -> None:
    for text, message in (
        (body(MASS), "has no movable joint"),
        (body(MASS + "<joint name='j'/>", "pos='nan 0 0'"), 'joint "j": its placement is not finite'),
        (body(MASS + "<joint name='j'/><site name='s' pos='0 inf 0'/>"), 'frame "s": its placement is not finite'),
    ):
        with pytest.raises(ModelError, match=message):
            Robot.from_mjcf(write(text))


# Changed copies


@pytest.fixture
def robot(write: Callable[[str], Path]) -> Robot:
    return Robot.from_urdf(write(TREE), tip="tool")


def pose(axis: Any, angle: float, t: Any) -> Array:
    axis = np.array(axis) / np.linalg.norm(axis)
    return dq.from_rotation_translation(np.r_[np.cos(angle / 2), np.sin(angle / 2) * axis], np.array(t, dtype=float))


SHIFT = pose([1, 2, 3], 0.7, [0.1, -0.2, 0.3])


@pytest.mark.parametrize("on", [None, "d", "base", "world", "weld"])
def test_a_tool_is_a_frame_on_its_carrier(robot: Robot, on: str | None) -> None:
    tooled = robot.with_tool("needle", SHIFT, on=on)
    assert tooled.tip == "needle"
    assert tooled.frames == (*robot.frames, "needle")
    assert "needle" not in robot.frames
    assert robot.tip == "tool"
    for q in random_q(robot):
        before, k = robot.kinematics(q), tooled.kinematics(q)
        carrier = on or "tool"
        expected = dq.product(before.pose(carrier), SHIFT)
        np.testing.assert_allclose(dq.nearest_sign(k.pose("needle"), expected), expected, rtol=0.0, atol=1e-14)
        lever = k.translation("needle") - before.translation(carrier)
        J = before.jacobian(carrier)
        moved = J[:3] + np.cross(J[3:].T, lever).T
        np.testing.assert_allclose(k.jacobian("needle"), np.vstack([moved, J[3:]]), rtol=0.0, atol=1e-12)


def test_tools_stand_on_tools(robot: Robot) -> None:
    twice = robot.with_tool("grip", SHIFT).with_tool("needle", SHIFT)
    k = twice.kinematics(random_q(robot)[1])
    expected = dq.product(k.pose("tool"), dq.product(SHIFT, SHIFT))
    np.testing.assert_allclose(dq.nearest_sign(k.pose("needle"), expected), expected, rtol=0.0, atol=1e-14)


def test_a_tool_that_is_none_is_refused(robot: Robot) -> None:
    with pytest.raises(UnknownNameError, match=r'unknown frame "tols". Did you mean "tool"'):
        robot.with_tool("needle", SHIFT, on="tols")
    for name in ("tool", "world", "weld"):
        with pytest.raises(InputError, match=f'frame "{name}" is there already'):
            robot.with_tool(name, SHIFT)
    for value in (2.0 * SHIFT, SHIFT[:7], SHIFT * np.nan, "here"):
        with pytest.raises(InputError, match=r'^pose of tool "needle": expected'):
            robot.with_tool("needle", value)


def test_groups(robot: Robot) -> None:
    grouped = robot.with_group("ends", ["spin", "lift"])
    assert grouped.group("ends").tolist() == [robot.joints.index("spin"), robot.joints.index("lift")]
    assert grouped.group("ends").dtype == np.int64
    assert grouped.group("all").tolist() == list(range(5))
    assert "ends" not in robot.groups
    with pytest.raises(UnknownNameError, match=r'unknown joint group "end". Did you mean "ends"'):
        grouped.group("end")
    with pytest.raises(UnknownNameError, match=r'unknown joint "spni". Did you mean "spin"'):
        robot.with_group("ends", ["lift", "spni"])
    for name, joints in (("none", []), ("twice", ["lift", "lift"]), ("all", ["lift"])):
        with pytest.raises(InputError, match=f'joint group "{name}": expected different joints'):
            robot.with_group(name, joints)


def test_limits(robot: Robot) -> None:
    spin, lift = robot.joints.index("spin"), robot.joints.index("lift")
    before = [row.copy() for row in robot.limits]
    changed = robot.with_limits(
        lower={"spin": -0.1}, upper={"spin": 0.2, "lift": np.inf}, acceleration=np.arange(1.0, 6.0)
    )
    assert (changed.limits.lower[spin], changed.limits.upper[spin]) == (-0.1, 0.2)
    assert (changed.limits.lower[lift], changed.limits.upper[lift]) == (-1.0, np.inf)
    assert changed.limits.acceleration.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert np.array_equal(changed.limits.velocity, before[2])
    assert all(np.array_equal(a, b) for a, b in zip(robot.limits, before, strict=True))
    assert changed.with_limits(velocity={"arm": 0.5}).limits.velocity[robot.joints.index("arm")] == 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lower": {"lift": 1.5}}, 'joint "lift": expected lower < upper, got 1.5 and 1.5'),
        ({"upper": {"lift": np.nan}}, 'joint "lift": expected lower < upper, got -1.0 and nan'),
        ({"velocity": {"spin": 0.0}}, 'joint "spin": expected limits of velocity and acceleration > 0, got 0.0'),
        ({"velocity": {"spin": np.nan}}, 'joint "spin": expected limits of velocity and acceleration > 0, got nan'),
        ({"acceleration": {"arm": -1.0}}, 'joint "arm": expected limits of .* and -1.0'),
        ({"velocity": [1.0, 1.0]}, r"velocity limits: expected shape \(5\), got \(2,\)"),
        ({"velocity": 3.0}, r"velocity limits: expected shape \(5\), got \(\)"),
        ({"velocity": {"arm": "fast"}}, "velocity limit of joint \"arm\": expected numbers, got 'fast'"),
        ({"velocity": {"arm": [1.0, 2.0]}}, 'velocity limit of joint "arm": expected shape'),
        ({"velocity": {"amr": 1.0}}, 'unknown joint "amr". Did you mean "arm"'),
    ],
)
def test_limits_that_are_none_are_refused(robot: Robot, change: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        robot.with_limits(**change)


def test_configuration_gives_continuous_joints_as_cosine_and_sine(robot: Robot) -> None:
    for q in random_q(robot):
        expected = pin.integrate(robot.model, pin.neutral(robot.model), q)
        np.testing.assert_allclose(robot.configuration(q), expected, rtol=0.0, atol=1e-15)
    for wrong in ([0.0] * 4, [0.0] * 4 + [np.nan]):
        with pytest.raises(InputError, match=r"^q: expected"):
            robot.configuration(wrong)


def test_the_given_model_stays_its_owners() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "j")
    model.addFrame(pin.Frame("f", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    robot = Robot.from_model("r", model)
    model.addFrame(pin.Frame("late", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    assert robot.frames == ("world", "f")


# Several arms


def test_an_assembled_arm_moves_as_alone(robot: Robot) -> None:
    other = Robot.from_dh([DHRow("revolute", 0.3, 0.2, 0.1, 0.4), DHRow("prismatic", 0.3, 0.2, 0.1, 0.4)])
    tooled = robot.with_tool("needle", SHIFT)
    bases = {"left": (other, SHIFT), "right": (tooled, pose([0, 1, 0], -1.2, [0, 1, 0]))}
    both = Robot.assemble("both", bases)
    assert (both.name, both.tip, both.n) == ("both", "left/frame2", 7)
    prefixed = [f"{prefix}/{f}" for prefix, (arm, _) in bases.items() for f in arm.frames[1:]]
    assert sorted(both.frames) == sorted(["world", *prefixed])
    for q in random_q(both):
        k = both.kinematics(q)
        for prefix, (arm, base) in bases.items():
            columns = both.group(prefix)
            assert tuple(both.joints[i] for i in columns) == tuple(f"{prefix}/{j}" for j in arm.joints)
            alone, R = arm.kinematics(q[columns]), dq.rotation_matrix(base)
            turn = np.block([[R, np.zeros((3, 3))], [np.zeros((3, 3)), R]])
            for frame in arm.frames[1:]:
                got, expected = k.pose(f"{prefix}/{frame}"), dq.product(base, alone.pose(frame))
                np.testing.assert_allclose(dq.nearest_sign(got, expected), expected, rtol=0.0, atol=1e-12)
                J = k.jacobian(f"{prefix}/{frame}")
                np.testing.assert_allclose(J[:, columns], turn @ alone.jacobian(frame), rtol=0.0, atol=1e-12)


def test_assembled_arms_keep_their_limits_and_groups(robot: Robot) -> None:
    slow = robot.with_limits(velocity={"spin": 0.5}, acceleration={"arm": 3.0}, lower={"spin": -4.0})
    slow = slow.with_group("wrist", ["spin", "arm"])
    both = Robot.assemble("both", {"l": (slow, SHIFT), "r": (robot, SHIFT)})
    of = {j: tuple(row[i] for row in both.limits) for i, j in enumerate(both.joints)}
    for prefix, arm in (("l", slow), ("r", robot)):
        for i, joint_name in enumerate(arm.joints):
            assert of[f"{prefix}/{joint_name}"] == tuple(row[i] for row in arm.limits)
    assert both.groups["l/wrist"] == ("l/spin", "l/arm")
    assert set(both.groups) == {"all", "l", "r", "l/wrist"}
    assert both.groups["all"] == both.joints
    assert set(both.groups["l"]) | set(both.groups["r"]) == set(both.joints)


def test_assemblies_can_be_assembled(robot: Robot) -> None:
    pair = Robot.assemble("pair", {"l": (robot, SHIFT), "r": (robot, pose([1, 0, 0], 0.4, [1, 0, 0]))})
    four = Robot.assemble("four", {"x": (pair, SHIFT), "y": (pair, pose([0, 0, 1], 2.0, [0, 3, 0]))})
    assert four.tip == "x/l/tool"
    assert set(four.groups) == {"all", "x", "y", "x/l", "x/r", "y/l", "y/r"}
    q = random_q(four)[-1]
    inner = pair.kinematics(q[four.group("y")])
    expected = dq.product(pose([0, 0, 1], 2.0, [0, 3, 0]), inner.pose("r/tool"))
    got = four.kinematics(q).pose("y/r/tool")
    np.testing.assert_allclose(dq.nearest_sign(got, expected), expected, rtol=0.0, atol=1e-12)


def test_assemblies_that_are_none_are_refused(robot: Robot) -> None:
    with pytest.raises(InputError, match=r'robot "empty": expected at least one arm'):
        Robot.assemble("empty", {})
    with pytest.raises(InputError, match=r'^base of arm "l": expected a unit dual quaternion'):
        Robot.assemble("one", {"l": (robot, np.ones(8))})
