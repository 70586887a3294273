"""Gaussian splats in glTF: KHR_gaussian_splatting, with one attribute for each property of a splat.

https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting
"""

import numpy as np

from odeform.errors import InputError
from odeform.formats.gltf.accessors import read_floats
from odeform.formats.gltf.document import Document, Tree
from odeform.formats.gltf.primitives import attributes_of
from odeform.geometry.ellipsoids import covariances_from_axes
from odeform.geometry.harmonics import rotated_harmonics
from odeform.types import Floats, GaussianSplats

__all__ = ["EXTENSION", "joined", "read_splats"]

EXTENSION = "KHR_gaussian_splatting"
MAX_DEGREE = 3


def read_splats(document: Document, primitive: Tree, matrix: Floats) -> GaussianSplats:
    """The splats of a primitive, placed by `matrix` (4, 4). Raises `InputError` where properties are missing."""
    attributes = attributes_of(document, primitive)
    used = document.extension(primitive, EXTENSION) or {}
    if used.get("extensions"):
        raise InputError(
            f"{document.where}: splats of {EXTENSION}, compressed by {', '.join(map(str, used['extensions']))[:100]}, "
            "which is not read: convert them to .ply or .spz"
        )
    missing = [name for name in ("ROTATION", "SCALE", "OPACITY") if f"{EXTENSION}:{name}" not in attributes]
    if missing:
        raise InputError(f"{document.where}: splats of {EXTENSION} without {', '.join(missing)}")
    points = read_floats(document, attributes["POSITION"], 3)
    count = len(points)
    turns = read_floats(document, attributes[f"{EXTENSION}:ROTATION"], 4, count)
    scales = read_floats(document, attributes[f"{EXTENSION}:SCALE"], 3, count)
    if (scales < 0.0).any():
        raise InputError(
            f"{document.where}: splats of {EXTENSION}: expected scales of at least 0, got {scales.min():g}"
        )
    if str(used.get("colorSpace", "")).startswith("lin_"):
        document.note("colors without gamma, shown as if they had one")
    linear = matrix[:3, :3]
    turn, _, other = np.linalg.svd(linear)
    turn = turn @ other
    harmonics = _harmonics(document, attributes, count)
    return GaussianSplats(
        points @ linear.T + matrix[:3, 3],
        linear @ covariances_from_axes(scales, np.roll(turns, 1, axis=1)) @ linear.T,
        harmonics if np.allclose(turn, np.eye(3), atol=1e-9) else rotated_harmonics(harmonics, turn),
        read_floats(document, attributes[f"{EXTENSION}:OPACITY"], 1, count)[:, 0],
    )


def _harmonics(document: Document, attributes: Tree, count: int) -> Floats:
    """(N, H, 3) coefficients up to the last complete degree; gray without any, with a note."""
    found: list[Floats] = []
    for degree in range(MAX_DEGREE + 1):
        names = [f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{n}" for n in range(2 * degree + 1)]
        if not all(name in attributes for name in names):
            break
        found += [read_floats(document, attributes[name], 3, count) for name in names]
    if not found:
        document.note("without colour, shown gray")
        return np.zeros((count, 1, 3), np.float32)
    return np.stack(found, axis=1).astype(np.float32)


def joined(parts: list[GaussianSplats]) -> GaussianSplats:
    """All splats, with as many harmonics as those with the most have."""
    most = max(part.harmonics.shape[1] for part in parts)
    harmonics = [np.pad(part.harmonics, ((0, 0), (0, most - part.harmonics.shape[1]), (0, 0))) for part in parts]
    return GaussianSplats(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.covariances for part in parts]),
        np.concatenate(harmonics),
        np.concatenate([part.opacities for part in parts]),
    )
