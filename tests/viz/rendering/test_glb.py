"""Files of colored meshes, read back by another library."""

import io

import numpy as np
import pytest
import trimesh

from odeform.models.base import Predictor
from odeform_viz.rendering.glb import LINEAR, GlbWriter


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
