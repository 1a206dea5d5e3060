"""The parts of a cycle as functions of its memory, in the order in which they run."""

from primitives.dual_quaternion import from_pose
from primitives.evaluate import evaluate_rows
from primitives.kinematics import forward_kinematics, frame_jacobians
from primitives.memory import cube, integer_matrix, integers, matrix, vector
from tests.bench import problem
from vfi.cycle import finish, solve_active_set
from vfi.inequality import fill_rows
from vfi.limits import fill_bounds
from vfi.memory import Real, Whole
from vfi.recovery import violation
from vfi.tasks import fill_cost, fill_pose_task

GAIN, DAMPING, LIMIT_ETA, PERIOD = problem.GAIN, problem.DAMPING, problem.LIMIT_ETA, problem.PERIOD


def kinematics(f, fl, w, wl, ring):
    parent, prismatic = integers(w, wl, Whole.PARENT), integers(w, wl, Whole.PRISMATIC)
    frame_joint, joint_pose = integers(w, wl, Whole.FRAME_JOINT), matrix(f, fl, Real.JOINT_POSE)
    placement, frame_placement = matrix(f, fl, Real.PLACEMENT), matrix(f, fl, Real.FRAME_PLACEMENT)
    pose, q = matrix(f, fl, Real.POSE), vector(f, fl, Real.Q)
    forward_kinematics(parent, prismatic, placement, frame_joint, frame_placement, q, joint_pose, pose)
    frame_jacobians(parent, prismatic, frame_joint, joint_pose, pose, cube(f, fl, Real.JACOBIAN))


def distances(f, fl, w, wl, ring):
    evaluate_rows(
        integers(w, wl, Whole.ADDRESS),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.GEOMETRY),
        vector(f, fl, Real.SIDE),
        vector(f, fl, Real.SAFE),
        matrix(f, fl, Real.POSE),
        cube(f, fl, Real.JACOBIAN),
        matrix(f, fl, Real.TWIST),
        vector(f, fl, Real.GIVEN),
        vector(f, fl, Real.DISTANCE),
        vector(f, fl, Real.MARGIN),
        matrix(f, fl, Real.ROW),
        vector(f, fl, Real.RESIDUAL),
        integers(w, wl, Whole.STATUS),
    )


def cost(f, fl, w, wl, ring):
    tip, x = integers(w, wl, Whole.TIPS)[0], vector(f, fl, Real.TIP)
    task, target = matrix(f, fl, Real.TASK), vector(f, fl, Real.TARGET)
    from_pose(matrix(f, fl, Real.POSE), tip, x)
    fill_pose_task(
        x,
        cube(f, fl, Real.JACOBIAN)[tip],
        vector(f, fl, Real.REFERENCE),
        vector(f, fl, Real.WEIGHT),
        vector(f, fl, Real.GIVEN),
        integers(w, wl, Whole.DECIDED),
        GAIN,
        matrix(f, fl, Real.POSE_JACOBIAN),
        vector(f, fl, Real.ERROR),
        task,
        target,
    )
    fill_cost(task, target, DAMPING, matrix(f, fl, Real.H), vector(f, fl, Real.G))


def rows(f, fl, w, wl, ring):
    decided = integers(w, wl, Whole.DECIDED)
    fill_rows(
        vector(f, fl, Real.MARGIN),
        matrix(f, fl, Real.ROW),
        vector(f, fl, Real.RESIDUAL),
        integers(w, wl, Whole.STATUS),
        integers(w, wl, Whole.ENFORCED),
        integers(w, wl, Whole.ANGULAR),
        vector(f, fl, Real.SIDE),
        vector(f, fl, Real.ETA),
        0.05,
        0.5,
        decided,
        matrix(f, fl, Real.A),
        vector(f, fl, Real.DEMAND),
        vector(f, fl, Real.RATE),
    )
    limits, last = matrix(f, fl, Real.LIMITS), vector(f, fl, Real.LAST)
    low, high = vector(f, fl, Real.LOW), vector(f, fl, Real.HIGH)
    fill_bounds(vector(f, fl, Real.Q), decided, limits, last, LIMIT_ETA, PERIOD, 1, low, high)


def solution(f, fl, w, wl, ring):
    solve_active_set(f, fl, w, wl)


def verification(f, fl, w, wl, ring):
    violation(f, fl, w, wl)


def record(f, fl, w, wl, ring):
    finish(f, fl, w, wl, 0.0, ring, 0)


NAMES = ("kinematics", "distances", "cost", "rows", "solution", "verification", "record")
