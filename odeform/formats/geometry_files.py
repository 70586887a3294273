"""Reading shapes from files. Every file is validated here, once; anything wrong raises `InputError`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.splat_files import holds_splats, read_splats
from odeform.geometry.parts import subset
from odeform.types import GaussianSplats, Geometry, Mesh, PointCloud

__all__ = ["read_geometry"]

AS_WRITTEN: dict[str, Any] = {
    ".obj": {"maintain_order": True, "skip_materials": True},
    ".ply": {"fix_texture": False, "skip_materials": True},
}
"""How readers are kept from splitting vertices where texture coordinates differ."""
MESHES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")


def read_geometry(path: str | Path, merge: bool = True) -> Geometry:
    """A mesh (.obj .ply .stl .glb .off), points (.ply .xyz), or Gaussian splats (.ply .splat .spz).

    Vertices of a mesh at one place are merged, so that it is no loose triangles; without `merge` they are as in the
    file, one by one and in its order, so that those of one frame are those of another.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"geometry {path}: no such file")
    suffix = path.suffix.lower()
    try:
        if holds_splats(path):
            with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is counted below
                geometry: Geometry = read_splats(path)
        elif suffix == ".xyz":
            geometry = PointCloud(np.loadtxt(path, ndmin=2)[:, [0, 1, 2]])
        elif suffix in MESHES:
            geometry = _from_trimesh(path, merge)
        else:
            expected = ", ".join([*MESHES, ".splat", ".spz", ".xyz"])
            raise InputError(f"geometry {path}: expected one of {expected}, got {suffix or 'no ending'}")
    except InputError:
        raise
    except Exception as error:
        # the parsers behind this raise whatever a broken file makes them trip over
        raise InputError(f"geometry {path}: cannot be read as {suffix}: {error}") from None
    return _validated(geometry, path)


def _validated(geometry: Geometry, path: Path) -> Geometry:
    count = len(geometry.points)
    broken = _broken(geometry)
    bad = int(broken.sum())
    # a capture of a million splats has a few that training lost; of a mesh or a scan every point is meant
    if isinstance(geometry, GaussianSplats) and 0 < bad <= count // 2:
        note = f"{bad} of {count} splats left out, not finite"
        geometry = replace(subset(geometry, ~broken), notes=(*geometry.notes, note))
    elif bad:
        raise InputError(f"geometry {path}: {bad} of {count} points are not finite")
    points = geometry.points
    if len(points) < 2:
        raise InputError(f"geometry {path}: expected at least 2 points, got {len(points)}")
    if np.ptp(points, axis=0).max() <= 0.0:
        raise InputError(f"geometry {path}: all {len(points)} points coincide")
    if isinstance(geometry, Mesh):
        if len(geometry.faces) == 0:
            raise InputError(f"geometry {path}: a mesh without faces")
        if geometry.faces.min() < 0 or geometry.faces.max() >= len(points):
            raise InputError(f"geometry {path}: faces refer to vertices that do not exist")
    return geometry


def _broken(geometry: Geometry) -> NDArray[np.bool_]:
    """(N,) points with a number that is not finite in the float32 that viewers take."""
    parts = [geometry.points]
    if isinstance(geometry, GaussianSplats):
        parts += [geometry.covariances, geometry.harmonics, geometry.opacities]
    broken = np.zeros(len(geometry.points), dtype=bool)
    with np.errstate(over="ignore", invalid="ignore"):
        for part in parts:
            finite = np.isfinite(part.astype(np.float32, copy=False))
            broken |= ~finite.all(axis=tuple(range(1, part.ndim)))
    return broken


def _from_trimesh(path: Path, merge: bool) -> Geometry:
    loaded: Any = trimesh.load(path, process=False, **({} if merge else AS_WRITTEN.get(path.suffix.lower(), {})))
    if isinstance(loaded, trimesh.Scene):
        if not loaded.geometry:
            raise InputError(f"geometry {path}: contains no mesh")
        loaded = loaded.to_geometry()
    if isinstance(loaded, trimesh.PointCloud):
        return PointCloud(np.asarray(loaded.vertices, dtype=np.float32))
    if merge and np.isfinite(loaded.vertices).all():  # else it is refused below, by number
        loaded.merge_vertices(merge_tex=True, merge_norm=True)
    return Mesh(np.asarray(loaded.vertices, dtype=np.float32), np.asarray(loaded.faces, dtype=np.int32))
