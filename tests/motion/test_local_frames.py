"""Covariances carried by motions that have an answer on paper."""

from dataclasses import dataclass

import numpy as np
import pytest
import trimesh

from odeform.geometry.rigid import rotation_from_vector
from odeform.motion.base import SolveStats
from odeform.motion.evaluated_basis import evaluate_basis
from odeform.motion.local_frames import BOUND, LocalFrames, gradients, moved_covariances
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import ReducedSpace, decompose, fit_modes, make_space
from odeform.schema import Schema, Window
from odeform.types import Floats, GaussianSplats, Mesh, MotionSequence

ANCHOR = np.array([0.1, -0.2, 0.3])
SCHEMA = Schema("made up", (), Window(0.0, 1.0, 10.0))


@dataclass(frozen=True)
class Still:
    """The same reduced coordinates at all times."""

    y: Floats
    last_good: float = 1.0

    @property
    def stats(self) -> SolveStats:
        return SolveStats("still", 0, 0, 0, "ok", 0.0, lambda: None)

    def reduced(self, times: Floats) -> Floats:
        return np.tile(self.y, (len(times), 1))


def splats_at(points: np.ndarray, size: float = 3e-3) -> GaussianSplats:
    halves = size * np.random.default_rng(5).normal(size=(len(points), 3, 3))
    ones = np.ones((len(points), 3))
    return GaussianSplats(points, halves @ halves.swapaxes(1, 2), ones[:, None], ones[:, 0])


def motion_of(splats: GaussianSplats, space: ReducedSpace, y: Floats) -> ReducedMotion:
    return ReducedMotion(SCHEMA, {}, splats, space, evaluate_basis(splats, space, 0.0), Still(y))


def error(got: np.ndarray, true: np.ndarray) -> float:
    """Largest relative error of any of the matrices."""
    size = np.linalg.norm(true, axis=(1, 2))
    return float((np.linalg.norm(got - true, axis=(1, 2)) / size).max())


def conjugated(matrix: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    return matrix @ covariances @ matrix.swapaxes(-1, -2)


def affine_space(rest: Mesh, matrix: np.ndarray) -> ReducedSpace:
    """One mode, whose coefficient 1 is the affine map x -> matrix x."""
    weights = np.full(len(rest.points), 1.0 / len(rest.points))
    shapes = (rest.points @ (matrix - np.eye(3)).T)[..., None]
    return make_space(rest, shapes, weights, ANCHOR)


def ball() -> Mesh:
    sphere = trimesh.creation.icosphere(2, 0.1)
    return Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))


def plate(count: int = 15, side: float = 0.2) -> Mesh:
    """A square in the plane z = 0, about the origin."""
    line = np.linspace(-0.5 * side, 0.5 * side, count)
    x, y = np.meshgrid(line, line, indexing="ij")
    index = np.arange(count * count).reshape(count, count)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.stack([x.ravel(), y.ravel(), np.zeros(count * count)], axis=1), faces)


AFFINE = np.array([[1.3, 0.2, 0.1], [-0.3, 0.8, 0.2], [0.1, -0.1, 1.1]])
POSED = np.array([0.3, 0.1, -0.2, 0.5, -2.0, 7.0])


def test_an_affine_map_of_a_volume() -> None:
    shell, inside = ball(), 0.05 * np.random.default_rng(1).uniform(-1.0, 1.0, size=(20, 3))
    space = affine_space(Mesh(np.concatenate([shell.points, inside]), shell.faces), AFFINE)
    canonical = 0.07 * np.random.default_rng(2).normal(size=(300, 3))
    splats = splats_at(canonical + ANCHOR)
    motion = motion_of(splats, space, np.array([*POSED, 1.0]))
    turn = rotation_from_vector(POSED[3:])
    centres = (canonical @ AFFINE.T) @ turn.T + POSED[:3] + ANCHOR
    assert np.abs(motion.vertices(0.0) - centres).max() < 1e-4 * np.abs(canonical).max()
    assert error(motion.gradients(0.0), np.tile(turn @ AFFINE, (300, 1, 1))) < 1e-4
    assert error(motion.covariances(0.0), conjugated(turn @ AFFINE, splats.covariances)) < 1e-4
    assert error(motion.deformed_covariances(0.0), conjugated(AFFINE, splats.covariances)) < 1e-4
    u, _, vt = np.linalg.svd(turn @ AFFINE)
    assert np.abs(motion.rotations(0.0) - u @ vt).max() < 1e-4


