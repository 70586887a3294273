import numpy as np
import trimesh

from odeform.motion.basis import CHUNK, DisplacementBasis, fit_basis

RADIUS = 0.1


def ball(level: int) -> np.ndarray:
    return np.asarray(trimesh.creation.icosphere(level, RADIUS).vertices)


def bend(points: np.ndarray) -> np.ndarray:
    """(N, 3, 2) metres: two smooth fields, larger than any real deformation."""
    x, y, z = points.T / RADIUS
    one = np.stack([np.sin(2.0 * y), x * z, np.cos(x + z)], axis=1)
    two = np.stack([z**2, np.exp(-(x**2)), y], axis=1)
    return np.stack([one, two], axis=2)


def fitted(level: int = 2) -> DisplacementBasis:
    return fit_basis(ball(level), bend(ball(level)), RADIUS)


def gradients(basis: DisplacementBasis, points: np.ndarray) -> np.ndarray:
    """(N, 3, 3, K), [n, i, j, k] = d(phi_k)_i / dx_j."""
    return basis.slopes(points, np.broadcast_to(np.eye(3), (len(points), 3, 3))).transpose(3, 2, 1, 0)


def test_exact_at_the_training_vertices() -> None:
    assert np.abs(fitted().values(ball(2)) - bend(ball(2))).max() < 1e-6


def test_its_first_modes_are_as_they_were() -> None:
    one = fitted().first(1)
    assert one.modes == 1
    np.testing.assert_allclose(one.values(ball(1)), fitted().values(ball(1))[..., :1], atol=1e-9)


def test_smooth_between_them() -> None:
    assert np.abs(fitted(3).values(ball(4)) - bend(ball(4))).max() < 5e-3


def test_affine_fields_are_exact_everywhere() -> None:
    """The least bending interpolates a field without bending: itself, off the surface too."""
    rng = np.random.default_rng(0)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    basis = fit_basis(ball(2), (ball(2) @ matrix.T + shift)[..., None], RADIUS)
    points = rng.uniform(-3.0, 3.0, size=(50, 3)) * RADIUS
    assert np.abs(basis.values(points)[..., 0] - (points @ matrix.T + shift)).max() < 1e-5
    assert np.abs(gradients(basis, points)[..., 0] - matrix).max() < 1e-4


def test_gradients_are_those_of_the_values() -> None:
    basis, step = fitted(), 3e-4
    points = np.random.default_rng(1).uniform(-1.2, 1.2, size=(200, 3)) * RADIUS
    slopes = gradients(basis, points)
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (basis.values(points + shift).astype(float) - basis.values(points - shift)) / (2.0 * step)
        assert np.abs(slopes[:, :, axis] - slope).max() < 1e-3 * np.abs(slopes).max()


def test_slopes_along_any_direction() -> None:
    basis, rng = fitted(), np.random.default_rng(4)
    points, along = rng.normal(size=(50, 3)) * RADIUS, rng.normal(size=(50, 2, 3))
    expected = np.einsum("nijk,nmj->kmin", gradients(basis, points).astype(float), along)
    assert np.abs(basis.slopes(points, along) - expected).max() < 1e-5 * np.abs(expected).max()


def test_flat_training_shape() -> None:
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-1.0, 1.0, 9))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(81)], axis=1) * RADIUS
    assert np.abs(fit_basis(points, bend(points), RADIUS).values(points) - bend(points)).max() < 1e-6


def test_many_points_are_evaluated_as_few() -> None:
    basis = fitted(1)
    points = np.random.default_rng(2).normal(size=(CHUNK + 100, 3)) * RADIUS
    values, slopes, few = basis.values(points), gradients(basis, points), slice(CHUNK - 5, CHUNK + 5)
    assert np.allclose(values[few], basis.values(points[few]), atol=1e-6)
    assert np.allclose(slopes[few], gradients(basis, points[few]), rtol=1e-5)


def test_gradients_far_away_are_those_of_the_values() -> None:
    """Where points are pulled in along their ray."""
    basis, step, rng = fitted(), 2e-3, np.random.default_rng(5)
    away = rng.normal(size=(60, 3))
    points = away / np.linalg.norm(away, axis=1, keepdims=True) * rng.uniform(6.5, 9.0, (60, 1)) * RADIUS
    slopes = gradients(basis, points)
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (basis.values(points + shift).astype(float) - basis.values(points - shift)) / (2.0 * step)
        assert np.abs(slopes[:, :, axis] - slope).max() < 1e-4 * np.abs(slopes).max()
