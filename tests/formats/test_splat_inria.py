from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.formats.splat_inria import inria_bytes
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.types import GaussianSplats

RNG = np.random.default_rng(0)
BASE = ("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")
AXES = ("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")


def encoded(columns: dict[str, np.ndarray], kind: str = "float") -> bytes:
    rows = np.stack(list(columns.values()), axis=1).astype({"float": "<f4", "double": "<f8"}[kind])
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    header += [*(f"property {kind} {name}" for name in columns), "end_header", ""]
    return "\n".join(header).encode() + rows.tobytes()


def drawn(count: int = 7, further: int = 0, normals: bool = False) -> dict[str, np.ndarray]:
    rest = tuple(f"f_rest_{k}" for k in range(3 * further))
    names = (*BASE[:3], *(("nx", "ny", "nz") if normals else ()), *BASE[3:6], *rest, BASE[6], *AXES)
    return {name: RNG.normal(size=count) for name in names}


def read(tmp_path: Path, data: bytes) -> GaussianSplats:
    (tmp_path / "splats.ply").write_bytes(data)
    splats = read_geometry(tmp_path / "splats.ply")
    assert isinstance(splats, GaussianSplats)
    return splats


def stack(columns: dict[str, np.ndarray], *names: str) -> np.ndarray:
    return np.stack([columns[name] for name in names], axis=1)


@pytest.mark.parametrize("kind", ["float", "double"])
@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("further", [0, 3, 8, 15])
def test_all_that_is_in_a_file(tmp_path: Path, further: int, normals: bool, kind: str) -> None:
    columns = drawn(further=further, normals=normals)
    shuffled = {name: columns[name] for name in RNG.permutation(list(columns))}
    for order in (columns, shuffled):
        splats = read(tmp_path, encoded(order, kind))
        assert splats.notes == ()
        assert np.allclose(splats.points, stack(columns, "x", "y", "z"), atol=1e-6)
        assert np.allclose(splats.opacities, 1.0 / (1.0 + np.exp(-columns["opacity"])), atol=1e-6)
        rotation = Rotation.from_quat(stack(columns, *AXES[3:]), scalar_first=True).as_matrix()
        variance = np.exp(stack(columns, *AXES[:3])) ** 2
        true = np.einsum("nij,nj,nkj->nik", rotation, variance, rotation)
        assert np.allclose(splats.covariances, true, rtol=1e-5, atol=1e-5)
        assert splats.harmonics.shape == (7, 1 + further, 3)
        assert np.allclose(splats.harmonics[:, 0], stack(columns, "f_dc_0", "f_dc_1", "f_dc_2"), atol=1e-6)
        for k in range(further):
            # all of red is before all of green
            channels = stack(columns, f"f_rest_{k}", f"f_rest_{further + k}", f"f_rest_{2 * further + k}")
            assert np.allclose(splats.harmonics[:, 1 + k], channels, atol=1e-6)
        color = 0.5 + stack(columns, "f_dc_0", "f_dc_1", "f_dc_2") / np.sqrt(4.0 * np.pi)
        assert np.allclose(splats.colors, np.clip(color, 0.0, 1.0), atol=1e-6)


def test_degree_four_is_left_out(tmp_path: Path) -> None:
    columns = drawn(further=24)
    splats = read(tmp_path, encoded(columns))
    assert splats.harmonics.shape == (7, 16, 3)
    assert np.allclose(splats.harmonics[:, 15, 1], columns["f_rest_38"], atol=1e-6)
    assert "degree 3" in splats.notes[0]


def test_without_colour(tmp_path: Path) -> None:
    columns = {name: column for name, column in drawn().items() if not name.startswith("f_dc")}
    splats = read(tmp_path, encoded(columns))
    assert np.array_equal(splats.colors, np.full((7, 3), 0.5))
    assert "colour" in splats.notes[0]


@pytest.mark.parametrize("count", [1, 8, 10, 46])
def test_harmonics_that_are_no_degree(tmp_path: Path, count: int) -> None:
    columns = drawn() | {f"f_rest_{k}": np.zeros(7) for k in range(count)}
    with pytest.raises(InputError, match=f"0, 9, 24 or 45 columns f_rest, got {count}"):
        read(tmp_path, encoded(columns))


def test_harmonics_with_a_gap(tmp_path: Path) -> None:
    columns = drawn(further=3)
    columns["f_rest_9"] = columns.pop("f_rest_4")
    with pytest.raises(InputError, match="without f_rest_4"):
        read(tmp_path, encoded(columns))


