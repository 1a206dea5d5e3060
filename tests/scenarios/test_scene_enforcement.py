"""How a scene is enforced: the same words for every kind, what the command line changes, clouds on trajectories."""

import json
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from primitives import dual_quaternion as dq
from primitives.errors import InputError, UnknownNameError
from scenarios.analysis.between import margins_at, margins_between
from scenarios.analysis.metrics import summary
from scenarios.anatomy.parts import build_parts
from scenarios.check import check_any
from scenarios.cli import app
from scenarios.enforcement import FORMS, GUARDS, METHODS, METRICS, Enforcement, chosen
from scenarios.hands_on.scene_file import dump_hands_on
from scenarios.resolved import resolved_scene
from scenarios.run import build, run
from scenarios.scene_file import dump_scene, load_any, load_scene
from vfi.forms import Soft

ARMS = ("lwr4plus", "neuro8")
GAIN = st.floats(1e-6, 1e6)
NUMBERS = {"eta": GAIN | st.fixed_dictionaries({"": GAIN}, optional={"C2": GAIN, "C4": GAIN}), "limit_eta": GAIN}
NAMES = {"guard": st.sampled_from(GUARDS), "reach": st.floats(1e-6, 1.0)}
FORM = st.sampled_from(FORMS[:2]) | st.builds(Soft, GAIN)
OPTIONS = {**NUMBERS, **NAMES, "forms": st.dictionaries(st.just("C2"), FORM)}


def enforcements(*methods: str, **more):
    return st.fixed_dictionaries({}, optional={"method": st.sampled_from(methods), **OPTIONS, **more}).map(
        lambda keys: Enforcement(**keys)
    )


def loaded(folder, text):
    file = folder / "scene.yaml"
    file.write_text(text, encoding="utf-8")
    return load_any(file)


ROUNDS = settings(suppress_health_check=list(HealthCheck), deadline=None, max_examples=40)


@ROUNDS
@given(enforcements("none", "vfi"), st.integers(0, 2**40), st.sampled_from(["kinematic", "mujoco"]))
def test_a_trajectory_scene_loses_nothing(tmp_path, enforcement, seed, plant):
    scene = load_scene("S5").with_changes(enforcement=enforcement, seed=seed, plant=plant)
    assert loaded(tmp_path, dump_scene(scene)) == scene


@ROUNDS
@given(enforcements(*METHODS, metric=st.sampled_from(METRICS)), st.integers(0, 2**40))
def test_a_scene_by_hand_loses_nothing(tmp_path, enforcement, seed):
    scene = load_scene("S5-hand").with_changes(enforcement=enforcement, seed=seed)
    assert loaded(tmp_path, dump_scene(scene)) == scene


@ROUNDS
@given(st.sampled_from(METHODS), GAIN, st.sampled_from(METRICS), st.sampled_from(["kinematic", "mujoco"]))
def test_a_hands_on_scene_loses_nothing(tmp_path, method, eta, metric, plant):
    how = Enforcement(method, eta={"bowl": eta}, metric=metric)
    scene = load_any("bowl-tip").with_changes(enforcement=how, plant=plant, seed=7)
    assert loaded(tmp_path, dump_hands_on(scene)) == scene


def test_each_kind_has_its_defaults():
    by_hand, hands_on = load_scene("S5-hand"), load_any("bowl-tip")
    assert load_scene("S5").in_force[:4] == ("vfi", 0.5, 5.0, "act")
    assert by_hand.in_force[:4] == ("vfi", 0.5, 5.0, "act")
    assert chosen(by_hand, enforcement="admittance").in_force.guard == "off"
    assert hands_on.in_force[:4] == ("admittance", 62.5, 5.0, "off")
    assert chosen(hands_on, enforcement="both", period=0.002).in_force[:4] == ("both", 125.0, 5.0, "act")
    assert hands_on.in_force.reach == hands_on.parameters.d_0 + 0.005


def test_a_base_gives_its_enforcement_as_a_whole(tmp_path):
    (tmp_path / "below.yaml").write_text(dump_scene(load_scene("S5")), encoding="utf-8")
    scene = loaded(tmp_path, "base: below.yaml\nenforcement: {guard: watch}\n")
    assert scene.enforcement == Enforcement(guard="watch") and scene.constraints == load_scene("S5").constraints
    assert loaded(tmp_path, "base: below.yaml\nenforcement: none\n").enforcement == Enforcement("none")


# Runs


def test_none_watches_what_the_scene_enforces():
    scene = load_scene("S5").with_changes(duration=2.0)
    free = scene.with_changes(constraints=scene.constraints.enforcing([]))
    trace = run(scene, enforcement="none")
    assert np.array_equal(trace["q"], run(free)["q"])
    assert (trace.header["enforcement"], trace.header["enforced"]) == ("none", [])
    assert resolved_scene(trace).enforcement.method == "none", "the trace holds the scene that was run"


def test_the_scene_and_the_arguments_say_the_same():
    scene = load_scene("S5").with_changes(duration=0.5)
    said = scene.with_changes(enforcement=Enforcement("vfi", 0.5, 5.0, "watch"), seed=4)
    a, b = run(said), run(scene, guard="watch", seed=4)
    assert np.array_equal(a["q"], b["q"]) and a.header["guard"] == b.header["guard"] == "watch"
    assert a.header["seed"] == b.header["seed"] == 4
    assert run(said, guard="off").header["guard"] == "off"


