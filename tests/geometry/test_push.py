"""Forces in the frame of a contact."""

import math

import numpy as np
import pytest
import trimesh

from odeform.geometry.contact import CONE, nearest_on, touching_centre
from odeform.geometry.push import Push, contact_axes, default_contact, push_of
from odeform.types import Mesh


@pytest.fixture(scope="module")
def ball() -> Mesh:
    sphere = trimesh.creation.icosphere(3, 0.1)
    return Mesh(np.asarray(sphere.vertices) + np.array([0.0, 0.0, 0.1]), np.asarray(sphere.faces, dtype=np.int32))


def test_axes_are_orthonormal_and_right_handed_everywhere() -> None:
    for normal in np.random.default_rng(0).normal(size=(50, 3)):
        axes = contact_axes(normal / np.linalg.norm(normal))
        assert np.allclose(axes @ axes.T, np.eye(3))
        assert np.allclose(np.cross(axes[1], axes[2]), -axes[0])


def test_a_force_and_its_push_are_the_same(ball: Mesh) -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        contact = nearest_on(ball, random.normal(size=3))
        push = Push(contact, 5.0, *random.uniform(-0.7, 0.7, 2))
        again = push_of(contact, push.force)
        assert (again.strength, again.up, again.side) == tuple(map(pytest.approx, (5.0, push.up, push.side)))
    assert push_of(contact, np.zeros(3)).strength == 0.0


def test_a_push_keeps_its_frame_at_another_contact(ball: Mesh) -> None:
    push = Push(nearest_on(ball, np.array([1.0, 0.0, 0.1])), 2.0, up=0.3)
    moved = push.at(nearest_on(ball, np.array([0.0, 1.0, 0.1])))
    assert np.allclose(push.force[2], moved.force[2], atol=1e-3)
    assert moved.direction @ -moved.contact.normal == pytest.approx(math.cos(0.3))
    assert not moved.steep
    assert Push(push.contact, 2.0, up=1.1 * CONE).steep


def test_a_default_contact_is_in_the_open_and_faces_the_way_asked_for(ball: Mesh) -> None:
    contact = default_contact(ball, np.array([0.0, -1.0, 1.0]))
    assert contact.normal @ np.array([0.0, -1.0, 1.0]) / math.sqrt(2.0) > 0.95
    assert touching_centre(ball, contact) is not None


def test_unless_asked_otherwise_a_contact_faces_up_and_towards_the_viewer(ball: Mesh) -> None:
    contact = default_contact(ball)
    assert contact.normal @ np.array([-0.6, -0.35, 0.72]) > 0.95


def test_up_along_a_surface_is_as_far_up_as_it_goes() -> None:
    for normal in ([0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.36, 0.48, -0.8]):
        up = contact_axes(np.array(normal))[2]
        assert np.allclose(up, (np.array([0.0, 0.0, 1.0]) - normal[2] * np.array(normal)) / math.hypot(*normal[:2]))
    # on top and below there is no such direction: it is x
    assert np.allclose(contact_axes(np.array([0.0, 0.0, 1.0])), [[0, 0, -1], [0, -1, 0], [1, 0, 0]])
    assert contact_axes(np.array([0.1, 0.0, -0.995]) / math.hypot(0.1, 0.995))[2][0] > 0.9
