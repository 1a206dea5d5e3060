"""Cost terms against DQ Robotics and NumPy, the sign of the reference, and what a task refuses."""

from typing import Any

import numpy as np
import pytest
from dqrobotics import DQ, E_, j_
from dqrobotics.robot_modeling import DQ_SerialManipulatorMDH

from primitives import dual_quaternion as dq
from primitives.constraint import ConstraintSet
from primitives.errors import InputError, UnknownNameError
from tests.primitives.qps import cases
from tests.vfi.arms import BASES, NEURO8, START, Array, closed_loop, pair, paper_reference, pose, seven
from vfi.controller import Controller
from vfi.messages import Measurement
from vfi.outcome import State
from vfi.tasks import PoseTask, VelocityTask, fill_cost, fill_velocity_task, unit_defect

PERIOD = 1e-3


def dq_arm() -> DQ_SerialManipulatorMDH:
    """The moving arm in DQ Robotics, tip included."""
    table = np.array([[r.theta, r.d, r.a, r.alpha, float(r.kind == "prismatic")] for r in NEURO8]).T
    arm = DQ_SerialManipulatorMDH(table)
    x, y, z = BASES["moving"]
    base = 1 + E_ * 0.5 * DQ([0, x, y, z])
    arm.set_base_frame(base)
    arm.set_reference_frame(base)
    arm.set_effector((1 + E_ * 0.5 * DQ([0, 0.012, 0, 0])) * (np.cos(np.pi / 4) + j_ * np.sin(np.pi / 4)))
    return arm


def random_q(rng: np.random.Generator) -> Array:
    robot = pair()
    return rng.uniform(robot.limits.lower, robot.limits.upper)


def random_reference(rng: np.random.Generator, x: Array) -> Array:
    """A pose within 0.5 rad and 0.05 m of x, under either sign."""
    moved = dq.product(pose(rng.uniform(-0.05, 0.05, 3), rng.uniform(-0.3, 0.3, 3)), x)
    return moved * rng.choice([-1.0, 1.0])


def controller(**options: Any) -> Controller:
    task = options.pop("task", PoseTask())
    return Controller(pair(), ConstraintSet(), task, period=PERIOD, group="moving", **options)