def test_the_command_line_overrides_the_scene(tmp_path):
    scene = load_scene("S5").with_changes(duration=0.4, enforcement=Enforcement("none", guard="off"), seed=9)
    file = tmp_path / "mine.yaml"
    file.write_text(dump_scene(scene), encoding="utf-8")
    found = {}
    for options in ((), ("--enforcement", "vfi", "--guard", "act", "--seed", "1", "--plant", "mujoco")):
        done = CliRunner().invoke(app, ["run", str(file), *options, "--json"])
        assert done.exit_code == 0, done.output
        (found[options],) = json.loads(done.stdout)
    told = [[r[key] for key in ("enforcement", "guard", "seed", "plant")] for r in found.values()]
    assert told == [["none", "off", 9, "kinematic"], ["vfi", "act", 1, "mujoco"]]


@pytest.mark.parametrize("form", ["equality", Soft(1e8)])
def test_a_port_is_kept_in_the_form_of_the_scene(form):
    """S3's entry point has room of 14 mm; these forms draw the shaft to the point itself, and faster than 1 / eta."""
    scene = load_scene("S3").with_changes(duration=4.0)
    how = Enforcement(eta={"": 0.5, "C2": 5.0}, forms={"C2": form})
    margin = run(scene.with_changes(enforcement=how)).margin("C2")
    assert run(scene).margin("C2")[-1] < 0.013 and margin[-1] == pytest.approx(0.014, abs=1e-5)


def test_mujoco_follows_as_the_ideal_plant_does():
    scene = load_scene("S5").with_changes(duration=2.0)
    ideal, physics = run(scene), run(scene, plant="mujoco")
    assert physics.header["plant"] == "mujoco"
    apart = np.abs(physics["q"] - ideal["q"]).max()
    assert 0.0 < apart < 2e-3, "servos give way a little"
    robot = scene.build_robot()
    middle = margins_at(robot, scene.constraints, 0.5 * (physics["q"][:-1] + physics["q"][1:]))
    assert (margins_between(physics, robot, scene.constraints)[:-1] <= middle + 1e-15).all()


def test_a_hand_along_a_trajectory_needs_the_ideal_plant():
    with pytest.raises(InputError, match='plant "mujoco" of scene S5-hand'):
        load_scene("S5-hand").with_changes(plant="mujoco")


# Clouds on a trajectory


@cache
def bowl(robot: str):
    scene = load_any("bowl-path", robot)
    return scene, build_parts(scene.anatomy)


@pytest.mark.parametrize("robot", ARMS)
def test_a_trajectory_is_kept_out_of_a_bowl(robot):
    """Margins by another way: the nearest of all points to places along the tool, at cycles and between them."""
    scene, parts = bowl(robot)
    free, kept = (run(scene, enforcement=e, parts=parts) for e in ("none", "vfi"))
    assert free.margin("bowl").min() < -1e-3, "the reference leads beyond the wall"
    assert kept.margin("bowl").min() > -1e-7 and summary(kept)["stopped_cycles"] == 0
    assert kept.margin("port").min() > scene.constraints["port"].safe_distance - 1e-4
    arm, cloud, c = scene.build_robot(), parts["bowl"].cloud, scene.constraints["bowl"]
    clouds = {"bowl": cloud}
    q = kept["q"][::200]
    found = margins_at(arm, scene.constraints, q, clouds)[:, scene.constraints.names.index("bowl")]
    np.testing.assert_allclose(found, kept.margin("bowl")[::200], atol=1e-9)
    along = np.linspace(0.0, 1.0, 2001)[:, None]
    for row, margin in zip(q, found, strict=True):
        pose = arm.kinematics(row).pose(c.first.frame)
        start = dq.translation(pose) + dq.rotation_matrix(pose) @ c.first.geometry[:3]
        end = start + c.first.geometry[6] * dq.rotation_matrix(pose) @ c.first.geometry[3:6]
        nearest = cloud.distance(start + along * (end - start)).min() - c.safe_distance
        assert margin <= nearest + 1e-12 and nearest - margin < 1e-5
    assert margins_between(kept, arm, scene.constraints, clouds)[:, 0].min() > -1e-6


@pytest.mark.parametrize("robot", ARMS)
def test_a_scene_with_a_cloud_is_checked_and_dumped(robot, tmp_path):
    scene, _ = bowl(robot)
    assert loaded(tmp_path, dump_scene(scene)) == scene
    report = check_any(scene.with_changes(duration=2.0))
    assert report.ok and {"clouds", "feasibility"} <= {part.name for part in report.parts}
    gains = {row["name"]: row["gain_T"] for part in report.parts if part.name == "gains" for row in part.rows}
    assert gains["bowl"] == pytest.approx(10.0 * 0.004)


def test_a_cloud_lies_where_the_world_says():
    scene, parts = bowl("neuro8")
    centre = np.array(scene.anatomy.at)
    away = np.linalg.norm(parts["bowl"].cloud.world_points - centre, axis=1)
    np.testing.assert_allclose(away, scene.anatomy.radius, atol=1e-4)


def test_a_cloud_without_anatomy_is_refused():
    with pytest.raises(UnknownNameError, match='part of the anatomy "bowl"'):
        bowl("neuro8")[0].with_changes(anatomy=None)
    with pytest.raises(InputError, match='for the solver "active-set"'):
        build(bowl("neuro8")[0], solver="proxqp", parts=bowl("neuro8")[1])
