"""How wrong a model is likely to be."""

import numpy as np
import pytest

from odeform.models.error_band import FEWEST, SIZES, ErrorBand, error_band
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


def test_what_grows_at_some_times_only_is_wider_there() -> None:
    rng = np.random.default_rng(3)
    theta = rng.uniform(-1.0, 1.0, (60, 2))
    late = (TIMES > 0.5) * 1.5 * theta[:, :1]
    arrays = {"val.theta": theta, "val.times": TIMES, "val.rmse_mm": np.exp(late + 0.1 * rng.normal(size=late.shape))}
    small, large = (ErrorBand(arrays).at(np.array([x, 0.0]), TIMES)[:, 1] for x in (-0.8, 0.8))
    assert (large[1:18] < 1.2 * small[1:18]).all()
    assert (large[24:] > 5.0 * small[24:]).all()


def sized(count: int, seed: int, power: float) -> Arrays:
    """Errors that follow the size of motions, which the parameters hardly tell."""
    rng = np.random.default_rng(seed)
    sizes = np.exp(rng.normal(size=count))
    scatter = 0.1 * rng.normal(size=(count, len(TIMES)))
    rmse = TIMES * sizes[:, None] ** power * np.exp(scatter)
    theta = rng.uniform(-1.0, 1.0, (count, 2))
    return {"val.theta": theta, "val.times": TIMES, "val.rmse_mm": rmse, SIZES: sizes}


def test_the_band_follows_the_size_of_motions_only_where_errors_do() -> None:
    arrays = sized(40, 0, 0.7)
    band, theta = ErrorBand(arrays), np.zeros(2)
    assert band.follows_size
    one, tenfold = (band.at(theta, TIMES, size=size)[20] for size in (0.5, 5.0))
    np.testing.assert_allclose(tenfold / one, 10.0**0.7, rtol=0.05)
    smallest = arrays[SIZES].min()
    np.testing.assert_array_equal(
        band.at(theta, TIMES, size=0.0), band.at(theta, TIMES, size=float(smallest))
    )  # nothing is known of smaller ones
    fresh = sized(300, 1, 0.7)
    rows = zip(fresh["val.theta"], fresh[SIZES], strict=True)
    bounds = np.stack([band.at(theta, TIMES, size=float(size))[1:, 1] for theta, size in rows])
    assert (fresh["val.rmse_mm"][:, 1:] <= bounds).mean() == pytest.approx(0.9, abs=0.05)
    for power in (0.0, -0.7):  # what moves less is not more wrong
        assert not ErrorBand(sized(40, 0, power)).follows_size
    alike = {**sized(40, 0, 0.7), SIZES: np.full(40, 2.0)}
    assert not ErrorBand(alike).follows_size
    without = {name: array for name, array in sized(40, 0, 0.0).items() if name != SIZES}
    np.testing.assert_array_equal(
        ErrorBand(without).at(theta, TIMES), ErrorBand(sized(40, 0, 0.0)).at(theta, TIMES, size=3.0)
    )


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
