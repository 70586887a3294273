"""Reading geometries. Every file is validated here, once; anything wrong with it raises `InputError`."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.registry import READERS, load_function
from odeform.geometry.parts import subset
from odeform.types import GaussianSplats, Geometry, Mesh

__all__ = ["read_geometry"]

EXTENT = (1e-15, 1e15)
"""Of a shape in the units of its file. Squares of lengths, and their inverses, are then numbers of single precision."""


def read_geometry(path: str | Path, merge: bool = True) -> Geometry:
    """Read a mesh, a point cloud or Gaussian splats, in the units and axes of the file.

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
        raise InputError(f"geometry {path}: expected one of {', '.join(READERS)}, got {suffix or 'no ending'}")
    try:
        # values that are not finite are counted below; warnings of parsers are about files that are refused or fine
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            geometry: Geometry = load_function(READERS[suffix].read)(path, merge)
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"geometry {path}: cannot be read as {suffix}: it takes too much memory") from None
    except Exception as error:
        # parsers raise anything on a broken file
        raise InputError(f"geometry {path}: cannot be read as {suffix}: {error}") from None
    return _validated(geometry, path)


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
    extent = float(np.ptp(points.astype(float), axis=0).max())
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
