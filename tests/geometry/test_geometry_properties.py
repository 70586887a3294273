"""Theorems of geometry, for any transform and any shape."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from properties import PROPERTY, rotations, similarities, vectors
from scipy.spatial.transform import Rotation

from odeform.geometry.ellipsoids import axes_from_covariances, covariances_from_axes
from odeform.geometry.harmonics import harmonic_basis, rotated_harmonics
from odeform.geometry.rigid import best_rigid, is_rotation, rotation_from_vector, unwrapped_vectors
from odeform.geometry.similarity import Similarity


@PROPERTY
@given(similarities(), similarities(), vectors(10.0, count=4))
def test_similarities_compose(one: Similarity, two: Similarity, points: np.ndarray) -> None:
    largest = 1.0 + np.abs(one.points(two.points(points))).max() + one.factor * np.abs(two.points(points)).max()
    np.testing.assert_allclose((one @ two).points(points), one.points(two.points(points)), atol=1e-12 * largest)


@PROPERTY
@given(similarities(), vectors(10.0, count=4))
def test_similarities_invert(move: Similarity, points: np.ndarray) -> None:
    size = 1.0 + np.abs(points).max() + np.abs(move.shift).max() / move.factor
    np.testing.assert_allclose(move.inverse.points(move.points(points)), points, atol=1e-12 * size)
    again = move.inverse.inverse
    assert again.factor == pytest.approx(move.factor)
    np.testing.assert_allclose(again.shift, move.shift, atol=1e-12 * (1.0 + np.abs(move.shift).max()))


@PROPERTY
@given(similarities())
def test_similarities_survive_json(move: Similarity) -> None:
    again = Similarity.from_json(move.to_json())
    assert again.factor == move.factor
    assert np.array_equal(again.rotation, move.rotation)
    assert np.array_equal(again.shift, move.shift)


@PROPERTY
@given(vectors(30.0))
def test_rotation_vectors_are_those_of_scipy(vector: np.ndarray) -> None:
    rotation = rotation_from_vector(vector)
    assert is_rotation(rotation)
    np.testing.assert_allclose(rotation, Rotation.from_rotvec(vector).as_matrix(), atol=1e-12)


@PROPERTY
@given(rotations(), vectors(10.0), st.integers(0, 2**32 - 1))
def test_best_rigid_recovers_a_rigid_motion(rotation: np.ndarray, shift: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rest, weights = rng.normal(size=(9, 3)), rng.uniform(0.1, 1.0, 9)
    weights /= weights.sum()
    centre = weights @ rest
    found, moved = best_rigid(rest, (rest - centre) @ rotation.T + centre + shift, weights)
    np.testing.assert_allclose(found, rotation, atol=1e-10)
    np.testing.assert_allclose(moved, shift, atol=1e-10)


@PROPERTY
@given(vectors(1.0), st.floats(0.0, 3.0), st.integers(2, 40))
def test_unwrapped_vectors_follow_any_number_of_turns(axis: np.ndarray, step: float, count: int) -> None:
    """About a fixed axis, by less than half a turn per frame."""
    assume(np.linalg.norm(axis) > 0.1)
    angles = step * np.arange(count)
    vectors = angles[:, None] * axis / np.linalg.norm(axis)
    np.testing.assert_allclose(unwrapped_vectors(rotation_from_vector(vectors)), vectors, atol=1e-6)


@PROPERTY
@given(rotations(), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_rotated_harmonics_have_the_colour_of_the_rotated_direction(
    rotation: np.ndarray, degree: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    harmonics = rng.normal(size=(2, (degree + 1) ** 2, 3))
    directions = rng.normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    before = harmonic_basis(directions, degree) @ harmonics
    after = harmonic_basis(directions @ rotation.T, degree) @ rotated_harmonics(harmonics, rotation)
    np.testing.assert_allclose(after, before, atol=1e-10)


@PROPERTY
@given(st.integers(0, 2**32 - 1))
def test_covariances_have_the_axes_they_were_made_of(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scales, quaternions = rng.uniform(1e-3, 1.0, (5, 3)), rng.normal(size=(5, 4))
    covariances = covariances_from_axes(scales, quaternions)
    np.testing.assert_allclose(covariances, covariances_from_axes(scales, -3.0 * quaternions), atol=1e-12)
    found, turns = axes_from_covariances(covariances)
    np.testing.assert_allclose(found, np.sort(scales, axis=1), rtol=1e-6)
    np.testing.assert_allclose(covariances_from_axes(found, turns), covariances, atol=1e-12)
