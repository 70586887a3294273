import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from odeform.mechanics.warping import Turning, surface_turns


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.3, 2.0])
def test_a_point_that_turns_evenly_moves_along_an_arc(angle: float) -> None:
    rng = np.random.default_rng(0)
    displacement, axis = rng.normal(size=(2, 50, 3))
    turns = angle * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    way = [Rotation.from_rotvec(0.5 * (s + 1.0) * turns).apply(displacement) for s in nodes]
    found = Turning(turns.T).warped(displacement.T).T
    np.testing.assert_allclose(found, 0.5 * np.tensordot(weights, way, 1), atol=1e-12)


def test_rotations() -> None:
    turns = np.random.default_rng(0).normal(size=(4, 5, 3))
    expected = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(4, 5, 3, 3)
    np.testing.assert_allclose(Turning(turns.swapaxes(1, 2)).rotations, expected, atol=1e-8)
    np.testing.assert_array_equal(Turning(np.zeros((3, 2))).rotations, np.broadcast_to(np.eye(3), (2, 3, 3)))


def test_the_turns_of_a_surface_that_turns_as_a_whole_are_that_turn() -> None:
    ball = trimesh.creation.icosphere(2)
    turn, shift = np.array([0.1, -0.4, 0.2]), np.array([1.0, 2.0, 3.0])
    points, faces = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int32)
    shapes = np.stack([np.cross(turn, points) + shift, 0.0 * points], axis=2)
    found = surface_turns(points, faces, shapes)
    np.testing.assert_allclose(found[..., 0], np.broadcast_to(turn, points.shape), rtol=1e-4)
    assert not found[..., 1].any()


def test_an_edge_without_length_tells_no_turn() -> None:
    ball = trimesh.creation.icosphere(2)
    points, turn = np.asarray(ball.vertices), np.array([0.1, -0.4, 0.2])
    doubled = np.concatenate([points, points[:1]])
    faces = np.concatenate([ball.faces, [[0, len(points), ball.faces[ball.faces[:, 0] == 0][0, 1]]]]).astype(np.int32)
    found = surface_turns(doubled, faces, np.cross(turn, doubled)[..., None])
    np.testing.assert_allclose(found[: len(points), :, 0], np.broadcast_to(turn, points.shape), rtol=1e-4)


def test_turns_fit_the_edges_around_a_point_with_equal_weight_for_each_direction() -> None:
    """Least squares over the edges, each by its own length."""
    rng = np.random.default_rng(0)
    ball = trimesh.creation.icosphere(1)
    points, faces = np.asarray(ball.vertices) * [1.0, 2.0, 0.5], np.asarray(ball.faces, dtype=np.int32)
    points = points + 0.1 * rng.normal(size=points.shape)
    shapes = rng.normal(size=(*points.shape, 1))
    found = surface_turns(points, faces, shapes)[..., 0]
    for vertex in (0, 17, 41):
        others = np.unique(faces[(faces == vertex).any(axis=1)])
        others = others[others != vertex]
        edges, moved = points[others] - points[vertex], (shapes[others] - shapes[vertex])[..., 0]
        length = np.linalg.norm(edges, axis=1)
        # turn x edge, as a matrix times the turn
        matrix = np.concatenate([np.cross(np.eye(3), edge).T / size for edge, size in zip(edges, length, strict=True)])
        expected = np.linalg.lstsq(matrix, (moved / length[:, None]).ravel(), rcond=None)[0]
        np.testing.assert_allclose(found[vertex], expected, rtol=1e-4, atol=1e-4)
