"""A block of rubber, struck by the sphere."""

from functools import cache

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.geometry.contact import CONE, RADIUS, nearest_on, touching_centre
from odeform.geometry.solids.tetrahedra import boundary
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.objects.settling import settle
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.simulation.scenes.contact_force import PULSE, SCENE, sample, simulate_object
from odeform.simulation.scenes.registry import get_scene
from odeform_figures.bodies.tetrahedra import CUBE

SIDE, CELLS = 0.06, 3  # m; cells along an edge
MATERIAL = SoftMaterial(80e3, 0.3, 500.0, 0.004, 0.5, "rubber")


@cache
def block() -> SoftObject:
    count = CELLS + 1
    index = np.arange(count**3).reshape(count, count, count)
    steps = [slice(None, -1), slice(1, None)]
    corners = np.stack([index[steps[c >> 2], steps[c >> 1 & 1], steps[c & 1]].ravel() for c in range(8)], axis=-1)
    elements = corners[:, CUBE].reshape(-1, 4)
    points = SIDE / CELLS * np.stack(np.unravel_index(index.ravel(), index.shape), axis=-1) - [
        0.5 * SIDE,
        0.5 * SIDE,
        0,
    ]
    flipped = np.linalg.det(points[elements][:, 1:] - points[elements][:, :1]) < 0.0
    elements[flipped] = elements[flipped][:, [0, 2, 1, 3]]
    faces = boundary(elements)
    order = np.concatenate([np.unique(faces), np.setdiff1d(index.ravel(), faces)])
    place = np.argsort(order)
    points, elements, faces = points[order], place[elements], place[faces]
    return SoftObject("block", points, elements, faces, settle(points, elements, MATERIAL), MATERIAL, (0.5, 3.0), SIDE)


def parameters(force: tuple[float, float, float], contact: tuple[float, float, float] = (0.03, 0.0, 0.035)) -> dict:
    named = {f"contact_{axis}": x for axis, x in zip("xyz", contact, strict=True)}
    return named | {f"force_{axis}": x for axis, x in zip("xyz", force, strict=True)}


def test_a_push_from_the_side_dents_and_moves_the_block() -> None:
    motion = simulate_object(block(), parameters((-3.0, 0.0, 0.0)))
    assert motion.times.tolist() == pytest.approx((np.arange(20) / 100.0).tolist())
    assert np.allclose(motion.vertices[0], block().rest_mesh().points, atol=1e-7)
    moved = motion.vertices - motion.vertices[0]
    at_contact = np.linalg.norm(motion.vertices[0] - [0.03, 0.01, 0.03], axis=1).argmin()
    centre = np.einsum("n,tni->ti", motion.weights, moved)
    pushed = round(100.0 * PULSE)
    assert moved[pushed, at_contact, 0] < centre[pushed, 0] - 5e-4 < -5e-3
    assert np.abs(centre[:, 1]).max() < 0.1 * np.abs(centre[:, 0]).max()


def test_without_a_force_nothing_moves() -> None:
    motion = simulate_object(block(), parameters((0.0, 0.0, 0.0)))
    assert np.abs(motion.vertices - motion.vertices[0]).max() < 1e-4


def test_the_same_twice_and_at_any_frame_rate() -> None:
    setting = parameters((-2.0, 0.5, 0.0))
    once, again = (simulate_object(block(), setting).vertices for _ in range(2))
    assert (once == again).all()
    assert np.allclose(simulate_object(block(), setting, rate=400.0).vertices[::4], once, atol=1e-6)


def test_small_changes_have_small_effects() -> None:
    motion, moved, stronger = (
        simulate_object(block(), setting).vertices
        for setting in (
            parameters((-2.0, 0.0, 0.0)),
            parameters((-2.0, 0.0, 0.0), (0.03, 0.001, 0.035)),
            parameters((-2.04, 0.0, 0.0)),
        )
    )
    displacement = np.sqrt(((motion - motion[0]) ** 2).mean())
    assert np.sqrt(((motion - moved) ** 2).mean()) < 0.2 * displacement
    assert np.sqrt(((motion - stronger) ** 2).mean()) < 0.1 * displacement


def test_contacts_that_the_scene_does_not_have() -> None:
    for setting, reason in (
        (parameters((1.0, 0.0, 0.0)), "pulls away"),
        (parameters((-1.0, 0.0, 0.0), (0.05, 0.0, 0.035)), "off it"),
        (parameters((-1.0, 0.0, 0.0), (0.03, 0.0, 0.01)), "does not fit"),
    ):
        with pytest.raises(InputError, match=reason):
            simulate_object(block(), setting)


def test_too_strong_a_push_is_refused() -> None:
    with pytest.raises(SimulationError):
        simulate_object(block(), parameters((-300.0, 0.0, 0.0)))


@pytest.mark.slow
def test_a_push_that_turns_a_soft_body_inside_out_is_simulated_again_with_a_guard() -> None:
    item = get_object("bottle")
    soft = {"mass": 0.37, "young": 41.5, **parameters((-8.0, 0.0, 0.0), (0.038, 0.0, 0.1))}
    with pytest.raises(SimulationError, match="inside out"):
        simulate_object(item, soft, until=0.1, guard=False)
    motion = simulate_object(item, soft, until=0.1)
    assert motion.times[-1] == pytest.approx(0.1)
    assert np.abs(motion.vertices[-1] - motion.vertices[0]).max() > 0.02


def test_drawn_contacts_lie_on_the_surface_where_the_sphere_fits() -> None:
    item = get_object("cat")
    rest = item.rest_mesh()
    for drawn in sample("cat", 20, seed=3):
        point, force = (np.array([drawn[f"{name}_{axis}"] for axis in "xyz"]) for name in ("contact", "force"))
        contact = nearest_on(rest, point)
        assert contact.distance < 1e-6
        centre = touching_centre(rest, contact)
        assert centre is not None
        assert centre[2] >= RADIUS
        assert -contact.normal @ force > np.cos(CONE) * np.linalg.norm(force) - 1e-3
        assert item.forces[0] <= np.linalg.norm(force) <= item.forces[1]


def test_longer_samples_start_with_the_shorter_and_cover_the_surface() -> None:
    drawn = sample("donut", 64, seed=1)
    assert drawn[:9] == sample("donut", 9, seed=1)
    assert drawn[:9] != sample("donut", 9, seed=2)
    azimuth = np.arctan2([p["contact_y"] for p in drawn], [p["contact_x"] for p in drawn])
    assert np.histogram(azimuth, bins=8, range=(-np.pi, np.pi))[0].min() >= 3


def test_every_sample_is_complete_and_within_the_schema() -> None:
    assert get_scene("contact-force") is SCENE
    for row in SCENE.sample(8, 0):
        assert SCENE.schema.complete(row) == row
        assert SCENE.schema.outside(row) == ()


def test_the_arrow_ends_at_the_contact() -> None:
    setting = {"object": "bottle", **parameters((-4.0, 0.0, 0.0), (0.038, 0.0, 0.1))}
    (arrow,) = SCENE.glyphs(setting, get_object("bottle").rest_mesh().points)
    assert np.allclose(arrow.start + arrow.vector, [0.038 + 2.0 * RADIUS, 0.0, 0.1])
    assert (arrow.label, arrow.begin, arrow.end) == ("4.0 N", 0.0, PULSE)
    assert SCENE.glyphs({**setting, "force_x": 0.0}, np.zeros((4, 3))) == ()
