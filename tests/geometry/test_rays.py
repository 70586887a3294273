"""What rays meet."""

import numpy as np
import pytest
import trimesh

from odeform.geometry.rays import first_on_mesh, first_on_points


def test_the_first_face_is_found_and_where_in_it() -> None:
    ball = trimesh.creation.icosphere(3, 1.0)
    points, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    hit = first_on_mesh(np.array([5.0, 0.1, 0.2]), np.array([-2.0, 0.0, 0.0]), points, faces)
    assert hit is not None
    face, shares, distance = hit
    assert np.allclose(shares @ points[faces[face]], [5.0 - 2.0 * distance, 0.1, 0.2])
    assert distance == pytest.approx(2.0, abs=0.05)
    assert first_on_mesh(np.array([5.0, 1.5, 0.0]), np.array([-1.0, 0.0, 0.0]), points, faces) is None
    assert first_on_mesh(np.array([5.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), points, faces) is None


def test_the_first_point_near_a_ray() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.05, 0.0], [1.02, 0.01, 0.0], [3.0, 1.0, 0.0]])
    hit = first_on_points(np.array([5.0, 0.0, 0.0]), np.array([-2.0, 0.0, 0.0]), points, 0.1)
    assert hit == (2, pytest.approx(1.99))
    assert first_on_points(np.array([5.0, 0.5, 0.0]), np.array([-1.0, 0.0, 0.0]), points, 0.1) is None
