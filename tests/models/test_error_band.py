"""How wrong a model is likely to be."""

import numpy as np
import pytest

from odeform.models.error_band import FEWEST, ErrorBand, error_band
from odeform.types import Arrays

TIMES = np.linspace(0.0, 1.0, 41)


def residuals(count: int, seed: int) -> Arrays:
    """Errors that grow in time and with the first parameter, and scatter the more the later."""
    rng = np.random.default_rng(seed)
    theta = rng.uniform(-1.0, 1.0, (count, 2))
    scatter = rng.normal(size=(count, 1)) * 0.5 + rng.normal(size=(count, len(TIMES))) * (0.1 + TIMES)
    rmse = TIMES * np.exp(1.5 * theta[:, :1] + scatter)
    return {"val.theta": theta, "val.times": TIMES, "val.rmse_mm": rmse}


@pytest.fixture(scope="module")
def expected() -> ErrorBand:
    return ErrorBand(residuals(60, 0))


def test_nine_in_ten_keep_to_the_band(expected: ErrorBand) -> None:
    fresh = residuals(400, 1)
    band = np.stack([expected.at(theta, TIMES) for theta in fresh["val.theta"]])
    within = fresh["val.rmse_mm"][:, 1:, None] <= band[:, 1:]
    assert within.mean(axis=(0, 1)) == pytest.approx([0.5, 0.9], abs=0.05)
    for part in np.array_split(within[..., 1], 4, axis=1):  # early as well as late
        assert 0.8 < part.mean() < 0.97


def test_where_errors_are_larger_the_band_is_wider(expected: ErrorBand) -> None:
    small, large = (expected.at(np.array([x, 0.0]), TIMES)[20] for x in (-0.8, 0.8))
    assert (large > 3.0 * small).all()


def test_nothing_is_off_at_rest_and_more_outside(expected: ErrorBand) -> None:
    theta = np.array([1.0, 0.3])
    inside = expected.at(theta, TIMES)
    assert (inside[0] == 0.0).all()
    assert (expected.at(np.array([1.5, 0.3]), TIMES)[1:] > inside[1:]).all()
    beyond = expected.at(theta, np.array([1.0, 1.5, 3.0]))
    assert beyond[1:] == pytest.approx(beyond[0] * np.array([[1.5], [3.0]]))


def test_beyond_the_window_it_grows_as_the_continuation_did() -> None:
    arrays = residuals(60, 0)
    plain = ErrorBand(arrays)
    later = np.linspace(0.0, 500.0, 20)[None] * np.linspace(0.5, 1.5, 60)[:, None]
    continued = ErrorBand({**arrays, "val.later_mm": later})
    theta, frame = np.zeros(2), TIMES[1] - TIMES[0]
    assert np.array_equal(continued.at(theta, TIMES), plain.at(theta, TIMES))
    beyond = continued.at(theta, TIMES[-1] + frame * np.array([10.0, 20.0, 60.0]))
    np.testing.assert_allclose(beyond[:2], np.quantile(later[:, [9, 19]], [0.5, 0.9], axis=0).T)
    np.testing.assert_allclose(beyond[2], 9.0 * beyond[1])


def test_too_few_validation_sequences_make_no_band() -> None:
    assert FEWEST == 8
    assert error_band({}) is None
    assert error_band(residuals(FEWEST - 1, 0)) is None
    assert error_band(residuals(FEWEST, 0)) is not None