def test_an_affine_map_of_a_surface_that_keeps_its_thickness() -> None:
    """A plate stretched and sheared in its plane: nothing but its surface is known, and nothing more is needed."""
    matrix = np.array([[1.4, 0.3, 0.0], [-0.1, 0.7, 0.0], [0.0, 0.0, 1.0]])
    space = affine_space(plate(), matrix)
    canonical = np.random.default_rng(2).uniform(-0.1, 0.1, size=(300, 3)) * [1.0, 1.0, 0.05]
    splats = splats_at(canonical + ANCHOR)
    motion = motion_of(splats, space, np.array([*POSED, 1.0]))
    turn = rotation_from_vector(POSED[3:])
    assert error(motion.gradients(0.0), np.tile(turn @ matrix, (300, 1, 1))) < 1e-4
    assert error(motion.covariances(0.0), conjugated(turn @ matrix, splats.covariances)) < 1e-4


def test_a_surface_takes_its_normal_along() -> None:
    """Under any affine map: tangents by the map, the normal to the unit vector along the cofactors times it."""
    space, canonical = affine_space(ball(), AFFINE), ball().points
    splats = splats_at(canonical + ANCHOR)
    normals = canonical / 0.1
    deformed = normals @ (np.linalg.det(AFFINE) * np.linalg.inv(AFFINE))
    deformed /= np.linalg.norm(deformed, axis=1, keepdims=True)
    outer = normals[:, :, None] * normals[:, None, :]
    true = AFFINE @ (np.eye(3) - outer) + deformed[:, :, None] * normals[:, None, :]
    motion = motion_of(splats, space, np.array([*np.zeros(6), 1.0]))
    # the normals of so coarse a mesh are those of the ball to half a degree
    assert error(motion.gradients(0.0), true) < 0.01
    assert error(np.tile(AFFINE, (len(true), 1, 1)), true) > 0.1


def arc(points: np.ndarray, curvature: np.ndarray) -> np.ndarray:
    """(T, N, 3): points of the plane z = 0 on cylinders about an axis along y."""
    angle = curvature[:, None] * points[:, 0]
    x, z = np.sin(angle) / curvature[:, None], (1.0 - np.cos(angle)) / curvature[:, None]
    return np.stack([x, np.broadcast_to(points[:, 1], x.shape), z], axis=-1)


def test_a_plate_bent_to_an_arc() -> None:
    """Isometric bending: each splat turns by the angle of its place on the arc, and keeps its shape."""
    rest, curvature = plate(), np.linspace(1e-6, 8.0, 25)  # the last one bends the 0.2 m by 1.6 rad
    weights = np.full(len(rest.points), 1.0 / len(rest.points))
    sequence = MotionSequence(np.linspace(0.0, 1.0, 25), arc(rest.points, curvature), rest.faces, weights)
    pose, local = decompose(sequence, np.zeros(3), 0.0)
    shapes = fit_modes([local], weights, 8)
    space = make_space(rest, shapes, weights, np.zeros(3))
    coefficients = np.einsum("n,ni,nik->k", weights, local[-1], shapes)
    centres = np.random.default_rng(3).uniform(-0.09, 0.09, size=(500, 3)) * [1.0, 1.0, 0.0]
    splats = splats_at(centres)
    motion = motion_of(splats, space, np.concatenate([pose[-1], coefficients]))
    assert np.abs(motion.vertices(0.0) - arc(centres, curvature[-1:])[0]).max() < 2e-4
    turns = rotation_from_vector(-curvature[-1] * centres[:, :1] * [0.0, 1.0, 0.0])
    covariances = motion.covariances(0.0)
    assert error(covariances, conjugated(turns, splats.covariances)) < 0.05
    assert error(motion.rotations(0.0), turns) < 0.05
    # the length of the normal is not in the data at all
    normals = motion.gradients(0.0)[:, :, 2].astype(float)
    thickness = np.einsum("ni,nij,nj->n", normals, covariances, normals)
    assert np.allclose(thickness, splats.covariances[:, 2, 2], rtol=1e-4)


