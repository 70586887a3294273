"""Meshes, read and written by trimesh."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.formats.gltf import require_modest_gltf
from odeform.formats.mesh_colors import mesh_colors
from odeform.types import Geometry, Mesh, PointCloud

__all__ = ["exported_bytes", "mesh_bytes", "read_mesh"]

AS_WRITTEN: dict[str, Any] = {
    ".obj": {"maintain_order": True, "skip_materials": True},
    ".ply": {"fix_texture": False, "skip_materials": True},
}
"""Options that keep readers from splitting vertices along texture seams."""

BYTES_PER_BYTE = {".obj": 16, ".ply": 20, ".stl": 14, ".off": 20, ".glb": 14, ".gltf": 14}
"""Memory that reading takes for each byte of a file, at most."""
UNIT = (1e-3, 1e6)
"""Largest coordinates for which trimesh merges vertices as they are."""


def read_mesh(path: Path, merge: bool) -> Geometry:
    """A mesh, or points where the file has no faces; all meshes of a scene are joined.

    Colors are read where vertices are merged: without, a mesh is a frame of a sequence, and only its points count.
    """
    suffix = path.suffix.lower()
    size = path.stat().st_size
    require_memory(f"geometry {path}", f"{size:,} bytes of {suffix}", BYTES_PER_BYTE[suffix] * size)
    if suffix in (".glb", ".gltf"):
        require_modest_gltf(path)
    loaded: Any = trimesh.load(path, process=False, **({} if merge else AS_WRITTEN.get(suffix, {})))
    colors = mesh_colors(loaded, gltf=suffix in (".glb", ".gltf")) if merge else None
    if isinstance(loaded, trimesh.Scene):
        if not loaded.geometry:
            raise InputError(f"geometry {path}: contains no mesh")
        loaded = _joined(loaded)
    vertices = np.asarray(loaded.vertices)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"geometry {path}: expected vertices of three coordinates, got an array {vertices.shape}")
    if isinstance(loaded, trimesh.PointCloud):
        return PointCloud(np.asarray(loaded.vertices, dtype=np.float32))
    if merge and np.isfinite(loaded.vertices).all():  # the caller rejects the others and counts them
        _merge(loaded)
    return Mesh(np.asarray(loaded.vertices, dtype=np.float32), np.asarray(loaded.faces, dtype=np.int32), colors)


def _joined(scene: trimesh.Scene) -> trimesh.Trimesh | trimesh.PointCloud:
    """All meshes where they are placed, without materials; points if there is no mesh.

    trimesh's own `to_geometry` copies materials for each placed mesh, and takes a minute for 20,000 of them.
    """
    vertices, faces, count = [], [], 0
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        part: Any = scene.geometry[name]
        corners = getattr(part, "faces", np.zeros((0, 3), dtype=int))
        if len(getattr(part, "vertices", ())):
            vertices.append(np.asarray(part.vertices) @ matrix[:3, :3].T + matrix[:3, 3])
            # a mirrored part is turned inside out again
            faces.append(count + (corners[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else corners))
            count += len(part.vertices)
    points = np.concatenate(vertices) if vertices else np.zeros((0, 3))
    if not any(map(len, faces)):
        return trimesh.PointCloud(points)
    return trimesh.Trimesh(points, np.concatenate(faces), process=False)


def _merge(mesh: trimesh.Trimesh) -> None:
    """Merge vertices that coincide. trimesh compares them as integers, which overflow far from the unit scale."""
    scale = float(np.abs(mesh.vertices).max(initial=0.0)) or 1.0
    if UNIT[0] < scale < UNIT[1]:
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
    else:
        mesh.vertices = mesh.vertices / scale
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
        mesh.vertices = mesh.vertices * scale


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
