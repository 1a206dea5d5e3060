"""Closed loops on two arms with random constraints of every pair, judged by Pinocchio at and between the samples."""

import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from primitives.compiled import JIT_DISABLED
from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Plane, Point, Segment
from primitives.evaluate import Entity, evaluate
from primitives.registry import pairs
from tests.primitives.pair_cases import CASES
from tests.primitives.qps import cases
from tests.vfi.arms import (
    START,
    Array,
    Mover,
    Oracle,
    Run,
    closed_loop,
    pair,
    paper_constraints,
    paper_reference,
    pose,
    random_constraints,
    random_unit,
    seven,
)
from vfi.controller import Controller
from vfi.messages import Measurement
from vfi.outcome import State
from vfi.tasks import PoseTask, VelocityTask

PERIODS = (1e-4, 1e-3, 4e-3, 8e-3, 2e-2)
SEVEN, PAIR = seven(), pair()
AWAKE = np.array([0.3, 0.5, 0.1, -1.2, 0.2, 0.8, 0.1])
RUNS = cases(60, 8)
CYCLES = cases(300, 60)


class Scene(NamedTuple):
    """A random scene and what is needed to run it; the same number gives the same scene."""

    controller: Callable[..., Controller]
    start: Array
    reference: Callable[[float], Array]
    others: Callable[[float], Array] | None
    movers: dict[str, Mover]
    oracle: Oracle
    period: float
    eta: float

    def run(self, **options: Any) -> tuple[Controller, Run]:
        c = self.controller(**options)
        return c, closed_loop(c, self.start, self.reference, CYCLES, others=self.others, movers=self.movers)

    def margins(self, q: Array, run: Run, after: float | None = None) -> Array:
        """(len(q), m) by the oracle; `after` is the time in periods since the sample, None for the samples."""
        entities = dict(run.entities)
        if after is not None:
            ticks = np.arange(len(q)) + after
            entities = {n: np.array([m.at(k * self.period) for k in ticks]) for n, m in self.movers.items()}
        return self.oracle.margins(q, entities)


