"""Keep-inside near its middle: cuts take off nothing that is allowed; little is lost against a brute-force optimum."""

import numpy as np
import pytest

from primitives.checks import Array
from primitives.constraint import Constraint, ConstraintSet
from primitives.dh import DHRow
from primitives.elements import Line, Point
from primitives.robot import Robot
from primitives.verification import TOLERANCE_LINEAR
from tests.primitives.qps import cases
from tests.vfi.arms import START, closed_loop, pair
from vfi.controller import Controller
from vfi.energy import account
from vfi.explain import label
from vfi.memory import Real, Whole
from vfi.messages import FreeReference, Measurement
from vfi.outcome import Option, State, Work
from vfi.tasks import ProjectionTask, VelocityTask

T, ETA, RADIUS = 0.008, 0.5, 0.004
LINKS = 0.3, 0.25
ELBOW = Robot.from_dh(
    [DHRow("revolute", 0.0, a, 0.0, 0.0, -3.0, 3.0, 5.0) for a in LINKS], convention="standard", name="elbow"
)
TIP = Point.at([0.0, 0.0, 0.0], frame=ELBOW.tip)


def place(q: Array) -> Array:
    """(.., 2) where the arm's end is, by trigonometry."""
    first, second = q[..., 0], q[..., 0] + q[..., 1]
    return np.stack(
        [
            LINKS[0] * np.cos(first) + LINKS[1] * np.cos(second),
            LINKS[0] * np.sin(first) + LINKS[1] * np.sin(second),
        ],
        axis=-1,
    )


def joints(at: Array, q: Array) -> Array:
    """(.., 2) configurations nearest to q with the end at these places, by Newton's method."""
    out = np.broadcast_to(q, at.shape).copy()
    for _ in range(8):
        first, second = out[..., 0], out[..., 0] + out[..., 1]
        b = LINKS[1] * np.stack([-np.sin(second), np.cos(second)], axis=-1)
        a = b + LINKS[0] * np.stack([-np.sin(first), np.cos(first)], axis=-1)
        off = at - place(out)
        det = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
        out[..., 0] += (off[..., 0] * b[..., 1] - off[..., 1] * b[..., 0]) / det
        out[..., 1] += (a[..., 0] * off[..., 1] - a[..., 1] * off[..., 0]) / det
    return out


class Case:
    """The end of a bent arm in a cylinder, `off` metres beside its axis, wanted to move in a direction of chance."""

    def __init__(self, rng: np.random.Generator, off: float):
        self.q = rng.uniform([-1.0, 0.6], [1.0, 2.4])
        angle = rng.uniform(-np.pi, np.pi)
        self.axis = place(self.q) - off * np.array([np.cos(angle), np.sin(angle)])
        self.weight = 10.0 ** rng.uniform(-1.0, 1.0, 2)
        self.wanted = rng.normal(size=2) * 10.0 ** rng.uniform(-2.0, -1.0)
        self.allowed = RADIUS - (1.0 - ETA * T) * (RADIUS - off) + TOLERANCE_LINEAR * T

    def controller(self, **options: str) -> Controller:
        inside = Constraint("bore", TIP, Line.through([*self.axis, 0.0], [0, 0, 1]), "inside", RADIUS)
        return Controller(ELBOW, ConstraintSet([inside]), VelocityTask(self.weight), period=T, eta=ETA, **options)

    def cost(self, v: Array) -> Array:
        return np.asarray(np.sum(self.weight * (v - self.wanted) ** 2, axis=-1))

    def off(self, v: Array) -> Array:
        """Distances from the axis after a period."""
        return np.asarray(np.linalg.norm(place(self.q + T * v) - self.axis, axis=-1))

    def best(self) -> Array:
        """The cheapest velocity that keeps the margin: what is wanted, or else one that leads to the edge."""
        if self.off(self.wanted) <= self.allowed:
            return self.wanted
        middle, span = 0.0, np.pi
        for _ in range(3):
            angle = np.linspace(middle - span, middle + span, 401)
            edge = self.axis + self.allowed * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            v = (joints(edge, self.q) - self.q) / T
            middle, span = angle[np.argmin(self.cost(v))], span / 40.0
        return np.asarray(v[np.argmin(self.cost(v))])


def stepped(case: Case, c: Controller) -> Array:
    command = c.step(Measurement(0.0, case.q, np.zeros(2)), case.wanted)
    assert command.state < State.HOLD
    assert case.off(command.qdot) <= case.allowed + 1e-12
    return command.qdot


@pytest.mark.parametrize("off", [0.0, 1e-10, 1e-7, 1e-5, 1e-4, 1e-3])
def test_little_is_lost_against_the_best_velocity(off):
    """Of what the best velocity gains over standing still; nowhere much, on the average next to nothing."""
    rng = np.random.default_rng(3)
    lost = []
    for _ in range(cases(80, 8)):
        case = Case(rng, off)
        v, best, still = stepped(case, case.controller()), case.best(), case.cost(np.zeros(2))
        lost.append((case.cost(v) - case.cost(best)) / (still - case.cost(best)))
    assert min(lost) > -1e-4, "the oracle is the best"
    assert np.mean(lost) < 0.02 and max(lost) < 0.25


def cut_rows(c: Controller) -> tuple[Array, Array, list[str]]:
    """A v >= b of the last cycle's cuts, and the names that they go by."""
    rows, count = int(c._memory.float_layout[Real.B, 1]), int(c._memory.whole[Whole.OPTIONS][Option.CUTS])
    at = slice(rows - count, rows)
    names = [label(c._memory, c.constraints.names, row) for row in range(rows - count, rows)]
    return c._memory.real[Real.A][at].copy(), c._memory.real[Real.B][at].copy(), names


