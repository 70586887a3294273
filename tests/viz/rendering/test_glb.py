"""Files of colored meshes, read back by another library."""

import io

import numpy as np
import pytest
import trimesh

from odeform.models.base import Predictor
from odeform_viz.coloring.scale import TABLE
from odeform_viz.rendering.glb import BRIGHTEST, LINEAR, GlbWriter


def _read(data: bytes) -> trimesh.Trimesh:
    loaded = trimesh.load(io.BytesIO(data), file_type="glb", process=False)
    assert isinstance(loaded, trimesh.Scene)
    (mesh,) = loaded.geometry.values()
    return mesh


@pytest.mark.parametrize("opacity", [None, 0.45])
def test_vertices_faces_and_colors_come_back(kick: Predictor, opacity: float | None) -> None:
    mesh = kick.rest
    colors = np.random.default_rng(0).integers(0, 256, (len(mesh.points), 3)).astype(np.uint8)
    writer = GlbWriter(len(mesh.points), mesh.faces, 1.0, opacity, wireframe=False)
    for points in (mesh.points, mesh.points + np.float32(0.1)):
        read = _read(writer.write(points, colors))
        np.testing.assert_array_equal(read.vertices.astype(np.float32), points)
        np.testing.assert_array_equal(read.faces, mesh.faces)
    linear = np.asarray(read.visual.vertex_attributes["color"])[:, :3]
    np.testing.assert_array_equal(linear, LINEAR[colors])


def test_a_wireframe_has_each_edge_once() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    data = GlbWriter(4, faces, 1.0, None, wireframe=True).write(corners, np.zeros((4, 3), np.uint8))
    assert b'"mode":1' in data
    assert b'"count":12,"type":"SCALAR"' in data  # six edges


def test_unlit_colors_pass_the_tone_mapping_of_the_browser_unchanged(kick: Predictor) -> None:
    read = _read(
        GlbWriter(len(kick.rest.points), kick.rest.faces, 1.0, None, False, unlit=True).write(
            kick.rest.points, TABLE[np.arange(len(kick.rest.points)) % 256]
        )
    )
    linear = np.asarray(read.visual.vertex_attributes["color"])[:256, :3] / 65535.0 * BRIGHTEST
    assert np.abs(_filmic(linear) - TABLE).max() < 1.5


def _filmic(linear: np.ndarray) -> np.ndarray:
    """sRGB (N, 3), 0 to 255, of `ACESFilmicToneMapping` of three.js, as its shader has it."""
    into = np.array([[0.59719, 0.07600, 0.02840], [0.35458, 0.90834, 0.13383], [0.04823, 0.01566, 0.83777]])
    out = np.array([[1.60475, -0.10208, -0.00327], [-0.53108, 1.10813, -0.07276], [-0.07367, -0.00605, 1.07602]])
    v = linear / 0.6 @ into
    v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    v = np.clip(v @ out, 0.0, 1.0)
    return 255.0 * np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1.0 / 2.4) - 0.055)
