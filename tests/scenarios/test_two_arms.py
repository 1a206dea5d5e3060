"""two-arms in three ways: what each keeps, clearances by another formula, one controller an arm, scene and errors."""

import json
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Plane, Point
from primitives.errors import FileError, InactiveConstraintError, InputError, UnknownNameError
from primitives.evaluate import evaluate
from scenarios.analysis.between import PARTS, margins_between
from scenarios.analysis.metrics import summary
from scenarios.cli import app
from scenarios.coordination import SeparateControllers, constraints_of
from scenarios.enforcement import Enforcement
from scenarios.run import build, run
from scenarios.scene_file import dump_scene, load_scene
from tests.vfi.arms import Oracle
from vfi.controller import Controller
from vfi.messages import Measurement
from vfi.outcome import State
from vfi.tasks import PoseTask

BETWEEN = ["shafts", "wrists", "wrist-shaft", "shaft-wrist"]
WAYS = ["central", "static", "velocity"]
SCENE = load_scene("two-arms")
ROBOT = SCENE.build_robot()
RADIUS, SAFE = 0.00175, 0.0045
PERIODS = [0.008, pytest.param(0.004, marks=pytest.mark.campaign)]


def gains(shared):
    return {"": 0.5, **dict.fromkeys(BETWEEN, shared)}


@cache
def trace(way, period=0.008, guard="act", shared=0.5):
    if way == "none":
        return run(SCENE.with_changes(constraints=SCENE.constraints.enforcing(())), period=period)
    return run(
        SCENE.with_changes(coordination=way, enforcement=Enforcement(eta=gains(shared))), period=period, guard=guard
    )


@cache
def between(*args, **options):
    return margins_between(trace(*args, **options), ROBOT, SCENE.constraints)


def smallest(names, *args, **options):
    return between(*args, **options)[:, [SCENE.constraints.names.index(name) for name in names]].min()


def own():
    return [name for name in SCENE.constraints.names if name not in BETWEEN]


def tip_distances(*args, **options):
    return [d["rms"] for d in summary(trace(*args, **options))["tip_distance_m"].values()]


# What each way keeps -------------------------------------------------------------------------------------------------


def test_references_collide_where_nothing_is_enforced():
    """The axes come nearer than the sum of the radii."""
    assert smallest(BETWEEN, "none") < 2 * RADIUS - SAFE - 0.001
    assert max(tip_distances("none")) < 2e-4


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("way", WAYS)
def test_all_keep_all_margins_at_a_low_gain(way, period):
    got = summary(trace(way, period))
    assert got["violated"] == [] and got["infeasible_cycles"] == 0 and got["stopped_cycles"] == 0
    assert got["cycles"] == round(18 / period) and got["coordination"] == way
    assert smallest(SCENE.constraints.names, way, period) > 0.0


@pytest.mark.parametrize("way", WAYS)
def test_tools_stay_apart_without_the_guard(way):
    assert smallest(BETWEEN, way, guard="off") > 5e-5
    assert summary(trace(way, guard="off"))["guard_interventions"] == 0


def test_guard_keeps_the_ports_where_rows_alone_do_not():
    assert smallest(own(), "central", guard="off") < -5e-5
    assert smallest(own(), "central") > 0.0


@pytest.mark.parametrize("period", PERIODS)
def test_static_comes_nearer_and_does_so_with_twice_the_gain_while_both_approach(period):
    assert 0.0 < smallest(BETWEEN, "static", period) < 0.5 * smallest(BETWEEN, "central", period)
    waiting = slice(round(4.0 / period), round(6.0 / period))
    static, twice, once = (
        np.min([found.margin(name) for name in BETWEEN], axis=0)[waiting]
        for found in (trace("static", period), trace("central", period, shared=1.0), trace("central", period))
    )
    np.testing.assert_allclose(static, twice, rtol=0.05)
    assert (static < 0.5 * once).all()


def test_both_arms_yield_together_and_static_lags_behind_what_it_follows():
    for way in WAYS:
        assert min(tip_distances(way)) > 1e-3
    following = np.searchsorted(trace("central").t, 8.99)
    off = {way: np.linalg.norm(trace(way)["error"][following, :8]) for way in WAYS}
    assert off["static"] > 2.0 * max(off["central"], off["velocity"])