def test_limits_that_mean_something(tmp_path: Path) -> None:
    columns = drawn()
    columns["opacity"][:3] = np.inf, -np.inf, 200.0
    columns["scale_1"][3] = -np.inf
    for name in AXES[3:]:
        columns[name][4] = 0.0
        columns[name][5] *= 1e6
    splats = read(tmp_path, encoded(columns))
    assert splats.notes == ()
    assert splats.opacities[:3].tolist() == [1.0, 0.0, 1.0]
    assert np.linalg.eigvalsh(splats.covariances[3])[0] == pytest.approx(0.0, abs=1e-12)
    assert np.allclose(splats.covariances[4], np.diag(np.exp(2.0 * stack(columns, *AXES[:3])[4])))
    assert np.linalg.eigvalsh(splats.covariances).min() > -1e-12


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, np.nan) for name in ("x", "opacity", "scale_1", "rot_0", "f_dc_0", "f_rest_40")),
        *((name, np.inf) for name in ("z", "scale_0", "rot_3", "f_dc_2", "f_rest_0")),
    ],
)
def test_broken_splats_are_left_out_and_told(tmp_path: Path, name: str, value: float) -> None:
    columns = drawn(further=15)
    columns[name][[1, 4]] = value
    splats = read(tmp_path, encoded(columns))
    kept = [0, 2, 3, 5, 6]
    assert splats.notes == ("2 of 7 splats left out, not finite",)
    assert np.allclose(splats.points, stack(columns, "x", "y", "z")[kept], atol=1e-6)
    assert len(splats.covariances) == len(splats.harmonics) == len(splats.opacities) == 5
    columns[name][[0, 3]] = value
    with pytest.raises(InputError, match="4 of 7 points are not finite"):
        read(tmp_path, encoded(columns))


@pytest.mark.parametrize("log", [60.0, 500.0, 1e30])
def test_scales_beyond_all_sense_are_left_out(tmp_path: Path, log: float) -> None:
    columns = drawn()
    columns["scale_2"][2] = log
    assert read(tmp_path, encoded(columns)).notes == ("1 of 7 splats left out, not finite",)


@pytest.mark.parametrize("count", [1, 4, 9, 16])
def test_what_is_written_reads_the_same(tmp_path: Path, count: int) -> None:
    size = 200
    scales = np.exp(RNG.uniform(-9.0, -2.0, (size, 3)))
    scales[:9, 0] = 0.0
    splats = GaussianSplats(
        RNG.normal(size=(size, 3)).astype(np.float32),
        covariances_from_axes(scales, RNG.normal(size=(size, 4))),
        RNG.normal(size=(size, count, 3)).astype(np.float32),
        RNG.uniform(size=size),
    )
    splats.opacities[:2] = 0.0, 1.0
    data = inria_bytes(splats)
    again = read(tmp_path, data)
    assert np.array_equal(again.points, splats.points)
    assert np.array_equal(again.harmonics, splats.harmonics)
    assert np.allclose(again.opacities, splats.opacities, atol=3e-7)
    largest = np.abs(splats.covariances).max(axis=(1, 2))
    assert (np.abs(again.covariances - splats.covariances).max(axis=(1, 2)) < 3e-6 * largest).all()
    # and so do the thin axes, which the largest would hide
    true, found = (np.sqrt(np.maximum(np.linalg.eigvalsh(s.covariances[9:]), 0.0)) for s in (splats, again))
    assert np.allclose(found, true, rtol=1e-4, atol=1e-8)
    assert np.linalg.eigvalsh(again.covariances).min() > -1e-12


@pytest.mark.parametrize("count", [1, 16])
def test_the_layout_that_other_viewers_expect(count: int) -> None:
    harmonics = np.arange(2.0 * count * 3).reshape(2, count, 3)
    splats = GaussianSplats(np.eye(2, 3), np.tile(1e-4 * np.eye(3), (2, 1, 1)), harmonics, np.array([0.0, 1.0]))
    text, body = inria_bytes(splats).split(b"end_header\n")
    lines = text.decode().splitlines()
    assert lines[:3] == ["ply", "format binary_little_endian 1.0", "element vertex 2"]
    names = [line.removeprefix("property float ") for line in lines[3:]]
    rest = [f"f_rest_{k}" for k in range(3 * (count - 1))]
    assert names == ["x", "y", "z", "nx", "ny", "nz", *BASE[3:6], *rest, "opacity", *AXES]
    rows = dict(zip(names, np.frombuffer(body, "<f4").reshape(2, -1).T, strict=True))
    assert np.isfinite(np.stack(list(rows.values()))).all()
    assert not np.any([rows["nx"], rows["ny"], rows["nz"]])
    assert [rows[name][1] for name in rest] == harmonics[1, 1:].T.ravel().tolist()
    assert np.allclose(stack(rows, *AXES[:3]), np.log(0.01))
    assert np.allclose(np.linalg.norm(stack(rows, *AXES[3:]), axis=1), 1.0)
