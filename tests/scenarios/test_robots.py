"""Every registered robot, and the numbers of the two arms that the scenes rest on."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from dqrobotics.robot_modeling import DQ_SerialManipulatorDH, DQ_SerialManipulatorMDH
from numpy.typing import NDArray

from primitives.constraint import Constraint, ConstraintSet
from primitives.dh import DHRow
from primitives.elements import Line, Plane, Point
from primitives.errors import InputError, UnknownNameError
from primitives.evaluate import evaluate
from primitives.robot import Robot
from scenarios.robots import RobotEntry, lwr4plus, neuro8, neuro8_pair, robots, urdf_path

Array = NDArray[np.float64]
MM = 1e-3


def random_q(robot: Robot, seed: int = 0, count: int = 5) -> list[Array]:
    rng = np.random.default_rng(seed)
    lower, upper = robot.limits.lower, robot.limits.upper
    return [lower, upper, np.clip(np.zeros(robot.n), lower, upper), *(rng.uniform(lower, upper) for _ in range(count))]


def mujoco_model(path: Path) -> Any:
    return mujoco.MjModel.from_xml_path(str(path))


def agrees_with_mujoco(robot: Robot, prefix: str, model: Any, tolerance: float) -> None:
    """Every body that is no part of the ground, in the frame of the root, which MuJoCo puts at the origin."""
    data = mujoco.MjData(model)
    names = [model.body(i).name for i in range(1, model.nbody)]
    root = prefix + names[0]
    for q in random_q(robot):
        k = robot.kinematics(q)
        for i in range(model.njnt):
            data.qpos[model.jnt_qposadr[i]] = q[robot.joints.index(prefix + model.joint(i).name)]
        mujoco.mj_kinematics(model, data)
        for name in names:
            R = k.rotation(root).T @ k.rotation(prefix + name)
            t = k.rotation(root).T @ (k.translation(prefix + name) - k.translation(root))
            np.testing.assert_allclose(t, data.body(name).xpos, rtol=0.0, atol=tolerance)
            np.testing.assert_allclose(R, data.body(name).xmat.reshape(3, 3), rtol=0.0, atol=tolerance)


# Every robot


@pytest.fixture(params=robots.names())
def entry(request: pytest.FixtureRequest) -> RobotEntry:
    return robots[request.param]


def test_the_robots_of_the_scenes_are_there() -> None:
    assert {"neuro8", "neuro8-pair", "lwr4plus"} <= set(robots.names())
    with pytest.raises(UnknownNameError, match=r'unknown robot "neuro-8". Did you mean "neuro8"'):
        robots["neuro-8"]


def test_a_robot_is_built_as_its_entry_says(entry: RobotEntry) -> None:
    robot = entry.build()
    assert robot.name == entry.name
    assert "\n" not in entry.summary
    assert len(entry.summary) <= 100
    assert robot.tip in robot.frames
    lower, upper, velocity, _ = robot.limits
    assert np.isfinite([lower, upper, velocity]).all()
    assert (lower < upper).all()
    assert (velocity > 0.0).all()
    assert entry.build() is not robot


def test_what_is_drawn_is_a_frame(entry: RobotEntry) -> None:
    """Each link with a shape has a frame to draw it at, shapes have a colour, and numbers are complete."""
    robot = entry.build()
    assert entry.urdf
    for prefix, path in entry.urdf.items():
        root = ElementTree.parse(path).getroot()
        materials = {m.get("name") for m in root.findall("material")}
        shapes = 0
        for link in root.findall("link"):
            name = link.get("name")
            assert (f"{prefix}/{name}" if prefix else name) in robot.frames
            for visual in link.findall("visual"):
                material = visual.find("material")
                assert material is not None
                assert material.get("name") in materials
                shapes += 1
        assert shapes >= 3 * robot.n / len(entry.urdf)


def test_mujoco_reads_and_agrees(entry: RobotEntry) -> None:
    """MuJoCo keeps all links and shapes; a moving link has a mass, and nothing collides with itself."""
    robot = entry.build()
    for prefix, path in entry.urdf.items():
        model = mujoco_model(path)
        assert model.nq == model.nv == robot.n / len(entry.urdf)
        assert model.ngeom == len(list(ElementTree.parse(path).iter("visual")))
        assert not model.geom_contype.any()
        agrees_with_mujoco(robot, f"{prefix}/" if prefix else "", model, 1e-12)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 10)
        assert np.isfinite(data.qpos).all()


def test_the_entry_path_exists_as_a_file(entry: RobotEntry) -> None:
    for path in entry.urdf.values():
        assert path.is_file()
        assert path == urdf_path(path.stem)


def test_listing_robots_imports_no_library_for_kinematics() -> None:
    code = (
        "import sys; from scenarios.robots import robots\n"
        "print([robots[n].summary for n in robots.names()])\n"
        "heavy = {'numba', 'pinocchio', 'mujoco', 'scipy', 'dqrobotics', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert done.returncode == 0, done.stderr
    assert "neurosurgical" in done.stdout


@pytest.fixture
def table() -> Iterator[None]:
    """Puts the table of robots back as it was."""
    before = dict(robots._things)
    yield
    robots._things.clear()
    robots._things.update(before)


@pytest.mark.usefixtures("table")
def test_a_robot_from_outside_is_known_by_its_name() -> None:
    mine = RobotEntry("mine", "one joint", lambda: Robot.from_dh([DHRow("revolute", 0, 0, 0, 0)], name="mine"))
    assert robots.register(mine) is robots["mine"]
    assert robots["mine"].build().n == 1
    assert robots["mine"].urdf == {}
    with pytest.raises(InputError, match=r'robot "neuro8" is registered already; give yours another name'):
        robots.register(mine._replace(name="neuro8"))


@pytest.mark.usefixtures("table")
@pytest.mark.parametrize("change", [{"name": ""}, {"summary": ""}, {"summary": "two\nlines"}, {"build": None}])
def test_an_entry_that_says_too_little_is_refused(change: dict[str, Any]) -> None:
    entry = RobotEntry("mine", "one joint", lambda: Robot.from_dh([]))
    with pytest.raises(InputError, match=r"expected a name, a summary of one line and a function build\(\)"):
        robots.register(entry._replace(**change))
    assert "mine" not in robots.names()


# The neurosurgical arm


@pytest.fixture(scope="module")
def arm() -> Robot:
    return robots["neuro8"].build()


@pytest.fixture(scope="module")
def pair() -> Robot:
    return robots["neuro8-pair"].build()


def columns(table: tuple[DHRow, ...]) -> Array:
    return np.array([[r.theta, r.d, r.a, r.alpha, float(r.kind == "prismatic")] for r in table]).T


def test_neuro8_is_its_table(arm: Robot) -> None:
    by_table = Robot.from_dh(neuro8.DH_TABLE, convention="modified")
    twin = DQ_SerialManipulatorMDH(columns(neuro8.DH_TABLE))
    assert arm.joints == by_table.joints
    for got, expected in zip(arm.limits, by_table.limits, strict=True):
        assert np.array_equal(got, expected)
    for q in random_q(arm, count=20):
        k, by = arm.kinematics(q), by_table.kinematics(q)
        for i in range(8):
            frame = f"frame{i + 1}"
            np.testing.assert_allclose(k.rotation(frame), by.rotation(frame), rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(k.translation(frame), by.translation(frame), rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(k.jacobian(frame), by.jacobian(frame), rtol=0.0, atol=1e-12)
            x, twins = k.pose(frame), twin.raw_fkm(q, i).vec8()
            np.testing.assert_allclose(x * np.sign(x @ twins), twins, rtol=0.0, atol=1e-12)


def test_neuro8_shaft_and_tip(arm: Robot) -> None:
    for q in random_q(arm):
        k = arm.kinematics(q)
        assert np.array_equal(k.poses[k.place("shaft")], k.poses[k.place("frame6")])
        assert np.array_equal(k.jacobian("shaft"), k.jacobian("frame6"))
        assert not k.jacobian("shaft")[:, 6:].any()
        R, t = k.rotation("frame8"), k.translation("frame8")
        turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        np.testing.assert_allclose(k.translation("tip"), t + 0.012 * R[:, 0], rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(k.rotation("tip"), R @ turn, rtol=0.0, atol=1e-15)


def test_neuro8_ranges_are_the_documented_ones(arm: Robot) -> None:
    degrees = np.pi / 180.0
    np.testing.assert_allclose(
        arm.limits.upper, [0.06, 0.06, 45 * degrees, 45 * degrees, 0.32, 180 * degrees, 1.4, 1.4], rtol=1e-15
    )
    np.testing.assert_allclose(arm.limits.lower[4], 0.15)
    np.testing.assert_allclose(np.delete(arm.limits.lower, 4), -np.delete(arm.limits.upper, 4))
    assert arm.limits.velocity.tolist() == [0.05, 0.05, 0.5, 0.5, 0.05, 2.0, 2.0, 2.0]


def test_neuro8_through_the_mjcf_that_mujoco_exports(tmp_path: Path) -> None:
    """MuJoCo writes six digits and normalises, which is exact for this arm's placements and rounds its ranges."""
    spec = mujoco.MjSpec.from_file(str(urdf_path("neuro8")))
    spec.compile()
    path = tmp_path / "neuro8.xml"
    path.write_text(spec.to_xml())
    exported = Robot.from_mjcf(path, tip="tip")
    agrees_with_mujoco(exported, "", mujoco_model(path), 1e-12)
    agrees_with_mujoco(exported, "", mujoco_model(urdf_path("neuro8")), 1e-12)
    np.testing.assert_allclose(exported.limits[:2], robots["neuro8"].build().limits[:2], rtol=5e-6)


