"""Lowering: what a controller's memory holds before the first cycle."""

import numpy as np
import pytest

from primitives.constraint import Constraint, ConstraintSet
from primitives.elements import Line, Plane, Point
from primitives.errors import InputError
from tests.vfi.arms import pair, paper_constraints, seven
from vfi.controller import Controller
from vfi.lowering import one_or_each
from vfi.memory import Real, Whole
from vfi.messages import Measurement
from vfi.outcome import Guard, Option, Setting
from vfi.tasks import POSE, VELOCITY, PoseTask, VelocityTask

PAIR = pair()


def lowered(constraints: ConstraintSet, **options: object) -> Controller:
    return Controller(PAIR, constraints, VelocityTask(), **{"period": 1e-3, "group": "moving", **options})


def test_tolerances_by_unit():
    """1e-6 m/s and 1e-5 rad/s: of constraints, of the user's rows (metres), and of slides and hinges."""
    cone = Constraint(
        "cone", Line.z_axis("moving/frame6"), Line.through([0, 0, 0], [0, 0, -1]), "inside", 1.0, "line_line_angle"
    )
    c = lowered(paper_constraints() + cone, user_rows=1)
    slides = [1e-6, 1e-6, 1e-5, 1e-5, 1e-6, 1e-5, 1e-5, 1e-5]
    np.testing.assert_array_equal(c._memory.real[Real.ROW_TOLERANCE][:6], [*[1e-6] * 4, 1e-5, 1e-6])
    np.testing.assert_array_equal(c._memory.real[Real.JOINT_TOLERANCE], slides)


def test_group_decides_the_order_of_joints_and_limits():
    robot = PAIR.with_group("some", ["moving/joint8", "parked/joint5", "moving/joint1"])
    c = Controller(robot, ConstraintSet(), VelocityTask(), period=1e-3, group="some")
    np.testing.assert_array_equal(c._memory.whole[Whole.DECIDED], [7, 12, 0])
    assert c.joints == ("moving/joint8", "parked/joint5", "moving/joint1")
    np.testing.assert_array_equal(c._memory.real[Real.LIMITS][0], [-1.4, 0.15, -0.06])
    np.testing.assert_array_equal(c._memory.real[Real.LIMITS][2], [2.0, 0.05, 0.05])


def test_gains_by_name_and_for_the_others():
    c = lowered(paper_constraints(), eta={"C2": 7.0, "": 3.0, "C4": 2.0})
    np.testing.assert_array_equal(c._memory.real[Real.ETA], [3.0, 7.0, 3.0, 2.0])
    np.testing.assert_array_equal(lowered(paper_constraints(), eta=4)._memory.real[Real.ETA], 4.0)


def test_sides_classes_and_what_is_enforced():
    watched = paper_constraints("C2 C3")
    c = lowered(ConstraintSet([*watched, Constraint("x", *_tip_and_plane(), "outside", 0.3, safety_class="task")]))
    np.testing.assert_array_equal(c._memory.real[Real.SIDE], [1, -1, -1, 1, 1])
    np.testing.assert_array_equal(c._memory.real[Real.SAFE], [0.005, 0.014, 0.014, 0.0, 0.3])
    np.testing.assert_array_equal(c._memory.whole[Whole.ENFORCED], [0, 1, 1, 0, 1])
    np.testing.assert_array_equal(c._memory.whole[Whole.SAFETY_CLASS][:5], [0, 0, 0, 0, 2])


def _tip_and_plane() -> tuple[Point, Plane]:
    return Point.at([0, 0, 0], frame="moving/tip"), Plane.through([0, 0, 0], [0, 0, 1], entity="table")


def test_entities_are_numbered_after_the_frames_of_the_robot():
    c = lowered(ConstraintSet([Constraint("x", *_tip_and_plane(), "outside", 0.0)]))
    assert c.entities == ("table",)
    frames = c._memory.whole[Whole.OPTIONS][Option.ROBOT_FRAMES]
    np.testing.assert_array_equal(c._memory.whole[Whole.FRAME], [[1, frames]])
    assert c._memory.real[Real.POSE].shape == (frames + 1, 12)


@pytest.mark.parametrize("guard", ["off", "watch", "act"])
def test_settings_and_options(guard):
    c = Controller(
        PAIR,
        paper_constraints(),
        PoseTask(gain=30.0, damping=0.02),
        period=2e-3,
        limit_eta=6.0,
        recovery_linear=0.01,
        recovery_angular=0.2,
        guard=guard,
        group="moving",
    )
    s, o = c._memory.real[Real.SETTINGS], c._memory.whole[Whole.OPTIONS]
    expected = {
        Setting.PERIOD: 2e-3,
        Setting.DAMPING: 0.02,
        Setting.REACH: 0.02,
        Setting.LIMIT_GAIN: 6.0,
        Setting.RECOVERY_LINEAR: 0.01,
        Setting.RECOVERY_ANGULAR: 0.2,
    }
    assert {setting: s[setting] for setting in Setting} == expected
    assert c._memory.real[Real.GAIN].tolist() == [30.0]
    assert o[Option.GUARD] == Guard[guard.upper()] and o[Option.TASK] == POSE and o[Option.SECOND_SOLVER] == 0
    other = Controller(PAIR, paper_constraints(), PoseTask(), period=2e-3, group="moving", solver="lp")
    assert other._memory.whole[Whole.OPTIONS][Option.SECOND_SOLVER] == 1
    assert lowered(ConstraintSet())._memory.whole[Whole.OPTIONS][Option.TASK] == VELOCITY


def test_second_set_of_the_same_robot_shares_nothing():
    one, two = lowered(paper_constraints()), lowered(paper_constraints())
    one._memory.floats[:] = 7.0
    assert not np.any(two._memory.floats == 7.0)


def test_one_number_or_each():
    np.testing.assert_array_equal(one_or_each(2, 3, "x"), [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(one_or_each([1, 2, 3], 3, "x"), [1.0, 2.0, 3.0])
    for bad in ([1, 2], [[1, 2, 3]], "x", float("nan"), None, [1, None, 3]):
        with pytest.raises(InputError, match="weights"):
            one_or_each(bad, 3, "weights")


def test_continuous_joint_without_limits():
    """Infinite limits reach the program as infinite bounds, and the optimum is still found."""
    free = seven().with_limits(lower=np.full(7, -np.inf), upper=np.full(7, np.inf), velocity=np.full(7, np.inf))
    c = Controller(free, ConstraintSet(), VelocityTask(), period=1e-3)
    command = c.step(Measurement(0.0, np.full(7, 100.0), np.zeros(7)), np.full(7, 12.0))
    np.testing.assert_allclose(command.qdot, 12.0)
    assert np.all(np.isinf(c.qp.low)) and np.all(np.isinf(c.qp.high))
