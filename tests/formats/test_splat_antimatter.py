from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.formats.splat_inria import inria_bytes
from odeform.types import GaussianSplats, PointCloud

SPLAT = np.dtype([("xyz", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rot", "u1", 4)])


def drawn(count: int = 5) -> np.ndarray:
    rng = np.random.default_rng(1)
    raw = np.zeros(count, SPLAT)
    raw["xyz"], raw["scale"] = rng.normal(size=(count, 3)), rng.uniform(0.01, 0.1, (count, 3))
    raw["rgba"], raw["rot"] = rng.integers(0, 256, (count, 4)), rng.integers(0, 256, (count, 4))
    return raw


def read(path: Path) -> GaussianSplats:
    splats = read_geometry(path)
    assert isinstance(splats, GaussianSplats)
    return splats


def test_splat(tmp_path: Path) -> None:
    raw = drawn()
    raw["rot"][1] = 128  # no turn
    (tmp_path / "a.splat").write_bytes(raw.tobytes())
    splats = read(tmp_path / "a.splat")
    assert splats.notes == ()
    assert np.array_equal(splats.points, raw["xyz"])
    assert np.allclose(splats.colors, raw["rgba"][:, :3] / 255.0, atol=1e-6)
    assert np.allclose(splats.opacities, raw["rgba"][:, 3] / 255.0)
    turn = raw["rot"].astype(float) - 128.0
    turn[1] = 1.0, 0.0, 0.0, 0.0
    rotation = Rotation.from_quat(turn, scalar_first=True).as_matrix()
    true = np.einsum("nij,nj,nkj->nik", rotation, raw["scale"].astype(float) ** 2, rotation)
    assert np.allclose(splats.covariances, true, atol=1e-9)


def test_splat_to_ply(tmp_path: Path) -> None:
    (tmp_path / "a.splat").write_bytes(drawn(100).tobytes())
    splats = read(tmp_path / "a.splat")
    (tmp_path / "a.ply").write_bytes(inria_bytes(splats))
    again = read(tmp_path / "a.ply")
    for name in ("points", "covariances", "harmonics", "opacities"):
        assert np.allclose(getattr(again, name), getattr(splats, name), rtol=1e-5, atol=3e-7), name


@pytest.mark.parametrize("field", ["xyz", "scale"])
def test_broken_splats_are_left_out_and_told(tmp_path: Path, field: str) -> None:
    raw = drawn()
    raw[field][2, 1] = np.nan
    (tmp_path / "a.splat").write_bytes(raw.tobytes())
    splats = read(tmp_path / "a.splat")
    assert splats.notes == ("1 of 5 splats left out, not finite",)
    assert np.array_equal(splats.points, raw["xyz"][[0, 1, 3, 4]])


def test_refuses(tmp_path: Path) -> None:
    mostly = drawn()
    mostly["xyz"][:3] = np.inf
    together = drawn()
    together["xyz"] = 1.0
    header = b"ply\nformat ascii 1.0\n%s\nend_header\n"
    files = {
        ("a.splat", "32 bytes a splat, got 153"): drawn().tobytes()[:-7],
        ("b.splat", "an empty file"): b"",
        ("c.splat", "at least 2 points, got 1"): drawn(1).tobytes(),
        ("d.splat", "3 of 5 points are not finite"): mostly.tobytes(),
        ("e.splat", "coincide"): together.tobytes(),
        ("a.ply", "element vertex of numbers, got splat"): header % b"element splat 0\nproperty float f_dc_0",
        ("b.ply", "line 3: expected a line of a PLY header"): header % b"property uint packed_position",
        ("c.ply", "line 4: expected a line of a PLY header"): header % b"element vertex 2\nproperty quad rot_0",
        ("d.ply", "splats without scale_0, scale_1, scale_2"): header % b"element vertex 0\nproperty float rot_0",
        ("e.ply", "expected 4000000000 rows of vertex, got 0"): header.replace(b"ascii", b"binary_little_endian")
        % b"element vertex 4000000000\nproperty float rot_0",
    }
    for (name, said), content in files.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=said) as caught:
            read_geometry(tmp_path / name)
        assert name in str(caught.value)


def test_ply_with_splats_or_without(tmp_path: Path) -> None:
    splats = GaussianSplats(np.eye(3), np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 1, 3)), np.ones(3))
    (tmp_path / "A.PLY").write_bytes(inria_bytes(splats))
    trimesh.PointCloud(np.eye(3)).export(tmp_path / "points.ply")
    assert len(read(tmp_path / "A.PLY").points) == 3
    assert isinstance(read_geometry(tmp_path / "points.ply"), PointCloud)