def alternation(way, begin, end):
    """Median size of what alternates from cycle to cycle in the rate of the smallest margin, m/s."""
    found = trace(way, guard="off")
    rate = np.diff(np.min([found.margin(name) for name in BETWEEN], axis=0)) / 0.008
    part = rate[round(begin / 0.008) : round(end / 0.008)]
    return np.median(np.abs(np.diff(part, n=2))) / 4.0


def test_velocity_alternates_and_the_alternation_grows_as_the_recursion_says():
    """s_k = -2 eta m_k - s_(k-1), m_(k+1) = m_k + T s_k: eigenvalue -(eta T + sqrt(1 + (eta T)^2))."""
    T, eta = 0.008, 0.5
    values = np.linalg.eigvals([[1.0, T], [-2.0 * eta, -1.0 - 2.0 * eta * T]])
    fastest = values[np.argmax(np.abs(values))].real
    assert fastest == pytest.approx(-(eta * T + np.hypot(1.0, eta * T)))
    growth = alternation("velocity", 5.5, 6.0) / alternation("velocity", 4.0, 4.5)
    assert growth == pytest.approx(abs(fastest) ** (1.5 / T), rel=0.1)
    assert alternation("velocity", 5.5, 6.0) > 1e-4
    assert max(alternation(way, 5.5, 6.0) for way in ("central", "static")) < 1e-6


@pytest.mark.parametrize("period", PERIODS)
def test_accelerations(period):
    rough = {way: summary(trace(way, period))["acceleration_rms"] for way in WAYS}
    assert rough["velocity"] > 3.0 * rough["central"]
    assert rough["static"] < 1.1 * rough["central"]


def test_at_a_high_gain_only_one_program_keeps_the_margin():
    """eta T = 0.8: static allows 2 eta T = 1.6; velocity breaks down, guard or not."""
    near = {way: smallest(BETWEEN, way, shared=100.0) for way in WAYS}
    assert near["central"] > -2e-6
    assert -1e-4 < near["static"] < -1e-5
    assert near["velocity"] < -2e-4
    assert summary(trace("velocity", shared=100.0))["infeasible_cycles"] > 10
    assert summary(trace("central", shared=100.0))["infeasible_cycles"] == 0


def test_half_the_gain_gives_two_controllers_the_approach_of_one():
    half = trace("static", shared=0.25)
    margin = np.array([half.margin(name) for name in BETWEEN])
    rate = np.diff(margin, axis=1) / 0.008
    assert (rate >= -0.5 * margin[:, :-1] - 1e-4).all()
    assert smallest(BETWEEN, "static", shared=0.25) > smallest(BETWEEN, "central")


# Clearance by another formula ----------------------------------------------------------------------------------------


def segment_distance(first, second):
    """Distances (N,) of segments given as geometries (N, 8): ternary search along one, the foot on the other."""

    def away(s):
        p = first[:, :3] + s[:, None] * first[:, 3:6]
        t = np.clip(np.einsum("ni,ni->n", p - second[:, :3], second[:, 3:6]), 0.0, second[:, 6])
        return np.linalg.norm(p - second[:, :3] - t[:, None] * second[:, 3:6], axis=1)

    low, high = np.zeros(len(first)), first[:, 6].copy()
    for _ in range(120):
        a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
        left = away(a) <= away(b)
        low, high = np.where(left, low, a), np.where(left, b, high)
    return away(0.5 * (low + high))


@pytest.mark.parametrize("way", ["none", *WAYS])
def test_clearance_at_and_between_samples_by_pinocchio_and_search(way):
    """Every fortieth cycle, at the cycle and at the places between it and the next."""
    found = trace(way)
    q, qdot = found["q"][::40], found["qdot"][::40]
    oracle = Oracle(ROBOT, SCENE.constraints)
    places = SCENE.constraints.names
    near = np.full((len(q), len(BETWEEN)), np.inf)
    for part in range(PARTS):
        frames = oracle.frames(q + part / PARTS * 0.008 * qdot)
        for i, name in enumerate(BETWEEN):
            c = SCENE.constraints[name]
            d = segment_distance(*(Oracle._world(e, frames) for e in (c.first, c.second))) - c.safe_distance
            near[:, i] = np.minimum(near[:, i], d)
            if part == 0:
                np.testing.assert_allclose(found.margin(name)[::40], d, atol=1e-9)
    ours = between(way)[::40][:, [places.index(name) for name in BETWEEN]]
    np.testing.assert_allclose(ours, near, atol=1e-9)


# One controller an arm -----------------------------------------------------------------------------------------------


