import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from odeform.geometry.rigid import (
    best_rigid,
    body_spin,
    rotation_from_vector,
    rotation_z,
    unwrapped_vectors,
    vector_from_rotation,
)

AXIS = np.array([2.0, -1.0, 2.0]) / 3.0


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.5, np.pi - 1e-9, np.pi, 4.0, 2.0 * np.pi, 23.0])
def test_rodrigues(angle: float) -> None:
    ours = rotation_from_vector(angle * AXIS)
    assert np.abs(ours - Rotation.from_rotvec(angle * AXIS).as_matrix()).max() < 1e-12


def test_rodrigues_of_many() -> None:
    vectors = np.random.default_rng(0).normal(size=(4, 5, 3))
    ours = rotation_from_vector(vectors)
    assert np.allclose(ours.reshape(-1, 3, 3), Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix(), atol=1e-14)


def test_vertical_axis() -> None:
    assert np.allclose(rotation_z(0.7), rotation_from_vector(np.array([0.0, 0.0, 0.7])), atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi - 1e-7])
def test_vector_of_rotation(angle: float) -> None:
    assert np.allclose(vector_from_rotation(rotation_from_vector(angle * AXIS)), angle * AXIS, atol=1e-12)


@pytest.mark.parametrize("turns", [4.3, -4.3])
def test_several_turns_about_one_axis(turns: float) -> None:
    # 161 frames: some fall on whole and half turns, where the short vector vanishes or flips
    true = np.linspace(0.0, 2.0 * np.pi * turns, 4 * 43 + 1)[:, None] * AXIS
    assert np.allclose(unwrapped_vectors(rotation_from_vector(true)), true, atol=1e-7)


def test_turns_about_a_wandering_axis() -> None:
    """A ball that rolls and veers: the vectors stay continuous and still describe the same rotations."""
    s = np.linspace(0.0, 1.0, 241)
    axes = np.stack([np.sin(0.3 * s), np.cos(0.3 * s), 0.2 * s], axis=1)
    true = 20.0 * s[:, None] * axes
    vectors = unwrapped_vectors(rotation_from_vector(true))
    assert np.abs(rotation_from_vector(vectors) - rotation_from_vector(true)).max() < 1e-9
    assert np.linalg.norm(np.diff(vectors, axis=0), axis=1).max() < 0.2
    assert np.linalg.norm(vectors[-1]) > 19.0


def test_best_rigid_recovers_a_motion() -> None:
    rng = np.random.default_rng(1)
    rest, weights = rng.normal(size=(50, 3)), rng.dirichlet(np.ones(50))
    centre = weights @ rest
    rotations = rotation_from_vector(rng.normal(size=(7, 3)))
    shifts = rng.normal(size=(7, 3))
    moved = (rest - centre) @ rotations.swapaxes(1, 2) + (centre + shifts)[:, None]
    found, found_shifts = best_rigid(rest, moved, weights)
    assert np.allclose(found, rotations, atol=1e-12)
    assert np.allclose(found_shifts, shifts, atol=1e-12)
    one, one_shift = best_rigid(rest, moved[3], weights)
    assert np.allclose(one, rotations[3], atol=1e-12)
    assert np.allclose(one_shift, shifts[3], atol=1e-12)


def test_best_rigid_follows_the_weights() -> None:
    rng = np.random.default_rng(2)
    rest = rng.normal(size=(30, 3))
    rotation = rotation_from_vector(np.array([0.3, 0.2, -0.5]))
    moved = rest @ rotation.T
    moved[20:] += rng.normal(size=(10, 3))
    weights = np.repeat([1.0 / 20.0, 0.0], [20, 10])
    assert np.allclose(best_rigid(rest, moved, weights)[0], rotation, atol=1e-12)


@pytest.mark.parametrize("flat", [False, True])
def test_best_rigid_never_mirrors(flat: bool) -> None:
    rest = np.random.default_rng(3).normal(size=(20, 3)) * [1.0, 1.0, 0.0 if flat else 1.0]
    rotation, _ = best_rigid(rest, rest * [-1.0, 1.0, 1.0], np.full(20, 0.05))
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_the_spin_of_a_changing_rotation_vector() -> None:
    """R(w + h dw) = R(w) R(h spin) to first order."""
    rng = np.random.default_rng(4)
    vectors = np.concatenate([rng.normal(size=(6, 3)) * 3.0, np.zeros((1, 3)), np.full((1, 3), 1e-6)])
    change, h = rng.normal(size=vectors.shape), 1e-6
    turned = rotation_from_vector(vectors + h * change)
    relative = rotation_from_vector(vectors).swapaxes(1, 2) @ turned
    spin = np.stack([relative[:, 2, 1], relative[:, 0, 2], relative[:, 1, 0]], axis=1) / h
    assert np.allclose(body_spin(vectors, change), spin, atol=1e-4)


def test_each_frame_may_have_its_own_shape() -> None:
    rng = np.random.default_rng(5)
    shapes, weights = rng.normal(size=(4, 9, 3)), rng.dirichlet(np.ones(9))
    turns, shifts = rotation_from_vector(rng.normal(size=(4, 3))), rng.normal(size=(4, 3))
    rotation, shift = best_rigid(shapes, shapes @ turns.swapaxes(1, 2) + shifts[:, None], weights)
    assert np.allclose(rotation, turns)
    centres = np.einsum("n,tni->ti", weights, shapes)
    assert np.allclose(shift, np.einsum("tij,tj->ti", turns, centres) + shifts - centres)


def test_the_spin_of_a_small_rotation_vector_is_its_series() -> None:
    """Below 1e-4 rad, where differences of cosines would be lost, as above."""
    change = np.array([0.3, -0.2, 0.9])
    for angle in (1e-9, 9.99e-5, 1.01e-4):
        vector = angle * AXIS
        across = np.cross(vector, change)
        expected = change - across / 2.0 + np.cross(vector, across) / 6.0
        np.testing.assert_allclose(body_spin(vector, change), expected, rtol=0.0, atol=1e-11)
