"""Cuts: further rows of keep-inside constraints, for a program that is solved again.

Near the middle of what a thing is kept in the gradient of the distance points anywhere: the row at q says nothing of a
motion across it, and asking more of that row does not help. The distance is a convex function of the place there, so
its tangent at a place outside cuts that place off and nothing that is inside (the method of cutting planes, J. E.
Kelley, 1960). Cuts stand beside the row at q and last for a cycle. Keep-outside needs none: there the row at q asks for
more than the distance does.
"""

import numpy as np

from primitives.checks import Array
from primitives.compiled import compiled
from primitives.evaluate import evaluate_rows
from primitives.kinematics import frame_jacobians
from primitives.memory import MEMORY, cube, integer_matrix, integers, matrix, vector
from primitives.vectors import DEGENERATE
from vfi.memory import Real, Whole
from vfi.outcome import Option
from vfi.rows import set_rows


@compiled("void(float64[::1], int64[:,::1], int64[::1], int64[:,::1])")
def drop_cuts(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Leave the rows that the cycle began with."""
    options = integers(w, wl, Whole.OPTIONS)
    if options[Option.CUTS]:
        options[Option.CUTS] = 0
        set_rows(fl, w, wl, options[Option.FIXED] + options[Option.CONTACTS])
        integers(w, wl, Whole.ACTIVE)[0] = 0


@compiled(f"void({MEMORY})")
def evaluate_next(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """ROW_NEXT and STATUS_NEXT (m,) from the poses at the predicted configuration."""
    pose, jacobian = matrix(f, fl, Real.POSE_NEXT), cube(f, fl, Real.JACOBIAN_NEXT)
    frame_jacobians(
        integers(w, wl, Whole.PARENT),
        integers(w, wl, Whole.PRISMATIC),
        integers(w, wl, Whole.FRAME_JOINT),
        matrix(f, fl, Real.JOINT_POSE_NEXT),
        pose,
        jacobian,
    )
    evaluate_rows(
        integers(w, wl, Whole.ADDRESS),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.GEOMETRY),
        vector(f, fl, Real.SIDE),
        vector(f, fl, Real.SAFE),
        pose,
        jacobian,
        matrix(f, fl, Real.TWIST),
        vector(f, fl, Real.GIVEN),
        vector(f, fl, Real.DISTANCE_NEXT),
        vector(f, fl, Real.MARGIN_NEXT),
        matrix(f, fl, Real.ROW_NEXT),
        vector(f, fl, Real.RESIDUAL_NEXT),
        integers(w, wl, Whole.STATUS_NEXT),
    )


@compiled("int64(float64[::1], int64[:,::1], int64[::1], int64[:,::1], float64[::1], int64)")
def calls_for_cut(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, v: Array, i: int) -> int:
    """1 where v leads out of constraint i although it keeps its row at q, or there is none.

    0 for keep-outside, for what standing still would not keep either, and where there is no gradient or no room.
    """
    options, demand = integers(w, wl, Whole.OPTIONS), vector(f, fl, Real.DEMAND)[i]
    if vector(f, fl, Real.SIDE)[i] > 0.0 or demand > 0.0 or options[Option.CUTS] == wl[Whole.CUT, 1]:
        return 0
    if integers(w, wl, Whole.STATUS_NEXT)[i] == DEGENERATE:
        return 0
    A, value = matrix(f, fl, Real.A), 0.0
    for j in range(v.shape[0]):
        value += A[i, j] * v[j]
    return int(demand == -np.inf or demand - value <= vector(f, fl, Real.ROW_TOLERANCE)[i])


@compiled("void(float64[::1], int64[:,::1], int64[::1], int64[:,::1], float64[::1], int64)")
def add_cut(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, v: Array, i: int) -> None:
    """Add the tangent of constraint i at q + T v, asking for its defect there.

    With J' the margin's Jacobian there, margin(q + T u) <= margin(q + T v) + T J' (u - v): J' u >= J' v + defect for
    every u that keeps the constraint.
    """
    options, decided = integers(w, wl, Whole.OPTIONS), integers(w, wl, Whole.DECIDED)
    defect, row = vector(f, fl, Real.DEFECT)[i], fl[Real.B, 1]
    integers(w, wl, Whole.CUT)[options[Option.CUTS]] = i
    options[Option.CUTS] += 1
    set_rows(fl, w, wl, row + 1)
    integers(w, wl, Whole.ACTIVE)[0] = 0
    A, b, there = matrix(f, fl, Real.A), vector(f, fl, Real.B), matrix(f, fl, Real.ROW_NEXT)
    b[row] = defect
    for j in range(v.shape[0]):
        A[row, j] = there[i, decided[j]]
        b[row] += A[row, j] * v[j]
    vector(f, fl, Real.DEMAND)[row] = -np.inf
    vector(f, fl, Real.RATE)[row] = -np.inf
    vector(f, fl, Real.SLACK)[row] = 0.0
    vector(f, fl, Real.DEFECT)[row] = -np.inf
    vector(f, fl, Real.ROW_TOLERANCE)[row] = vector(f, fl, Real.ROW_TOLERANCE)[i]