def test_cuts_take_off_nothing_that_keeps_the_margin():
    rng, seen = np.random.default_rng(4), 0
    for _ in range(cases(100, 10)):
        case = Case(rng, 10.0 ** rng.uniform(-8.0, -3.5))
        c = case.controller()
        stepped(case, c)
        A, b, names = cut_rows(c)
        seen += len(b)
        assert names == ["bore"] * len(b)
        angle, share = rng.uniform(-np.pi, np.pi, 300), np.sqrt(rng.uniform(0.0, 1.0, 300))
        inside = case.axis + case.allowed * (share * np.array([np.cos(angle), np.sin(angle)])).T
        v = (joints(inside, case.q) - case.q) / T
        # What the arm's own curvature adds, a second order of the ways to the cut's place and to v.
        way = T * (np.abs(v).sum(axis=1) + np.abs(case.wanted).sum())[:, None]
        assert (v @ A.T >= b - TOLERANCE_LINEAR - 0.5 * sum(LINKS) * way**2 / T).all()
    assert seen > 20


def test_cuts_last_for_a_cycle():
    case = Case(np.random.default_rng(5), 1e-7)
    c = case.controller()
    rows = int(c._memory.float_layout[Real.B, 1])
    case.wanted = 0.3 * np.ones(2)
    stepped(case, c)
    assert len(cut_rows(c)[1]) > 0 and c._memory.float_layout[Real.B, 1] > rows == len(c.qp.b)
    again = c.step(Measurement(T, case.q, np.zeros(2)), np.zeros(2))
    assert again.state == State.RUN and not again.qdot.any()
    assert c._memory.float_layout[Real.B, 1] == rows and len(cut_rows(c)[1]) == 0


def test_multiplier_of_a_cut_is_that_of_its_constraint():
    """Exactly on the axis there is no row at q, so all that pushes is a cut."""
    case = Case(np.random.default_rng(6), 0.0)
    case.weight[:], case.wanted = 1.0, np.array([0.01, 0.003])
    c = case.controller()
    command = c.step(Measurement(0.0, case.q, np.zeros(2)), case.wanted)
    A, _, _ = cut_rows(c)
    assert len(A) > 0 and command.state == State.RUN and command.multipliers["bore"] > 0.0
    push = command.qdot - case.wanted
    if len(A) == 1:
        np.testing.assert_allclose(command.multipliers["bore"] * A[0], push, rtol=1e-6)
    assert command.multipliers["bore"] == pytest.approx(float(c._memory.real[Real.MULTIPLIER][1 : 1 + len(A)].sum()))


@pytest.mark.parametrize("solver", ["daqp", "lp"])
def test_other_solvers_get_no_cuts(solver):
    from vfi.tasks import PoseTask

    inside = Constraint("bore", TIP, Line.through([*place(np.array([0.3, 1.0])), 0.0], [0, 0, 1]), "inside", RADIUS)
    c = Controller(ELBOW, ConstraintSet([inside]), PoseTask(), period=T, eta=ETA, solver=solver)
    x = ELBOW.kinematics(np.array([0.6, 1.3])).pose(ELBOW.tip)
    assert c.step(Measurement(0.0, np.array([0.3, 1.0]), np.zeros(2)), x).state < State.HOLD
    assert len(c._memory.whole[Whole.CUT]) == 0


def test_projection_stays_passive_and_its_ledger_exact():
    """In a basis; what cuts do counts as keeping, and takes energy out."""
    rng, cut = np.random.default_rng(7), 0
    for _ in range(cases(100, 10)):
        case = Case(rng, rng.choice([0.0, 1e-7, 1e-5]))
        inside = Constraint("bore", TIP, Line.through([*case.axis, 0.0], [0, 0, 1]), "inside", RADIUS)
        c = Controller(ELBOW, ConstraintSet([inside]), ProjectionTask(2), period=T, eta=ETA)
        metric = np.diag(case.weight) + 0.1 * np.ones((2, 2))
        basis = np.linalg.qr(rng.normal(size=(2, 2)))[0]
        command = c.step(Measurement(0.0, case.q, np.zeros(2)), FreeReference(case.wanted, metric, basis, np.zeros(2)))
        assert command.state < State.HOLD and case.off(command.qdot) <= case.allowed + 1e-12
        account(*c._arguments)
        work = command.record[c.columns["work"]]
        done = command.free @ metric @ (command.free - case.wanted)
        assert np.isfinite(work).all() and work.sum() == pytest.approx(done, abs=1e-12)
        assert work[Work.KEEPING] <= 1e-12 and not work[[Work.RECOVERING, Work.MOVING, Work.PORT]].any()
        cut += len(cut_rows(c)[1])
    assert cut > 20


def test_a_shaft_through_the_middle_of_its_port_goes_on():
    """S1-S5's shaft, its port where it runs through: it turns about it and nothing is scaled down."""
    robot = pair()
    seen = robot.kinematics(START)
    middle = seen.translation("moving/frame6") - 0.045 * seen.rotation("moving/frame6")[:, 2]
    port = Constraint("port", Line.z_axis("moving/frame6"), Point.at(middle), "inside", RADIUS)
    c = Controller(robot, ConstraintSet([port]), VelocityTask(), period=T, eta=ETA, group="moving", ring=200)
    push = np.array([0.01, -0.008, 0.05, 0.04, 0.01, 0.0, 0.0, 0.0])
    run = closed_loop(c, START, lambda t: push, cases(150, 40))
    rows = c.ring[: len(run.commands)]
    assert {command.state for command in run.commands} == {State.RUN}
    assert rows[:, c.columns["intervened"]].sum() > 3 and not rows[:, c.columns["halvings"]].any()
    assert min(command.margins["port"] for command in run.commands) > 0.0
