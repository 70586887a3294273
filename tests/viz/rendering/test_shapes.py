"""What is sent to the page for a shape."""

from typing import Any

import numpy as np
import pytest
import viser

from odeform.models.base import Predictor
from odeform.types import GaussianSplats, PointCloud
from odeform_viz.rendering.look import Look
from odeform_viz.rendering.shadow import FloorShadow
from odeform_viz.rendering.shapes import show_shape

COLOR = (206, 78, 26)


def _handle(server: viser.ViserServer, name: str) -> Any:
    return server.scene.get_handle_by_name(name)


def test_points_show_values_and_then_their_own_color_again(server: viser.ViserServer, kick: Predictor) -> None:
    points = kick.rest.points
    view = show_shape(server, "/cloud", PointCloud(points), COLOR)
    colors = np.random.default_rng(0).integers(0, 256, points.shape).astype(np.uint8)
    view.show(None, None, Look(colors))
    np.testing.assert_array_equal(_handle(server, "/cloud/points").colors, colors)
    view.show(points + np.float32(0.1), None, Look())
    np.testing.assert_array_equal(_handle(server, "/cloud/points").colors, np.tile(np.uint8(COLOR), (len(points), 1)))
    np.testing.assert_array_equal(_handle(server, "/cloud/points").points, points + np.float32(0.1))


def test_a_mesh_is_a_checkerboard_or_colored(server: viser.ViserServer, kick: Predictor) -> None:
    view = show_shape(server, "/mesh", kick.rest, COLOR)
    parts = [_handle(server, f"/mesh/part_{index}") for index in (0, 1)]
    assert _handle(server, "/mesh/colored") is None  # sent only once it is needed
    view.show(None, None, Look(np.zeros((len(kick.rest.points), 3), np.uint8), 0.45))
    colored = _handle(server, "/mesh/colored")
    assert b"0.45" in colored.glb_data
    assert colored.visible
    assert not any(part.visible for part in parts)
    view.show(None, None, Look(opacity=0.45, wireframe=True))
    assert not colored.visible
    assert all(part.visible and part.opacity == 0.45 and part.wireframe for part in parts)


def test_a_body_at_rest_sends_no_vertices(
    server: viser.ViserServer, kick: Predictor, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = show_shape(server, "/mesh", kick.rest, COLOR)
    sent: list[str] = []
    monkeypatch.setattr(viser.MeshHandle, "_queue_update", lambda _, name, value: sent.append(name), raising=False)
    view.show(None, None, Look())
    view.show(None, None, Look())
    assert "vertices" not in sent


@pytest.mark.parametrize("shadow", [True, False])
def test_splats_cast_the_shadow_of_an_invisible_hull(server: viser.ViserServer, kick: Predictor, shadow: bool) -> None:
    points = kick.rest.points
    covariances, ones = np.tile(1e-6 * np.eye(3), (len(points), 1, 1)), np.ones((len(points), 1, 3))
    show_shape(server, "/body", GaussianSplats(points, covariances, ones, np.ones(len(points))), COLOR, shadow)
    hull = _handle(server, "/body/shadow")
    assert (hull is not None) == shadow
    if shadow:
        assert hull.cast_shadow
        assert b'"alphaMode":"BLEND"' in hull.glb_data


def test_splats_in_a_captured_scene_have_a_shadow_that_follows_them(server: viser.ViserServer) -> None:
    points = 0.1 * np.random.default_rng(0).normal(size=(500, 3)).astype(np.float32) + np.float32([0.0, 0.0, 0.3])
    shadow = FloorShadow(server, "/shadow", points)
    splats = server.scene.get_handle_by_name("/shadow")
    assert isinstance(splats, viser.GaussianSplatHandle)
    shadow.show(np.array([0.4, -0.2, 0.3]))
    assert tuple(splats.position[:2]) == pytest.approx((0.4, -0.2))
    near = np.array(splats.buffer)
    shadow.show(np.array([0.4, -0.2, 0.8]))
    assert not np.array_equal(near, np.array(splats.buffer))
