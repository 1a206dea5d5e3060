"""Every registered pair against its oracle in `pair_cases`: gradient, singular sets, and wrong kernels refused.

Requirement (safety.md): |J - finite difference| <= 1e-6 outside the declared band, in absolute numbers even where J
grows like 1/angle; and 0 NaN in 10^5 degenerate cases.
"""

from typing import Any

import numpy as np
import pytest

from primitives.checks import Array
from primitives.pair import Kernel, Pair
from primitives.pairs.line_line import parallel_lines
from primitives.registry import pairs
from primitives.vectors import CONTACT, DEGENERATE, IN_BAND, OK, PARALLEL
from tests.primitives import differences as diff
from tests.primitives import pair_cases as cases
from tests.primitives.pair_cases import CASES

REQUIRED = 1e-6
DIGITS = 1e-12
"""Of distances of about a metre; lines at an angle of 1e-4 lose four of sixteen digits."""

NAMES = pairs.names()
extended = pytest.mark.skipif(
    not cases.EXTENDED, reason="differences at d = 1e-8 need a long double of more than 53 bits"
)


def rng_of(name: str) -> np.random.Generator:
    return np.random.default_rng([ord(c) for c in name])


def check_gradient(kernel: Kernel, name: str, n: int) -> float:
    """Distance and gradient of a kernel outside its band; returns the largest disagreement of the gradient."""
    case = CASES[name]
    a, b = case.sample(rng_of(name), n, 1e-8)
    off = diff.off(kernel, case.distance, a, b, diff.step_of(case.bend, a, b), case.absolute)
    worst = int(off.gradient.argmax())
    assert off.distance.max() <= DIGITS, "distance disagrees with the oracle"
    assert (off.status == OK).all(), "outside the declared band every status is OK"
    assert off.gradient[worst] <= REQUIRED, (
        f"gradient disagrees with central differences by {off.gradient[worst]:.1e} at {a[worst]}, {b[worst]}"
    )
    return float(off.gradient[worst])


def check_finite(kernel: Kernel, pair: Pair, n: int) -> int:
    """Degenerate cases of a kernel; returns how many are not finite, always 0."""
    a, b = cases.degenerate(rng_of(pair.name), n, (pair.first, pair.second))
    distance, gradient, status = diff.evaluated(kernel, a, b)
    bad = ~(np.isfinite(distance) & np.isfinite(gradient).all(axis=1))
    assert not bad.any(), f"{bad.sum()} of {n} degenerate cases are not finite"
    assert np.isin(status, (OK, DEGENERATE, IN_BAND)).all()
    np.testing.assert_array_equal(~gradient.any(axis=1), status == DEGENERATE, "a zero gradient has to be declared")
    assert np.abs(gradient[:, [0, 1, 2, 6, 7, 8]]).max() < 1.001
    return int(bad.sum())


def test_every_registered_pair_has_a_case() -> None:
    assert set(NAMES) == set(CASES), "add the new pair to tests/primitives/pair_cases.py"


@extended
@pytest.mark.parametrize("name", NAMES)
def test_gradient_is_the_derivative_of_the_distance(name: str, record_property: Any) -> None:
    worst = check_gradient(pairs[name].kernel, name, 10_000)
    record_property("pair", (name, "central differences", f"{worst:.1e}"))


@pytest.mark.parametrize("name", NAMES)
def test_the_sample_is_near_singular(name: str) -> None:
    a, b = CASES[name].sample(rng_of(name), 10_000, 1e-8)
    bend, d = CASES[name].bend(a, b), np.abs(CASES[name].distance(a, b))
    if name == "point_plane":
        assert (d < 1e-16).sum() > 500 and (CASES[name].distance(a, b) < 0).sum() > 3000
        return
    assert bend.min() < (1.1 * PARALLEL if name == "line_line" else 1.1e-8)
    assert d.min() < 1.1e-8 and d.max() > 0.9
    if {"line"} == {pairs[name].first, pairs[name].second} or name == "segment_segment":
        cosine = np.einsum("ni,ni->n", a[:, 3:6], b[:, 3:6])
        assert (cosine < -0.9999).sum() > 1000 and (cosine > 0.9999).sum() > 1000