def test_pose_cost_by_dq_robotics():
    """H = J^T W^2 J + lambda I and g = J^T W^2 gain x~, J and x of DQ Robotics, for random weights and poses."""
    rng, arm = np.random.default_rng(1), dq_arm()
    for _ in range(cases(200, 10)):
        gain, damping, weight = rng.uniform(1.0, 50.0), 10.0 ** rng.uniform(-8.0, 0.0), rng.uniform(0.0, 3.0, 8)
        c = controller(task=PoseTask(gain=gain, damping=damping, weight=weight))
        q = random_q(rng)
        x, J = arm.fkm(q[:8]).vec8(), arm.pose_jacobian(q[:8])
        reference = random_reference(rng, x)
        c.step(Measurement(0.0, q, np.zeros(16)), reference)
        x_d = reference if x @ reference >= 0.0 else -reference
        W2 = np.diag(weight**2)
        np.testing.assert_allclose(c.qp.H, J.T @ W2 @ J + damping * np.eye(8), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(c.qp.g, J.T @ W2 @ (gain * (x - x_d)), rtol=1e-11, atol=1e-12)
        # The task's own matrix and target, for solvers that take another norm; x may have the other sign there.
        side = 1.0 if abs(c.qp.task - weight[:, None] * J).max() < 1e-9 else -1.0
        np.testing.assert_allclose(side * c.qp.task, weight[:, None] * J, atol=1e-12)
        np.testing.assert_allclose(side * c.qp.error, weight * gain * (x - x_d), atol=1e-11)


def test_optimum_is_the_damped_least_squares_solution():
    """Far from every bound the command is -(J^T J + lambda I)^-1 J^T gain x~: (6) with its minus."""
    rng, arm = np.random.default_rng(2), dq_arm()
    free = pair().with_limits(lower=np.full(16, -np.inf), upper=np.full(16, np.inf), velocity=np.full(16, np.inf))
    c = Controller(free, ConstraintSet(), PoseTask(gain=20.0, damping=1e-2), period=PERIOD, group="moving")
    for k in range(cases(100, 10)):
        q = random_q(rng)
        x, J = arm.fkm(q[:8]).vec8(), arm.pose_jacobian(q[:8])
        reference = random_reference(rng, x)
        x_d = reference if x @ reference >= 0.0 else -reference
        expected = np.linalg.solve(J.T @ J + 1e-2 * np.eye(8), -J.T @ (20.0 * (x - x_d)))
        command = c.step(Measurement(float(k), q, np.zeros(16)), reference)
        np.testing.assert_allclose(command.qdot, expected, rtol=1e-9, atol=1e-10)


def test_velocities_of_other_joints_enter_the_target():
    """Deciding joints 5-8 only: J v is completed by what the first four are measured to do."""
    rng, arm = np.random.default_rng(3), dq_arm()
    names = [f"moving/joint{i}" for i in range(5, 9)]
    robot = pair().with_group("wrist", names)
    c = Controller(robot, ConstraintSet(), PoseTask(gain=10.0), period=PERIOD, group="wrist")
    for k in range(20):
        q, qdot = random_q(rng), rng.uniform(-0.1, 0.1, 16)
        x, J = arm.fkm(q[:8]).vec8(), arm.pose_jacobian(q[:8])
        reference = random_reference(rng, x)
        x_d = reference if x @ reference >= 0.0 else -reference
        c.step(Measurement(float(k), q, qdot), reference)
        target = 10.0 * (x - x_d) + J[:, :4] @ qdot[:4]
        np.testing.assert_allclose(c.qp.g, J[:, 4:].T @ target, rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(c.qp.H, J[:, 4:].T @ J[:, 4:] + 1e-3 * np.eye(4), rtol=1e-11, atol=1e-12)


def test_both_signs_of_the_reference_give_the_same_command_to_the_bit():
    """Also where the tip's own quaternion crosses w = 0 and changes its sign."""
    reference = paper_reference(pair())
    rng = np.random.default_rng(4)
    plus, minus = (controller() for _ in range(2))
    first = closed_loop(plus, START, reference, cases(3000, 60))
    second = closed_loop(minus, START, lambda t: reference(t) * (-1.0 if rng.random() < 0.5 else 1.0), cases(3000, 60))
    np.testing.assert_array_equal(first.qdot, second.qdot)


def test_error_never_takes_the_long_way():
    """The recorded error is that of the nearer of both signs, so it stays small along the whole reference."""
    reference = paper_reference(pair())
    c = controller(ring=cases(1500, 60))
    q, decided = START.copy(), c.robot.group("moving")
    w = []
    for k in range(cases(1500, 60)):
        command = c.step(Measurement(k * 0.01, q, np.zeros(16)), reference(k * 0.01))
        q[decided] += 0.001 * command.qdot * 10.0
        w.append(c.ring[k, c.columns["pose"]][0])
    errors = np.linalg.norm(c.ring[:, c.columns["error"]], axis=1)
    assert errors.max() < 0.1
    assert min(w) >= 0.0, "the pose itself is given with w >= 0, whichever way it turns"


def test_velocity_task():
    """Sum of weight (v - v_ref)^2: without constraints the reference itself, clipped to the limits."""
    rng = np.random.default_rng(5)
    weight = rng.uniform(0.1, 4.0, 7)
    c = Controller(seven(), ConstraintSet(), VelocityTask(weight), period=PERIOD)
    for k in range(20):
        v = rng.uniform(-5.0, 5.0, 7)
        command = c.step(Measurement(float(k), np.zeros(7), np.zeros(7)), v)
        np.testing.assert_allclose(c.qp.H, np.diag(weight), rtol=1e-15)
        np.testing.assert_allclose(c.qp.g, -weight * v, rtol=1e-15)
        limit = c.robot.limits.velocity
        np.testing.assert_allclose(command.qdot, np.clip(v, -limit, limit), rtol=1e-12)


def test_weights_of_the_velocity_task_decide_who_gives_way():
    """Two joints that move one point alike share the loss in the inverse ratio of their weights."""
    task, target = np.zeros((2, 2)), np.zeros(2)
    fill_velocity_task(np.array([1.0, -2.0]), np.array([4.0, 9.0]), task, target)
    np.testing.assert_allclose(task, [[2.0, 0.0], [0.0, 3.0]])
    np.testing.assert_allclose(target, [-2.0, 6.0])


def test_cost_of_any_task_matrix():
    rng = np.random.default_rng(6)
    task, target = rng.normal(size=(8, 5)), rng.normal(size=8)
    H, g = np.full((5, 5), np.nan), np.full(5, np.nan)
    fill_cost(task, target, 0.3, H, g)
    np.testing.assert_allclose(H, task.T @ task + 0.3 * np.eye(5), rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(g, task.T @ target, rtol=1e-13, atol=1e-14)
    np.testing.assert_array_equal(H, H.T)


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        ([1, 0, 0, 0, 0, 0.1, 0, 0], 0.0),
        ([1.1, 0, 0, 0, 0, 0, 0, 0], 0.21),
        ([1, 0, 0, 0, 0.02, 0, 0, 0], 0.02),
        ([0, 0, 0, 0, 0, 0, 0, 0], 1.0),
    ],
)
def test_defect_of_a_pose(x, expected):
    assert unit_defect(np.array(x, dtype=float)) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("factor", [0.999, 1.001, 0.0, -1.01])
def test_reference_that_is_no_pose_is_a_fault_that_shows_it(factor):
    c, reference = controller(latch=None), paper_reference(pair())(0.0)
    command = c.step(Measurement(0.0, START, np.zeros(16)), factor * reference)
    assert command.state == State.FAULT and not command.qdot.any()
    assert "unit dual quaternion" in command.reason and "|r| = " in command.reason
    assert c.step(Measurement(1.0, START, np.zeros(16)), reference).state == State.RUN


def test_reference_within_tolerance_is_taken():
    c, reference = controller(), paper_reference(pair())(0.0)
    assert c.step(Measurement(0.0, START, np.zeros(16)), (1.0 + 4e-7) * reference).state == State.RUN


def test_reference_may_be_a_dq():
    reference = paper_reference(pair())(0.5)
    as_array, as_dq = controller(), controller()
    measurement = Measurement(0.0, START, np.zeros(16))
    first = as_array.step(measurement, reference)
    second = as_dq.step(measurement, DQ(reference))
    np.testing.assert_array_equal(first.qdot, second.qdot)


def test_task_on_another_frame():
    """The shaft's end follows instead of the tip: the wrist's joints are then without influence."""
    c = controller(task=PoseTask("moving/frame6"))
    reference = dq.product(pose([0.0, 0.0, 0.001]), c.robot.kinematics(START).pose("moving/frame6"))
    command = c.step(Measurement(0.0, START, np.zeros(16)), reference)
    assert np.abs(command.qdot[:6]).max() > 1e-3
    np.testing.assert_allclose(command.qdot[6:], 0.0, atol=1e-12)
    np.testing.assert_allclose(c.qp.H[6:, 6:], 1e-3 * np.eye(2), atol=1e-15)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gain": 0.0}, "gain of PoseTask"),
        ({"gain": -1.0}, "gain of PoseTask"),
        ({"gain": float("nan")}, "gain of PoseTask"),
        ({"damping": 0.0}, "damping of PoseTask"),
        ({"damping": float("inf")}, "damping of PoseTask"),
        ({"weight": np.ones(7)}, "weight of PoseTask"),
        ({"weight": -np.ones(8)}, "weight of PoseTask"),
        ({"weight": [np.nan] * 8}, "weight of PoseTask"),
    ],
)
def test_pose_task_refuses(options, words):
    with pytest.raises(InputError, match=words):
        PoseTask(**options)


@pytest.mark.parametrize("weight", [0.0, -1.0, np.nan, [1.0, 0.0], "heavy"])
def test_velocity_task_refuses(weight):
    with pytest.raises(InputError, match="weight of VelocityTask"):
        VelocityTask(weight)


@pytest.mark.parametrize("weight", [np.ones(6), np.inf])
def test_weights_that_do_not_fit_the_robot(weight):
    with pytest.raises(InputError, match="weight"):
        Controller(seven(), ConstraintSet(), VelocityTask(weight), period=PERIOD)


def test_unknown_frame_of_a_task():
    with pytest.raises(UnknownNameError, match='Did you mean "moving/tip"'):
        controller(task=PoseTask("moving/tipp"))