def separate(way, **changes):
    built = build(SCENE.with_changes(coordination=way, **changes), solver="active-set")
    assert isinstance(built, SeparateControllers)
    return built


@pytest.mark.parametrize("way", WAYS)
def test_sixteen_joints_are_decided_and_recorded(way):
    found = trace(way)
    assert found.header["decided"] == list(ROBOT.joints) and found["qdot"].shape[1] == 16
    q = found["q"]
    np.testing.assert_allclose(q[1:], q[:-1] + 0.008 * found["qdot"][:-1], atol=1e-12)
    assert (np.abs(found["qdot"]).max(axis=0) > 0.0).all()
    assert found.columns == trace("central").columns and found["error"].shape[1] == 16


@pytest.mark.parametrize("way", ["static", "velocity"])
def test_joint_record_is_that_of_both_controllers(way):
    joint = separate(way)
    rng = np.random.default_rng(7)
    q, qdot = np.array(SCENE.start), 0.01 * rng.normal(size=16)
    x = [np.array(ROBOT.kinematics(q).pose(t.frame)) for t in SCENE.tasks]
    command = joint.step(Measurement(0.0, q, qdot), np.concatenate(x))
    for k, arm in enumerate(SCENE.arms):
        seen = qdot if way == "velocity" else np.zeros(16)
        alone = Controller(
            ROBOT,
            constraints_of(ROBOT, SCENE.constraints, arm),
            SCENE.tasks[k],
            period=0.008,
            group=arm,
            eta=0.5,
        ).step(Measurement(0.0, q, seen), x[k])
        np.testing.assert_array_equal(command.qdot[ROBOT.group(arm)], alone.qdot)
        assert all(command.multipliers[n] >= alone.multipliers[n] for n in SCENE.constraints.names)
    np.testing.assert_array_equal(command.record[joint.columns["q"]], q)
    assert command.record[joint.columns["cycle_us"]][0] > 0.0
    assert command.expires == pytest.approx(0.016) and command.state == State.RUN


def test_measured_velocities_reach_the_controllers_of_one_way_only():
    """The other arm comes on fast: who knows it gives way, who takes it to stand still does not."""
    q = trace("central")["q"][500]
    x = np.concatenate([ROBOT.kinematics(q).pose(t.frame) for t in SCENE.tasks])
    qdot = np.zeros(16)
    # The parked arm towards the moving one: down the gradient of the distance.
    row = evaluate(ROBOT, SCENE.constraints, q).jacobian[SCENE.constraints.names.index("shafts"), 8:]
    qdot[8:] = -0.02 * row / np.linalg.norm(row)
    moved = {way: separate(way).step(Measurement(0.0, q, qdot), x).qdot for way in ("static", "velocity")}
    still = separate("velocity").step(Measurement(0.0, q, np.zeros(16)), x).qdot
    np.testing.assert_array_equal(moved["static"], still)
    assert np.abs(moved["velocity"] - still)[:8].max() > 1e-3


def test_state_and_words_of_the_arm_that_is_worse_off():
    joint = separate("static")
    q = np.array(SCENE.start)
    x = np.concatenate([ROBOT.kinematics(q).pose(t.frame) for t in SCENE.tasks])
    x[8:12] *= 1.1
    command = joint.step(Measurement(0.0, q, np.zeros(16)), x)
    assert command.state == State.FAULT and command.reason.startswith("parked: reference")
    assert command.record[joint.columns["state"]][0] == State.FAULT
    assert not command.qdot[8:].any()


def test_constraints_of_an_arm_are_those_it_can_influence():
    names = {arm: [c.name for c in constraints_of(ROBOT, SCENE.constraints, arm) if c.enforced] for arm in SCENE.arms}
    assert names["moving"] == [*BETWEEN, "moving-port", "moving-end", "moving-floor"]
    assert names["parked"] == [*BETWEEN, "parked-port", "parked-end", "parked-floor"]


def test_constraint_that_no_arm_can_influence_is_refused():
    stuck = Constraint("stuck", Point.at([0, 0, 0]), Plane.through([0, 0, -1], [0, 0, 1]), "outside", 0.0)
    for way in WAYS:
        scene = SCENE.with_changes(coordination=way, constraints=SCENE.constraints + stuck)
        with pytest.raises(InactiveConstraintError, match='"stuck"'):
            build(scene, solver="active-set")


# The scene and its errors --------------------------------------------------------------------------------------------


