"""Colours of a shape on another mesh in the same place."""

import numpy as np
import trimesh

from odeform.geometry.carried_colors import colored_like
from odeform.types import SH0, GaussianSplats, Mesh, PointCloud

BALL = trimesh.creation.icosphere(3, 0.1)
COARSE = trimesh.creation.icosphere(2, 0.101)
RED, BLUE = (200, 10, 10), (10, 10, 200)


def mesh(shape: trimesh.Trimesh, colors: np.ndarray | None = None) -> Mesh:
    return Mesh(np.asarray(shape.vertices, np.float32), np.asarray(shape.faces, np.int32), colors)


def halves(height: np.ndarray) -> np.ndarray:
    return np.where((height > 0.0)[:, None], RED, BLUE).astype(np.uint8)


def test_each_face_has_the_colour_of_what_is_nearest() -> None:
    height = BALL.triangles_center[:, 2]
    found = colored_like(mesh(COARSE), mesh(BALL, np.repeat(halves(height)[:, None], 3, axis=1)))
    assert found.colors is not None
    middle = COARSE.triangles_center[:, 2]
    clear = np.abs(middle) > 0.02
    assert (found.colors[clear] == halves(middle)[clear][:, None]).all()
    points = np.asarray(BALL.vertices, np.float32)
    of_points = colored_like(mesh(COARSE), PointCloud(points, halves(points[:, 2])))
    assert of_points.colors is not None
    assert (of_points.colors[clear] == halves(middle)[clear][:, None]).all()
    harmonics = (halves(points[:, 2])[:, None] / 255.0 - 0.5) / SH0
    splats = GaussianSplats(points, np.zeros((len(points), 3, 3)), harmonics, np.ones(len(points)))
    of_splats = colored_like(mesh(COARSE), splats)
    assert of_splats.colors is not None
    assert (of_splats.colors[clear] == halves(middle)[clear][:, None]).all()


def test_a_plain_shape_changes_nothing() -> None:
    plain = mesh(COARSE)
    assert colored_like(plain, mesh(BALL)) is plain
