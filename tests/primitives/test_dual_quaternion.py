"""Dual quaternion algebra against DQ Robotics, SciPy, Pinocchio and screws written out by hand."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from dqrobotics import C8, DQ, E_, cross, dot
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from primitives import conversions
from primitives import dual_quaternion as dq
from primitives.errors import InputError

repeatable = settings(derandomize=True, deadline=None, max_examples=60, database=None)

Array = NDArray[np.float64]
AXIS, POINT = np.array([2.0, -3.0, 6.0]) / 7.0, np.array([0.3, -0.7, 0.2])
PI = np.pi
ANGLES = [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, PI - 1e-9, PI, PI + 1e-9, 4.0, 2 * PI - 1e-6, 2 * PI]
SHIFTS = [np.zeros(3), np.array([0.1, -0.2, 0.05]), np.array([1e6, -2e6, 5e5])]


def pose(angle: float, axis: Array, t: Array, sign: float = 1.0) -> Array:
    r = np.r_[np.cos(angle / 2), np.sin(angle / 2) * axis]
    x: Array = sign * (DQ(r) + 0.5 * E_ * DQ(np.r_[0.0, t]) * DQ(r)).vec8()
    return x


Z_AXIS = np.array([0.0, 0.0, 1.0])
NEAR_SINGULAR = [pose(a, n, t, s) for a in ANGLES for n in (AXIS, Z_AXIS) for t in SHIFTS for s in (1, -1)]

numbers = st.floats(-3.0, 3.0)
vectors = st.lists(numbers, min_size=3, max_size=3).map(np.array)
octets = st.lists(numbers, min_size=8, max_size=8).map(np.array)
axes = vectors.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
angles = st.floats(0.0, 6.0) | st.sampled_from(ANGLES)
poses = st.builds(pose, angles, axes, vectors, st.sampled_from([1.0, -1.0]))


def visiting(*cases: tuple[Any, ...]) -> Callable[[Any], Any]:
    """Run a property on these cases every time, besides those that hypothesis draws."""

    def decorate(test: Any) -> Any:
        for case in cases:
            test = example(*case)(test)
        return test

    return decorate


every_pose = visiting(*((x,) for x in NEAR_SINGULAR))
every_pair = visiting(
    *((x, y) for x in NEAR_SINGULAR[::5] for y in NEAR_SINGULAR[::7]),
    *((x, x.copy()) for x in NEAR_SINGULAR[::3]),
)


def size(*values: Array) -> float:
    """1e-12 at the scale of the values."""
    return float(1e-12 * max(1.0, *(np.abs(v).max() for v in values)))


def close(got: Any, expected: Any, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=tolerance)


def log_tolerance(x: Array) -> float:
    """Near -1 the screw axis is far and digits are lost: 4e-15 / sin(phi/2), at most 2e-8."""
    s = float(np.linalg.norm(x[1:4]))
    return size(x) * (1.0 if x[0] > -0.5 else min(max(1.0, 4e-3 / max(s, 1e-30)), 2e4))


@repeatable
@given(octets, octets)
def test_products_agree_with_dq_robotics(a: Array, b: Array) -> None:
    tolerance = 1e-12 * 100.0
    close(dq.product(a, b), (DQ(a) * DQ(b)).vec8(), tolerance)
    close(dq.quaternion_product(a[:4].copy(), b[4:].copy()), (DQ(a[:4]) * DQ(b[4:])).vec4(), tolerance)
    close(dq.conjugate(a), DQ(a).conj().vec8(), 0.0)
    close(np.diag(C8()) * a, dq.conjugate(a), 0.0)
    a[[0, 4]] = b[[0, 4]] = 0.0
    close(dq.inner(a, b), dot(DQ(a), DQ(b)).vec8(), tolerance)
    close(dq.cross(a, b), cross(DQ(a), DQ(b)).vec8(), tolerance)
    close(dq.inner(a, b)[[1, 2, 3, 5, 6, 7]], np.zeros(6), 0.0)
    close(dq.inner(a, b)[[0, 4]], [a[1:4] @ b[1:4], a[1:4] @ b[5:] + a[5:] @ b[1:4]], tolerance)
    close(dq.cross(a, b)[1:4], np.cross(a[1:4], b[1:4]), tolerance)


@repeatable
@given(octets, octets)
def test_hamilton_operators(h: Array, a: Array) -> None:
    close(dq.hamilton_plus_8(h), DQ(h).hamiplus8(), 0.0)
    close(dq.hamilton_minus_8(h), DQ(h).haminus8(), 0.0)
    close(dq.hamilton_plus_4(h[4:].copy()), DQ(h[4:]).hamiplus4(), 0.0)
    close(dq.hamilton_minus_4(h[4:].copy()), DQ(h[4:]).haminus4(), 0.0)
    close(dq.hamilton_plus_8(h) @ a, dq.product(h, a), 1e-12 * 100.0)
    close(dq.hamilton_minus_8(h) @ a, dq.product(a, h), 1e-12 * 100.0)


@repeatable
@given(octets.filter(lambda a: np.linalg.norm(a[:4]) > 0.1))
def test_norm_and_normalisation(a: Array) -> None:
    close(dq.norm(a), DQ(a).norm().vec8()[[0, 4]], 1e-11)
    close(dq.normalized(a), DQ(a).normalize().vec8(), 1e-9)
    close(dq.norm(dq.normalized(a)), [1.0, 0.0], size(a) / float(np.linalg.norm(a[:4])))


def test_norm_without_a_primary_part_is_zero() -> None:
    close(dq.norm(np.array([0.0, 0, 0, 0, 1, 2, 3, 4])), [0.0, 0.0], 0.0)
    close(dq.norm(np.array([3e-6, 0, 4e-6, 0, 1, 2, 3, 4])), [5e-6, 3.0], 1e-14)


@repeatable
@given(poses)
@every_pose
def test_parts_of_a_pose(x: Array) -> None:
    r, t = dq.rotation(x), dq.translation(x)
    close(r, x[:4], 0.0)
    close(t, (2.0 * DQ(x).D() * DQ(x).P().conj()).vec3(), size(x))  # its translation() refuses far poses
    close(dq.from_rotation_translation(r, t), x, size(x))
    close(dq.rotation_matrix(x), Rotation.from_quat(x[:4], scalar_first=True).as_matrix())


@repeatable
@given(poses)
@every_pose
def test_pose_of_a_matrix(x: Array) -> None:
    R = np.ascontiguousarray(Rotation.from_quat(x[:4], scalar_first=True).as_matrix())
    got = dq.from_matrix(R, dq.translation(x))
    assert got[0] >= 0.0
    close(got, x if got @ x > 0.0 else -x, size(x))


@pytest.mark.parametrize("angle", [np.pi - 1e-7, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3), AXIS, -AXIS, np.array([0.6, 0.0, 0.8])])
def test_pose_of_a_half_turn_keeps_every_digit(angle: float, axis: Array) -> None:
    got = dq.from_matrix(np.ascontiguousarray(Rotation.from_rotvec(angle * axis).as_matrix()), np.zeros(3))
    expected = pose(angle, axis, np.zeros(3))
    close(got, expected if got @ expected > 0.0 else -expected, 1e-15)


def screw(angle: float, axis: Array, point: Array, shift: float) -> tuple[Array, Array]:
    """A turn about and a shift along the line through a point: its logarithm and its pose, by hand."""
    v = np.r_[0.0, angle * axis, 0.0, shift * axis + angle * np.cross(point, axis)] / 2.0
    half = np.sin(angle / 2) * np.cross(axis, point)
    turned = 2.0 * (np.sin(angle / 2) * np.cross(axis, half) + np.cos(angle / 2) * half)
    return v, pose(angle, axis, shift * axis - turned)


@repeatable
@given(st.floats(1e-3, 5.5), axes, vectors, numbers)
@visiting(*((a, n, POINT * k, 0.4 * k) for a in ANGLES[:10] for n in (AXIS, -Z_AXIS) for k in (0.0, 1.0, 1e6)))
def test_logarithm_and_exponential_of_a_screw(angle: float, axis: Array, point: Array, shift: float) -> None:
    v, x = screw(angle, axis, point, shift)
    close(dq.exponential(v), x, 4 * size(x, v))
    got = dq.logarithm(x)
    np.testing.assert_allclose(got[:4], v[:4], rtol=1e-12, atol=1e-12 * angle)
    close(got[4:], v[4:], 4 * log_tolerance(x) * max(1.0, float(np.abs(point).max())))


@repeatable
@given(octets)
def test_exponential_is_the_power_series(v: Array) -> None:
    v[[0, 4]] = 0.0
    close(dq.exponential(v), expm(DQ(v).hamiplus8())[:, 0], 1e-11)


@repeatable
@given(poses)
@every_pose
def test_exponential_undoes_the_logarithm(x: Array) -> None:
    v = dq.logarithm(x)
    assert v[0] == 0.0 == v[4]
    assert np.linalg.norm(v[1:4]) <= np.pi + 1e-15
    close(dq.exponential(v), x, log_tolerance(x))


@pytest.mark.parametrize("t", SHIFTS)
def test_logarithm_at_minus_one_turns_about_the_shift(t: Array) -> None:
    x = pose(0.0, AXIS, t, -1.0)
    v = dq.logarithm(x)
    close(v[1:4], np.pi * t / np.linalg.norm(t) if t.any() else [np.pi, 0.0, 0.0])
    close(dq.exponential(v), x, size(t))


@repeatable
@given(st.floats(0.0, 3.0), axes, vectors)
@visiting(*((a, AXIS, t) for a in (*ANGLES[:6], np.pi - 1e-3) for t in SHIFTS))
def test_logarithm_is_half_the_twist_of_pinocchio(angle: float, axis: Array, t: Array) -> None:
    x = pose(angle, axis, t)
    twist = pin.log6(pin.SE3(dq.rotation_matrix(x), dq.translation(x)))
    # Pinocchio takes the angle from a trace, which has half the digits.
    close(2.0 * dq.logarithm(x)[1:4], twist.angular, 1e-9)
    close(2.0 * dq.logarithm(x)[5:8], twist.linear, 1e-9 * max(1.0, float(np.abs(t).max())))


@repeatable
@given(st.floats(0.3, 5.9), axes, numbers)
def test_logarithm_and_power_of_dq_robotics_where_it_has_one(angle: float, axis: Array, shift: float) -> None:
    """Its log has the dual part t/2, which is the group's logarithm only where t is along the axis.

    Elsewhere its pow(0.5) squared is not the pose. Its angle is 2 acos(w): 0 below 1e-8.
    """
    x = pose(angle, axis, shift * axis)
    close(dq.logarithm(x), DQ(x).log().vec8(), 1e-11)
    close(dq.exponential(dq.logarithm(x)), DQ(x).log().exp().vec8(), 1e-11)
    close(dq.power(x, 0.3), DQ(x).pow(0.3).vec8(), 1e-11)


@repeatable
@given(poses)
@every_pose
def test_powers_multiply(x: Array) -> None:
    tolerance = 10 * log_tolerance(x)
    third = dq.power(x, 1.0 / 3.0)
    if x[0] > -0.5 or np.linalg.norm(x[1:4]) > 1e-3:
        close((DQ(third) * DQ(third) * DQ(third)).vec8(), x, tolerance)
        close(dq.product(dq.power(x, -0.5), x), dq.power(x, 0.5), tolerance)
    close(dq.power(x, 0.0), [1, 0, 0, 0, 0, 0, 0, 0], 0.0)


def same_pose(got: Array, expected: Array, tolerance: float) -> None:
    close(got, expected if got[:4] @ expected[:4] > 0.0 else -expected, tolerance)


@repeatable
@given(poses, poses)
@every_pair
def test_sclerp_meets_its_ends_the_short_way(x0: Array, x1: Array) -> None:
    tolerance = 30 * size(x0, x1)
    close(dq.sclerp(x0, x1, 0.0), x0, tolerance)
    same_pose(dq.sclerp(x0, x1, 1.0), x1, tolerance)
    for tau in (0.25, 0.5, 1.0):
        turned = (DQ(x0).conj() * DQ(dq.sclerp(x0, x1, tau))).vec8()
        assert turned[0] >= np.cos(tau * np.pi / 2) - 1e-12
    if abs(x0[:4] @ x1[:4]) > 1e-9:
        close(dq.sclerp(x0, -x1, 0.4), dq.sclerp(x0, x1, 0.4), tolerance)
    same_pose(dq.sclerp(-x0, x1, 0.0), x0, tolerance)


@repeatable
@given(poses, poses)
@every_pair
def test_sclerp_has_constant_screw_speed(x0: Array, x1: Array) -> None:
    tolerance = 100 * size(x0, x1)
    path = [DQ(dq.sclerp(x0, x1, tau)) for tau in np.linspace(0.0, 1.0, 6)]
    steps = [(a.conj() * b).vec8() for a, b in pairwise(path)]
    for step in steps[1:]:
        close(step, steps[0], tolerance)


def test_sclerp_between_a_half_turn_apart() -> None:
    x0, x1 = pose(0.0, AXIS, np.zeros(3)), pose(np.pi, np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.4]))
    for sign in (1.0, -1.0):
        middle = dq.sclerp(x0, sign * x1, 0.5)
        close(abs(dq.rotation_matrix(middle)[1, 0]), 1.0)
        close(dq.translation(middle), [1.0, -dq.rotation_matrix(middle)[1, 0], 0.2])


def test_sclerp_follows_a_helix() -> None:
    """A quarter turn about the vertical line through (1, 0, 0), with a rise of 0.2 m."""
    x0 = pose(0.7, AXIS, POINT)
    _, whole = screw(np.pi / 2, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 0.2)
    x1 = (DQ(whole) * DQ(x0)).vec8()
    for tau in (0.2, 0.5, 0.9):
        R = Rotation.from_rotvec([0.0, 0.0, tau * np.pi / 2]).as_matrix()
        expected = R @ (POINT - [1.0, 0.0, 0.0]) + [1.0, 0.0, 0.2 * tau]
        close(dq.translation(dq.sclerp(x0, x1, tau)), expected)
        close(dq.rotation_matrix(dq.sclerp(x0, x1, tau)), R @ dq.rotation_matrix(x0))


@repeatable
@given(poses, poses)
@every_pair
def test_nearest_sign_has_the_smaller_error(x_d: Array, x: Array) -> None:
    got = dq.nearest_sign(x_d, x)
    assert np.array_equal(got, x_d) or np.array_equal(got, -x_d)
    assert got @ x >= -size(x, x_d) * size(x, x_d) * 1e12
    assert not np.shares_memory(got, x_d)


def test_nearest_sign_counts_all_eight_numbers() -> None:
    x_d, x = pose(0.0, AXIS, np.array([5.0, 0, 0])), pose(0.2, AXIS, np.array([-5.0, 0, 0]))
    assert x_d[:4] @ x[:4] > 0.0 > x_d @ x
    close(dq.nearest_sign(x_d, x), -x_d, 0.0)
    right = np.array([1.0, 0, 0, 0, 0, 0, 0, 0])
    close(dq.nearest_sign(right, np.roll(right, 1)), right, 0.0)


def test_border_with_dq_robotics() -> None:
    x = pose(2.0, AXIS, POINT, -1.0)
    close(conversions.from_dq(DQ(x)), x, 0.0)
    close(conversions.to_dq(x).vec8(), x, 0.0)
    close(conversions.to_dq(list(x)).vec8(), x, 0.0)
    close(conversions.as_dual_quaternion(DQ(x), "x"), x, 0.0)
    close(conversions.as_dual_quaternion([1, 2, 3, 4, 5, 6, 7, 8], "x"), np.arange(1.0, 9.0), 0.0)
    for got in (conversions.from_dq(DQ(x)), conversions.as_dual_quaternion(x[::-1], "x"), conversions.as_pose(x, "x")):
        assert got.flags.c_contiguous
        assert got.flags.writeable
        assert not np.shares_memory(got, x)
        dq.conjugate(got)


NO_NUMBERS = [1, 0, 0, 0, np.nan, 0, 0, 0], [1, 0, 0, 0, 0, np.inf, 0, 0]


@pytest.mark.parametrize("value", [None, "one", [1.0, 0.0], np.eye(8), *NO_NUMBERS])
def test_what_is_no_dual_quaternion_is_refused(value: Any) -> None:
    for check in (conversions.as_dual_quaternion, conversions.as_pose):
        with pytest.raises(InputError, match="pose of shaft: expected"):
            check(value, "pose of shaft")
    with pytest.raises(InputError):
        conversions.to_dq(value)


@repeatable
@given(poses)
@every_pose
def test_a_pose_is_accepted_and_normalised(x: Array) -> None:
    close(conversions.as_pose(x, "x"), x, size(x))
    close(conversions.as_pose(DQ(x), "x"), x, size(x))
    close(dq.norm(conversions.as_pose(x * (1.0 + 9e-7), "x")), [1.0, 0.0], 1e-15 * max(1.0, float(np.abs(x).max())))
    along = np.r_[np.zeros(4), x[:4]]
    close(conversions.as_pose(x + 9e-7 * along, "x"), x, size(x))
    skew = x + 2e-6 * max(1.0, float(np.linalg.norm(x))) * along
    for wrong in (x * (1.0 + 2e-6), x * (1.0 - 2e-6), 0.0 * x, skew):
        with pytest.raises(InputError, match="pose of base: expected a unit dual quaternion"):
            conversions.as_pose(wrong, "pose of base")


@repeatable
@given(vectors, axes, st.floats(1e-3, 50.0), numbers)
def test_line_and_plane(p: Array, n: Array, length: float, s: float) -> None:
    line, plane = conversions.line(p, length * n), conversions.plane(length * n, p)
    close(line[[0, 4]], np.zeros(2), 0.0)
    close(line[1:4], n)
    close(line[5:], np.cross(p + s * n, n), 1e-11)
    close(plane, np.r_[0.0, n, p @ n, 0.0, 0.0, 0.0], 1e-11)
    across = np.cross(n, [n[1], n[2] + 1.0, n[0]])
    close(conversions.plane(n, p + s * across), plane, 1e-11)


def test_line_and_plane_refuse_what_has_no_direction() -> None:
    with pytest.raises(InputError, match="direction of line"):
        conversions.line([0, 0, 0], [0, 0, 0])
    with pytest.raises(InputError, match="normal of plane"):
        conversions.plane([0, 0, 0], [0, 0, 0])
    with pytest.raises(InputError, match="point of line"):
        conversions.line([0, np.nan, 0], [0, 0, 1])
    with pytest.raises(InputError, match="point of plane"):
        conversions.plane([0, 0, 1], [0, 0])
