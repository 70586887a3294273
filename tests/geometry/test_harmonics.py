import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import sph_harm_y

from odeform.geometry.harmonics import harmonic_basis, rotated_harmonics

RNG = np.random.default_rng(0)
HARMONICS = (1, 4, 9, 16)


def directions(count: int) -> np.ndarray:
    free = RNG.normal(size=(count, 3))
    return free / np.linalg.norm(free, axis=1, keepdims=True)


def color(coefficients: np.ndarray, seen_from: np.ndarray) -> np.ndarray:
    """(N, H, 3) in (D, 3) directions -> (N, D, 3)."""
    return harmonic_basis(seen_from, math.isqrt(coefficients.shape[1]) - 1) @ coefficients


def test_basis_is_that_of_scipy() -> None:
    seen = directions(40)
    theta, phi = np.arccos(seen[:, 2]), np.arctan2(seen[:, 1], seen[:, 0])
    basis = harmonic_basis(seen, 4)
    for degree in range(5):
        for order in range(-degree, degree + 1):
            whole = sph_harm_y(degree, abs(order), theta, phi)
            true = whole.real if order == 0 else math.sqrt(2.0) * (whole.real if order > 0 else whole.imag)
            assert np.allclose(basis[:, degree * (degree + 1) + order], true, atol=1e-12)


def test_signs_are_those_of_the_trained_files() -> None:
    """The constants and signs of `eval_sh` in the code of Kerbl et al. (2023)."""
    x, y, z = seen = np.array([0.36, 0.48, 0.8])
    basis = harmonic_basis(seen, 3)
    assert np.allclose(basis[:4], [0.28209479177387814, *(0.4886025119029199 * np.array([-y, z, -x]))])
    assert np.allclose(
        basis[4:9],
        [
            *(1.0925484305920792 * x * y, -1.0925484305920792 * y * z),
            0.31539156525252005 * (2.0 * z * z - x * x - y * y),
            *(-1.0925484305920792 * x * z, 0.5462742152960396 * (x * x - y * y)),
        ],
    )
    assert basis[9] == pytest.approx(-0.5900435899266435 * y * (3 * x * x - y * y))
    assert basis[15] == pytest.approx(-0.5900435899266435 * x * (x * x - 3 * y * y))


@pytest.mark.parametrize("count", HARMONICS)
def test_what_was_seen_from_d_is_seen_from_the_turned_d(count: int) -> None:
    coefficients, seen = RNG.normal(size=(50, count, 3)), directions(20)
    turns = Rotation.random(50, rng=1).as_matrix()
    for index, turned in enumerate(rotated_harmonics(coefficients, turns)):
        moved = color(turned[None], seen @ turns[index].T)
        assert np.abs(moved - color(coefficients[index : index + 1], seen)).max() < 1e-10


@pytest.mark.parametrize("count", HARMONICS)
def test_rotations_form_a_group(count: int) -> None:
    coefficients = RNG.normal(size=(30, count, 3))
    one, two = (Rotation.random(30, rng=seed).as_matrix() for seed in (2, 3))
    assert np.abs(rotated_harmonics(coefficients, np.eye(3)) - coefficients).max() < 1e-12
    twice = rotated_harmonics(rotated_harmonics(coefficients, one), two)
    assert np.abs(twice - rotated_harmonics(coefficients, two @ one)).max() < 1e-10
    # one turn for all is that turn for each
    assert np.allclose(rotated_harmonics(coefficients, one[0])[0], rotated_harmonics(coefficients, one)[0], atol=1e-12)


def test_many_splats_keep_their_order_and_type() -> None:
    coefficients = RNG.normal(size=(10_000, 16, 3)).astype(np.float32)
    turns = Rotation.random(10_000, rng=4).as_matrix()
    turned = rotated_harmonics(coefficients, turns)
    assert turned.dtype == np.float32
    for index in (0, 4095, 4096, 9999):
        alone = rotated_harmonics(coefficients[index : index + 1], turns[index])
        assert np.allclose(turned[index], alone[0], atol=1e-5)
    assert np.array_equal(turned[:, 0], coefficients[:, 0])
