"""Barrier and repulsion against the paper's formulas, brute force in NumPy, and differences."""

import numpy as np
import pytest

from admittance.nullspace import free_basis
from admittance.potential import barrier, repulsion
from primitives.errors import InputError
from primitives.voxel_grid import build_grid
from tests.admittance.cases import bowl

K, D_0, D_C, R = 0.01, 0.0115, 0.0035, 0.0035
PORT, TIP = np.array([0.02, -0.01, 0.3]), np.zeros(3)
AXIS = (TIP - PORT) / np.linalg.norm(TIP - PORT)


def printed(distance: np.ndarray, safe: float) -> tuple[np.ndarray, np.ndarray]:
    """(9) with its erratum and the magnitude of (11): potential and force, as they stand in the paper."""
    with np.errstate(invalid="ignore"):
        psi = (distance - (D_0 + safe)) ** 2 / D_0**2
        V = 0.5 * K * np.log(1.0 / (1.0 - psi)) ** 2
        force = 2.0 * K / (D_0**2 * (1.0 - psi)) * np.log(1.0 / (1.0 - psi)) * ((D_0 + safe) - distance)
    inside = distance <= D_0 + safe
    return np.where(inside, V, 0.0), np.where(inside, force, 0.0)


def brute(points: np.ndarray, tip: np.ndarray, axis: np.ndarray, length: float, safe: float):
    """(14), (34)-(37) over all points, without a grid."""
    p = tip - axis * length * np.clip((tip - points) @ axis / max(length, 1e-300), 0.0, 1.0)[:, None]
    difference = p - points
    distance = np.linalg.norm(difference, axis=1)
    V, size = printed(distance, safe)
    f = size[:, None] * difference / distance[:, None]
    return V.sum(), np.concatenate([f.sum(0), np.cross(p - tip, f).sum(0)]), size.sum()


def query(points: np.ndarray, tip: np.ndarray, axis: np.ndarray, length: float, safe: float, **more: object):
    segment = np.array([*(tip - length * axis), *axis, length, 0.0])
    options = {"safe": safe, "k": K, "d_0": D_0, "tip": tip, "port": PORT, "axis": axis, **more}
    return repulsion(build_grid(points), segment, **options)


def scene(rng: np.random.Generator, count: int = 400, nearest: float = 2e-4):
    """Points about a tool that goes through the port, none of them within `nearest` of its barrier."""
    axis = AXIS + 0.05 * rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    tip, length = PORT + axis * rng.uniform(0.1, 0.3), 0.43
    place = rng.uniform(-0.02, 0.2, count)
    points = tip - place[:, None] * axis + 0.015 * rng.normal(size=(count, 3))
    foot = tip - axis * np.clip((tip - points) @ axis, 0.0, length)[:, None]
    return points[np.linalg.norm(points - foot, axis=1) > D_C + R + nearest], tip, axis, length


@pytest.mark.parametrize("clearance", [1e-9, 1e-6, 1e-4, 1e-3, 5e-3, 0.0114999, 0.0115, 0.02])
def test_barrier_and_its_derivatives(clearance):
    V, force, stiffness = barrier(clearance, K, D_0, 0.0)
    h = 1e-5 * clearance
    (ahead, f_ahead, _), (behind, f_behind, _) = (barrier(clearance + s * h, K, D_0, 0.0) for s in (1, -1))
    assert force == pytest.approx(-(ahead - behind) / (2 * h), rel=1e-5, abs=1e-7)
    assert stiffness == pytest.approx(-(f_ahead - f_behind) / (2 * h), rel=1e-5, abs=1e-1 * K)
    if clearance >= 1e-6:
        printed_V, printed_force = printed(np.array(clearance + D_C), D_C)
        assert pytest.approx(float(printed_V), rel=1e-7, abs=1e-15) == V
        assert force == pytest.approx(float(printed_force), rel=1e-7, abs=1e-12)


def test_the_barrier_holds_little_energy():
    """readings.md, erratum 8: 0.37 J at 1 um with Table 1."""
    assert barrier(1e-6, K, D_0, 0.0)[0] == pytest.approx(0.37, abs=0.01)


@pytest.mark.parametrize("clearance", [-0.01, 0.0, 4e-4, 5.7e-4])
def test_linear_continuation_is_finite_and_smooth_of_first_order(clearance):
    eps = 0.05 * D_0
    V, force, stiffness = barrier(clearance, K, D_0, eps)
    at, f_at, _ = barrier(eps, K, D_0, 0.0)
    assert force == f_at and stiffness == 0.0
    assert pytest.approx(at + f_at * (eps - clearance), rel=1e-14) == V
    assert barrier(eps + 1e-12, K, D_0, eps)[0] == pytest.approx(at, rel=1e-8)


