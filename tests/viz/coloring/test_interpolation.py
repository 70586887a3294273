"""Values carried to another discretization."""

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform_viz.coloring.interpolation import NearestInterpolation


def test_values_are_interpolated_on_the_surface(kick: Predictor) -> None:
    coarse, fine = kick.rest.points[::4], kick.rest.points
    interpolate = NearestInterpolation(coarse, fine)
    assert interpolate(np.full(len(coarse), 2.5)) == pytest.approx(np.full(len(fine), 2.5))
    np.testing.assert_allclose(interpolate(coarse[:, 2].astype(float)), fine[:, 2], atol=0.02)
    np.testing.assert_allclose(interpolate(coarse[:, 2].astype(float))[::4], coarse[:, 2], atol=1e-6)
