"""Deformations in axes that do not turn with a body."""

import numpy as np
import pytest

from odeform.motion.rolling import Rolling, fourier_series

AXIS = np.array([0.0, 1.0, 0.0])


@pytest.fixture
def rolling() -> Rolling:
    rng = np.random.default_rng(0)
    return Rolling(AXIS, rng.normal(size=(7, 6, 3)))


def test_a_fourier_series_has_the_values_it_was_made_of() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    values = np.stack([2.0 + np.cos(3.0 * angles), np.sin(angles)], axis=1)[:, :, None]
    series = fourier_series(values, 1e-6)
    assert series.shape == (7, 2, 1)
    assert np.allclose(Rolling(AXIS, series).matrices(angles), values)
    assert fourier_series(values, 0.5).shape == (3, 2, 1)


def test_amplitudes_come_back(rolling: Rolling) -> None:
    rng = np.random.default_rng(1)
    vectors, amplitudes = rng.normal(size=(300, 1)) * AXIS, rng.normal(size=(300, 3))
    found = rolling.amplitudes(vectors, rolling.coefficients(vectors, amplitudes))
    assert np.allclose(found, amplitudes, rtol=1e-6, atol=1e-6)
    assert np.allclose(
        rolling.first(2).coefficients(vectors, amplitudes[:, :2]),
        rolling.coefficients(vectors, amplitudes * [1.0, 1.0, 0.0]),
    )


def test_damaged_arrays_are_refused(rolling: Rolling) -> None:
    arrays = rolling.arrays()
    again = Rolling.from_arrays(arrays, 6)
    assert again is not None
    assert np.allclose(again.harmonics, rolling.harmonics, atol=1e-6)
    assert Rolling.from_arrays({}, 6) is None
    with pytest.raises(ValueError, match=r"rolling.axis: expected a unit vector"):
        Rolling.from_arrays({**arrays, "rolling.axis": np.array([1.0, 1.0, 0.0])}, 6)
    for wrong in (np.zeros((6, 6, 3)), np.zeros((7, 5, 3)), np.zeros((7, 6)), np.full((7, 6, 3), np.nan)):
        with pytest.raises(ValueError, match=r"rolling.harmonics: expected a finite array of 6 modes"):
            Rolling.from_arrays({**arrays, "rolling.harmonics": wrong}, 6)
