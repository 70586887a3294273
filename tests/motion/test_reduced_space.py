from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import prepare
from odeform.geometry.rigid import rotation_from_vector, rotation_z
from odeform.models.base import Predictor
from odeform.motion.reduced_space import (
    POSE,
    ReducedSpace,
    decompose,
    fit_modes,
    make_space,
    motion_rmse,
    rotation_of,
    small_motion,
    to_canonical,
)
from odeform.motion.rolling import Rolling
from odeform.types import Mesh, MotionSequence

HEADING = 0.9


def rolling() -> tuple[MotionSequence, np.ndarray, np.ndarray]:
    """A stiff ball that flies off and makes two turns, and the pose that describes it."""
    sphere = trimesh.creation.icosphere(2, 0.1)
    rest = np.add(sphere.vertices, (0.0, 0.0, 0.1))
    s = np.linspace(0.0, 1.0, 61)[:, None]
    pose = np.concatenate([s * [0.8, 0.1, 0.3], s * [0.2, 4.0 * np.pi, 0.1]], axis=1)
    anchor = np.array([0.0, 0.0, 0.1])
    canonical = to_canonical(rest, anchor, HEADING)
    moved = canonical @ rotation_from_vector(pose[:, 3:]).swapaxes(1, 2) + pose[:, None, :3]
    vertices = moved @ rotation_z(HEADING).T + anchor
    weights = np.full(len(rest), 1.0 / len(rest))
    return MotionSequence(s[:, 0], vertices, np.asarray(sphere.faces), weights), anchor, pose


def test_decomposes_a_rigid_motion() -> None:
    sequence, anchor, true = rolling()
    pose, local = decompose(sequence, anchor, HEADING)
    assert np.abs(pose - true).max() < 1e-9
    assert np.abs(local).max() < 1e-12


def test_pose_does_not_depend_on_the_heading() -> None:
    sequence, anchor, true = rolling()
    turned = (sequence.vertices - anchor) @ rotation_z(1.7).T + anchor
    other = MotionSequence(sequence.times, turned, sequence.faces, sequence.weights)
    assert np.abs(decompose(other, anchor, HEADING + 1.7)[0] - true).max() < 1e-9


def test_anchor_need_not_be_the_centroid() -> None:
    sequence, _, _ = rolling()
    anchor = np.array([0.05, -0.02, 0.3])
    pose, _ = decompose(sequence, anchor, HEADING)
    rotation, shift = rotation_of(pose, HEADING)
    canonical = to_canonical(sequence.vertices[0], anchor, HEADING)
    rebuilt = canonical @ rotation.swapaxes(1, 2) + (shift + anchor)[:, None]
    assert np.abs(rebuilt - sequence.vertices).max() < 1e-12


def test_modes_are_orthonormal_in_the_mass(dataset: Dataset) -> None:
    data = prepare(dataset, modes=12)
    modes = data.space.basis.values(data.rest).astype(float)
    gram = np.einsum("n,nik,nil->kl", data.weights, modes, modes)
    assert np.abs(gram - np.eye(12)).max() < 1e-5


def test_truncation_is_what_the_modes_leave_out(dataset: Dataset) -> None:
    few, many = prepare(dataset, modes=3), prepare(dataset, modes=12)
    assert 0.0 < many.truncation_mm["train"] < few.truncation_mm["train"]
    residual = []
    modes = few.space.basis.values(few.rest)
    for row, sequence in enumerate(dataset.sequences("train")):
        _, local = decompose(sequence, few.space.anchor, few.schema.azimuth(sequence.parameters))
        rest = local - np.einsum("nik,tk->tni", modes, few.reduced["train"][row][:, POSE:])
        residual.append(np.einsum("n,tni->t", sequence.weights, rest**2).mean())
    assert few.truncation_mm["train"] == pytest.approx(1e3 * np.sqrt(np.mean(residual)), rel=1e-3)


