"""Pushes at walls of every kind, on both arms: what is declared is kept, no energy comes from it, and without the
barrier the same pushes go through."""

from itertools import product

import numpy as np
import pytest

from admittance.controller import Admittance
from admittance.outcome import State
from tests.admittance.cases import Q0, Array, column, lwr4plus, on_shaft, paper_port
from tests.admittance.walls import PAIR, S5, SHAFT, START, lean, margin, pair, paper_arm, reach, walls

WALLS = ("plane", "cylinder", "hole", "shaft", "line", "cone")
ARMS = ("lwr4plus", "neuro8-pair")
FORCES = {"lwr4plus": (10.0, 20.0, 40.0, 60.0), "neuro8-pair": (2.0, 5.0, 10.0, 60.0)}
"""N; the hand of the small arm is one of at most 10 N, and 60 N more than its joints can follow."""


def facing(arm: str, wall: str, integrator: str, gap: float = 1.0) -> tuple[Admittance, Array]:
    """An arm and its port, one wall enforced and the others watched, at `gap` times 27 mm or 6 mm."""
    if arm == "lwr4plus":
        robot = lwr4plus()
        port = paper_port(robot)
        declared = walls(robot, Q0, "tip", port, 0.027 * gap, 0.2 * gap).enforcing([wall])
        return paper_arm(declared, integrator=integrator, ring=1000), port
    port = on_shaft(PAIR, START, SHAFT, 0.045)
    declared = walls(PAIR, START, SHAFT, port, 0.006 * gap, 0.15 * gap).enforcing([wall])
    return pair(declared, integrator=integrator, ring=1000), port


def between_samples(a: Admittance, wall: str) -> float:
    """Smallest margin on the straight line in joint space between the cycles next to the closest, 20 samples each."""
    place, q = a.constraints.names.index(wall), column(a, "q")
    closest = int(np.argmin(column(a, "margin")[:, place]))
    least = np.inf
    for k in range(max(1, closest - 1), min(closest + 2, len(q))):
        for s in np.linspace(0.0, 1.0, 20):
            least = min(least, margin(a.constraints[wall], a.robot.kinematics(q[k - 1] + s * (q[k] - q[k - 1]))))
    return least


def assert_kept(a: Admittance, wall: str, least: float) -> None:
    """The wall was within its barrier's range, was kept at and between samples, and gave no energy."""
    assert least < reach(a.constraints[wall], a.parameters), "it was pushed against the wall"
    assert least > 0.0 and between_samples(a, wall) > 0.0
    assert column(a, "excess")[-1] <= 1e-4 and column(a, "excess_chord")[-1] <= 1e-4
    assert column(a, "state").max() < State.HOLD
    assert column(a, "potential").max() > 0.0


HALF = [(arm, wall) for i, wall in enumerate(WALLS) for k, arm in enumerate(ARMS) if (i + k) % 2]
"""Every wall on one arm, three of them on each; the campaign has all."""
OTHER_HALF = [pushed for pushed in product(ARMS, WALLS) if pushed not in HALF]


@pytest.mark.parametrize(("arm", "wall"), HALF)
def test_the_robust_integrator_keeps_a_wall_against_a_force_that_sets_in_at_once(arm, wall):
    """The strongest hand; the campaign has the weaker ones and other gaps."""
    a, port = facing(arm, wall, "robust")
    assert_kept(a, wall, lean(a, port, wall, FORCES[arm][-1], 1.8))


@pytest.mark.parametrize(
    ("arm", "wall"), [*OTHER_HALF, *(pytest.param(*pushed, marks=pytest.mark.campaign) for pushed in HALF)]
)
def test_a_guided_push_is_passive_with_the_plain_integrator(arm, wall):
    a, port = facing(arm, wall, "semi-implicit")
    assert_kept(a, wall, lean(a, port, wall, 5.0 if arm == "lwr4plus" else 2.0, 2.4, ramp=1.0))


@pytest.mark.campaign
def test_walls_campaign():
    """240 pushes: two arms, six walls, four forces, five gaps. None crosses, none hands energy in."""
    count = 0
    for arm, wall, gap in product(ARMS, WALLS, (0.6, 0.8, 1.0, 1.2, 1.4)):
        for force in FORCES[arm]:
            a, port = facing(arm, wall, "robust", gap)
            least = lean(a, port, wall, force, 2.4)
            assert least > 0.0 and between_samples(a, wall) > 0.0, (arm, wall, gap, force)
            assert column(a, "excess")[-1] <= 1e-9 and column(a, "substeps").mean() <= 1.25
            count += 1
    assert count == 240


BACK = {"C1": 0.045, "C2": 0.12, "C3": 0.045, "C4": 0.045}
"""Where the port is, metres back from the shaft's end: for C2 it must not be where the shaft passes the entry point."""


GENTLE = [pytest.param(5.0, name, marks=pytest.mark.campaign) for name in BACK]


@pytest.mark.parametrize(("force", "name"), [*((20.0, name) for name in BACK), *GENTLE])
def test_s5_by_hand(force, name):
    """Each of C1 to C4 is pushed at and kept with all four enforced, and violated where they are only watched."""
    port = on_shaft(PAIR, START, SHAFT, BACK[name])
    kept = pair(S5.constraints, BACK[name], integrator="robust", ring=1000)
    least = lean(kept, port, name, force, 2.0)
    assert_kept(kept, name, least)
    assert column(kept, "margin").min() > 0.0, "and so were the other three"
    watched = pair(S5.constraints.enforcing(()), BACK[name], integrator="robust", ring=1000)
    assert lean(watched, port, name, force, 2.0) < -1e-3


def test_the_wrist_gives_way_to_a_plane_that_the_tip_is_pushed_at():
    """C4 is on the tip, beyond the wrist: its force reaches the wrist, which no hand and no region does."""
    port = on_shaft(PAIR, START, SHAFT, 0.045)
    a = pair(integrator="robust", ring=1000)
    lean(a, port, "C4", 5.0, 2.0)
    assert np.abs(column(a, "free_repulsion")[:, 4:]).max() > 1e-3
    assert np.abs(column(a, "q")[-1, 6:8] - START[6:8]).max() > 0.1
    quiet = pair(S5.constraints.enforcing(["C1", "C2", "C3"]), integrator="robust", ring=1000)
    lean(quiet, port, "C3", 5.0, 1.0)
    np.testing.assert_allclose(column(quiet, "free_repulsion")[:, 4:], 0.0, atol=1e-12)
    np.testing.assert_allclose(column(quiet, "q")[:, 6:8], START[6:8][None].repeat(250, 0), atol=1e-12)


def test_the_parked_arm_stands():
    a = pair(integrator="robust", ring=400)
    lean(a, on_shaft(PAIR, START, SHAFT, 0.045), "C1", 5.0, 1.0)
    np.testing.assert_array_equal(column(a, "q")[:, 8:], START[None, 8:].repeat(250, 0))
