"""What a cycle is given, checked and copied to its memory: measurement, reference and rows of the user's own."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from primitives import conversions
from primitives.checks import Array, array, known, number
from primitives.errors import InputError
from primitives.evaluate import entity_arrays
from primitives.verification import move_frames
from vfi.lowering import Lowered, one_or_each
from vfi.memory import Real, Whole
from vfi.messages import FreeReference, Measurement, Rows
from vfi.outcome import Option, Reason, Setting, State

JOINT_AGE = 1.5
"""Periods that joint positions and velocities may be old."""
ENTITY_AGE = 0.1
"""Seconds that the pose of an entity may be old: it is taken on by its twist, which changes too."""
JOINTS = ("q", "qdot")
UNUSED = ("wrench",)
"""Stamps that a measurement may have and a controller has no use for."""


def ages(given: Mapping[str, float], period: float, entities: tuple[str, ...]) -> dict[str, float]:
    """How old q, qdot and each entity may be, seconds; raises InputError and UnknownNameError."""
    out = dict.fromkeys(JOINTS, JOINT_AGE * period) | dict.fromkeys(entities, ENTITY_AGE)
    for name, value in given.items():
        out[known("stamp", name, out)] = number(value, f"max_age of {name}", positive=True)
    return out


def _age_of(name: str, stamp: Any, t: float) -> float:
    """Seconds from a stamp to t; raises InputError for one that lies after t."""
    age = t - number(stamp, f"stamp of {name}")
    if age < 0.0:
        raise InputError(f"stamp of {name}: expected a time up to t = {t:g} s, got one {-age:.3g} s later")
    return age


def _plain(value: Any) -> Any:
    return conversions.from_dq(value) if hasattr(value, "vec8") else value


def _copy_to(view: Array, value: Any, what: str) -> None:
    """Copy an input to its place in the memory; raises InputError where its form is wrong."""
    if type(value) is np.ndarray and value.shape == view.shape and value.dtype == view.dtype:
        view[:] = value
    else:
        view[:] = array(_plain(value), view.shape, what, finite=False)


class Inputs:
    """The places of a controller's inputs in its memory.

    Parameters
    ----------
    ages : how old q, qdot and entities may be, seconds.
    free : whether the reference is a `FreeReference`.
    """

    def __init__(self, lowered: Lowered, ages: Mapping[str, float], free: bool):
        real, whole = lowered.memory.real, lowered.memory.whole
        self._ages, self._entities, self._first = ages, lowered.entities, lowered.first_entity
        self._pose, self._twist, self._clock = real[Real.POSE], real[Real.TWIST], real[Real.CLOCK]
        self._joints = ("q", real[Real.Q]), ("qdot", real[Real.QDOT])
        self._reference = real[Real.REFERENCE]
        given = ("metric", Real.METRIC), ("basis", Real.BASIS), ("offset", Real.OFFSET)
        self._free = tuple((what, real[block]) for what, block in given) if free else ()
        order = f" of {' and '.join(lowered.tips)}, one after the other" if len(lowered.tips) > 1 else ""
        self._wanted = f"reference{order}"
        self._A, self._demand, self._settings = real[Real.A], real[Real.DEMAND], real[Real.SETTINGS]
        self._options: Any = whole[Whole.OPTIONS]
        self._before = len(real[Real.MARGIN])
        self.stale = ""
        """What was too old in the last cycle, and by how much."""

    def take(self, measurement: Measurement, reference: ArrayLike | FreeReference, rows: Rows | None) -> float:
        """Copy the inputs to the cycle's memory and return the time; raises InputError where their form is wrong."""
        t = number(measurement.t, "t")
        if not self._clock[0] < t:
            raise InputError(f"t: expected a time after {self._clock[0]} s, got {t}")
        for (what, view), value in zip(self._joints, (measurement.q, measurement.qdot), strict=True):
            _copy_to(view, value, what)
        if self._free:
            if not isinstance(reference, FreeReference):
                raise InputError(f"reference: expected a FreeReference, got {type(reference).__name__}")
            _copy_to(self._reference, reference.v_ref, "v_ref")
            for (what, place), given in zip(self._free, reference[1:], strict=True):
                _copy_to(place, given, what)
        else:
            _copy_to(self._reference, reference, self._wanted)
        found = self._check_ages(measurement, t)
        if self._entities:
            self._take_entities(measurement, found)
        if rows is not None or self._options[Option.FIXED] > self._before:
            self._take_rows(rows)
        self._clock[0] = t
        return t

    def _check_ages(self, measurement: Measurement, t: float) -> dict[str, float]:
        """How old what has a stamp is, seconds; asks for HOLD where that is more than it may be."""
        stamps = measurement.stamps
        if stamps is None:
            return {}
        names = tuple(dict.fromkeys((*self._ages, *UNUSED, *(measurement.entities or {}))))
        found = {known("stamp", name, names): _age_of(name, stamps[name], t) for name in stamps}
        old = [name for name, most in self._ages.items() if found.get(name, 0.0) > most]
        if old and not self._options[Option.STOP]:
            self.stale = "; ".join(
                f"{name} was measured {found[name] * 1e3:.3g} ms ago, more than {self._ages[name] * 1e3:.3g} ms"
                for name in old
            )
            self._options[Option.STOP], self._options[Option.WHY] = State.HOLD, Reason.STALE
        return found

    def _take_entities(self, measurement: Measurement, age: Mapping[str, float]) -> None:
        """Poses and twists; what was measured a while ago is taken on by its twist to where it is now."""
        poses, twists = entity_arrays(measurement.entities or {}, self._entities)
        for i, name in enumerate(self._entities):
            if age.get(name, 0.0) > 0.0:
                move_frames(poses[i : i + 1].copy(), twists[i : i + 1], 0, age[name], poses[i : i + 1])
        self._pose[self._first :] = poses
        self._twist[self._first :] = twists

    def _take_rows(self, rows: Rows | None) -> None:
        m, last, d = self._before, int(self._options[Option.FIXED]), self._A.shape[1]
        self._A[m:last], self._demand[m:last] = 0.0, -np.inf
        if rows is None:
            return
        jacobian = array(rows.jacobian, (None, d), "jacobian of rows")
        k = len(jacobian)
        if k > last - m:
            raise InputError(f"got {k} rows, expected at most {last - m}; raise user_rows of the Controller")
        margin = array(rows.margin, (k,), "margin of rows")
        eta, period = number(rows.eta, "eta of rows", positive=True), self._settings[Setting.PERIOD]
        if eta * period > 1.0 + 1e-12:
            raise InputError(f"eta of rows: expected eta T <= 1, got eta = {eta} 1/s and T = {period} s")
        self._A[m : m + k] = jacobian
        demanded = np.minimum(-eta * margin, self._settings[Setting.RECOVERY_LINEAR])
        self._demand[m : m + k] = demanded - one_or_each(rows.residual, k, "residual of rows")
