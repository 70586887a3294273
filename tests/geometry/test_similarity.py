import numpy as np
import pytest

from odeform.geometry.harmonics import harmonic_basis
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import GaussianSplats

MOVE = Similarity(2.5, rotation_from_vector(np.array([0.4, -1.1, 0.7])), np.array([3.0, -1.0, 0.2]))


def splats(count: int = 7) -> GaussianSplats:
    rng = np.random.default_rng(3)
    half = rng.normal(size=(count, 3, 3))
    return GaussianSplats(
        rng.normal(size=(count, 3)), half @ half.swapaxes(1, 2), rng.normal(size=(count, 9, 3)), np.full(count, 0.5)
    )


@pytest.mark.parametrize("up", UPRIGHT)
def test_upright_turns_the_named_axis_up(up: str) -> None:
    axis = (1.0 if up[0] == "+" else -1.0) * np.eye(3)["xyz".index(up[1])]
    assert np.array_equal(UPRIGHT[up] @ axis, [0.0, 0.0, 1.0])
    assert np.linalg.det(UPRIGHT[up]) == pytest.approx(1.0)


def test_inverse_and_product() -> None:
    points = np.random.default_rng(0).normal(size=(5, 3))
    assert np.allclose(MOVE.points(points), 2.5 * (MOVE.rotation @ points.T).T + MOVE.shift)
    assert np.allclose(MOVE.inverse.points(MOVE.points(points)), points)
    other = Similarity(0.3, UPRIGHT["-y"], np.array([0.0, 5.0, 0.0]))
    assert np.allclose((other @ MOVE).points(points), other.points(MOVE.points(points)))


def test_a_shape_takes_along_what_has_a_direction() -> None:
    before = splats()
    after = MOVE.shape(before)
    offset = np.random.default_rng(1).normal(size=3)
    # a quadratic form is the same wherever it is taken
    moved = 2.5 * MOVE.rotation @ offset
    form, same = (
        np.einsum("i,nij,j->n", v, np.linalg.inv(s.covariances), v) for v, s in ((offset, before), (moved, after))
    )
    assert np.allclose(form, same)
    seen = offset / np.linalg.norm(offset)
    color, turned = (harmonic_basis(v, 2) @ s.harmonics for v, s in ((seen, before), (MOVE.rotation @ seen, after)))
    assert np.allclose(color, turned, atol=1e-6)
    assert np.abs(after.harmonics - before.harmonics).max() > 0.1


def test_a_shape_comes_back() -> None:
    before = splats()
    back = MOVE.inverse.shape(MOVE.shape(before))
    assert np.allclose(back.points, before.points, atol=1e-6)
    assert np.allclose(back.covariances, before.covariances)
    assert np.allclose(back.harmonics, before.harmonics, atol=1e-6)
