"""The MJCF files of the arms: the kinematics of the URDFs to the last digits, and dynamics that are plausible."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from primitives.errors import FileError, ModelError
from primitives.robot import Robot
from scenarios.plants.assembly import robot_spec
from scenarios.robots import RobotEntry, robots

Array = NDArray[np.float64]
ARMS = ("lwr4plus", "neuro8")


def random_q(robot: Robot, count: int = 20) -> list[Array]:
    rng = np.random.default_rng(5)
    lower, upper = robot.limits.lower, robot.limits.upper
    return [lower, upper, *(rng.uniform(lower, upper) for _ in range(count))]


def links(path: Path) -> dict[str, ElementTree.Element]:
    return {str(link.get("name")): link for link in ElementTree.parse(path).getroot().findall("link")}


@pytest.fixture(params=ARMS)
def entry(request: pytest.FixtureRequest) -> RobotEntry:
    return robots[request.param]


@pytest.fixture
def model(entry: RobotEntry) -> Any:
    return mujoco.MjModel.from_xml_path(str(entry.mjcf[""]))


def test_frames_and_jacobians_are_those_of_the_urdf(entry: RobotEntry) -> None:
    urdf, mjcf = entry.build(), Robot.from_mjcf(entry.mjcf[""], tip="tip")
    names = set(links(entry.urdf[""]))
    assert names <= set(mjcf.frames)
    assert set(mjcf.frames) - names == {"world", "handle", "sensor"}
    for q in random_q(urdf):
        a, b = urdf.kinematics(q), mjcf.kinematics(q)
        for frame in names:
            np.testing.assert_allclose(b.translation(frame), a.translation(frame), rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(b.rotation(frame), a.rotation(frame), rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(b.jacobian(frame), a.jacobian(frame), rtol=0.0, atol=1e-12)


def test_joints_and_their_ranges_are_those_of_the_urdf(entry: RobotEntry) -> None:
    urdf, mjcf = entry.build(), Robot.from_mjcf(entry.mjcf[""], tip="tip")
    assert mjcf.joints == urdf.joints
    assert np.array_equal(mjcf.limits.lower, urdf.limits.lower)
    assert np.array_equal(mjcf.limits.upper, urdf.limits.upper)


def test_forces_are_limited_as_in_the_urdf(entry: RobotEntry, model: Any) -> None:
    """The servo and the compensation of gravity share one limit."""
    efforts = {
        j.get("name"): float(j.find("limit").get("effort"))  # type: ignore[union-attr, arg-type]
        for j in ElementTree.parse(entry.urdf[""]).getroot().findall("joint")
        if j.find("limit") is not None
    }
    assert len(efforts) == model.njnt
    for i in range(model.njnt):
        assert model.jnt_actfrcrange[i].tolist() == [-efforts[model.joint(i).name], efforts[model.joint(i).name]]
        assert model.jnt_actfrclimited[i] and model.jnt_actgravcomp[i]


def test_links_weigh_what_the_urdf_says_and_the_tool_is_steel(entry: RobotEntry, model: Any) -> None:
    tools = {int(b) for b in model.geom_bodyid[model.geom_contype == 1]}
    assert tools
    for name, link in links(entry.urdf[""]).items():
        body = model.body(name)
        mass = link.find("inertial/mass")
        if body.id in tools:
            geoms = np.flatnonzero(model.geom_bodyid == body.id)
            volume = sum(np.pi * r**2 * (2.0 * half + 4.0 / 3.0 * r) for r, half, _ in model.geom_size[geoms])
            assert body.mass[0] == pytest.approx(7850.0 * volume, rel=1e-9)
        else:
            assert body.mass[0] == (float(str(mass.get("value"))) if mass is not None else 0.0)


def test_the_tool_has_the_size_of_the_papers() -> None:
    for name, radius, length in (("lwr4plus", 0.0035, 0.43), ("neuro8", 0.00175, 0.335)):
        model = mujoco.MjModel.from_xml_path(str(robots[name].mjcf[""]))
        size = model.geom("tool").size
        assert size[0] == radius
        ends = {"lwr4plus": 2.0 * radius, "neuro8": 0.0}[name]  # the LWR4+'s rod includes its rounded ends
        assert 2.0 * size[1] + ends == pytest.approx(length, rel=1e-12)


def test_only_the_tool_can_touch_and_not_itself(model: Any) -> None:
    assert set(model.geom_contype.tolist()) == {0, 1}
    assert not model.geom_conaffinity.any()


def test_handle_and_sensor_share_the_base_of_the_shaft(entry: RobotEntry) -> None:
    robot = Robot.from_mjcf(entry.mjcf[""], tip="tip")
    frame, offset = {"lwr4plus": ("flange", 0.0), "neuro8": ("shaft", -0.335)}[entry.name]
    for q in random_q(robot, 3):
        k = robot.kinematics(q)
        expected = k.translation(frame) + offset * k.rotation(frame)[:, 2]
        np.testing.assert_allclose(k.translation("handle"), expected, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(k.translation("sensor"), expected, rtol=0.0, atol=1e-15)


def test_servos_damp_every_mode_and_steps_of_1_ms_resolve_them(entry: RobotEntry, model: Any) -> None:
    """At 20 configurations: damping ratios of 0.3 to 3, modes of 5 Hz or more, none of more than 1 rad a step."""
    data = mujoco.MjData(model)
    stiffness, damping = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2] + model.dof_damping
    full = np.zeros((model.nv, model.nv))
    for q in random_q(entry.build(), 18):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        values, modes = np.linalg.eig(np.linalg.solve(full, np.diag(stiffness)))
        omega = np.sqrt(values.real)
        modal = [(v @ (damping * v)) / (v @ full @ v) for v in modes.T.real]
        ratio = np.array(modal) / (2.0 * omega)
        assert ratio.min() >= 0.3 and ratio.max() <= 3.0, ratio
        assert omega.min() / (2.0 * np.pi) >= 5.0, omega
        assert omega.max() * 1e-3 <= 1.0, omega


def test_the_pair_is_assembled_where_its_frames_are() -> None:
    entry = robots["neuro8-pair"]
    robot = entry.build()
    model = robot_spec(entry, robot).compile()
    data = mujoco.MjData(model)
    arms = set(links(entry.urdf["moving"]))
    names = {f"{prefix}/{link}" for prefix in entry.mjcf for link in arms}
    assert names <= {model.body(i).name for i in range(model.nbody)}
    for q in random_q(robot, 5):
        k = robot.kinematics(q)
        for joint, value in zip(robot.joints, q, strict=True):
            data.joint(joint).qpos = value
        mujoco.mj_kinematics(model, data)
        for name in names:
            np.testing.assert_allclose(data.body(name).xpos, k.translation(name), rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(data.body(name).xmat.reshape(3, 3), k.rotation(name), rtol=0.0, atol=1e-12)


def test_a_robot_without_mjcf_or_with_another_one_is_refused(tmp_path: Path) -> None:
    entry = robots["neuro8"]
    robot = entry.build()
    with pytest.raises(ModelError, match='robot "neuro8" has no MJCF file'):
        robot_spec(entry._replace(mjcf={}), robot)
    with pytest.raises(ModelError, match=r"has the joints joint1, .*; expected joint1"):
        robot_spec(entry._replace(mjcf=robots["lwr4plus"].mjcf), robot)
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco><worldbody><body name='base'><joint type='hinge'/></body></worldbody>")
    with pytest.raises(FileError, match=r"broken\.xml: MuJoCo cannot read this MJCF file"):
        robot_spec(entry._replace(mjcf={"": broken}), robot)
    broken.write_text("<mujoco><worldbody/></mujoco>")
    with pytest.raises(ModelError, match="expected one body in the world, the base of the arm, got 0"):
        robot_spec(entry._replace(mjcf={"": broken}), robot)
