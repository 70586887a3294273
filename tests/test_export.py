import io
from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.export import parse_times, write_motion
from odeform.predictor import Predictor
from odeform.types import GaussianSplats, PointCloud


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


def test_points_and_splats(predictors: dict[str, Predictor], tmp_path: Path) -> None:
    points = np.random.default_rng(0).uniform((-0.05, -0.05, 0.0), (0.05, 0.05, 0.2), size=(8, 3))
    covariances = np.tile(1e-6 * np.diag([1.0, 2.0, 3.0]), (8, 1, 1))
    splats = GaussianSplats(points, covariances, np.ones((8, 3)), np.ones(8))
    times = np.array([0.0, 0.3])
    for shape, keys in (
        (PointCloud(points), {"times", "parameters", "vertices", "faces"}),
        (splats, {"times", "parameters", "centers", "covariances"}),
    ):
        motion = predictors["nearest"].solve(shape)
        write_motion(motion, times, tmp_path / "a.npz")
        with np.load(io.BytesIO((tmp_path / "a.npz").read_bytes()), allow_pickle=False) as arrays:
            assert set(arrays) == keys
            frames = arrays["vertices" if "vertices" in keys else "centers"]
            assert np.array_equal(frames, motion.vertices(times))
            if "faces" in keys:
                assert arrays["faces"].shape == (0, 3)
            else:
                assert np.allclose(arrays["covariances"][1], motion.covariances(0.3), atol=1e-12)
        write_motion(motion, times, tmp_path / "{frame}.ply")
        assert np.allclose(trimesh.load(tmp_path / "00001.ply").vertices, motion.vertices(0.3), atol=1e-7)


def test_braces_of_others(predictors: dict[str, Predictor], tmp_path: Path) -> None:
    write_motion(predictors["nearest"].solve(), np.array([0.0]), tmp_path / "{x}_{frame}.ply")
    assert [path.name for path in tmp_path.iterdir()] == ["{x}_00000.ply"]