@extended
@pytest.mark.parametrize("name", [n for n in NAMES if CASES[n].kinks])
def test_gradient_is_continuous_where_a_closest_point_meets_an_end(name: str) -> None:
    sample = CASES[name].kinks
    assert sample is not None
    a, b = sample(rng_of(name), 3000)
    off = diff.off(pairs[name].kernel, CASES[name].distance, a, b, np.full(3000, 1e-11))
    assert off.distance.max() <= DIGITS
    assert off.gradient.max() <= REQUIRED


@extended
@pytest.mark.parametrize("name", [n for n in NAMES if CASES[n].band])
def test_inside_the_declared_band_the_limiting_formula_holds(name: str) -> None:
    """Its distance and its gradient belong together, exactly (anti)parallel lines included."""
    limit = CASES[name].band
    assert limit is not None
    sample, distance = limit
    a, b = sample(rng_of(name), 10_000)
    off = diff.off(pairs[name].kernel, distance, a, b, diff.step_of(cases.parallel_bend, a, b))
    assert (off.status == IN_BAND).all()
    assert off.distance.max() <= DIGITS
    assert off.gradient.max() <= REQUIRED
    parallel = cases.sine(a, b) == 0
    assert parallel.sum() > 1000
    assert np.abs(distance(a, b) - cases.point_to_line(a, b))[parallel].max() < 1e-15


def test_the_band_of_lines_ends_at_its_declared_angle() -> None:
    line = np.array([0.0, 0, 0, 0, 0, 1, 0, 0])
    for sine, status in ((0.999 * PARALLEL, IN_BAND), (1.001 * PARALLEL, OK)):
        for sign in (1.0, -1.0):
            other = np.array([0.1, 0, 0, 0, sine, sign * np.sqrt(1 - sine**2), 0, 0])
            assert pairs["line_line"].kernel(line, other, np.empty(12))[1] == status


@pytest.mark.parametrize("name", [n for n in NAMES if CASES[n].several])
def test_of_several_closest_pairs_the_gradient_is_that_of_one(name: str) -> None:
    """Segments that overlap and are parallel, exactly or within PARALLEL: a generalised gradient of the distance.

    Read from the gradient: the unit vector u between the closest points, and where on each segment they are.
    """
    sample = CASES[name].several
    assert sample is not None
    a, b = sample(rng_of(name), 10_000)
    d, g, status = diff.evaluated(pairs[name].kernel, a, b)
    u, s, t = g[:, :3], np.einsum("ni,ni->n", g[:, 3:6], g[:, :3]), -np.einsum("ni,ni->n", g[:, 9:], g[:, :3])
    apart = a[:, :3] + s[:, None] * a[:, 3:6] - b[:, :3] - t[:, None] * b[:, 3:6]
    assert (status == OK).all()
    assert np.abs(d - CASES[name].distance(a, b)).max() <= DIGITS
    np.testing.assert_allclose(apart, d[:, None] * u, atol=DIGITS)
    np.testing.assert_allclose(g[:, 6:9], -u, atol=0)
    assert s.min() > -DIGITS and (s - a[:, 6]).max() < DIGITS
    assert t.min() > -DIGITS and (t - b[:, 6]).max() < DIGITS

    parallel = cases.sine(a, b) == 0
    shadow = np.einsum("ni,ni->n", b[:, :3] - a[:, :3], a[:, 3:6])
    end = shadow + b[:, 6] * np.sign(np.einsum("ni,ni->n", a[:, 3:6], b[:, 3:6]))
    low, high = np.maximum(np.minimum(shadow, end), 0.0), np.minimum(np.maximum(shadow, end), a[:, 6])
    assert parallel.sum() > 1000
    np.testing.assert_allclose(s[parallel], 0.5 * (low + high)[parallel], atol=DIGITS)


@pytest.mark.parametrize("name", NAMES)
def test_degenerate_cases_are_finite_and_declared(name: str, record_property: Any) -> None:
    pair = pairs[name]
    count = check_finite(pair.kernel, pair, 100_000)
    record_property("pair", (name, "not finite", f"{count} of 100000"))
    a, b = cases.degenerate(rng_of(name), 100_000, (pair.first, pair.second))
    distance, _, status = diff.evaluated(pair.kernel, a, b)
    if name == "point_plane":
        assert (status == OK).all() and (distance == 0.0).sum() > 10_000
        return
    assert (status == DEGENERATE).sum() > 3000 and (distance == 0.0).sum() > 500
    small = np.minimum(distance, np.pi - distance) if name == "line_line_angle" else distance
    np.testing.assert_array_equal(status == DEGENERATE, small < CONTACT)
    with np.errstate(invalid="ignore"):  # 0/0 for parallel lines, which the limiting formula takes
        expected = np.abs(CASES[name].distance(a, b))
    if limit := CASES[name].band:
        in_band = cases.sine(a, b) < PARALLEL
        assert 30_000 < in_band.sum() < 70_000
        expected = np.where(in_band, limit[1](a, b), expected)
    assert np.abs(distance - expected).max() <= DIGITS