def test_training_motions_come_back(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    """Decomposed, kept, looked up by their own parameters and composed again: the simulated vertices."""
    for sequence in dataset.sequences("train"):
        motion = predictors["nearest"].solve(sequence.rest, sequence.parameters)
        error = np.linalg.norm(motion.vertices(sequence.times) - sequence.vertices, axis=-1)
        assert np.sqrt((error**2).mean()) < 5e-5
        assert error.max() < 5e-4


def test_space_survives_its_parts(predictors: dict[str, Predictor]) -> None:
    rest = predictors["nearest"].rest
    space = predictors["nearest"].space  # pyright: ignore[reportAttributeAccessIssue]
    again = ReducedSpace.from_parts(space.to_json(), space.arrays(), rest)
    points = np.asarray(Mesh(space.basis.centers * space.gyration_radius, np.zeros((0, 3), int)).points)
    assert np.array_equal(again.basis.values(points), space.basis.values(points))
    assert np.array_equal(again.anchor, space.anchor)
    assert again.gyration_radius == space.gyration_radius
    assert again.surface is not None
    assert np.allclose(again.surface.points + space.anchor, rest.points, rtol=0.0, atol=1e-12)


def test_a_vertex_without_a_face_is_inside() -> None:
    """Data with interior points fill a volume, and their checkpoint says so; one that does not say is of a surface."""
    sphere = trimesh.creation.icosphere(1, 0.1)
    points = np.concatenate([sphere.vertices, [[0.01, 0.0, 0.02]]])
    weights, shapes = np.full(len(points), 1.0 / len(points)), np.ones((len(points), 3, 1))
    faces, anchor = np.asarray(sphere.faces), np.zeros(3)
    shell = make_space(Mesh(points[:-1], faces), shapes[:-1], weights[:-1], anchor)
    solid = make_space(Mesh(points, faces), shapes, weights, anchor)
    assert shell.surface is not None
    assert solid.surface is None
    assert ReducedSpace.from_parts(solid.to_json(), solid.arrays(), Mesh(points, faces)).surface is None
    for largest in ((np.inf, 1.0), (1.0, np.inf)):  # JSON has no such number
        assert "largest" not in replace(solid, largest=largest).to_json()
    old = {name: value for name, value in shell.to_json().items() if name != "surface"}
    assert ReducedSpace.from_parts(old, shell.arrays(), Mesh(points[:-1], faces)).surface is not None


def test_nothing_grows_by_more_than_three_tenths_of_what_was_trained() -> None:
    """And what is within half of that is left alone, to the last bit; directions are kept."""
    points, faces = np.random.default_rng(0).normal(size=(8, 3)), np.array([[0, 1, 2]])
    shapes, weights = np.random.default_rng(1).normal(size=(8, 3, 2)), np.full(8, 0.125)
    space = replace(make_space(Mesh(points, faces), shapes, weights, np.zeros(3)), largest=(0.4, 2e-3))
    sizes = np.array([1.0, 1.1, 1.2, 1e6])
    y = np.zeros((4, 8))
    y[:, :3] = 0.4 * sizes[:, None] * [0.0, 0.6, -0.8]
    y[:, 3:6] = 100.0
    y[:, 6:] = 2e-3 * sizes[::-1, None] * [0.6, -0.8]
    bounded = space.bounded(y, np.ones(4))
    assert np.array_equal(bounded[:2, :6], y[:2, :6])
    assert np.array_equal(bounded[2:, 6:], y[2:, 6:])
    assert np.array_equal(bounded[:, 3:6], y[:, 3:6])
    for part, largest in ((bounded[2:, :3], 0.4), (bounded[1::-1, 6:], 2e-3)):
        size = np.linalg.norm(part, axis=1) / largest
        assert 1.15 < size[0] < 1.2
        assert size[1] == pytest.approx(1.3)
        assert np.allclose(part[:, -2:] / (largest * size[:, None]), [0.6, -0.8])
    assert np.isfinite(space.bounded(np.full((1, 8), 1e300), np.ones(1))).all()
    later = space.bounded(y, np.full(4, 3.0))  # by then it may have moved three times as far
    assert np.array_equal(later[:3, :3], y[:3, :3])
    assert np.linalg.norm(later[3, :3]) == pytest.approx(3.0 * 1.3 * 0.4)
    assert np.array_equal(later[:, 6:], bounded[:, 6:])
    assert ReducedSpace.from_parts(space.to_json(), space.arrays(), Mesh(points, faces)).largest == (0.4, 2e-3)


def test_small_motions_are_measured_by_what_they_move() -> None:
    """A shift as it is, a turn by sqrt(2/3) of the radius of gyration, and coefficients, which are displacements."""
    y = np.array([[3.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.6, 0.0, 0.8, 0.0, 0.0]])
    bent = np.array([[0.0] * 6 + [0.3, -0.4]])
    assert small_motion(y, 0.3) == pytest.approx([5.0, 0.3 * np.sqrt(2.0 / 3.0)])
    assert small_motion(bent, 0.3) == pytest.approx([0.5])
    # over three axes and all times
    assert motion_rmse(y, np.zeros_like(y), 0.3) == pytest.approx(np.sqrt((25.0 + 0.06) / 6.0))
    assert motion_rmse(y, y, 0.3) == 0.0


def test_bodies_that_roll_have_patterns_in_place_of_modes() -> None:
    rng, axis = np.random.default_rng(0), np.array([0.0, 1.0, 0.0])
    rest = np.asarray(trimesh.creation.icosphere(1, 0.1).vertices)
    modes, weights = rng.normal(size=(len(rest), 3, 4)), np.full(len(rest), 1.0 / len(rest))
    plain = make_space(Mesh(rest, np.zeros((0, 3), np.int32)), modes, weights, np.zeros(3))
    space = replace(plain, rolling=Rolling(axis, rng.normal(size=(5, 4, 2))))
    assert (plain.coordinates, space.coordinates) == (POSE + 4, POSE + 2)
    y = np.concatenate([rng.normal(size=(6, 3)), rng.normal(size=(6, 1)) * axis, rng.normal(size=(6, 2))], axis=1)
    whole = space.with_modes(y)
    assert whole.shape == (6, POSE + 4)
    np.testing.assert_array_equal(whole[:, :POSE], y[:, :POSE])
    np.testing.assert_allclose(whole[:, POSE:], space.rolling.coefficients(y[:, 3:POSE], y[:, POSE:]))
    np.testing.assert_allclose(space.with_patterns(whole), y, rtol=1e-5, atol=1e-6)
    assert plain.with_modes(whole) is whole
    assert plain.with_patterns(whole) is whole


def test_the_radius_of_gyration_is_that_of_the_masses() -> None:
    rest = Mesh(
        np.array([[0.3, 0.0, 0.4], [0.0, 0.2, 0.0], [0.0, 0.0, 0.1], [0.1, 0.1, 0.0]]), np.zeros((0, 3), np.int32)
    )
    space = make_space(rest, np.ones((4, 3, 1)), np.array([0.5, 0.25, 0.25, 0.0]), np.zeros(3))
    assert space.gyration_radius == pytest.approx(np.sqrt(0.5 * 0.25 + 0.25 * 0.04 + 0.25 * 0.01))


def test_modes_of_few_frames_are_those_of_many() -> None:
    """Where frames are fewer than coordinates, they are decomposed in place of the covariance: the same modes."""
    rng = np.random.default_rng(0)
    weights, few = rng.dirichlet(np.ones(20)), rng.normal(size=(15, 20, 3))
    one, other = fit_modes([few[:5], few[5:]], weights, 4), fit_modes([few] * 5, weights, 4)
    products = np.einsum("n,nik,nil->kl", weights, one, other)
    np.testing.assert_allclose(np.abs(products), np.eye(4), atol=1e-9)
