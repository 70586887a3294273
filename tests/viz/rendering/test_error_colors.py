"""Errors as colors."""

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform_viz.rendering.error_colors import BANDS, NearestInterpolation, band_indices, scale_for, split_into_bands


def test_the_scale_is_round_and_at_least_three_times_the_largest_error() -> None:
    assert scale_for(np.array([0.1, np.nan, 1.5])) == 5.0
    assert scale_for(np.array([0.33])) == 1.0
    assert scale_for(np.zeros(3)) == scale_for(np.array([np.nan])) == 1.0


def test_the_last_band_holds_all_larger_errors() -> None:
    values = np.array([0.0, 0.9, 1.0, 7.9, 8.0, 100.0])
    np.testing.assert_array_equal(band_indices(values, 8.0), [0, 0, 1, 7, 7, 7])


def test_each_face_is_in_one_band(kick: Predictor) -> None:
    mesh = kick.rest
    values = mesh.points[:, 2].astype(float)
    parts = split_into_bands(values, mesh.faces, 0.2)
    assert len(parts) == len(BANDS)
    assert sum(len(part[1]) for part in parts if part) == len(mesh.faces)
    for band, part in enumerate(parts):
        if part is not None:
            used, faces = part
            level = values[used][faces].mean(axis=1) / 0.2 * len(BANDS)
            assert (np.clip(level.astype(int), 0, len(BANDS) - 1) == band).all()


def test_values_are_interpolated_on_the_surface(kick: Predictor) -> None:
    coarse, fine = kick.rest.points[::4], kick.rest.points
    interpolate = NearestInterpolation(coarse, fine)
    assert interpolate(np.full(len(coarse), 2.5)) == pytest.approx(np.full(len(fine), 2.5))
    np.testing.assert_allclose(interpolate(coarse[:, 2].astype(float)), fine[:, 2], atol=0.02)
    np.testing.assert_allclose(interpolate(coarse[:, 2].astype(float))[::4], coarse[:, 2], atol=1e-6)
