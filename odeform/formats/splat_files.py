"""Gaussian splats from any file that holds them, in the axes of the file: for captures x right, y down, z forward."""

from pathlib import Path

import numpy as np

from odeform.errors import InputError
from odeform.formats.ply import ply_properties, read_ply_tables
from odeform.formats.splat_compressed import compressed_splats
from odeform.formats.splat_inria import inria_splats
from odeform.formats.splat_spz import spz_splats
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.types import SH0, GaussianSplats

__all__ = ["holds_splats", "read_splats"]

SPLAT = np.dtype([("xyz", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rot", "u1", 4)])


def holds_splats(path: Path) -> bool:
    """By the name of the file, and for a .ply by what its points have."""
    suffix = path.suffix.lower()
    return suffix in (".splat", ".spz") or (
        suffix == ".ply" and bool(ply_properties(path) & {"f_dc_0", "rot_0", "packed_position"})
    )


def read_splats(path: Path) -> GaussianSplats:
    """A .ply as trained or compressed, a .splat, or a .spz. Numbers that make no sense pass; the caller counts them."""
    suffix = path.suffix.lower()
    if suffix == ".spz":
        return spz_splats(path.read_bytes(), path)
    if suffix == ".splat":
        return _antimatter(path.read_bytes(), path)
    tables = read_ply_tables(path)
    if "vertex" not in tables:
        raise InputError(f"geometry {path}: expected an element vertex of numbers, got {', '.join(tables) or 'none'}")
    if "packed_position" in (tables["vertex"].dtype.names or ()):
        return compressed_splats(tables, path)
    return inria_splats(tables["vertex"], path)


def _antimatter(data: bytes, path: Path) -> GaussianSplats:
    """The 32 bytes a splat of https://github.com/antimatter15/splat: one colour, linear scales, turns in bytes."""
    if len(data) % SPLAT.itemsize:
        raise InputError(f"geometry {path}: expected 32 bytes a splat, got {len(data)} bytes")
    raw = np.frombuffer(data, dtype=SPLAT)
    rgba = raw["rgba"] / np.float32(255.0)
    harmonics = ((rgba[:, None, :3] - 0.5) / SH0).astype(np.float32)
    covariances = covariances_from_axes(raw["scale"], raw["rot"] - 128.0)
    return GaussianSplats(raw["xyz"].copy(), covariances, harmonics, rgba[:, 3])
