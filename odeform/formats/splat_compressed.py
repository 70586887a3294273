"""Gaussian splats as SuperSplat compresses them: 16 bytes each, relative to a chunk of 256, in a .ply.

https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/ply/. In older files colours have no
extent and are relative to [0, 1]. An element `sh` has one byte per further harmonic.
"""

import itertools
from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.ply import Table, columns
from odeform.formats.splat_inria import harmonic_columns
from odeform.geometry.ellipsoids import covariances_from_axes, with_fourth
from odeform.types import SH0, Floats, GaussianSplats, Harmonics, Points

__all__ = ["compressed_splats"]

CHUNK = 256
SPLAT_BYTES, HARMONIC_BYTES = 400, 24  # of memory while reading: a splat, and each of its further columns


def compressed_splats(tables: dict[str, Table], path: Path) -> GaussianSplats:
    """The elements vertex, chunk, and optionally sh -> splats. Raises `InputError` if they do not fit together."""
    table, chunks, sh = tables["vertex"], tables.get("chunk"), tables.get("sh")
    count = len(table)
    if chunks is None or len(chunks) * CHUNK < count:
        expected, got = -(-count // CHUNK), 0 if chunks is None else len(chunks)
        raise InputError(f"geometry {path}: expected {expected} chunks for {count} splats, got {got}")
    if sh is not None and len(sh) != count:
        raise InputError(f"geometry {path}: expected harmonics of {count} splats, got {len(sh)}")

    harmonics = len(sh.dtype.names or ()) if sh is not None else 0
    require_memory(f"geometry {path}", f"{count:,} splats", count * (SPLAT_BYTES + HARMONIC_BYTES * harmonics))

    def words(name: str) -> Table:
        if name not in (table.dtype.names or ()):
            raise InputError(f"geometry {path}: compressed splats without {name}")
        return table[name].astype(np.uint32)

    def denormalised(fractions: Points, names: str) -> Points:
        """Fractions of the extent of each chunk -> values."""
        low, high = (columns(chunks, [f"{end}_{name}" for name in names.split()], path) for end in ("min", "max"))
        low, high = (np.repeat(end, CHUNK, axis=0)[:count] for end in (low, high))
        return low * (1.0 - fractions) + high * fractions

    rgba = words("packed_color").astype(">u4").view("u1").reshape(-1, 4) / 255.0
    colors = denormalised(rgba[:, :3], "r g b") if "min_r" in (chunks.dtype.names or ()) else rgba[:, :3]
    harmonics = ((colors - 0.5) / SH0).astype(np.float32)[:, None]
    if sh is not None:
        harmonics = np.concatenate([harmonics, _further(sh, path)], axis=1)
    scales = np.exp(denormalised(_fractions(words("packed_scale")), "scale_x scale_y scale_z"))
    return GaussianSplats(
        denormalised(_fractions(words("packed_position")), "x y z").astype(np.float32),
        covariances_from_axes(scales, _quaternions(words("packed_rotation"))),
        harmonics,
        rgba[:, 3],
    )


def _further(sh: Table, path: Path) -> Harmonics:
    names = harmonic_columns(sh, path)
    level = columns(sh, list(itertools.chain(*names)), path)
    # the middle of each step, except that both ends are exact
    fraction = np.where(level == 0.0, 0.0, np.where(level == 255.0, 1.0, (level + 0.5) / 256.0))
    return (8.0 * (fraction - 0.5)).astype(np.float32).reshape(len(sh), len(names), 3)


def _fractions(packed: Table) -> Points:
    """(N,) words of 11, 10 and 11 bits -> (N, 3) in [0, 1]."""
    return np.stack([(packed >> 21) / 2047.0, (packed >> 11 & 1023) / 1023.0, (packed & 2047) / 2047.0], axis=1)


def _quaternions(packed: Table) -> Floats:
    """(N,) words of 2 bits for the index of the largest component and 10 for each other one -> (N, 4), w first."""
    others = np.stack([packed >> 20 & 1023, packed >> 10 & 1023, packed & 1023], axis=1)
    return with_fourth((others / 1023.0 - 0.5) * np.sqrt(2.0), packed >> 30)
