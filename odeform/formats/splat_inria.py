"""Gaussian splats as they are trained: one row of numbers each, in a .ply.

Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering" (2023), and their code's `save_ply`:
logarithmic scales, quaternion w first, logit of the opacity, all of red's harmonics before green's and blue's.
"""

import itertools
from math import isqrt
from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.ply import Table, columns
from odeform.formats.ply_mesh import channels
from odeform.geometry.ellipsoids import axes_from_covariances, covariances_from_axes
from odeform.types import SH0, Floats, GaussianSplats

__all__ = ["harmonic_columns", "inria_bytes", "inria_splats"]

POINT = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
SCALE = ("scale_0", "scale_1", "scale_2")
ROTATION = ("rot_0", "rot_1", "rot_2", "rot_3")
CONSTANT = ("f_dc_0", "f_dc_1", "f_dc_2")
SPLAT_BYTES, HARMONIC_BYTES = 240, 24  # of memory while reading: a splat, and each of its harmonics
MAX_DEGREE = 3  # of harmonics; no viewer shows more
MIN_SCALE = 2e-9  # viewers clip logarithms of scales at -20
MARGIN = 1e-7  # to opacities 0 and 1, whose logits are not finite


def inria_splats(table: Table, path: Path) -> GaussianSplats:
    """Reads the element vertex as splats; gray without colour. Raises `InputError` for missing columns.

    Splats of two scales are flat (Huang et al., "2D Gaussian Splatting for Geometrically Accurate Radiance Fields",
    2024). Red, green and blue, from 0 to 255, stand for the constant harmonic where there is none.
    """
    degrees = sum(name.startswith("f_rest_") for name in table.dtype.names or ()) // 3 + 1
    require_memory(f"geometry {path}", f"{len(table):,} splats", len(table) * (SPLAT_BYTES + HARMONIC_BYTES * degrees))
    notes = []
    if any(name in (table.dtype.names or ()) for name in CONSTANT):
        rest = harmonic_columns(table, path)
        kept = [CONSTANT, *rest][: (MAX_DEGREE + 1) ** 2]
        harmonics = columns(table, list(itertools.chain(*kept)), path).reshape(len(table), len(kept), 3)
        if len(rest) >= len(kept):
            notes.append(f"colour beyond degree {MAX_DEGREE} left out")
    elif (painted := channels({name: table[name] for name in table.dtype.names or ()})) is not None:
        harmonics = ((painted[:, None] / np.float32(255.0) - 0.5) / SH0).astype(np.float32)
    else:
        harmonics = np.zeros((len(table), 1, 3), np.float32)
        notes.append("without colour, shown gray")
    scales = np.exp(columns(table, SCALE[: 2 if _is_flat(table) else 3], path), dtype=float)
    if _is_flat(table):
        scales = np.pad(scales, ((0, 0), (0, 1)))
        notes.append("flat splats, of two scales")
    covariances = covariances_from_axes(scales, columns(table, ROTATION, path))
    opacities = 1.0 / (1.0 + np.exp(-columns(table, ["opacity"], path)[:, 0]))
    double = any(table.dtype[name].itemsize > 4 for name in POINT if name in (table.dtype.names or ()))
    points = np.stack([table[name] for name in POINT], axis=1) if double else columns(table, POINT, path)
    return GaussianSplats(points, covariances, harmonics, opacities, tuple(notes))


def _is_flat(table: Table) -> bool:
    names = table.dtype.names or ()
    return SCALE[1] in names and SCALE[2] not in names


def harmonic_columns(table: Table, path: Path) -> list[tuple[str, str, str]]:
    """Names of red, green and blue of each harmonic after the constant."""
    count = sum(name.startswith("f_rest_") for name in table.dtype.names or ())
    each = count // 3
    if count % 3 or isqrt(each + 1) ** 2 != each + 1:
        raise InputError(f"geometry {path}: expected 0, 9, 24 or 45 columns f_rest, got {count}")
    return [(f"f_rest_{k}", f"f_rest_{each + k}", f"f_rest_{2 * each + k}") for k in range(each)]


def inria_bytes(splats: GaussianSplats) -> bytes:
    """Encodes the .ply of splats, with float32 columns in the order of the original code."""
    count = len(splats.points)
    scales, quaternions = axes_from_covariances(splats.covariances)
    opacities = np.clip(splats.opacities, MARGIN, 1.0 - MARGIN, dtype=float)
    further = splats.harmonics[:, 1:].swapaxes(1, 2).reshape(count, 3 * (splats.harmonics.shape[1] - 1))
    names = [
        *POINT,
        *NORMAL,
        *CONSTANT,
        *(f"f_rest_{k}" for k in range(further.shape[1])),
        "opacity",
        *SCALE,
        *ROTATION,
    ]
    parts: list[Floats] = [
        *(splats.points, np.zeros((count, 3)), splats.harmonics[:, 0], further),
        *(np.log(opacities / (1.0 - opacities))[:, None], np.log(np.maximum(scales, MIN_SCALE)), quaternions),
    ]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [*(f"property float {name}" for name in names), "end_header", ""]
    return "\n".join(header).encode() + np.concatenate(parts, axis=1, dtype="<f4", casting="same_kind").tobytes()
