"""Gaussian splats of .ksplat and .sog."""

from pathlib import Path

import numpy as np
import pytest
from fuzz.scans import ksplat_bytes, sog_bytes

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import GaussianSplats

POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (30, 3))
HARMONICS = (1, 4, 9, 16)


def _read(path: Path, content: bytes) -> GaussianSplats:
    path.write_bytes(content)
    splats = read_geometry(path)
    assert isinstance(splats, GaussianSplats)
    return splats


@pytest.mark.parametrize("level", range(3))
@pytest.mark.parametrize("degree", range(4))
def test_ksplat(tmp_path: Path, level: int, degree: int) -> None:
    splats = _read(tmp_path / "a.ksplat", ksplat_bytes(POINTS, level, degree))
    np.testing.assert_allclose(splats.points, POINTS, atol=1e-6 if level == 0 else 5e-5)
    np.testing.assert_allclose(splats.covariances, np.tile(0.01 * np.eye(3), (30, 1, 1)), rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(splats.colors, [[1, 0, 0]] * 30, atol=1e-6)
    assert splats.harmonics.shape == (30, HARMONICS[degree], 3)
    if degree:  # of the first degree red counts up from 1 hundredth, then green, then blue
        expected = np.arange(1, 10).reshape(3, 3).T / 100.0
        np.testing.assert_allclose(splats.harmonics[0, 1:4], expected, atol=1e-6 if level == 0 else 0.007)


def test_ksplat_refused(tmp_path: Path) -> None:
    data = ksplat_bytes(POINTS, 1)
    for changed, said in (
        (data[:-9], "expected 30 splats in a section, got fewer: truncated"),
        (data[:5000], "expected 1 headers of sections, got 5,000 bytes: truncated"),
        (data[:100], "expected a header of 4096 bytes"),
        (b"\2" + data[1:], "version 2.1 and level 1"),
        (data[:16] + b"\x40" + data[17:], "expected 64 splats, got 30"),
    ):
        with pytest.raises(InputError, match=said):
            _read(tmp_path / "a.ksplat", changed)


@pytest.mark.parametrize("bands", range(4))
def test_sog(tmp_path: Path, bands: int) -> None:
    splats = _read(tmp_path / "a.sog", sog_bytes(POINTS, bands))
    np.testing.assert_allclose(splats.points, POINTS, atol=1e-4)
    np.testing.assert_allclose(splats.covariances, np.tile(np.diag([0.04, 0.01, 0.01]), (30, 1, 1)), atol=4e-4)
    np.testing.assert_allclose(splats.colors, [[1, 0, 0]] * 30, atol=1e-6)
    np.testing.assert_allclose(splats.opacities, 128 / 255, atol=1e-6)
    assert splats.harmonics.shape == (30, HARMONICS[bands], 3)
    assert (splats.harmonics[:, 1:] == 0.25).all()


def test_sog_refused(tmp_path: Path) -> None:
    for content, said in (
        (sog_bytes(POINTS, version=1), "expected .sog of version 2, got 1"),
        (sog_bytes(POINTS, count=99), "expected 99 pixels, got 32"),
        (sog_bytes(POINTS, without="quats.webp"), "expected quats.webp in the archive"),
        (sog_bytes(POINTS)[:300], "expected a zip archive .*truncated"),
        (b"not one", "expected a zip archive"),
    ):
        with pytest.raises(InputError, match=said):
            _read(tmp_path / "a.sog", content)
