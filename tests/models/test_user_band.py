"""The error band of shapes that were not trained."""

from dataclasses import replace

import numpy as np
import pytest

from odeform.models.modal.shape_band import (
    ShapeBand,
    ShapeErrors,
    calibrated_shape_band,
    coverage,
    coverages_left_out,
    fit_shape_band,
)

TIMES = np.arange(1, 20) / 100.0


def shapes(count: int, seed: int, by_size: float = 0.5, by_distance: float = 0.8) -> list[ShapeErrors]:
    """Errors that grow with the motion and the distance, with a log-normal rest."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(count):
        distance, sizes = float(rng.uniform(0.0, 0.2)), rng.uniform(2.0, 20.0, 12)
        scale = 0.1 * sizes**by_size * (1.0 + distance / 0.02) ** by_distance * np.exp(0.3 * rng.standard_normal(12))
        found.append(ShapeErrors(distance, sizes, scale[:, None] * np.linspace(0.2, 1.0, len(TIMES))))
    return found


def test_the_band_finds_how_errors_grow_and_covers_nine_in_ten_of_other_shapes() -> None:
    band = fit_shape_band(shapes(40, 0), TIMES)
    assert band.by_size == pytest.approx(0.5, abs=0.15)
    assert band.by_distance == pytest.approx(0.8, abs=0.15)
    assert 0.8 < coverage(band, shapes(40, 1)) < 0.97


def test_the_band_widens_with_distance_and_time_and_begins_at_zero() -> None:
    band = fit_shape_band(shapes(20, 0), TIMES)
    near, far = (band.at(10.0, distance, np.array([0.0, 0.1, 0.19, 0.38])) for distance in (0.0, 0.2))
    assert (near[0] == 0.0).all()
    assert (far[1:] > near[1:]).all()
    assert (near[1:, 1] > near[1:, 0]).all()
    assert near[3] == pytest.approx(2.0 * near[2])


def test_errors_that_shrink_with_distance_do_not_narrow_the_band() -> None:
    band = fit_shape_band(shapes(20, 0, by_distance=-0.5), TIMES)
    assert band.by_distance == 0.0
    assert band.by_size > 0.0


def one_by_one(count: int, seed: int) -> list[ShapeErrors]:
    """Shapes of which each has a level of its own: of few of them, a fit is too sure of the next."""
    rng = np.random.default_rng([seed, 1])
    found = shapes(count, seed)
    return [replace(one, errors=one.errors * np.exp(0.8 * rng.standard_normal())) for one in found]


def test_a_band_that_is_calibrated_by_shapes_covers_nine_in_ten_of_the_next() -> None:
    fitted, calibrated = [], []
    for seed in range(8):
        few, next_ones = one_by_one(12, seed), one_by_one(40, 100 + seed)
        fitted.append(coverage(fit_shape_band(few, TIMES), next_ones))
        calibrated.append(coverage(calibrated_shape_band(few, TIMES), next_ones))
    assert np.mean(fitted) < 0.86
    assert 0.86 < np.mean(calibrated) < 0.94


def test_coverage_is_measured_on_shapes_that_are_left_out_in_turn() -> None:
    known = one_by_one(14, 0)
    found = coverages_left_out(known, TIMES)
    assert len(found) == 14
    assert 0.8 < np.mean(found) < 0.97
    far = replace(known[0], errors=1e3 * known[0].errors)
    assert coverages_left_out([far, *known[1:]], TIMES)[0] == 0.0, "it does not calibrate itself"


def test_a_band_says_of_how_many_shapes_it_is() -> None:
    band = replace(calibrated_shape_band(shapes(11, 0), TIMES), covered=0.91)
    assert band.describe() == (
        "as measured on 11 other shapes that were not trained, where the limit for 9 of 10 cases held in 91 %"
    )
    assert ShapeBand.from_json(band.to_json()) == band


def test_a_band_returns_from_json() -> None:
    band = fit_shape_band(shapes(4, 0), TIMES)
    assert ShapeBand.from_json(band.to_json()) == band
    with pytest.raises(KeyError):
        ShapeBand.from_json({})
