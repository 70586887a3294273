"""Scans in the formats of programs: .pcd, .las and .laz."""

import struct
from pathlib import Path

import numpy as np
import pytest
from fuzz.scans import las_bytes, lzf_literals, pcd_bytes

from odeform.errors import InputError
from odeform.formats.lzf import decompressed
from odeform.formats.reading import read_geometry
from odeform.types import PointCloud

POINTS = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
COLORS = np.random.default_rng(1).integers(0, 256, (50, 3)).astype(np.uint8)
KINDS = ("ascii", "binary", "binary_compressed")


def _read(path: Path, content: bytes) -> PointCloud:
    path.write_bytes(content)
    cloud = read_geometry(path)
    assert isinstance(cloud, PointCloud)
    return cloud


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("colors", [None, COLORS])
def test_pcd(tmp_path: Path, kind: str, colors: np.ndarray | None) -> None:
    cloud = _read(tmp_path / "a.pcd", pcd_bytes(POINTS, colors, kind))
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert (cloud.colors is None) == (colors is None)
    if cloud.colors is not None:
        np.testing.assert_array_equal(cloud.colors, COLORS)
    assert cloud.notes == ()


@pytest.mark.parametrize("kind", KINDS)
def test_points_of_a_depth_image_that_are_nowhere_are_left_out(tmp_path: Path, kind: str) -> None:
    points = POINTS.copy()
    points[::5] = np.nan
    cloud = _read(tmp_path / "a.pcd", pcd_bytes(points, COLORS, kind))
    assert len(cloud.points) == 40
    assert cloud.colors is not None
    np.testing.assert_array_equal(cloud.colors[:4], COLORS[1:5])
    assert cloud.notes == ("10 of 50 points left out, not finite",)


def test_colors_as_whole_numbers_and_further_fields(tmp_path: Path) -> None:
    text = (
        "VERSION .7\nFIELDS x y z rgb normal _\nSIZE 8 4 4 4 4 1\nTYPE F F F U F U\nCOUNT 1 1 1 1 3 2\nWIDTH 2\n"
        "HEIGHT 1\nPOINTS 2\nDATA ascii\n0.5 0 0 16711935 0 0 1 9 9\n1 1 1 255 0 0 1 9 9\n"
    )
    cloud = _read(tmp_path / "a.pcd", text.encode())
    assert cloud.colors is not None
    assert cloud.colors.tolist() == [[255, 0, 255], [0, 0, 255]]
    assert cloud.notes == ("normal of the points left out",)


@pytest.mark.parametrize("kind", KINDS)
def test_a_pcd_that_is_cut_short(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InputError, match=r"expected (50 points|3 numbers of a point|\d+ compressed bytes), got .*"):
        _read(tmp_path / "a.pcd", pcd_bytes(POINTS, None, kind)[:-20])


def test_other_headers_are_refused(tmp_path: Path) -> None:
    data = pcd_bytes(POINTS)
    for changed, said in (
        (data.replace(b"FIELDS x y z", b"FIELDS u v w"), "expected fields x, y and z and data ascii, binary"),
        (data.replace(b"SIZE 4 4 4", b"SIZE 4 4"), "expected FIELDS, SIZE, TYPE, COUNT, POINTS and DATA that agree"),
        (data.replace(b"TYPE F", b"TYPE Q"), "expected FIELDS, SIZE, TYPE"),
        (data.partition(b"DATA")[0], "a header of .pcd that ends in a line DATA"),
    ):
        with pytest.raises(InputError, match=said):
            _read(tmp_path / "a.pcd", changed)


def test_lzf_repeats_what_it_has_unpacked() -> None:
    """Two control bytes: three letters, then nine more from three letters back, which overlap with themselves."""
    assert decompressed(b"\x02abc" + bytes([7 << 5, 0, 2]), 12, "file") == b"abc" * 4
    assert decompressed(b"\x02abc" + bytes([2 << 5, 2]), 7, "file") == b"abcabca"
    assert decompressed(lzf_literals(bytes(range(100))), 100, "file") == bytes(range(100))
    for packed, size in ((b"\x02abc" + bytes([1 << 5, 9]), 6), (b"\x02ab", 3), (b"\x02abc", 4), (b"\xff", 9)):
        with pytest.raises(InputError, match="file: "):
            decompressed(packed, size, "file")


@pytest.mark.parametrize("compressed", [False, True])
def test_laser_scans_on_a_map(tmp_path: Path, compressed: bool) -> None:
    """Millimetres survive coordinates of millions of metres; a note says where the points were."""
    there = POINTS.astype(float) + np.array([500_000.0, 5_400_000.0, 300.0])
    path = tmp_path / ("a.laz" if compressed else "a.las")
    cloud = _read(path, las_bytes(there, COLORS, compressed))
    np.testing.assert_allclose(cloud.points.astype(float) + cloud.offset, there, atol=6e-4)
    assert cloud.points.dtype == np.float32
    assert cloud.notes[0].startswith("positions are relative to (")
    assert cloud.colors is not None
    np.testing.assert_array_equal(cloud.colors, COLORS)


@pytest.mark.parametrize("compressed", [False, True])
def test_a_laser_scan_that_is_cut_short(tmp_path: Path, compressed: bool) -> None:
    data = las_bytes(POINTS, COLORS, compressed)
    last = "a table of chunks" if compressed else f"{len(POINTS)} points, got {len(POINTS) - 1}: truncated"
    for stop, said in ((100, "a header of 227 bytes, got 100"), (300, "truncated"), (len(data) - 9, last)):
        with pytest.raises(InputError, match=said):
            _read(tmp_path / ("a.laz" if compressed else "a.las"), data[:stop])


def test_another_file_is_no_laser_scan(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected a file that starts with LASF, got b'PDF-'"):
        _read(tmp_path / "a.las", b"PDF-1.4" + bytes(300))


def test_compressed_points_of_another_size_are_refused_in_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    data = las_bytes(POINTS, COLORS, True)
    parts = struct.pack("<HHHHHHH", 2, 6, 20, 2, 8, 6, 2)
    assert data.count(parts) == 1
    with pytest.raises(InputError, match="expected compressed points of 26 bytes, got 31: damaged"):
        _read(tmp_path / "a.laz", data.replace(parts, struct.pack("<HHHHHHH", 2, 6, 25, 2, 8, 6, 2)))
    assert capfd.readouterr().err == ""


def test_a_table_of_chunks_that_claims_everything(tmp_path: Path) -> None:
    data = bytearray(las_bytes(POINTS, COLORS, True))
    start = int.from_bytes(data[96:100], "little")
    table = int.from_bytes(data[start : start + 8], "little")
    data[table + 4 : table + 8] = b"\xff\xff\xff\x7f"
    with pytest.raises(InputError, match="cannot hold 2,147,483,647 compressed chunks"):
        _read(tmp_path / "a.laz", bytes(data))
