"""Strain of surfaces, against formulas."""

import numpy as np
import pytest
import trimesh

from odeform.types import Mesh
from odeform_viz.coloring.strain import SurfaceStrain


@pytest.fixture
def ball() -> Mesh:
    sphere = trimesh.creation.icosphere(2)
    return Mesh(sphere.vertices.astype(np.float32), np.asarray(sphere.faces, dtype=np.int32))


def test_a_rigid_motion_strains_nothing(ball: Mesh) -> None:
    turn = trimesh.transformations.rotation_matrix(0.7, [1.0, 2.0, 0.5])[:3, :3]
    assert SurfaceStrain(ball)(ball.points @ turn.T + np.array([1.0, 2.0, 3.0])).max() < 1e-6


def test_an_even_stretch_strains_everything_alike(ball: Mesh) -> None:
    assert SurfaceStrain(ball)(1.3 * ball.points) == pytest.approx(np.full(len(ball.points), 0.3), abs=1e-5)
    assert SurfaceStrain(ball)(0.8 * ball.points) == pytest.approx(np.full(len(ball.points), 0.2), abs=1e-5)


def test_a_sheared_sheet_has_the_principal_strain_of_the_formula() -> None:
    sheet = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2]]))
    gamma = 0.4
    sheared = sheet.points + gamma * sheet.points[:, [1]] * np.array([1.0, 0.0, 0.0])
    stretches = np.linalg.svd(np.array([[1.0, gamma], [0.0, 1.0]]), compute_uv=False)
    assert SurfaceStrain(sheet)(sheared) == pytest.approx(np.full(3, np.abs(stretches - 1.0).max()))


def test_triangles_without_area_are_unstrained() -> None:
    line = Mesh(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2], [0, 1, 3]]))
    strain = SurfaceStrain(line)(line.points * 1.1)
    assert np.isfinite(strain).all()
    assert strain[[0, 1, 3]] == pytest.approx(0.1, abs=1e-6)
