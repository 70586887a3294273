import numpy as np
from scipy.spatial.transform import Rotation

from odeform.geometry.ellipsoids import axes_from_covariances, covariances_from_axes, with_fourth

RNG = np.random.default_rng(0)


def test_covariances_are_turned_scales_squared() -> None:
    scales, quaternions = RNG.uniform(1e-4, 1.0, (40, 3)), 3.0 * RNG.normal(size=(40, 4))
    turn = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    true = np.einsum("nij,nj,nkj->nik", turn, scales**2, turn)
    covariances = covariances_from_axes(scales, quaternions)
    assert np.allclose(covariances, true, atol=1e-14)
    assert np.array_equal(covariances, covariances.swapaxes(1, 2))


def test_a_quaternion_of_no_length_is_no_turn() -> None:
    scales = np.array([[1.0, 2.0, 3.0]])
    assert np.array_equal(covariances_from_axes(scales, np.zeros((1, 4)))[0], np.diag([1.0, 4.0, 9.0]))


def test_what_is_not_finite_stays_so() -> None:
    quaternions = np.array([[np.nan, 0.0, 0.0, 1.0], [np.inf, 0.0, 0.0, 1.0]])
    with np.errstate(invalid="ignore"):
        covariances = covariances_from_axes(np.ones((2, 3)), quaternions)
    assert not np.isfinite(covariances).all(axis=(1, 2)).any()


def test_axes_lead_back() -> None:
    scales = np.exp(RNG.uniform(-9.0, 0.0, (200, 3)))
    scales[:20, 1] = 0.0  # flat
    scales[20:40] = scales[20:40, :1]  # round
    covariances = covariances_from_axes(scales, RNG.normal(size=(200, 4)))
    lengths, quaternions = axes_from_covariances(covariances)
    assert np.allclose(np.linalg.norm(quaternions, axis=1), 1.0)
    assert (quaternions[:, 0] >= 0.0).all()
    assert np.allclose(lengths, np.sort(scales, axis=1), rtol=1e-6, atol=3e-8)
    assert np.allclose(covariances_from_axes(lengths, quaternions), covariances, atol=1e-14)


def test_the_fourth_component_comes_back() -> None:
    true = RNG.normal(size=(60, 4))
    true /= np.linalg.norm(true, axis=1, keepdims=True)
    place = np.abs(true).argmax(axis=1)
    true *= np.sign(np.take_along_axis(true, place[:, None], axis=1))
    others = np.stack([np.delete(row, index) for row, index in zip(true, place, strict=True)])
    assert np.allclose(with_fourth(others, place), true)
