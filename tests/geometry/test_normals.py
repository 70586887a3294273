import numpy as np
import trimesh

from odeform.geometry.normals import nearest_normals, vertex_normals
from odeform.geometry.primitives import octasphere
from odeform.types import Mesh


def test_vertex_normals_of_a_ball() -> None:
    ball = octasphere(0.1, 12)
    assert np.abs(vertex_normals(ball.points, ball.faces) - ball.points / 0.1).max() < 0.02


def test_nearest_normals_of_a_ball() -> None:
    """Inside, outside and on it: those of the direction from its centre, between the vertices too."""
    ball, rng = octasphere(0.1, 12), np.random.default_rng(0)
    away = rng.normal(size=(2000, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    normals = nearest_normals(ball, away * rng.uniform(0.08, 0.13, size=(2000, 1)))
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    # area weights leave a degree and a half where triangles of unlike sizes meet
    assert np.arccos((normals * away).sum(axis=1)).max() < np.radians(2.0)


def test_nearest_normals_beside_a_box() -> None:
    """Each of the faces apart: a vertex of the trained surface never shares its normal with the other side."""
    box = trimesh.creation.box((2.0, 2.0, 0.02))
    apart = Mesh(box.vertices[box.faces].reshape(-1, 3), np.arange(3 * len(box.faces)).reshape(-1, 3))
    points = np.array([[0.3, -0.4, 0.02], [0.3, -0.4, -0.05], [0.1, 0.2, 0.009]])
    assert np.allclose(nearest_normals(apart, points), [[0, 0, 1], [0, 0, -1], [0, 0, 1]], atol=1e-12)


def test_a_surface_without_area_has_some_normal() -> None:
    line = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [9, 9, 9]]), np.array([[0, 1, 2]]))
    normals = nearest_normals(line, np.array([[0.5, 0.1, 0.0], [9.0, 9.0, 9.0]]))
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
