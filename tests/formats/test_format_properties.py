"""Formats of splats and meshes: what is written is read, and any bytes at all are either read or refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import PROPERTY

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.formats.registry import READERS
from odeform.formats.splat_inria import inria_bytes
from odeform.formats.splat_spz import spz_bytes
from odeform.formats.writing import write_shape
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.types import GaussianSplats, Geometry

SEEDS = st.integers(0, 2**32 - 1)
MAGIC = {
    ".ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float rot_0\nend_header\n",
    ".spz": b"NGSP\x03\x00\x00\x00\x02\x00\x00\x00\x00\x0c\x00\x00",
    ".glb": b"glTF\x02\x00\x00\x00",
    ".off": b"OFF\n3 1 0\n",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("formats")


def drawn(seed: int, degree: int) -> GaussianSplats:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 20))
    covariances = covariances_from_axes(np.exp(rng.uniform(-6.0, 1.0, (count, 3))), rng.normal(size=(count, 4)))
    harmonics = rng.uniform(-1.0, 1.0, (count, (degree + 1) ** 2, 3)).astype(np.float32)
    points = rng.uniform(-9.0, 9.0, (count, 3)).astype(np.float32)
    return GaussianSplats(points, covariances, harmonics, rng.uniform(0.01, 0.99, count))


def read(path: Path) -> GaussianSplats:
    splats = read_geometry(path)
    assert isinstance(splats, GaussianSplats)
    return splats


def read_or_refused(path: Path) -> Geometry | None:
    """None where the file was refused, in one line that names it; any other error is a failure."""
    try:
        return read_geometry(path)
    except InputError as error:
        said = str(error)
    assert path.name in said
    assert "\n" not in said
    return None


@PROPERTY
@given(SEEDS, st.integers(0, 3))
def test_ply_round_trip(folder: Path, seed: int, degree: int) -> None:
    splats = drawn(seed, degree)
    write_shape(splats, folder / "a.ply")
    again = read(folder / "a.ply")
    assert np.array_equal(again.points, splats.points)
    assert np.array_equal(again.harmonics, splats.harmonics)
    np.testing.assert_allclose(again.opacities, splats.opacities, atol=1e-6)
    np.testing.assert_allclose(again.covariances, splats.covariances, rtol=1e-4, atol=1e-5)


@PROPERTY
@given(SEEDS)
def test_spz_round_trip(folder: Path, seed: int) -> None:
    """Within the steps of the format: 2^-12 of a unit, 1/255, and 1/16 of a logarithm."""
    splats = drawn(seed, 0)
    (folder / "a.spz").write_bytes(spz_bytes(splats))
    again = read(folder / "a.spz")
    np.testing.assert_allclose(again.points, splats.points, atol=0.5 * 2.0**-12 + 1e-6)
    np.testing.assert_allclose(again.opacities, splats.opacities, atol=0.5 / 255.0 + 1e-6)
    np.testing.assert_allclose(again.harmonics, splats.harmonics, atol=0.5 / 255.0 / 0.15 + 1e-6)
    size = np.trace(splats.covariances, axis1=1, axis2=2)
    np.testing.assert_allclose(np.trace(again.covariances, axis1=1, axis2=2), size, rtol=0.07)


@pytest.mark.parametrize("suffix", READERS)
@PROPERTY
@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_read_or_refused(folder: Path, suffix: str, content: bytes, headed: bool) -> None:
    path = folder / f"any{suffix}"
    path.write_bytes((MAGIC.get(suffix, b"") if headed else b"") + content)
    geometry = read_or_refused(path)
    assert geometry is None or np.isfinite(geometry.points).all()


@PROPERTY
@given(SEEDS, st.integers(0, 2**16), st.integers(0, 7))
def test_a_flipped_bit_is_read_or_refused(folder: Path, seed: int, at: int, bit: int) -> None:
    for name, whole in (("flipped.ply", inria_bytes(drawn(seed, 1))), ("flipped.spz", spz_bytes(drawn(seed, 0)))):
        data = bytearray(whole)
        data[at % len(data)] ^= 1 << bit
        (folder / name).write_bytes(data)
        geometry = read_or_refused(folder / name)
        assert geometry is None or np.isfinite(geometry.points).all()