LINES = {
    "moving": ([-0.005, -0.011, 0.0], [0.0, -0.011, -0.045]),
    "parked": ([0.007, 0.002, 0.0], [0.002, 0.002, -0.062]),
}


@pytest.mark.parametrize("name", ["moving", "parked"])
def test_the_start_is_the_documented_one(pair: Robot, name: str) -> None:
    """readings.md gives the lines and the rounded joints; they hold to the last digit that is given."""
    q = neuro8_pair.start()
    k = pair.kinematics(q)
    through, end = LINES[name]
    t6, z6 = k.translation(f"{name}/shaft"), k.rotation(f"{name}/shaft")[:, 2]
    np.testing.assert_allclose(t6, end, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(np.cross(np.array(through) - t6, z6), 0.0, rtol=0.0, atol=1e-15)
    assert z6 @ (t6 - through) > 0.0
    rounded = {
        "moving": [-0.011, -0.001667, -0.110657, 0.0, 0.246754, 0.0, 0.15, 0.10],
        "parked": [0.002, -0.003645, 0.080471, 0.0, 0.26298, 0.0, 0.15, -0.10],
    }
    assert np.round(q[pair.group(name)], 6).tolist() == rounded[name]


def test_the_margins_at_the_start_are_the_documented_ones(pair: Robot) -> None:
    shaft, entry = Line.z_axis("moving/shaft"), Point.at([0.0, 0.0, 0.0])
    end = Point.at([0.0, 0.0, 0.0], frame="moving/shaft")
    tip = Point.at([0.0, 0.0, 0.0], frame="moving/tip")
    constraints = ConstraintSet(
        [
            Constraint("C1", shaft, Line.z_axis("parked/shaft"), "outside", 5 * MM),
            Constraint("C2", shaft, entry, "inside", 14 * MM),
            Constraint("C3", end, Line.through([0, 0, 0], [0, 0, 1]), "inside", 14 * MM),
            Constraint("C4", tip, Plane.through([0, 0, -80 * MM], [0, 0, 1]), "outside", 0.0),
        ]
    )
    q = neuro8_pair.start()
    margins = evaluate(pair, constraints, q).margin / MM
    assert np.round(margins, 2).tolist() == [8.0, 1.93, 3.0, 19.47]
    tip_at = pair.kinematics(q).translation("moving/tip") / MM
    assert np.round(tip_at, 3).tolist() == [2.931, -8.618, -60.532]


def test_the_pair_stands_on_its_bases(pair: Robot) -> None:
    assert (pair.n, pair.tip) == (16, "moving/tip")
    assert pair.group("moving").tolist() == list(range(8))
    assert pair.group("parked").tolist() == list(range(8, 16))
    assert pair.joints == tuple(f"{name}/joint{i}" for name in ("moving", "parked") for i in range(1, 9))
    k = pair.kinematics(neuro8_pair.start())
    for name, x in (("moving", -0.03), ("parked", 0.03)):
        assert np.array_equal(k.translation(f"{name}/base"), [x, 0.0, 0.29])
        assert np.array_equal(k.rotation(f"{name}/base"), np.eye(3))


def test_a_configuration_for_any_shaft_within_reach(arm: Robot) -> None:
    """From a random q to the shaft's line and back; the wrist and the roll leave the line alone."""
    rng = np.random.default_rng(8)
    base = np.array([0.3, -0.2, 0.7])
    for q in (rng.uniform(arm.limits.lower, arm.limits.upper) for _ in range(200)):
        k = arm.kinematics(q)
        end, z6 = k.translation("shaft") + base, k.rotation("shaft")[:, 2]
        found = neuro8.configuration_for_shaft(end - rng.uniform(0.01, 0.5) * z6, end, q[5:], base=base)
        np.testing.assert_allclose(found, q, rtol=0.0, atol=1e-13)


BAD_SHAFTS: list[tuple[Callable[[], Array], str]] = [
    (lambda: neuro8.configuration_for_shaft([0, 0, 0], [0, 0, 0], [0, 0, 0]), "expected a direction"),
    (lambda: neuro8.configuration_for_shaft([0, 0, 0], [0, 0, 0.1], [0, 0, 0]), "expected an end below the point"),
    (lambda: neuro8.configuration_for_shaft([0, 0, 0], [0.1, 0, 0], [0, 0, 0]), "expected an end below the point"),
    (lambda: neuro8.configuration_for_shaft([0, 0, 0], [0, np.nan, 0], [0, 0, 0]), "^end of the shaft: expected"),
    (lambda: neuro8.configuration_for_shaft([0, 0], [0, 0, -0.3], [0, 0, 0]), "^point of the shaft: expected"),
    (lambda: neuro8.configuration_for_shaft([0, 0, 0], [0, 0, -0.3], [0, 0]), "^wrist: expected shape"),
    (lambda: neuro8.configuration_for_shaft([0, 0, 0], [0, 0, -0.1], [0, 0, 0]), "joint5 of neuro8: this shaft needs"),
    (lambda: neuro8.configuration_for_shaft([0, 0.1, 0], [0, 0.1, -0.3], [0, 0, 0]), "joint1 of neuro8"),
    (lambda: neuro8.configuration_for_shaft([0, 0, -0.2], [-0.3, 0, -0.3], [0, 0, 0]), "of neuro8: this shaft needs"),
    (
        lambda: neuro8.configuration_for_shaft([0, 0, 0], [0, 0, -0.3], [0, 0, 1.5]),
        "joint8 .* 1.5, its range is -1.4 to",
    ),
]


@pytest.mark.parametrize(("ask", "message"), BAD_SHAFTS)
def test_a_shaft_out_of_reach_is_refused(ask: Callable[[], Array], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ask()


# The LWR4+


@pytest.fixture(scope="module")
def lwr() -> Robot:
    return robots["lwr4plus"].build()


def test_lwr4plus_is_its_table(lwr: Robot) -> None:
    by_table = Robot.from_dh(lwr4plus.DH_TABLE)
    twin = DQ_SerialManipulatorDH(columns(lwr4plus.DH_TABLE))
    assert lwr.joints == by_table.joints
    for got, expected in zip(lwr.limits, by_table.limits, strict=True):
        assert np.array_equal(got, expected)
    for q in random_q(lwr, count=20):
        k, by = lwr.kinematics(q), by_table.kinematics(q)
        np.testing.assert_allclose(k.rotation("link7"), by.rotation("frame7"), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(k.translation("link7"), by.translation("frame7"), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(k.jacobian("link7"), by.jacobian("frame7"), rtol=0.0, atol=1e-12)
        x, twins = k.pose("link7"), twin.fkm(q).vec8()
        np.testing.assert_allclose(x * np.sign(x @ twins), twins, rtol=0.0, atol=1e-12)


def test_lwr4plus_flange_and_tool_lie_along_the_last_axis(lwr: Robot) -> None:
    for q in random_q(lwr):
        k = lwr.kinematics(q)
        z7, t7 = k.rotation("link7")[:, 2], k.translation("link7")
        np.testing.assert_allclose(k.translation("flange"), t7 + 0.078 * z7, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(k.translation("tip"), t7 + 0.508 * z7, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(k.rotation("tip"), k.rotation("link7"), rtol=0.0, atol=1e-15)


def test_lwr4plus_first_pose_of_the_paper(lwr: Robot) -> None:
    """The tool is vertical, points down and passes p_c as closely as p_c's four digits allow."""
    k = lwr.kinematics(np.deg2rad([20.0, 50.0, 0.0, -70.0, 0.0, 60.0, 0.0]))
    n_t, p_t = k.rotation("tip")[:, 2], k.translation("tip")
    np.testing.assert_allclose(n_t, [0.0, 0.0, -1.0], rtol=0.0, atol=1e-15)
    off = float(np.linalg.norm(np.cross(np.array([-0.6053, -0.2203, 0.0]) - p_t, n_t)))
    assert round(off, 6) == 2.7e-5


def test_lwr4plus_ranges_are_the_documented_ones(lwr: Robot) -> None:
    lower, upper, velocity, _ = np.rad2deg(lwr.limits)
    np.testing.assert_allclose(upper, [170, 120, 170, 120, 170, 120, 170], rtol=1e-14)
    np.testing.assert_allclose(lower, -upper, rtol=1e-14)
    np.testing.assert_allclose(velocity, [110, 110, 128, 128, 204, 184, 184], rtol=1e-14)
