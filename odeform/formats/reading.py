"""Reading geometries. Every file is validated here, once; anything wrong with it raises `InputError`."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError, one_line
from odeform.formats.foreign import require_content, unread
from odeform.formats.merging import centred, merged
from odeform.formats.registry import READERS, load_function
from odeform.geometry.parts import subset
from odeform.types import GaussianSplats, Geometry, Mesh

__all__ = ["read_geometry"]

HEAD = 512  # bytes that tell what a file is
EXTENT = (1e-15, 1e15)
"""Bounds the size of a shape in the units of its file. Squares of lengths, and their inverses, are then numbers of
single precision."""


def read_geometry(path: str | Path, merge: bool = True) -> Geometry:
    """Read a mesh, a point cloud or Gaussian splats, in the units and axes of the file.

    `up` of the result says which axis points up, where the format does: y in glTF. What was left out is in `notes`.
    Points with the coordinates of a map, which single precision would round, are relative to `offset`; without
    `merge` they stay as they are, in double precision.

    The suffix selects the format (`odeform.formats.registry.READERS`); a `.ply` may hold any of the three. Vertices of
    a mesh that coincide become one unless `merge` is false, which keeps the vertices and their order as in the file, so
    that they correspond between frames. Splats with values that are not finite are left out, and `notes` say so.

    Args:
        path: The file.
        merge: Whether coinciding vertices of a mesh become one.

    Returns:
        A `Mesh`, `PointCloud` or `GaussianSplats` of N points.

    Raises:
        InputError: A missing, damaged or unknown file, or one without extent.

    Examples:
        >>> import odeform
        >>> odeform.write_shape(odeform.load("kick").rest, "ball.ply")
        >>> ball = odeform.read_geometry("ball.ply")
        >>> ball.points.shape, ball.faces.shape
        ((2306, 3), (4608, 3))
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"geometry {path}: no such file")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        other = unread(suffix)
        raise InputError(
            f"geometry {path}: {other}"
            if other
            else f"geometry {path}: expected one of {', '.join(READERS)}, got {suffix or 'no ending'}"
        )
    try:
        with path.open("rb") as file:
            require_content(file.read(HEAD), suffix, f"geometry {path}")
        # values that are not finite are counted below; warnings of parsers are about files that are refused or fine
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            geometry: Geometry = load_function(READERS[suffix].read)(path, merge)
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"geometry {path}: cannot be read as {suffix}: it takes too much memory") from None
    except OSError as error:
        raise InputError(f"geometry {path}: cannot be read: {error.strerror or error}") from None
    except Exception as error:
        # parsers of libraries raise anything on a broken file
        said = one_line(error) or "no reason given"
        raise InputError(
            f"geometry {path}: cannot be read as {suffix}, damaged? {type(error).__name__}: {said}"
        ) from None
    return _prepared(_validated(geometry, path), merge)


def _prepared(geometry: Geometry, merge: bool) -> Geometry:
    """Single precision, after large coordinates are made small and vertices merged.

    Frames of a sequence share one origin: where single precision would round their coordinates, they stay double.
    """
    near = centred(geometry)
    if not merge:
        return geometry if near is not geometry else _single(geometry)
    return _single(merged(near) if isinstance(near, Mesh) else near)


def _single(geometry: Geometry) -> Geometry:
    points = np.ascontiguousarray(geometry.points, dtype=np.float32)
    if isinstance(geometry, Mesh):
        return replace(geometry, points=points, faces=np.ascontiguousarray(geometry.faces, dtype=np.int32))
    return replace(geometry, points=points)


def _validated(geometry: Geometry, path: Path) -> Geometry:
    count = len(geometry.points)
    broken = _broken(geometry)
    bad = int(broken.sum())
    # training leaves a few broken splats among a million; in a mesh or a scan every point is meant
    if isinstance(geometry, GaussianSplats) and 0 < bad <= count // 2:
        note = f"{bad} of {count} splats left out, not finite"
        geometry = replace(subset(geometry, ~broken), notes=(*geometry.notes, note))
    elif bad:
        raise InputError(f"geometry {path}: {bad} of {count} points are not finite")
    points = geometry.points
    if len(points) < 2:
        raise InputError(f"geometry {path}: expected at least 2 points, got {len(points)}")
    extent = float(max(np.ptp(column.astype(float)) for column in points.T))
    if extent <= 0.0:
        raise InputError(f"geometry {path}: all {len(points)} points coincide")
    if not EXTENT[0] <= extent <= np.abs(points).max(initial=extent) <= EXTENT[1]:
        raise InputError(
            f"geometry {path}: expected an extent and coordinates from {EXTENT[0]:g} to {EXTENT[1]:g}, "
            f"got an extent of {extent:.3g} and coordinates up to {np.abs(points).max():.3g}"
        )
    if isinstance(geometry, Mesh):
        if len(geometry.faces) == 0:
            raise InputError(f"geometry {path}: a mesh without faces")
        if geometry.faces.min() < 0 or geometry.faces.max() >= len(points):
            raise InputError(f"geometry {path}: faces refer to vertices that do not exist")
    return geometry


def _broken(geometry: Geometry) -> NDArray[np.bool_]:
    """(N,) points with a value that is not finite in float32, which viewers use."""
    parts = [geometry.points]
    if isinstance(geometry, GaussianSplats):
        parts += [geometry.covariances, geometry.harmonics, geometry.opacities]
    broken = np.zeros(len(geometry.points), dtype=bool)
    with np.errstate(over="ignore", invalid="ignore"):
        for part in parts:
            finite = np.isfinite(part.astype(np.float32, copy=False))
            broken |= ~finite.all(axis=tuple(range(1, part.ndim)))
    return broken
