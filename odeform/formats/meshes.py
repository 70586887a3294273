"""Meshes, written by trimesh."""

from pathlib import Path

import trimesh

from odeform.errors import InputError
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import Geometry, Mesh

__all__ = ["exported_bytes", "mesh_bytes"]


def mesh_bytes(geometry: Geometry, path: Path) -> bytes:
    """A mesh in the format of the suffix of `path`; in .glb y is up, whichever axis it is in the mesh.

    Raises `InputError` for points and splats.
    """
    if not isinstance(geometry, Mesh):
        got = type(geometry).__name__
        raise InputError(f"{path}: {path.suffix} holds meshes only, got a {got}: use .ply")
    suffix, points = path.suffix.lower(), geometry.points
    if suffix == ".glb" and geometry.up != "+y":
        points = Similarity(rotation=UPRIGHT["+y"].T @ UPRIGHT[geometry.up or "+z"]).points(points)
    return exported_bytes(trimesh.Trimesh(points, geometry.faces, process=False), suffix[1:])


def exported_bytes(shape: trimesh.Trimesh | trimesh.PointCloud, kind: str) -> bytes:
    """The file of a trimesh object; `kind` is a suffix without its dot."""
    data = shape.export(file_type=kind)
    return data if isinstance(data, bytes) else str(data).encode()
