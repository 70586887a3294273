"""Matern kernels against their definition by Bessel functions, and their derivatives."""

import numpy as np
import pytest
from scipy.special import gamma, kv

from odeform.models.kernels.functions import matern, matern_slope


@pytest.mark.parametrize("order", [2, 6])
def test_values_are_those_of_the_definition(order: int) -> None:
    """k(d) = 2^(1 - nu) / Gamma(nu) s^nu K_nu(s), s = sqrt(2 nu) d, nu = p + 1/2 (Rasmussen, Williams 2006, 4.14)."""
    distances, nu = np.linspace(0.05, 4.0, 20), order + 0.5
    s = np.sqrt(2.0 * nu) * distances
    expected = 2.0 ** (1.0 - nu) / gamma(nu) * s**nu * kv(nu, s)
    found = matern(distances[:, None] * [[0.6, 0.8]], np.zeros((1, 2)), order)[:, 0]
    assert found == pytest.approx(expected, rel=1e-9)
    assert matern(np.ones((1, 2)), np.ones((1, 2)), order) == pytest.approx(1.0)


@pytest.mark.parametrize("order", [2, 6])
def test_slopes_are_derivatives(order: int) -> None:
    apart, step = np.array([[0.3, -0.7], [0.0, 0.0], [1.5, 0.2]]), 1e-5
    for index, shift in enumerate(step * np.eye(2)):
        up, down = (np.diag(matern(apart + sign * shift, np.zeros((3, 2)), order)) for sign in (1.0, -1.0))
        assert matern_slope(apart, order)[:, index] == pytest.approx((up - down) / (2.0 * step), abs=1e-8)


@pytest.mark.parametrize("order", [2, 6])
def test_kernel_matrices_are_positive_definite(order: int) -> None:
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 3)) / 0.3
    assert np.linalg.eigvalsh(matern(points, points, order)).min() > 0.0
