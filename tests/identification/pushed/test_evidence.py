from dataclasses import replace

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.geometry.primitives import octasphere
from odeform.geometry.rigid import rotation_from_vector
from odeform.identification.pushed import search
from odeform.identification.pushed.evidence import Cloud, Known
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.registration import cameras_of
from odeform.identification.pushed.state import Camera, PushState
from odeform.identification.pushed.views import CloudView, cloud_of, points_of
from odeform.schema import Parameter
from odeform.types import Mesh

ONE = np.array([[1.0, 0.0, 0.0]])
TIMES = np.array([0.0, 0.01])


def egg() -> Mesh:
    """A body without a symmetry but a mirror's."""
    sphere = octasphere(1.0, 12)
    points = np.asarray(sphere.points, dtype=float) * np.array([0.05, 0.08, 0.12])
    points[:, 0] += 4.0 * points[:, 2] ** 2 + 3.0 * points[:, 1] * points[:, 2]
    points[:, 2] -= points[:, 2].min()
    return Mesh(points.astype(np.float32), sphere.faces)


def surfaces(mesh: Mesh) -> np.ndarray:
    rest = np.asarray(mesh.points, dtype=float)
    return np.stack([rest, rest @ rotation_from_vector(np.array([0.0, 0.1, 0.05])).T + 0.01])


def test_exact_points_have_no_residual_and_slopes_are_those_of_the_surface() -> None:
    mesh = egg()
    moved = surfaces(mesh)
    known = points_of(TIMES, moved, mesh.faces)
    step = np.random.default_rng(0).normal(size=(1, *moved.shape))
    exact, ahead = (known.compared(surface, step, Camera()) for surface in (moved, moved + 1e-3 * step[0]))
    assert max(np.abs(row).max() for row in exact.values) < 1e-9
    for before, after, slope in zip(exact.values, ahead.values, exact.slopes, strict=True):
        np.testing.assert_allclose((before - after) / 1e-3, slope[0], rtol=1e-6)


def test_slopes_of_a_cloud_by_its_camera_are_those_of_differences() -> None:
    mesh = egg()
    moved = surfaces(mesh)
    cloud = cloud_of(TIMES, moved, mesh.faces, CloudView(noise_mm=0.1))
    cloud = replace(cloud, points=[Camera(rotation_from_vector(np.array([0.0, 0.0, 0.2]))).points(p) for p in moved])
    camera = Camera(rotation_from_vector(np.array([0.0, 0.0, -0.2])))
    nothing = np.zeros((0, *moved.shape))
    base = cloud.compared(moved, nothing, camera)
    about = moved[0].mean(axis=0)
    for axis in range(6):
        step = np.zeros(6)
        step[axis] = 1e-6
        off = cloud.compared(moved, nothing, camera.moved(step, about))
        for before, after, slope in zip(base.values, off.values, base.slopes, strict=True):
            change = (before - after) / 1e-6
            assert np.median(np.abs(change - slope[axis])) < 1e-3 * np.abs(slope[axis]).max()


def test_a_camera_is_found_from_half_of_the_surface() -> None:
    mesh = egg()
    cloud = cloud_of(TIMES, surfaces(mesh), mesh.faces, CloudView(points=400, noise_mm=1.0, seed=3))
    camera = cameras_of(cloud.points[0], mesh, 1)[0]
    seen = camera.points(cloud.points[0])
    middles = np.asarray(mesh.points, dtype=float)[mesh.faces].mean(axis=1)
    away = np.linalg.norm(seen[:, None] - middles[None], axis=2).min(axis=1)
    assert np.sqrt((away**2).mean()) < 0.005


def test_cameras_that_are_tried_stand_apart() -> None:
    mesh = egg()
    cloud = cloud_of(TIMES, surfaces(mesh), mesh.faces, CloudView(points=400, noise_mm=1.0, seed=3)).points[0]
    places = [camera.points(cloud) for camera in cameras_of(cloud, mesh, 4)]
    assert len(places) > 1, "an egg looks alike from places about its axis"
    for index, one in enumerate(places):
        for other in places[:index]:
            assert np.sqrt(((one - other) ** 2).sum(axis=1).mean()) > 0.05 * np.ptp(cloud, axis=0).max()


def test_the_back_of_a_shell_is_seen() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    faces = np.array([[0, 1, 2]])
    for turn in (1.0, -1.0):
        (seen,) = cloud_of(np.zeros(1), (points * [1.0, turn, 1.0])[None], faces, CloudView(points=9)).points
        assert np.isfinite(seen).all()


def test_half_of_the_surface_is_seen() -> None:
    mesh = egg()
    whole, half = (
        cloud_of(TIMES, surfaces(mesh), mesh.faces, CloudView(points=2000, noise_mm=0.1, half=half))
        for half in (False, True)
    )
    spans = [np.linalg.svd(c.points[0] - c.points[0].mean(axis=0), full_matrices=False)[1] for c in (whole, half)]
    assert spans[1].prod() < 0.8 * spans[0].prod()


def test_a_wrong_observation_is_refused() -> None:
    with pytest.raises(InputError, match="at least one time"):
        Cloud(TIMES, [np.zeros((3, 3))], np.zeros((1, 3), dtype=int), 1.0)
    with pytest.raises(InputError, match="positive noise"):
        Known(TIMES, np.zeros((2, 1, 3)), np.zeros((1, 3), dtype=int), np.zeros(1, dtype=int), np.eye(3)[:1], 0.0)


def test_residuals_are_weighed_by_the_inverse_of_their_covariance() -> None:
    rng, forward = np.random.default_rng(0), object.__new__(Forward)
    causes, columns = rng.normal(size=(12, 6)), rng.normal(size=(12, 2))
    errors = np.array([0.7])
    known = Known(TIMES[:1], np.zeros((1, 1, 3)), np.zeros((1, 3), dtype=int), np.zeros(1, dtype=int), ONE, 0.3)
    problem = search.Problem(forward, known, errors, ())
    covariance = 0.49 / 6.0 * causes @ causes.T + (0.09 + search.FLOOR_MM**2 + 0.49 / 9.0) * np.eye(12)
    np.testing.assert_allclose(search._weighted(problem, 0, causes, columns), np.linalg.solve(covariance, columns))


def test_a_step_keeps_the_contact_on_the_surface_and_the_body_in_its_ranges() -> None:
    mesh = egg()
    ranges = tuple(Parameter(name, "", 0.5, 2.0, 1.0, "log") for name in ("mass", "young", "friction"))
    contact = np.asarray(mesh.points[mesh.points[:, 1].argmax()], dtype=float)
    state = PushState(mesh, ranges, 8.0, np.zeros(3), contact, np.array([0.0, -4.0, 0.0]))
    assert [state.value(name) for name in ("mass", "friction")] == pytest.approx([1.0, 1.0])
    ahead = state.stepped(np.array([3.0, -0.5, 0.0, 0.1, 0.1, 0.0, 0.25, 0.0]))
    np.testing.assert_allclose(ahead.body, [1.0, -0.5, 0.0])
    np.testing.assert_allclose(ahead.force, [0.0, -2.0, 0.0])
    assert 0.01 < np.linalg.norm(ahead.contact - contact) < 0.03
    with pytest.raises(InputError, match="pulls away"):
        state.stepped(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0]))