@pytest.mark.parametrize("whole", [False, True])
def test_equal_to_brute_force(whole):
    """Within 1e-12 of the sum of |f_i|, in random scenes."""
    rng = np.random.default_rng(1)
    pushed = 0
    for _ in range(60):
        points, tip, axis, length = scene(rng)
        length, safe = (length, D_C + R) if whole else (0.0, D_C)
        found = query(points, tip, axis, length, safe)
        V, F_r, total = brute(points, tip, axis, length, safe)
        pushed += total > 0.0
        assert np.abs(found.F_r - F_r).max() <= 1e-12 * total
        assert found.potential == pytest.approx(V, rel=1e-11, abs=1e-18)
        Z_x = np.empty((4, 6))
        x = np.cross(axis, [1.0, 0.0, 0.0])
        x /= np.linalg.norm(x)
        free_basis(np.concatenate([np.column_stack([x, np.cross(axis, x), axis]).ravel(), tip]), PORT, Z_x)
        np.testing.assert_allclose(found.F_rx, Z_x @ F_r, atol=1e-12 * (1.0 + total))
    assert pushed > 40


def moved(tip: np.ndarray, axis: np.ndarray, v: np.ndarray, h: float):
    """Tip and axis after h seconds of a free velocity: along the shaft, and a rotation about the port."""
    w = v[1:] * h
    angle = float(np.linalg.norm(w))
    u = w / angle if angle > 0.0 else w

    def turn(x: np.ndarray) -> np.ndarray:
        return x * np.cos(angle) + np.cross(u, x) * np.sin(angle) + u * (u @ x) * (1.0 - np.cos(angle))

    return PORT + turn(tip + v[0] * h * axis - PORT), turn(axis)


@pytest.mark.parametrize("whole", [False, True])
def test_free_repulsion_is_minus_the_gradient_of_the_potential(whole):
    """(11)-(13), (36), (37) are -grad of (9) to 1e-5, in the free coordinates, and rows those of the clearances."""
    rng = np.random.default_rng(2)
    for _ in range(25):
        points, tip, axis, length = scene(rng, nearest=2e-3)
        length, safe = (length, D_C + R) if whole else (0.0, D_C)
        here, h = query(points, tip, axis, length, safe), 1e-6
        for coordinate in np.eye(4):
            ahead, behind = (
                query(points, *moved(tip, axis, coordinate, s * h), length, safe).potential for s in (1, -1)
            )
            slope = (ahead - behind) / (2 * h)
            assert here.F_rx @ coordinate == pytest.approx(-slope, abs=1e-5 * (1.0 + np.abs(here.F_rx).max()))


def test_rows_are_derivatives_of_clearances_and_stiffness_their_sum():
    rng, h = np.random.default_rng(3), 1e-7
    points, tip, axis, length = scene(rng, nearest=1e-3)
    for point in points[:60]:
        here = query(point[None], tip, axis, length, D_C + R)
        if not len(here.rows):
            continue
        for i, coordinate in enumerate(np.eye(4)):
            ahead, behind = (
                query(point[None], *moved(tip, axis, coordinate, s * h), length, D_C + R, sight=0.02).clearance
                for s in (1, -1)
            )
            assert here.rows[0, i] == pytest.approx((ahead - behind) / (2 * h), abs=1e-6)
        stiffness = barrier(here.clearances[0], K, D_0, 0.0)[2]
        np.testing.assert_allclose(here.stiffness, stiffness * np.outer(here.rows, here.rows), rtol=1e-12)


def test_a_point_on_the_range_and_beyond_does_nothing():
    for distance in (D_C + D_0, D_C + D_0 + 1e-9, 1.0):
        found = query(TIP[None] + [distance, 0.0, 0.0], TIP, AXIS, 0.0, D_C)
        assert found.potential == 0.0 and not found.F_r.any() and not found.stiffness.any()
    assert found.clearance == np.inf and found.point == -1


@pytest.mark.parametrize("depth", [0.0, 1e-6, 1e-3, 0.0035])
def test_a_point_inside_is_an_error_with_its_index_and_depth(depth):
    away = np.array([[0.5, 0.5, 0.5], [0.4, 0.4, 0.4]])
    points = np.vstack([away, TIP + np.array([D_C - depth, 0.0, 0.0])])
    with pytest.raises(InputError, match=rf"{depth * 1e3:.4g} mm inside the sphere of point 2 \(psi >= 1\)"):
        query(points, TIP, AXIS, 0.0, D_C)
    found = query(points, TIP, AXIS, 0.0, D_C, linear_below=1e-4)
    assert np.isfinite([found.potential, *found.F_r, *found.stiffness.ravel()]).all()
    assert found.clearance == pytest.approx(-depth, abs=1e-15)


def test_in_a_bowl_the_force_points_to_the_middle():
    points = bowl(TIP, 0.012, 0.0005)
    tip = np.array([0.0, 0.0, -0.002])
    found = query(points, tip, AXIS, 0.0, 0.001)
    assert found.F_r[2] > 0.0 and np.abs(found.F_r[:2]).max() < 0.01 * found.F_r[2]