def scene(number: int, *, what: str) -> Scene:
    """Constraints of all pairs and both sides on a 7R arm (odd numbers) or beside a second 8-dof arm (even ones).

    what : "static"; "moving", a moving entity, or the second arm moving; "violating", static with negative margins.
    """
    rng = np.random.default_rng([number, len(what)])
    period = float(rng.choice(PERIODS))
    eta = min(float(rng.choice([0.5, 2.0, 20.0, 1.0 / period])), 1.0 / period)
    if number % 2:
        robot, start, group, frames, reach = SEVEN, AWAKE, "all", ["frame5", "frame6", "frame7"], 0.3
    else:
        robot, start, group, frames, reach = PAIR, START, "moving", ["moving/frame6", "moving/tip"], 0.03
    near = robot.kinematics(start).translation(frames[-1])
    against: list[dict[str, str]] = [{}]
    movers, others = {}, None
    if number % 2 == 0:
        against.append({"frame": "parked/frame6"})
        if what == "moving":
            swing = rng.uniform(-1.0, 1.0, 16) * np.r_[np.zeros(8), [0.01, 0.01, 0.1, 0.1, 0.01, 1.0, 1.0, 1.0]]
            others = lambda t: swing * np.cos(3.0 * t)  # noqa: E731
    if what == "moving" and number % 4 != 0:
        twist = np.r_[rng.uniform(0.0, 0.1) * reach * random_unit(rng), rng.uniform(0.0, 0.2) * random_unit(rng)]
        movers["e"] = Mover(pose(near + 0.5 * reach * random_unit(rng), random_unit(rng)), twist)
        against.append({"entity": "e"})
    constraints = random_constraints(
        rng,
        robot,
        start,
        frames=frames,
        against=against,
        count=int(rng.integers(3, 9)),
        reach=reach,
        near=near,
        margin=(-0.1, 0.2) if what == "violating" else (0.02, 0.3),
        entities={name: m.at(0.0) for name, m in movers.items()},
    )
    speed = robot.limits.velocity[robot.group(group)]
    wishes = rng.uniform(-1.0, 1.0, (12, len(speed))) * (0.0 if what == "violating" else speed)

    def build(**options: Any) -> Controller:
        given = {"period": period, "eta": eta, "group": group, "ring": CYCLES, **options}
        return Controller(robot, constraints, VelocityTask(), **given)

    def reference(t: float) -> Array:
        return wishes[round(t / period) // 25 % 12]

    return Scene(build, start, reference, others, movers, Oracle(robot, constraints), period, eta)


def column(c: Controller, name: str) -> Array:
    """A column of the ring of a run of CYCLES cycles."""
    return c.ring[:, c.columns[name]]


def shortfall(s: Scene, c: Controller, run: Run) -> Array:
    """(cycles, m) by how many tolerances each predicted margin falls short of what was asked, by the oracle.

    Asked is margin + T (min(-eta margin, v_rec) - slack), the slack being what the controller recorded. Infinite lines
    in their band are left out: the band's distance is another one, and there they jump.
    """
    margins = s.margins(run.q, run).astype(np.longdouble)
    angular = np.array([k.definition.unit == "rad" for k in s.oracle.constraints])
    rate = np.minimum(-s.eta * margins[:-1], np.where(angular, 0.5, 0.05))
    short = rate - column(c, "slack") - (margins[1:] - margins[:-1]) / s.period
    jumps = s.oracle.near_parallel(run.q, run.entities)
    short[jumps[1:] | jumps[:-1]] = -np.inf
    return np.asarray(short / np.where(angular, 1e-5, 1e-6), dtype=float)


def passes_parallel(s: Scene, run: Run, ways: list[Array]) -> NDArray[np.bool_]:
    """(cycles, m) where two infinite lines come near parallel within a cycle: their angle falls to less than a half.

    The distance of such lines is as large as one likes for an instant, which no verification at the samples can see.
    """
    ends = s.oracle.sines(run.q, run.entities)
    least = np.min([ends[:-1], ends[1:], *(s.oracle.sines(q, run.entities) for q in ways)], axis=0)
    return least < 0.5 * np.maximum(ends[:-1], ends[1:])


SLACK_OF_ARITHMETIC = 1.0 + 1e-4
"""The oracle and the controller round margins differently, by 1e-15 m or so; divided by the shortest T and 1e-6."""


def stops(s: Scene, run: Run) -> int:
    """Cycles in HOLD, but for those at the place where infinite lines become parallel and their distance jumps."""
    jumps = [f'"{c.name}"' for c in s.oracle.constraints if c.definition.name == "line_line"]
    held = [command.reason for command in run.commands if command.state == State.HOLD]
    return sum(not any(name in reason for name in jumps) for reason in held)


def test_scenes_hold_every_pair_and_both_sides():
    seen = Counter((c.definition.name, c.keep) for k in range(RUNS) for c in scene(k, what="static").oracle.constraints)
    if not JIT_DISABLED:
        assert {name for name, _ in seen} == set(pairs.names()) == set(CASES)
        assert {keep for _, keep in seen} == {"outside", "inside"}


@pytest.mark.parametrize("number", range(RUNS))
def test_static_scene_keeps_every_margin(number, record_property):
    """From a safe start: each cycle at least (1 - eta T) of each margin is left, and no margin ends below zero."""
    s = scene(number, what="static")
    c, run = s.run()
    states = Counter(command.state for command in run.commands)
    assert State.FAULT not in states and np.isfinite(run.qdot).all()
    assert shortfall(s, c, run).max() <= SLACK_OF_ARITHMETIC
    margins = s.margins(run.q, run).astype(float)
    angular = np.array([k.definition.unit == "rad" for k in s.oracle.constraints])
    allowed = np.where(angular, 1e-5, 1e-6) / s.eta
    assert np.all(margins >= -1.001 * allowed)
    limits = c.robot.limits
    assert np.all(run.q >= limits.lower - 1e-9) and np.all(run.q <= limits.upper + 1e-9)
    decided = c.robot.group(c.group)
    assert np.all(np.abs(run.qdot) <= limits.velocity[decided] + 1e-9)
    assert stops(s, run) <= CYCLES // 50
    ways = [run.q[:-1] + share * np.diff(run.q, axis=0) for share in np.arange(1, 11) / 11.0]
    through = passes_parallel(s, run, ways)
    between = min(float((s.margins(q, run) + allowed)[~through].min()) for q in ways)
    record_property("worst between samples, m or rad", f"{between:.1e}")
    # An obstacle passed tangentially at v is nearest between samples, by v^2 T^2 / (8 d) in the worst case.
    assert between >= -2e-6


@pytest.mark.parametrize("number", range(RUNS))
def test_moving_scene_keeps_what_it_says(number):
    """Entities and the other arm move as measured: the recorded slack is all that a margin falls short by."""
    s = scene(number, what="moving")
    c, run = s.run()
    states = np.array([command.state for command in run.commands])
    assert not np.any(states == State.FAULT) and np.isfinite(run.qdot).all()
    short = shortfall(s, c, run)
    assert short[states != State.HOLD].max() <= SLACK_OF_ARITHMETIC
    slack = column(c, "slack")
    assert not slack[states == State.RUN].any()
    assert stops(s, run) <= CYCLES // 20
    # Slack is for rows that standing still would not keep either, and that had to.
    still = run.q[:-1].copy()
    if s.others is not None:
        still += s.period * np.array([s.others(k * s.period) for k in range(CYCLES)])
    margins = s.margins(run.q, run).astype(float)[:-1]
    drift = (s.margins(still, run, after=1.0).astype(float) - margins) / s.period
    assert np.all((drift < -s.eta * margins + 1e-3)[slack > 1e-6])


@pytest.mark.parametrize("number", range(RUNS))
def test_violating_start_recovers_as_fast_as_was_asked(number):
    """min(eta |margin|, v_rec) each cycle, by the oracle, and at the end nothing is worse than at the start."""
    s = scene(number, what="violating")
    c, run = s.run()
    states = np.array([command.state for command in run.commands])
    assert not np.any(states >= State.HOLD)
    assert shortfall(s, c, run).max() <= SLACK_OF_ARITHMETIC
    margins = s.margins(run.q, run).astype(float)
    below = np.minimum(margins, 0.0)
    assert np.all(below[-1] >= below[0] - 1e-6)
    unslackened = ~column(c, "slack").any(axis=0)[: margins.shape[1]]
    expected = below[0].copy()
    angular = np.array([k.definition.unit == "rad" for k in s.oracle.constraints])
    for _ in range(CYCLES):
        expected += s.period * np.minimum(-s.eta * expected, np.where(angular, 0.5, 0.05))
    tolerated = 1.01 * CYCLES * s.period * np.where(angular, 1e-5, 1e-6)
    assert np.all((below[-1] >= expected - tolerated)[unslackened])


def test_violating_scenes_do_violate():
    starts = [s.oracle.margins(s.start).min() for s in (scene(k, what="violating") for k in range(RUNS))]
    assert np.count_nonzero(np.array(starts) < -1e-4) > RUNS // 2


@pytest.mark.parametrize("number", range(0, RUNS, 3))
def test_watching_commands_what_the_solver_says_and_counts(number):
    """guard "watch" and "off" command the same to the bit; only "act" keeps the sampled margins."""
    s = scene(number, what="static")
    (off, without), (watch, watching), (act, acting) = (s.run(guard=g) for g in ("off", "watch", "act"))
    np.testing.assert_array_equal(without.qdot, watching.qdot)
    np.testing.assert_array_equal(without.margins, watching.margins)
    assert not column(off, "intervened").any() and not column(off, "resolves").any()
    # What is counted is what the oracle finds: a predicted margin that falls short.
    short = shortfall(s, watch, watching).max(axis=1)
    counted = column(watch, "intervened")[:, 0] == 1.0
    clear = np.abs(short - 1.0) > 1e-3
    np.testing.assert_array_equal(counted[clear], (short > 1.0)[clear])
    assert not column(watch, "resolves").any() and not column(watch, "halvings").any()
    if counted.any():
        first = int(np.argmax(counted))
        np.testing.assert_array_equal(acting.qdot[:first], without.qdot[:first])
        assert column(act, "intervened")[first, 0] == 1.0
        assert not np.array_equal(acting.qdot[first], without.qdot[first])


@pytest.mark.parametrize("number", range(0, RUNS, 3))
@pytest.mark.parametrize("what", ["static", "moving", "violating"])
def test_same_inputs_give_the_same_commands_to_the_bit(number, what):
    s = scene(number, what=what)
    (first, one), (second, two) = s.run(), s.run()
    np.testing.assert_array_equal(one.qdot, two.qdot)
    np.testing.assert_array_equal(one.q, two.q)
    same = [name for name in first.columns if name != "cycle_us"]
    for name in same:
        np.testing.assert_array_equal(column(first, name), column(second, name))


@pytest.mark.parametrize("period", PERIODS)
def test_every_period_at_the_limit_of_its_gain(period):
    """eta T = 1: a margin may be used up within one period, and is kept from then on."""
    s = scene(5, what="static")
    c = s.controller(period=period, eta=1.0 / period)
    run = closed_loop(c, s.start, lambda t: s.reference(t * s.period / period), CYCLES)
    assert Oracle(c.robot, c.constraints).margins(run.q).min() > -1e-5 * period - 1e-12
    assert np.isfinite(run.qdot).all()


# The constraints of the paper -----------------------------------------------------------------------------------------


@pytest.mark.skipif(JIT_DISABLED, reason="runs of 15 s are too long for Python")
def test_s5_of_the_paper():
    """Smallest margins of readings.md at 8 ms, nothing infeasible, by the controller and by Pinocchio."""
    c = Controller(PAIR, paper_constraints(), PoseTask(), period=0.008, group="moving", guard="off", ring=1875)
    run = closed_loop(c, START, paper_reference(PAIR), 1875)
    assert {command.state for command in run.commands} == {State.RUN}
    oracle = Oracle(PAIR, paper_constraints()).margins(run.q[:-1]).astype(float)
    np.testing.assert_allclose(run.margins, oracle, atol=1e-13)
    np.testing.assert_allclose(1e3 * oracle.min(axis=0), [0.88, 1.93, 0.06, 0.38], atol=0.03)
    error = np.linalg.norm(c.ring[:, c.columns["error"]], axis=1)
    assert error.max() == pytest.approx(4.05e-3, rel=5e-3)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(2.66e-3, rel=5e-3)


@pytest.mark.skipif(JIT_DISABLED, reason="runs of 15 s are too long for Python")
def test_watched_constraints_are_measured_and_have_no_effect():
    """S1: all four watched. The commands are those without any constraint, to the bit; multipliers stay 0."""
    watched = Controller(PAIR, paper_constraints(""), PoseTask(), period=0.008, group="moving")
    bare = Controller(PAIR, ConstraintSet(), PoseTask(), period=0.008, group="moving")
    reference = paper_reference(PAIR)
    with_margins, without = (closed_loop(c, START, reference, 1875) for c in (watched, bare))
    np.testing.assert_array_equal(with_margins.qdot, without.qdot)
    np.testing.assert_allclose(1e3 * with_margins.margins.min(axis=0), [-2.80, -9.95, -5.99, -4.00], atol=0.03)
    assert not np.array([np.asarray(command.multipliers) for command in with_margins.commands]).any()
    assert {command.state for command in with_margins.commands} == {State.RUN}


def test_keep_inside_through_the_axis():
    """The singular set of a keep-inside row, d = 0: void there, kept elsewhere; the arm crosses the axis freely."""
    tip = PAIR.kinematics(START).translation("moving/tip")
    inside = ConstraintSet(
        [Constraint("near", Point.at([0, 0, 0], frame="moving/tip"), Point.at(tip), "inside", 0.004)]
    )
    c = Controller(PAIR, inside, VelocityTask(), period=1e-3, eta=20.0, group="moving")
    push = np.zeros(8)
    push[0] = 0.02
    first = c.step(Measurement(0.0, START, np.zeros(16)), push)
    assert first.state == State.RUN and first.margins["near"] == pytest.approx(0.004)
    np.testing.assert_allclose(first.qdot, push, atol=1e-9)
    assert first.multipliers["near"] == 0.0
    c = Controller(PAIR, inside, VelocityTask(), period=1e-3, eta=20.0, group="moving")
    run = closed_loop(c, START, lambda t: push * (1.0 if t < 0.3 else -1.0), cases(1000, 100))
    assert {command.state for command in run.commands} <= {State.RUN, State.DEGRADED}
    assert Oracle(PAIR, inside).margins(run.q).min() > -1e-7
    if not JIT_DISABLED:
        assert run.margins.min() < 1e-4 and run.margins[400:].max() > 0.0035


def test_keep_outside_at_contact_is_a_fault_that_names_it():
    tip = PAIR.kinematics(START).translation("moving/tip")
    both = ConstraintSet(
        [
            Constraint(
                "floor", Point.at([0, 0, 0], frame="moving/tip"), Plane.through([0, 0, -1], [0, 0, 1]), "outside", 0
            ),
            Constraint("vessel", Point.at([0, 0, 0], frame="moving/tip"), Point.at(tip), "outside", 0.001),
        ]
    )
    c = Controller(PAIR, both, VelocityTask(), period=1e-3, group="moving")
    command = c.step(Measurement(0.0, START, np.zeros(16)), np.full(8, 0.01))
    assert command.state == State.FAULT and not command.qdot.any()
    assert '"vessel"' in command.reason and "floor" not in command.reason
    moved = START.copy()
    moved[4] -= 0.01
    c.acknowledge()
    assert c.step(Measurement(0.1, moved, np.zeros(16)), np.full(8, 0.01)).state == State.RUN


def test_safe_distance_is_kept_by_capsules_of_two_arms():
    """Both shafts as segments, the other one sweeping towards the moving one: pushed aside, never nearer."""
    shafts = [Segment.between([0, 0, -0.1], [0, 0, 0], frame=f"{arm}/frame6") for arm in ("moving", "parked")]
    apart = ConstraintSet([Constraint("shafts", *shafts, "outside", 0.005)])
    c = Controller(PAIR, apart, VelocityTask(), period=1e-3, eta=50.0, group="moving")
    towards = evaluate(PAIR, apart, START).jacobian[0, 8:10]
    sweep = np.zeros(16)
    sweep[8:10] = -0.02 * towards / np.linalg.norm(towards)
    run = closed_loop(c, START, lambda t: np.zeros(8), cases(2000, 50), others=lambda t: sweep)
    assert {command.state for command in run.commands} == {State.RUN}
    margins = Oracle(PAIR, apart).margins(run.q).astype(float)
    assert margins.min() > -2e-8
    if not JIT_DISABLED:
        assert margins.min() < 1e-4 and np.abs(run.qdot).max() > 0.005


# What a cycle costs ---------------------------------------------------------------------------------------------------


def dispatchers() -> dict[str, int]:
    """Number of compiled signatures of every compiled function of the two rooms."""
    from numba.core.dispatcher import Dispatcher

    modules = [m for name, m in sys.modules.items() if name.split(".")[0] in ("vfi", "primitives")]
    found = [(f"{m.__name__}.{name}", f) for m in modules for name, f in vars(m).items() if isinstance(f, Dispatcher)]
    return {name: len(f.nopython_signatures) for name, f in found}


@pytest.mark.skipif(JIT_DISABLED, reason="nothing is compiled")
def test_no_memory_grows_and_nothing_compiles_in_the_loop():
    """20 000 cycles, re-solves and refusals among them: no Python object, no array of numba and no signature more."""
    from numba.core.runtime import _nrt_python, rtsys

    c = Controller(
        PAIR, paper_constraints(), PoseTask(), period=0.008, group="moving", user_rows=2, ring=24_000, latch=None
    )
    reference = paper_reference(PAIR)
    poses = [reference(0.008 * k) for k in range(1875)]
    q, decided, still = START.copy(), PAIR.group("moving"), np.zeros(16)
    bad = np.full(16, np.nan)

    def loop(begin: int, count: int) -> None:
        nonlocal q
        for k in range(begin, begin + count):
            if k % 1875 == 0:
                q = START.copy()
            given = bad if k % 500 == 499 else q
            q[decided] += 0.008 * c.step(Measurement(0.008 * k, given, still), poses[k % 1875]).qdot

    loop(0, 4000)
    compiled = dispatchers()
    assert len(compiled) > 40
    tracemalloc.start()
    _nrt_python.memsys_enable_stats()
    try:
        before, arrays = tracemalloc.get_traced_memory()[0], _living(rtsys)
        loop(4000, 20_000)
        after, later = tracemalloc.get_traced_memory()[0], _living(rtsys)
    finally:
        tracemalloc.stop()
        _nrt_python.memsys_disable_stats()
    assert after - before < 20_000, "bytes"
    assert later == arrays
    assert dispatchers() == compiled
    assert c.ring[4000:, c.columns["intervened"]].sum() > 100 and c.ring[4000:, c.columns["state"]].max() == 3


def _living(rtsys: Any) -> int:
    stats = rtsys.get_allocation_stats()
    return int(stats.alloc - stats.free)


def test_ring_records_what_was_commanded():
    """Every cycle's row: time, q, command, margins, multipliers, state and reason, and it wraps around."""
    s = scene(2, what="moving")
    c = s.controller(ring=7)
    q, T, decided = s.start.copy(), s.period, c.robot.group(c.group)
    for k in range(20):
        t = k * T
        entities = {n: Entity(m.at(t), m.twist) for n, m in s.movers.items()}
        command = c.step(Measurement(t, q, s.others(t), entities=entities), s.reference(t))
        row = c.ring[k % 7]
        assert row[c.columns["t"]][0] == t and row[c.columns["cycle_us"]][0] > 0.0
        np.testing.assert_array_equal(row[c.columns["q"]], q)
        np.testing.assert_array_equal(row[c.columns["qdot"]], command.qdot)
        np.testing.assert_array_equal(row[c.columns["margin"]], np.asarray(command.margins))
        m = len(c.constraints)
        np.testing.assert_array_equal(row[c.columns["multiplier"]][:m], np.asarray(command.multipliers))
        assert row[c.columns["state"]][0] == command.state
        np.testing.assert_array_equal(row[c.columns["reference"]], s.reference(t))
        q = q + T * s.others(t)
        q[decided] += T * command.qdot
    assert c.cycles == 20


@pytest.mark.campaign
def test_a_million_cycles():
    """Random scenes by the hundred: no margin below what was asked, at any sample, undetected."""
    cycles = 0
    number = 0
    while cycles < 1_000_000:
        s = scene(number, what=("static", "moving", "violating")[number % 3])
        c, run = s.run()
        states = np.array([command.state for command in run.commands])
        assert not np.any(states == State.FAULT) and np.isfinite(run.qdot).all()
        assert shortfall(s, c, run)[states != State.HOLD].max(initial=0.0) <= SLACK_OF_ARITHMETIC, number
        cycles, number = cycles + CYCLES, number + 1