@pytest.mark.parametrize("solid", [False, True])
def test_rigid_motions_turn(solid: bool) -> None:
    space = affine_space(Mesh(ball().points, ball().faces[: 40 if solid else None]), AFFINE)
    assert (space.surface is None) == solid
    splats = splats_at(ball().points + ANCHOR)
    turn = rotation_from_vector(POSED[3:])
    motion = motion_of(splats, space, np.array([*POSED, 0.0]))
    assert error(motion.covariances(0.0), conjugated(turn, splats.covariances)) < 1e-7
    assert error(motion.gradients(0.0), np.tile(turn, (len(splats.points), 1, 1))) < 1e-6
    almost = motion_of(splats, space, np.array([*POSED, 1e-9]))
    assert error(almost.covariances(0.0), conjugated(turn, splats.covariances)) < 2e-6
    resting = motion_of(splats, space, np.zeros(7))
    assert np.array_equal(resting.covariances(0.0), splats.covariances.astype(np.float32))


def local_frames(followed: int, count: int = 400, modes: int = 5) -> LocalFrames:
    rng = np.random.default_rng(7)
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0].transpose(1, 2, 0)
    if followed == 2:
        axes[2] = np.cross(axes[0], axes[1], axis=0)
    slopes = rng.normal(size=(modes, followed, 3, count))
    return LocalFrames(axes.astype(np.float32), slopes.astype(np.float32))


@pytest.mark.parametrize("followed", [2, 3])
def test_singular_values_are_bounded(followed: int) -> None:
    """Within the bound nothing is changed; beyond it the singular values are clipped and the directions kept."""
    evaluated, coefficients = local_frames(followed), 0.5 * np.random.default_rng(8).normal(size=5)
    carried = evaluated.carried(coefficients)
    free = evaluated.rest[:followed] + np.einsum("k,kmin->min", coefficients, evaluated.slopes)
    u, size, vt = np.linalg.svd(free.transpose(2, 1, 0).astype(float), full_matrices=False)
    wild = (size.max(axis=1) > BOUND) | (size.min(axis=1) < 1.0 / BOUND)
    assert 40 < wild.sum() < 360
    true = (u * np.clip(size, 1.0 / BOUND, BOUND)[:, None]) @ vt
    assert np.abs(carried[:followed].transpose(2, 1, 0) - true).max() < 1e-5
    values = np.linalg.svd(carried.transpose(2, 0, 1), compute_uv=False)
    assert BOUND * (1.0 + 1e-5) > values.max() >= values.min() > (1.0 - 1e-5) / BOUND
    if followed == 2:
        normal = np.cross(carried[0], carried[1], axis=0)
        assert np.abs(carried[2] - normal / np.linalg.norm(normal, axis=0)).max() < 1e-4


@pytest.mark.parametrize("followed", [2, 3])
@pytest.mark.parametrize("coefficient", [1e15, 1e25, 1e38, -1.0, np.inf, np.nan])
def test_finite_whatever_the_coefficients(followed: int, coefficient: float) -> None:
    evaluated = local_frames(followed)
    # the first points collapse to nothing, the next ones onto a line
    evaluated.slopes[:, :, :, :5] = evaluated.rest[:followed, :, :5]
    evaluated.slopes[:, :, :, 5:10] = evaluated.rest[:followed, :, 5:10] - evaluated.rest[:1, :, 5:10]
    coefficients = np.array([coefficient, 0.0, 0.0, 0.0, 0.0])
    carried = evaluated.carried(coefficients)
    assert np.isfinite(carried).all()
    values = np.linalg.svd(carried.transpose(2, 0, 1), compute_uv=False)
    assert BOUND * (1.0 + 1e-5) > values.max() >= values.min() > (1.0 - 1e-5) / BOUND


@pytest.mark.parametrize("followed", [2, 3])
def test_single_precision_is_enough(followed: int) -> None:
    evaluated, coefficients = local_frames(followed), 0.05 * np.random.default_rng(9).normal(size=5)
    covariances = splats_at(np.zeros((400, 3))).covariances
    axes = evaluated.rest.astype(float)
    carried = np.array(axes)
    carried[:followed] += np.einsum("k,kmin->min", coefficients, evaluated.slopes.astype(float))
    if followed == 2:
        carried[2] = np.cross(carried[0], carried[1], axis=0)
        carried[2] /= np.linalg.norm(carried[2], axis=0)
    local = np.einsum("jin,nik,lkn->jln", axes, covariances, axes).astype(np.float32)
    got = moved_covariances(local, evaluated.carried(coefficients))
    assert error(got, conjugated(gradients(axes, carried), covariances)) < 1e-5
    assert np.abs(got - got.swapaxes(1, 2)).max() < 1e-6 * np.abs(got).max()
