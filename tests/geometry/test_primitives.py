import numpy as np
import pytest
import trimesh

from odeform.geometry.primitives import octasphere


@pytest.mark.parametrize("segments", [1, 2, 7, 24])
def test_octasphere(segments: int) -> None:
    mesh = octasphere(0.3, segments)
    ball = trimesh.Trimesh(mesh.points, mesh.faces, process=False)
    assert np.allclose(np.linalg.norm(mesh.points, axis=1), 0.3)
    assert len(mesh.points) == 4 * segments**2 + 2
    assert len(mesh.faces) == 8 * segments**2
    # closed, without doubled vertices, and seen from outside
    assert ball.is_watertight
    assert ball.is_winding_consistent
    assert len(np.unique(np.round(mesh.points, 9), axis=0)) == len(mesh.points)
    assert ball.volume > 0.0