def test_scene_goes_to_a_file_and_back(tmp_path):
    file = tmp_path / "again.yaml"
    for way in WAYS:
        scene = SCENE.with_changes(coordination=way)
        file.write_text(dump_scene(scene))
        assert load_scene(file) == scene


def test_one_task_in_a_list_is_one_task(tmp_path):
    single = load_scene("S5")
    listed = single.with_changes(task=(single.task,), reference=[single.reference])
    assert listed == single and listed.tasks == (single.task,)


REFUSED = [
    ({"reference": SCENE.references[:1]}, InputError, "expected one a task, 2, in their order, got 1"),
    ({"reference": (*SCENE.references, SCENE.references[0])}, InputError, "expected one a task, 2"),
    ({"arms": ("moving",)}, InputError, "expected one joint group a task, 2, got moving"),
    ({"arms": (), "coordination": "static"}, InputError, '"static" is for several arms, got 0'),
    ({"coordination": "centrl"}, UnknownNameError, 'Did you mean "central"'),
]


@pytest.mark.parametrize(("changes", "error", "words"), REFUSED)
def test_scene_refuses(changes, error, words):
    with pytest.raises(error, match=words):
        SCENE.with_changes(**changes)


@pytest.mark.parametrize("arms", [("moving", "moving"), ("moving", "all")])
def test_arms_that_share_joints_are_refused(arms):
    with pytest.raises(InputError, match="share no joint and are all together"):
        SCENE.with_changes(arms=arms).build_robot()


def test_tasks_of_one_frame_twice_are_refused():
    twice = SCENE.with_changes(task=(PoseTask("moving/tip"), PoseTask("moving/tip")))
    with pytest.raises(InputError, match="different frames"):
        build(twice, solver="active-set")


def test_task_of_an_arm_that_is_not_its_own_is_refused():
    """The order of the arms is that of the tasks."""
    crossed = SCENE.with_changes(arms=("parked", "moving"), coordination="static")
    with pytest.raises(InputError, match='no joint of the group "parked" moves the frame "moving/tip"'):
        build(crossed, solver="active-set")


def test_file_names_every_problem_with_its_line(tmp_path):
    lines = dump_scene(SCENE.with_changes(constraints=ConstraintSet())).splitlines()
    place = {what: next(i for i, line in enumerate(lines) if what in line) for what in ("moving/tip", "coordination")}
    lines[place["moving/tip"]] = lines[place["moving/tip"]].replace("moving/tip", "moving/tpi")
    lines[place["coordination"]] = "coordination: centrall"
    file = tmp_path / "broken.yaml"
    file.write_text("\n".join(lines))
    with pytest.raises(FileError) as caught:
        load_scene(file)
    said = str(caught.value)
    assert f"{file}:{place['moving/tip'] + 1}: task[0].frame: unknown frame" in said
    assert f'{file}:{place["coordination"] + 1}: coordination: unknown coordination "centrall". Did you mean' in said


def test_command_line_shows_the_ways_side_by_side(tmp_path):
    """Of a scene of 2 s, which takes no longer than its figures need."""
    out, file = tmp_path / "out", tmp_path / "two-arms.yaml"
    file.write_text(dump_scene(SCENE.with_changes(duration=2.0)))
    result = CliRunner().invoke(
        app, ["run", str(file), "--coordination", "central,static,velocity", "--json", "--out", str(out)]
    )
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)
    assert [r["coordination"] for r in rows] == WAYS
    assert all(set(r["tip_distance_m"]) == {"moving/tip", "parked/tip"} for r in rows)
    assert all(set(r["min_margin_between_m"]) == set(SCENE.constraints.names) for r in rows)
    assert sorted(p.name for p in out.glob("*.mcap")) == [f"two-arms-{way}.mcap" for way in WAYS]


WRONG = [
    (["two-arms", "--coordination", "central,none"], "none"),
    (["two-arms", "--coordination", "static,static"], "named twice"),
    (["S5", "--coordination", "static"], "for several arms"),
    (["bowl-tool", "--coordination", "static"], "--coordination"),
]


@pytest.mark.parametrize(("arguments", "words"), WRONG)
def test_command_line_refuses(arguments, words):
    result = CliRunner().invoke(app, ["run", *arguments])
    assert result.exit_code == 2
    assert words in result.stderr


def test_constraint_sets_of_the_two_arms_are_one_declaration():
    sets = [constraints_of(ROBOT, SCENE.constraints, arm) for arm in SCENE.arms]
    assert all(isinstance(s, ConstraintSet) and s.names == SCENE.constraints.names for s in sets)
