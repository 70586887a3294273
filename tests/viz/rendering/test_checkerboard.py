"""The checkerboard that makes rotations visible."""

import numpy as np
import pytest
import trimesh

from odeform.types import Mesh
from odeform_viz.rendering import checkerboard
from odeform_viz.rendering.checkerboard import CELLS, checkerboard_parts


def _area(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, i]].astype(float) for i in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def test_parts_are_cut_along_the_planes_and_cover_the_surface() -> None:
    ball = trimesh.creation.icosphere(2)
    turned = trimesh.transformations.rotation_matrix(0.7, [1.0, 2.0, 0.5])[:3, :3]
    mesh = Mesh((ball.vertices @ turned.T).astype(np.float32), np.asarray(ball.faces, dtype=np.int32))
    centre = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
    parts = checkerboard_parts(mesh)
    assert sum(_area(p.vertices(mesh.points), p.faces) for p in parts) - _area(mesh.points, mesh.faces) < 1e-5
    cell = float(np.ptp(mesh.points, axis=0).max()) / CELLS
    for part, odd in zip(parts, (1, 0), strict=True):
        corners = (part.vertices(mesh.points) - centre)[part.faces]
        cubes = np.floor(corners.mean(axis=1) / cell)
        assert (cubes.sum(axis=1) % 2 == odd).all()
        for axis in range(3):  # no face on both sides of a plane
            assert (corners[..., axis].min(axis=1) > cell * cubes[:, axis] - 1e-5).all()
            assert (corners[..., axis].max(axis=1) < cell * (cubes[:, axis] + 1.0) + 1e-5).all()
        # faces keep their orientation
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert ((normals * (corners.mean(axis=1) + centre)).sum(axis=1) > -1e-9).all()


def test_a_mesh_along_the_planes_is_not_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkerboard, "CELLS", 4)
    box = trimesh.creation.box((4.0, 4.0, 4.0)).subdivide().subdivide()
    mesh = Mesh(np.asarray(box.vertices, np.float32), np.asarray(box.faces, np.int32))
    parts = checkerboard_parts(mesh)
    assert sum(len(part.faces) for part in parts) == len(mesh.faces)
    together = np.concatenate([part.vertices(mesh.points) for part in parts])
    assert set(map(tuple, together)) == set(map(tuple, mesh.points))


def test_new_vertices_deform_with_the_mesh() -> None:
    ball = trimesh.creation.icosphere(1)
    mesh = Mesh(ball.vertices.astype(np.float32), np.asarray(ball.faces, dtype=np.int32))
    stretch = np.array([2.0, 1.0, 0.5], dtype=np.float32)
    for part in checkerboard_parts(mesh):
        np.testing.assert_allclose(
            part.vertices(mesh.points * stretch), part.vertices(mesh.points) * stretch, atol=1e-6
        )
