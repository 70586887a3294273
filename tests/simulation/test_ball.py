import numpy as np
import pytest

from odeform.simulation.objects.ball import RADIUS, rest_mesh, sphere, stress_free


@pytest.mark.parametrize("segments", [4, 5, 10])
def test_stands_on_a_triangle(segments: int) -> None:
    mesh = sphere(segments)
    assert mesh.points.shape == (4 * segments**2 + 2, 3)
    assert np.allclose(np.linalg.norm(mesh.points, axis=1), RADIUS)
    order = np.argsort(mesh.points[:, 2])
    heights = mesh.points[order, 2]
    assert np.ptp(heights[:3]) < 1e-12
    assert heights[3] - heights[0] > 1e-3
    assert sorted(order[:3]) in np.sort(mesh.faces, axis=1).tolist()
    # about whose middle it stands
    assert np.abs(mesh.points[order[:3], :2].sum(axis=0)).max() < 1e-12


@pytest.mark.parametrize("segments", [4, 5])
def test_is_mirrored_across_the_plane_of_the_pulse(segments: int) -> None:
    """Points and triangles alike: what moves the ball along x cannot push it along y."""
    mesh = sphere(segments)
    mirrored = mesh.points * [1.0, -1.0, 1.0]
    distance = np.linalg.norm(mirrored[:, None] - mesh.points, axis=2)
    partner = distance.argmin(axis=1)
    assert distance.min(axis=1).max() < 1e-12
    faces = {tuple(sorted(face)) for face in mesh.faces.tolist()}
    assert {tuple(sorted(partner[face])) for face in mesh.faces} == faces


def test_a_vertex_in_the_middle_is_refused() -> None:
    for segments in (3, 6, 9):
        with pytest.raises(ValueError, match="multiple of 3"):
            sphere(segments)


@pytest.mark.parametrize("bending", [0.3, 3.0])
def test_stress_free_ball_touches_the_floor(bending: float) -> None:
    body, rest, mesh = stress_free({"mass": 0.4, "bending": bending}, step=1e-3, segments=4)
    assert body.positions[:, 2].min() == pytest.approx(0.0, abs=1e-12)
    assert np.allclose(body.positions - rest, [0.0, 0.0, -rest[:, 2].min()])
    assert np.allclose(body.weights @ rest, 0.0, atol=1e-9)
    assert np.linalg.norm(rest, axis=1).mean() == pytest.approx(RADIUS, abs=1e-9)
    assert np.abs(rest - mesh.points).max() < 5e-4
    assert body.masses.sum() == pytest.approx(0.4)
    assert body.model.opt.timestep == 1e-3


def test_the_ball_on_display_hangs_as_high_as_asked() -> None:
    assert rest_mesh().points[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    assert np.allclose(rest_mesh(0.4).points - rest_mesh().points, [0.0, 0.0, 0.4])
