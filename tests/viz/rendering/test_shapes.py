"""What is sent to the page for a shape."""

import numpy as np
import viser

from odeform.models.base import Predictor
from odeform.types import PointCloud
from odeform_viz.rendering.error_colors import BANDS, band_indices
from odeform_viz.rendering.shapes import show_shape


def test_points_show_errors_and_then_their_own_color_again(server: viser.ViserServer, kick: Predictor) -> None:
    points = kick.rest.points
    view = show_shape(server, "/cloud", PointCloud(points), (206, 78, 26))
    values = np.linspace(0.0, 2.0, len(points))
    view.paint(points, values, 1.0)
    cloud = view._cloud  # pyright: ignore
    np.testing.assert_array_equal(cloud.colors, np.array(BANDS, dtype=np.uint8)[band_indices(values, 1.0)])
    view.move(points + np.float32(0.1))
    np.testing.assert_array_equal(cloud.colors, np.tile(np.array([206, 78, 26], dtype=np.uint8), (len(points), 1)))
    np.testing.assert_array_equal(cloud.points, points + np.float32(0.1))


def test_an_overlaid_mesh_is_transparent_in_error_colors_too(server: viser.ViserServer, kick: Predictor) -> None:
    view = show_shape(server, "/mesh", kick.rest, (206, 78, 26))
    view.fade(0.45)
    view.paint(kick.rest.points, np.full(len(kick.rest.points), 0.3), 1.0)
    bands = [band for band in view._bands if band is not None]  # pyright: ignore
    assert [band.opacity for band in bands] == [0.45]
    assert not any(handle.visible for handle, _ in view._parts)  # pyright: ignore
    view.move(kick.rest.points)
    assert not bands[0].visible
    assert all(handle.visible for handle, _ in view._parts)  # pyright: ignore
