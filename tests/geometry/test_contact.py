import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.contact import (
    RADIUS,
    checked_contact,
    nearest_on,
    projectile_centre,
    touching_centre,
)
from odeform.types import Mesh

UP = np.array([0.0, 0.0, 1.0])


def mesh_of(solid: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces))


@pytest.fixture(scope="module")
def ball() -> Mesh:
    """Radius 0.1 m, on the floor."""
    solid = trimesh.creation.icosphere(4, 0.1)
    return mesh_of(solid.apply_translation([0.0, 0.0, 0.1]))


def test_the_nearest_point_of_a_ball(ball: Mesh) -> None:
    direction = np.array([0.6, 0.0, 0.8])
    found = nearest_on(ball, np.array([0.0, 0.0, 0.1]) + 0.15 * direction)
    assert np.allclose(found.point, [0.06, 0.0, 0.18], atol=1e-3)
    assert np.allclose(found.normal, direction, atol=0.02)
    assert found.distance == pytest.approx(0.05, abs=1e-3)
    assert found.barycentric.sum() == pytest.approx(1.0)
    assert np.allclose(found.moved(ball.points + UP, ball.faces), found.point + UP)


def test_the_normal_is_continuous_across_edges(ball: Mesh) -> None:
    angles = np.linspace(0.0, 0.15, 60)
    path = [0.1 * np.array([np.sin(a), 0.0, np.cos(a)]) + 0.1 * UP for a in angles]
    normals = np.stack([nearest_on(ball, point).normal for point in path])
    # a hundredth of the angle between two faces would be 0.06 degrees a step
    assert np.linalg.norm(np.diff(normals, axis=0), axis=1).max() < 3.0 * (angles[1] - angles[0])


def test_the_sphere_touches_the_surface(ball: Mesh) -> None:
    centre = touching_centre(ball, nearest_on(ball, np.array([0.1, 0.0, 0.1])))
    assert centre is not None
    assert nearest_on(ball, centre).distance == pytest.approx(RADIUS, abs=1e-6)


def test_the_sphere_does_not_fit_below_the_body_or_between_two_parts(ball: Mesh) -> None:
    assert touching_centre(ball, nearest_on(ball, np.array([0.03, 0.0, 0.0]))) is None
    other = trimesh.creation.icosphere(4, 0.1).apply_translation([0.2 + RADIUS, 0.0, 0.1])
    pair = trimesh.util.concatenate(trimesh.Trimesh(ball.points, ball.faces), other)
    assert isinstance(pair, trimesh.Trimesh)
    assert touching_centre(mesh_of(pair), nearest_on(mesh_of(pair), np.array([0.1, 0.0, 0.1]))) is None


def test_contacts_near_the_surface_are_moved_to_it(ball: Mesh) -> None:
    contact, _ = checked_contact(ball, np.array([0.104, 0.0, 0.1]), np.array([-1.0, 0.0, 0.0]))
    assert contact.point[0] == pytest.approx(0.1, abs=1e-3)
    with pytest.raises(InputError, match=r"within 5 mm of the surface, got one 10\.\d mm off"):
        checked_contact(ball, np.array([0.11, 0.0, 0.1]), np.array([-1.0, 0.0, 0.0]))


def test_forces_push_inward_or_are_none(ball: Mesh) -> None:
    side = np.array([0.1, 0.0, 0.1])
    checked_contact(ball, side, np.zeros(3))
    checked_contact(ball, side, np.array([-0.1, 1.0, 0.0]))
    with pytest.raises(InputError, match="pulls away"):
        checked_contact(ball, side, np.array([1.0, 0.0, 0.0]))
    with pytest.raises(InputError, match="does not fit"):
        checked_contact(ball, np.array([0.03, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def test_the_projectile_moves_along_the_force_as_far_as_the_surface(ball: Mesh) -> None:
    contact, force = nearest_on(ball, np.array([0.1, 0.0, 0.1])), np.array([-2.0, 0.0, 0.0])
    centre = contact.point + RADIUS * contact.normal
    moved = contact.moved(ball.points + np.array([-0.03, 0.02, 0.01]), ball.faces)
    assert np.allclose(projectile_centre(contact, centre, force, moved), centre - [0.03, 0.0, 0.0], atol=1e-6)
    still = projectile_centre(contact, centre, np.zeros(3), contact.point)
    assert np.allclose(still, centre)