@pytest.mark.parametrize("name", [n for n in NAMES if n != "point_plane"])
def test_contact_has_a_zero_gradient_and_says_so(name: str) -> None:
    """Just above CONTACT the gradient is there, just below it is not; never in between."""
    for d, status in ((0.9 * CONTACT, DEGENERATE), (1.1 * CONTACT, OK)):
        a = np.array([0.0, 0, 0, 0, 0, 1, 1, 0])
        b = np.array([d, 0, 0, 0, 1, 0, 1, 0])
        if name == "line_line_angle":
            b[3:6] = np.sin(d), 0, np.cos(d)
        gradient = np.full(12, np.nan)
        assert pairs[name].kernel(a, b, gradient)[1] == status
        assert np.isfinite(gradient).all() and gradient.any() == (status == OK)


def changed(name: str, change: Any) -> Kernel:
    """A pair's kernel with something done to its result."""

    def kernel(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
        distance, status = pairs[name].kernel(a, b, gradient)
        change(gradient)
        return distance, status

    return kernel


def with_sign_flipped(gradient: Array) -> None:
    gradient *= -1.0


def without_lever_arm(gradient: Array) -> None:
    gradient[3:6] = 0.0


def without_second_element(gradient: Array) -> None:
    gradient[6:] = 0.0


def with_arms_exchanged(gradient: Array) -> None:
    gradient[3:6], gradient[9:] = -gradient[9:], -gradient[3:6].copy()


def off_by_four_millionths(gradient: Array) -> None:
    gradient *= 1.0 + 4e-6


@extended
@pytest.mark.parametrize(
    ("name", "change"),
    [
        *((name, with_sign_flipped) for name in NAMES),
        *((name, without_second_element) for name in NAMES),
        *((name, off_by_four_millionths) for name in NAMES),
        *((name, without_lever_arm) for name in ("line_point", "line_line", "line_line_angle", "segment_segment")),
        *((name, with_arms_exchanged) for name in ("line_line", "segment_segment")),
    ],
)
def test_wrong_gradients_are_refused(name: str, change: Any) -> None:
    with pytest.raises(AssertionError, match="disagrees with central differences"):
        check_gradient(changed(name, change), name, 300)


@extended
def test_wrong_distances_are_refused() -> None:
    """The squared distance; and (34) where (29) is due."""

    def squared(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
        distance, status = pairs["point_point"].kernel(a, b, gradient)
        gradient *= 2.0 * distance
        return distance**2, status

    def parallel(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
        return parallel_lines(a, b, gradient)[0], OK

    for name, kernel in (("point_point", squared), ("line_line", parallel)):
        with pytest.raises(AssertionError, match="distance disagrees"):
            check_gradient(kernel, name, 300)


def test_kernels_without_a_guard_at_contact_are_refused() -> None:
    def unguarded(a: Array, b: Array, gradient: Array) -> tuple[float, int]:
        w = a[:3] - b[:3]
        d = np.sqrt(w @ w)
        with np.errstate(all="ignore"):
            gradient[:3], gradient[6:9] = w / d, -w / d
        gradient[3:6] = gradient[9:] = 0.0
        return float(d), OK

    a, b = CASES["point_point"].sample(rng_of("unguarded"), 300, 1e-8)
    right = diff.evaluated(pairs["point_point"].kernel, a, b)
    np.testing.assert_allclose(diff.evaluated(unguarded, a, b)[1], right[1], atol=1e-15)
    with pytest.raises(AssertionError, match="are not finite"):
        check_finite(unguarded, pairs["point_point"], 1000)
    with pytest.raises(AssertionError, match="has to be declared"):
        check_finite(changed("point_point", lambda g: g.fill(0.0)), pairs["point_point"], 1000)
