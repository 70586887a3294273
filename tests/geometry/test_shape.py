from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.geometry.shape import fit_to, surface_shares
from odeform.types import GaussianSplats, Mesh, PointCloud


def ball(level: int, radius: float = 0.1, centre: tuple[float, float, float] = (0.0, 0.0, 0.1)) -> Mesh:
    sphere = trimesh.creation.icosphere(level, radius)
    return Mesh(np.asarray(sphere.vertices) + centre, np.asarray(sphere.faces))


def test_shares_are_thirds_of_the_adjacent_faces() -> None:
    # two triangles of areas 1/2 and 3/2 on one edge, and a point on neither
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -3, 0], [5, 5, 5]], dtype=float)
    mesh = Mesh(points, np.array([[0, 1, 2], [0, 3, 1]]))
    assert np.allclose(surface_shares(mesh), np.array([2.0, 2.0, 0.5, 1.5, 0.0]) / 6.0)


def test_shares_weigh_area_not_points() -> None:
    """A ball, finer on one half: its shares still have the ball's centre as their mean."""
    mesh = ball(3).points - [0.0, 0.0, 0.1], ball(3).faces
    fine = trimesh.Trimesh(*mesh, process=False)
    upper = np.flatnonzero(fine.triangles_center[:, 2] > 0.0)
    vertices, faces = trimesh.remesh.subdivide(fine.vertices, fine.faces, face_index=upper)
    points = vertices * (0.1 / np.linalg.norm(vertices, axis=1, keepdims=True))
    shares = surface_shares(Mesh(points, faces))
    assert points.mean(axis=0)[2] > 1e-2
    assert np.abs(shares @ points).max() < 5e-4


@pytest.mark.parametrize(
    "shape", [PointCloud(np.eye(3)), Mesh(np.eye(3), np.array([[0, 0, 1]]))], ids=["points", "no area"]
)
def test_shares_without_area_are_equal(shape: PointCloud | Mesh) -> None:
    assert np.allclose(surface_shares(shape), 1.0 / 3.0)


def test_fit_stands_on_the_same_floor() -> None:
    rng = np.random.default_rng(0)
    shape = PointCloud(rng.uniform([3.0, -7.0, 40.0], [5.0, 1.0, 44.0], size=(500, 3)))
    reference = ball(2, centre=(1.0, 2.0, 0.1))
    fit = fit_to(shape, reference)
    low, high = fit.geometry.points.min(axis=0), fit.geometry.points.max(axis=0)
    assert (high - low).max() == pytest.approx(0.2, abs=1e-6)
    assert np.allclose(0.5 * (low + high)[:2], [1.0, 2.0], atol=1e-6)
    assert low[2] == pytest.approx(0.0, abs=1e-6)
    assert np.allclose(fit.geometry.points, fit.factor * shape.points + fit.shift, atol=1e-5)


def test_fit_leaves_what_fits() -> None:
    reference = ball(2)
    fit = fit_to(reference, reference)
    assert fit.factor == 1.0
    assert np.allclose(fit.geometry.points, reference.points, atol=1e-7)


def test_fit_scales_splats() -> None:
    points = np.random.default_rng(0).normal(size=(9, 3))
    splats = GaussianSplats(points, np.tile(np.eye(3), (9, 1, 1)), np.ones((9, 4, 3)), np.ones(9))
    fit = fit_to(splats, ball(2))
    assert isinstance(fit.geometry, GaussianSplats)
    assert np.allclose(fit.geometry.covariances, fit.factor**2 * np.eye(3))
    assert fit.geometry.harmonics is splats.harmonics
    moved = replace(splats, points=100.0 * points + 7.0)
    assert np.allclose(fit_to(moved, ball(2)).geometry.points, fit.geometry.points, atol=1e-6)
