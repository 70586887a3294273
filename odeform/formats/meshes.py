"""Meshes, read and written by trimesh."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from odeform.errors import InputError
from odeform.types import Geometry, Mesh, PointCloud

__all__ = ["exported_bytes", "mesh_bytes", "read_mesh"]

AS_WRITTEN: dict[str, Any] = {
    ".obj": {"maintain_order": True, "skip_materials": True},
    ".ply": {"fix_texture": False, "skip_materials": True},
}
"""Options that keep readers from splitting vertices along texture seams."""


def read_mesh(path: Path, merge: bool) -> Geometry:
    """A mesh, or points where the file has no faces; all meshes of a scene are joined."""
    loaded: Any = trimesh.load(path, process=False, **({} if merge else AS_WRITTEN.get(path.suffix.lower(), {})))
    if isinstance(loaded, trimesh.Scene):
        if not loaded.geometry:
            raise InputError(f"geometry {path}: contains no mesh")
        loaded = loaded.to_geometry()
    if isinstance(loaded, trimesh.PointCloud):
        return PointCloud(np.asarray(loaded.vertices, dtype=np.float32))
    if merge and np.isfinite(loaded.vertices).all():  # the caller rejects the others and counts them
        loaded.merge_vertices(merge_tex=True, merge_norm=True)
    return Mesh(np.asarray(loaded.vertices, dtype=np.float32), np.asarray(loaded.faces, dtype=np.int32))


def mesh_bytes(geometry: Geometry, path: Path) -> bytes:
    """A mesh in the format of the suffix of `path`. Raises `InputError` for points and splats."""
    if not isinstance(geometry, Mesh):
        got = type(geometry).__name__
        raise InputError(f"{path}: {path.suffix} holds meshes only, got a {got}: use .ply")
    return exported_bytes(trimesh.Trimesh(geometry.points, geometry.faces, process=False), path.suffix.lower()[1:])


def exported_bytes(shape: trimesh.Trimesh | trimesh.PointCloud, kind: str) -> bytes:
    """The file of a trimesh object; `kind` is a suffix without its dot."""
    data = shape.export(file_type=kind)
    return data if isinstance(data, bytes) else str(data).encode()
