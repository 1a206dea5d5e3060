"""Variable damping: the formulas with Table 1, and the erratum of (45)."""

import numpy as np
import pytest

from admittance.damping import fill_damping
from admittance.parameters import NEURO8, TABLE_1, Parameters
from primitives.errors import InputError

GAINS = np.array([TABLE_1.D_c, TABLE_1.Q, TABLE_1.M, TABLE_1.G, TABLE_1.C])


def damping(v, F_rx) -> np.ndarray:
    D = np.full(len(v), np.nan)
    fill_damping(GAINS, TABLE_1.redundant_damping, np.asarray(v, dtype=float), np.asarray(F_rx, dtype=float), D)
    return D


def test_at_rest_and_free_it_is_the_constant_plus_Q():
    np.testing.assert_array_equal(damping(np.zeros(5), np.zeros(4)), [35.0, 24.0, 24.0, 24.0, 60.0])


def test_formulas_43_to_45():
    """z_1 is the force along the shaft, z_2..4 the norm of the torque; s likewise of the velocity."""
    v, F = [-0.03, 0.1, -0.2, 0.2, 5.0], [-3.0, 1.0, 2.0, -2.0]
    along = 10.0 + 25.0 * np.exp(-22.0 * 0.03) + 60.0 * (1.0 - np.exp(-0.01 * 9.0))
    about = 4.0 + 20.0 * np.exp(-19.0 * 0.3) + 30.0 * (1.0 - np.exp(-0.2 * 9.0))
    np.testing.assert_allclose(damping(v, F), [along, about, about, about, 60.0], rtol=1e-14)


def test_bounds_whatever_the_speed_and_the_force():
    rng = np.random.default_rng(1)
    for size in (0.0, 1e-6, 1.0, 1e6, 1e150):
        D = damping(size * rng.normal(size=5), size * rng.normal(size=4))
        assert np.all(D >= [10.0, 4.0, 4.0, 4.0, 60.0]) and np.all(D <= [95.0, 54.0, 54.0, 54.0, 60.0])


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("D_c", (1.0, 1.0, 1.0), "D_c of Parameters"),
        ("D_c", (0.0, 1.0, 1.0, 1.0), "D_c"),
        ("inertia", (-1.0, 1.0, 1.0, 1.0), "inertia"),
        ("Q", (np.nan, 1.0, 1.0, 1.0), "Q of Parameters"),
        ("d_0", 0.0, "d_0"),
        ("k", -1.0, "k of Parameters"),
        ("W", (1.0, 0.0), "W of Parameters"),
        ("W", -1.0, "W of Parameters"),
        ("alpha", "fast", "alpha"),
    ],
)
def test_bad_parameters_are_refused_by_name(field, value, words):
    with pytest.raises(InputError, match=words):
        Parameters(**{field: value})


def test_weights_for_another_number_of_joints_are_refused():
    with pytest.raises(InputError, match="W of Parameters"):
        Parameters(W=(1.0, 2.0, 3.0)).weights(7)
    assert Parameters(W=(1.0, 2.0, 3.0)).weights(3).tolist() == [1.0, 2.0, 3.0]


def test_the_set_of_the_neurosurgical_arm():
    assert NEURO8.masses(6).tolist()[:4] == [8.0, 0.3, 0.3, 0.3] and NEURO8.implicit_damping
