import io
from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.formats.times import parse_times
from odeform.formats.writing import write_motion
from odeform.geometry.harmonics import harmonic_basis
from odeform.geometry.region import Sphere
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.shape import fit_to
from odeform.geometry.similarity import Similarity
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.types import GaussianSplats, PointCloud


@pytest.fixture(scope="module")
def rival() -> Predictor:
    """The bundled model that is fastest to solve."""
    return load("kick/nearest")


def test_times_are_half_open() -> None:
    assert np.allclose(parse_times("0:1:0.25"), [0.0, 0.25, 0.5, 0.75])
    assert np.allclose(parse_times("0.5:0.7:0.5"), [0.5])


@pytest.mark.parametrize(
    "text",
    ["", "0:1", "0:1:0.1:3", "a:b:c", "0:1:0", "0:1:-0.1", "1:1:0.1", "-1:1:0.1", "0:inf:1", "0:nan:1", "0:9:1e-9"],
)
def test_impossible_times(text: str) -> None:
    with pytest.raises(InputError, match="times"):
        parse_times(text)


def test_points_and_splats(rival: Predictor, tmp_path: Path) -> None:
    points = np.random.default_rng(0).uniform((-0.05, -0.05, 0.0), (0.05, 0.05, 0.2), size=(8, 3))
    covariances = np.tile(1e-6 * np.diag([1.0, 2.0, 3.0]), (8, 1, 1))
    splats = GaussianSplats(points, covariances, np.random.default_rng(1).normal(size=(8, 4, 3)), np.full(8, 0.7))
    times = np.array([0.0, 0.3])
    for shape, keys in (
        (PointCloud(points), {"times", "parameters", "notes", "vertices", "faces"}),
        (splats, {"times", "parameters", "notes", "centers", "covariances"}),
    ):
        motion = rival.solve(shape)
        write_motion(motion, times, tmp_path / "a.npz")
        with np.load(io.BytesIO((tmp_path / "a.npz").read_bytes()), allow_pickle=False) as arrays:
            assert set(arrays) == keys
            frames = arrays["vertices" if "vertices" in keys else "centers"]
            # frames asked for one at a time: they round otherwise than all at once
            np.testing.assert_allclose(frames, motion.vertices(times), rtol=0.0, atol=1e-6)
            if "faces" in keys:
                assert arrays["faces"].shape == (0, 3)
            else:
                assert np.allclose(arrays["covariances"][1], motion.covariances(0.3), atol=1e-12)
        write_motion(motion, times, tmp_path / "{frame}.ply")
        assert np.allclose(trimesh.load(tmp_path / "00001.ply").vertices, motion.vertices(0.3), atol=1e-7)


def test_splats_are_written_as_splats(rival: Predictor, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform((-0.05, -0.05, 0.0), (0.05, 0.05, 0.2), size=(8, 3))
    factors = 1e-3 * rng.normal(size=(8, 3, 3))
    splats = GaussianSplats(points, factors @ factors.swapaxes(1, 2), rng.normal(size=(8, 16, 3)), np.full(8, 0.7))
    motion = rival.solve(splats)
    write_motion(motion, np.array([0.0, 0.5]), tmp_path / "{frame}.ply")
    seen = rng.normal(size=(20, 3))
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    for name, time in (("00000.ply", 0.0), ("00001.ply", 0.5)):
        read = read_geometry(tmp_path / name)
        assert isinstance(read, GaussianSplats)
        assert np.array_equal(read.points, motion.vertices(time))
        assert np.allclose(read.covariances, motion.covariances(time), rtol=1e-4, atol=1e-12)
        assert np.allclose(read.opacities, 0.7, atol=1e-6)
        # a side of the body keeps its colour as the body turns
        moved = harmonic_basis(seen @ motion.pose(time)[:3, :3].T, 3) @ read.harmonics
        assert np.allclose(moved, harmonic_basis(seen, 3) @ splats.harmonics, atol=1e-5)
    assert np.abs(motion.pose(0.5)[:3, :3] - np.eye(3)).max() > 1e-3


def test_a_fitted_part_is_written_as_its_file_has_it_with_the_remainder(kick: Predictor, tmp_path: Path) -> None:
    """Rotated, in feet, far from the origin: the moving part is transformed back, the remainder is that of the file."""
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(200, 3))
    ball = 0.1 * directions / np.linalg.norm(directions, axis=1, keepdims=True) + [0.0, 0.0, 0.1]
    floor = np.concatenate([rng.uniform(-1.0, 1.0, (300, 2)), np.full((300, 1), -0.01)], axis=1)
    half = 1e-3 * rng.normal(size=(500, 3, 3))
    scene = GaussianSplats(
        np.concatenate([ball, floor]), half @ half.swapaxes(1, 2), rng.normal(size=(500, 4, 3)), np.full(500, 0.7)
    )
    away = Similarity(3.28, rotation_from_vector(np.array([1.5, 0.1, -0.2])), np.array([20.0, -6.0, 1.0]))
    file = away.shape(scene)
    region = Sphere(np.array([0.0, 0.0, 0.105]), 0.1052).transformed(away)
    fit = fit_to(file, kick.rest, region, transform=away.inverse)
    motion = kick.solve(fit.geometry)
    times = np.array([0.0, 0.02, 0.3])
    write_motion(motion, times, tmp_path / "{frame}.ply", fit)
    write_motion(motion, times, tmp_path / "a.npz", fit)
    start, early, late = (read_geometry(tmp_path / f"0000{frame}.ply") for frame in range(3))
    for name, tolerance in (("points", 5e-6), ("harmonics", 1e-5), ("covariances", 1e-9), ("opacities", 1e-6)):
        assert np.allclose(getattr(start, name), getattr(file, name), atol=tolerance), name
    for frame, (moved, time) in enumerate(zip((start, early, late), times, strict=True)):
        assert isinstance(moved, GaussianSplats)
        for name in ("points", "harmonics"):
            assert np.array_equal(getattr(moved, name)[200:], getattr(file, name)[200:].astype(np.float32))
        assert np.allclose(away.inverse.points(moved.points[:200]), motion.vertices(float(time)), atol=2e-6)
        assert np.allclose(
            away.inverse.covariances(moved.covariances[:200]), motion.covariances(float(time)), rtol=1e-3, atol=1e-10
        )
        with np.load(tmp_path / "a.npz") as arrays:
            assert np.allclose(arrays["centers"][frame], moved.points[:200], atol=5e-6)
            assert np.allclose(arrays["covariances"][frame], moved.covariances[:200], rtol=1e-3, atol=1e-9)
    assert np.abs(late.points[:200] - start.points[:200]).max() > 0.3


def test_other_braces_in_the_name(rival: Predictor, tmp_path: Path) -> None:
    write_motion(rival.solve(), np.array([0.0]), tmp_path / "{x}_{frame}.ply")
    assert [path.name for path in tmp_path.iterdir()] == ["{x}_00000.ply"]
