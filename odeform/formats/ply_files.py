"""PLY files of any content: meshes, points, or Gaussian splats as trained or compressed."""

from pathlib import Path

import trimesh

from odeform.errors import InputError
from odeform.formats.meshes import exported_bytes, mesh_bytes
from odeform.formats.ply import read_header
from odeform.formats.ply_data import read_tables
from odeform.formats.ply_mesh import read_ply_mesh
from odeform.formats.splat_compressed import compressed_splats
from odeform.formats.splat_inria import inria_bytes, inria_splats
from odeform.types import GaussianSplats, Geometry, Mesh

__all__ = ["ply_bytes", "read_ply"]

SPLAT_PROPERTIES = {"f_dc_0", "rot_0", "packed_position"}
"""Any of these marks a file of splats."""


def read_ply(path: Path, merge: bool) -> Geometry:
    """Splats where the properties of the file say so, else a mesh, or points where it has no faces."""
    header = read_header(path)
    names = {entry.name for element in header.elements for entry in element.properties}
    if not names & SPLAT_PROPERTIES:
        return read_ply_mesh(path, header, merge)
    tables = read_tables(path, header)
    if "vertex" not in tables:
        raise InputError(f"geometry {path}: expected an element vertex of numbers, got {', '.join(tables) or 'none'}")
    if "packed_position" in (tables["vertex"].dtype.names or ()):
        return compressed_splats(tables, path)
    return inria_splats(tables["vertex"], path)


def ply_bytes(geometry: Geometry, path: Path) -> bytes:
    """Splats in the layout of INRIA's code, which splat viewers open; meshes and points as trimesh writes them."""
    if isinstance(geometry, GaussianSplats):
        return inria_bytes(geometry)
    if isinstance(geometry, Mesh):
        return mesh_bytes(geometry, path)
    return exported_bytes(trimesh.PointCloud(geometry.points, colors=geometry.colors), "ply")
