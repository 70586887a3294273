import gzip
import struct
from pathlib import Path

import numpy as np
import pytest
import zstandard

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.geometry.harmonics import harmonic_basis
from odeform.types import SH0, GaussianSplats

COUNT = 60
FLIP = np.array([1.0, -1.0, -1.0])  # x right, y up, z backward, as the format has it


class Capture:
    """Splats in the axes of the format, and the bytes that Niantic's code would make of them."""

    def __init__(self, degree: int = 0, count: int = COUNT) -> None:
        rng = np.random.default_rng(degree)
        self.points = rng.uniform(-9.0, 9.0, (count, 3))
        self.scales = rng.uniform(-8.0, 3.0, (count, 3))
        turns = rng.normal(size=(count, 4))
        self.turns = turns / np.linalg.norm(turns, axis=1, keepdims=True)
        self.colors = rng.uniform(-1.0, 1.0, (count, 3))
        self.opacities = rng.uniform(size=count)
        self.further = rng.uniform(-0.99, 0.99, (count, (degree + 1) ** 2 - 1, 3))
        self.degree, self.count = degree, count

    def attributes(self, version: int, fraction: int) -> list[bytes]:
        if version == 1:
            position = self.points.astype("<f2").tobytes()
        else:
            fixed = np.round(self.points * 2**fraction).astype("<i4")
            position = fixed.view("u1").reshape(-1, 3, 4)[:, :, :3].tobytes()
        xyzw = np.roll(self.turns, -1, axis=1)
        turn = first_three(xyzw) if version < 3 else smallest_three(xyzw)
        levels = (255.0 * self.opacities, 255.0 * (0.15 * self.colors + 0.5), 16.0 * (self.scales + 10.0))
        further = np.clip(np.round(128.0 * self.further + 128.0), 0, 255).astype("u1").tobytes()
        return [position, *(np.round(level).astype("u1").tobytes() for level in levels), turn, further]

    def encoded(
        self, version: int, packed: bool = True, fraction: int = 12, flags: int = 0, more: bytes = b""
    ) -> bytes:
        attributes = self.attributes(version, fraction)
        head = struct.pack("<4sIIBBB", b"NGSP", version, self.count, self.degree, fraction, flags)
        if version < 4:
            data = head + b"\0" + b"".join(attributes) + more
            return gzip.compress(data) if packed else data
        streams = [(zstandard.compress(part), len(part)) for part in attributes if part]
        table = b"".join(struct.pack("<QQ", len(stream), size) for stream, size in streams)
        head += struct.pack("<BI12x", len(streams), 32 + len(more)) + more
        return head + table + b"".join(stream for stream, _ in streams)


def first_three(xyzw: np.ndarray) -> bytes:
    xyz = xyzw[:, :3] * np.sign(xyzw[:, 3:])
    return np.round(127.5 * xyz + 127.5).astype("u1").tobytes()


def smallest_three(xyzw: np.ndarray) -> bytes:
    out = []
    for row in xyzw:
        place = int(np.abs(row).argmax())
        word = place
        for value in np.delete(row * np.sign(row[place]), place):
            word = word << 10 | (value < 0) << 9 | int(511 * abs(value) * np.sqrt(2.0) + 0.5)
        out.append(word)
    return np.array(out, "<u4").tobytes()


def read(tmp_path: Path, data: bytes) -> GaussianSplats:
    (tmp_path / "a.spz").write_bytes(data)
    splats = read_geometry(tmp_path / "a.spz")
    assert isinstance(splats, GaussianSplats)
    return splats


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize(("version", "packed"), [(1, True), (2, True), (2, False), (3, True), (3, False), (4, True)])
def test_reads_what_was_packed(tmp_path: Path, version: int, packed: bool, degree: int) -> None:
    capture = Capture(degree)
    splats = read(tmp_path, capture.encoded(version, packed))
    assert splats.notes == ()
    assert np.abs(splats.points - FLIP * capture.points).max() < (5e-3 if version == 1 else 0.51 / 4096)
    assert np.abs(splats.opacities - capture.opacities).max() < 0.51 / 255
    assert np.abs(splats.colors - np.clip(0.5 + SH0 * capture.colors, 0.0, 1.0)).max() < 0.51 * SH0 / 0.15 / 255
    mirror = np.diag(FLIP)
    true = mirror @ covariances_from_axes(np.exp(capture.scales), capture.turns) @ mirror
    error = np.abs(splats.covariances - true).max(axis=(1, 2)) / np.abs(true).max(axis=(1, 2))
    assert error.max() < (0.2 if version < 3 else 0.08)
    # each splat looks from a direction as it did from that direction in the other axes
    coefficients = np.concatenate([capture.colors[:, None], capture.further], axis=1)
    seen = np.random.default_rng(0).normal(size=(20, 3))
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    looks = harmonic_basis(seen, degree) @ splats.harmonics
    assert np.abs(looks - harmonic_basis(seen * FLIP, degree) @ coefficients).max() < 0.06


