"""The checkerboard that makes rotations visible."""

import numpy as np
import trimesh

from odeform.models.base import Predictor
from odeform.types import Mesh
from odeform_viz.rendering.checkerboard import checkerboard_parts


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
    for part, sign in zip(parts, (1.0, -1.0), strict=True):
        corners = (part.vertices(mesh.points) - centre)[part.faces]
        for axis in range(3):  # no face on both sides of a plane
            assert (np.minimum(corners[..., axis].max(axis=1), -corners[..., axis].min(axis=1)) < 1e-5).all()
        assert (sign * np.prod(corners.mean(axis=1), axis=1) > 0.0).all()
        # faces keep their orientation
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert ((normals * (corners.mean(axis=1) + centre)).sum(axis=1) > -1e-9).all()


def test_a_mesh_along_the_planes_is_not_cut(kick: Predictor) -> None:
    parts = checkerboard_parts(kick.rest)
    assert sum(len(part.faces) for part in parts) == len(kick.rest.faces)
    together = np.concatenate([part.vertices(kick.rest.points) for part in parts])
    assert set(map(tuple, together)) == set(map(tuple, np.asarray(kick.rest.points, dtype=np.float32)))


def test_new_vertices_deform_with_the_mesh() -> None:
    ball = trimesh.creation.icosphere(1)
    mesh = Mesh(ball.vertices.astype(np.float32), np.asarray(ball.faces, dtype=np.int32))
    stretch = np.array([2.0, 1.0, 0.5], dtype=np.float32)
    for part in checkerboard_parts(mesh):
        np.testing.assert_allclose(
            part.vertices(mesh.points * stretch), part.vertices(mesh.points) * stretch, atol=1e-6
        )
