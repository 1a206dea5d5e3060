"""Clouds as inequalities: a row for every point within reach, and what becomes of these points at q + T v."""

import numpy as np

from primitives.checks import Array
from primitives.cloud_rows import find_contacts, follow_contacts
from primitives.compiled import compiled
from primitives.memory import MEMORY, cube, integer_matrix, integers, matrix, vector
from vfi.blend import eased
from vfi.inequality import demanded_rate
from vfi.memory import Real, Whole
from vfi.outcome import Blend, Option, Setting
from vfi.rows import set_rows


@compiled(f"int64({MEMORY})")
def find(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> int:
    """Find the points within reach and fill distance, margin and status of the constraints on clouds.

    Returns
    -------
    How many points there are; < 0 where a number is not finite.
    """
    options = integers(w, wl, Whole.OPTIONS)
    seen = find_contacts(
        integer_matrix(w, wl, Whole.CLOUD),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.GEOMETRY),
        matrix(f, fl, Real.SPHERE),
        matrix(f, fl, Real.CLOUD_PLACEMENT),
        matrix(f, fl, Real.POSE),
        vector(f, fl, Real.SETTINGS)[Setting.REACH],
        matrix(f, fl, Real.POINTS),
        integers(w, wl, Whole.CELLS),
        integers(w, wl, Whole.FOUND),
        vector(f, fl, Real.ALONG),
        vector(f, fl, Real.APART),
        integers(w, wl, Whole.ENFORCED),
        vector(f, fl, Real.DISTANCE),
        vector(f, fl, Real.MARGIN),
        integers(w, wl, Whole.STATUS),
        matrix(f, fl, Real.CONTACT),
        vector(f, fl, Real.CLEARANCE),
        integers(w, wl, Whole.OWNER),
        integers(w, wl, Whole.POINT),
    )
    options[Option.CONTACTS] = max(seen, 0)
    set_rows(fl, w, wl, options[Option.FIXED] + max(seen, 0))
    # The points have other numbers than in the last cycle, so what was active then says nothing.
    integers(w, wl, Whole.ACTIVE)[0] = 0
    return seen


@compiled(f"void({MEMORY})")
def fill_contacts(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Rows and demands of the points within reach; those of their constraints (m,) themselves become void.

    A margin d grows with the tool's nearest place x and falls with the point p, along the unit vector u from p to x:
    each side moves with its own frame, d' = u . (v + w x (x - o)) - u . (v' + w' x (p - o')).
    """
    cloud, frame, pose = (
        integer_matrix(w, wl, Whole.CLOUD),
        integer_matrix(w, wl, Whole.FRAME),
        matrix(f, fl, Real.POSE),
    )
    owner, contact, clearance = integers(w, wl, Whole.OWNER), matrix(f, fl, Real.CONTACT), vector(f, fl, Real.CLEARANCE)
    jacobian, twist, given = cube(f, fl, Real.JACOBIAN), matrix(f, fl, Real.TWIST), vector(f, fl, Real.GIVEN)
    decided, options, settings = (
        integers(w, wl, Whole.DECIDED),
        integers(w, wl, Whole.OPTIONS),
        vector(f, fl, Real.SETTINGS),
    )
    A, demand, rate = matrix(f, fl, Real.A), vector(f, fl, Real.DEMAND), vector(f, fl, Real.RATE)
    eta, force, blend = vector(f, fl, Real.ETA), vector(f, fl, Real.FORCE), matrix(f, fl, Real.BLEND)
    sphere, safe_rate = matrix(f, fl, Real.SPHERE), vector(f, fl, Real.SAFE_RATE)
    classes, tolerance = integers(w, wl, Whole.SAFETY_CLASS), vector(f, fl, Real.ROW_TOLERANCE)
    speed, period = settings[Setting.RECOVERY_LINEAR], settings[Setting.PERIOD]
    for c in range(cloud.shape[0]):
        demand[cloud[c, 0]] = -np.inf
        rate[cloud[c, 0]] = -np.inf
    for k in range(options[Option.CONTACTS]):
        c, row = owner[k], options[Option.FIXED] + k
        i, apart = cloud[c, 0], clearance[k] + sphere[c, 0] + sphere[c, 1]
        classes[row], tolerance[row] = classes[i], tolerance[i]
        for j in range(decided.shape[0]):
            A[row, j] = 0.0
        residual = -safe_rate[i]
        for side in range(2):
            at = frame[i, side]
            if at == 0:
                continue
            sign, back = (1.0, 0.0) if side == 0 else (-1.0, apart)
            x, y, z = sign * contact[k, 0], sign * contact[k, 1], sign * contact[k, 2]
            a = contact[k, 3] - back * contact[k, 0] - pose[at, 9]
            b = contact[k, 4] - back * contact[k, 1] - pose[at, 10]
            e = contact[k, 5] - back * contact[k, 2] - pose[at, 11]
            p, q, r = b * z - e * y, e * x - a * z, a * y - b * x
            J, t = jacobian[at], twist[at]
            residual += x * t[0] + y * t[1] + z * t[2] + p * t[3] + q * t[4] + r * t[5]
            for j in range(given.shape[0]):
                if given[j] != 0.0:
                    residual += given[j] * (
                        x * J[0, j] + y * J[1, j] + z * J[2, j] + p * J[3, j] + q * J[4, j] + r * J[5, j]
                    )
            for n in range(decided.shape[0]):
                j = decided[n]
                A[row, n] += x * J[0, j] + y * J[1, j] + z * J[2, j] + p * J[3, j] + q * J[4, j] + r * J[5, j]
        rising = blend[i, Blend.FORCE_TO] - blend[i, Blend.FORCE_FROM]
        rate[row] = eased(demanded_rate(clearance[k], eta[i], speed), force[i], rising, clearance[k], speed, period)
        demand[row] = rate[row] - residual


@compiled(f"void({MEMORY})")
def predict(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray) -> None:
    """Margins of the points at POSE_NEXT, and of their constraints: NaN where another point has come within reach.

    What is within reach is foreseen: a point beyond it may come as near as a row at the edge of reach would let it.
    """
    cloud, enforced = integer_matrix(w, wl, Whole.CLOUD), integers(w, wl, Whole.ENFORCED)
    settings, eta, predicted = vector(f, fl, Real.SETTINGS), vector(f, fl, Real.ETA), vector(f, fl, Real.MARGIN_NEXT)
    for c in range(cloud.shape[0]):
        i = cloud[c, 0]
        if not enforced[i]:
            continue
        predicted[i] = follow_contacts(
            cloud,
            integer_matrix(w, wl, Whole.FRAME),
            matrix(f, fl, Real.GEOMETRY),
            matrix(f, fl, Real.SPHERE),
            matrix(f, fl, Real.CLOUD_PLACEMENT),
            matrix(f, fl, Real.POSE_NEXT),
            c,
            settings[Setting.REACH] * (1.0 - eta[i] * settings[Setting.PERIOD]),
            matrix(f, fl, Real.POINTS),
            integers(w, wl, Whole.CELLS),
            integers(w, wl, Whole.FOUND),
            vector(f, fl, Real.ALONG),
            vector(f, fl, Real.APART),
            integers(w, wl, Whole.OPTIONS)[Option.CONTACTS],
            integers(w, wl, Whole.OWNER),
            integers(w, wl, Whole.POINT),
            vector(f, fl, Real.CLEARANCE_NEXT),
        )