@pytest.mark.parametrize("version", [2, 3, 4])
@pytest.mark.parametrize("fraction", [0, 8, 19])
def test_bits_of_a_fraction(tmp_path: Path, version: int, fraction: int) -> None:
    capture = Capture()
    splats = read(tmp_path, capture.encoded(version, fraction=fraction))
    assert np.abs(splats.points - FLIP * capture.points).max() < 0.51 / 2**fraction


def test_what_is_beyond_us_is_told(tmp_path: Path) -> None:
    splats = read(tmp_path, Capture(4).encoded(4))
    assert splats.harmonics.shape == (COUNT, 16, 3)
    assert "degree 3" in splats.notes[0]
    record = struct.pack("<III", 0xADBE0001, 4, 7)
    for version in (3, 4):
        splats = read(tmp_path, Capture(1).encoded(version, flags=2, more=record))
        assert np.abs(splats.points - FLIP * Capture(1).points).max() < 1e-3
        assert "extensions" in splats.notes[0]


@pytest.mark.parametrize("version", [3, 4])
def test_many_alike(tmp_path: Path, version: int) -> None:
    """A stream that packs to almost nothing is read to its end."""
    capture = Capture(3, 3000)
    for values in (capture.points, capture.scales, capture.turns, capture.colors, capture.opacities, capture.further):
        values[1:] = values[0]
    capture.points[0] += 1.0
    assert len(read(tmp_path, capture.encoded(version)).points) == 3000


def faults() -> dict[str, tuple[bytes, str]]:
    whole = Capture(1)
    raw, four = whole.encoded(3, packed=False), whole.encoded(4)
    crowd = struct.pack("<4sIIBBBB", b"NGSP", 3, 2**32 - 1, 3, 12, 0, 0)
    sized = bytearray(four)
    struct.pack_into("<Q", sized, 40, 7)
    return {
        "empty": (b"", "empty file"),
        "another file": (b"solid x" * 9, "NGSP"),
        "gzip of another file": (gzip.compress(b"solid x" * 9), "NGSP"),
        "raw, truncated": (raw[:-1], f"expected {len(raw) - 16} bytes of 60 splats, got {len(raw) - 17}"),
        "gzip, truncated": (whole.encoded(3)[:-400], "of 60 splats"),
        "gzip, damaged": (whole.encoded(3)[:40] + b"\xff" * 400, "spz"),
        "header alone": (raw[:16], "hold 60 splats|of 60 splats"),
        "version 0": (raw[:4] + b"\0" + raw[5:], "version 1 to 4"),
        "version 5": (raw[:4] + b"\5" + raw[5:], "version 1 to 4, got 5"),
        "degree 5": (raw[:12] + b"\5" + raw[13:], "degree 5"),
        "bits": (raw[:13] + b"\x20" + raw[14:], "32 bits"),
        "more splats than bytes": (crowd + bytes(100), "cannot hold 4294967295 splats"),
        "more splats than gzip": (gzip.compress(crowd + bytes(100)), "cannot hold 4294967295 splats"),
        "no splats": (Capture(1, 0).encoded(3), "at least 2 points, got 0"),
        "no splats, 4": (Capture(1, 0).encoded(4), "at least 2 points, got 0"),
        "4, truncated": (four[:-9], "stream|spz"),
        "4, header alone": (four[:32], "stream table"),
        "4, streams": (four[:15] + b"\3" + four[16:], "expected 6 streams of .spz, got 3"),
        "4, table before the header's end": (four[:16] + b"\4" + four[17:], "stream table"),
        "4, a size that differs": (bytes(sized), "stream 1"),
        "4, damaged": (four[:140] + b"\xff" * 200 + four[340:], "spz"),
    }


FAULTS = faults()


@pytest.mark.parametrize("fault", FAULTS)
def test_refuses(tmp_path: Path, fault: str) -> None:
    data, said = FAULTS[fault]
    with pytest.raises(InputError, match=said):
        read(tmp_path, data)
