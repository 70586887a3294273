"""The file formats that can be read and written, by suffix. A format is one module and one line here.

Modules are named, not imported: help texts and menus list the formats without loading them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

__all__ = [
    "FRAME",
    "READERS",
    "WRITERS",
    "Reader",
    "Writer",
    "load_function",
    "motion_endings",
    "motion_formats",
    "shape_formats",
    "writers",
]  # fmt: skip

FRAME = "{frame}"
"""Placeholder of the frame number in the name of a file; such a name asks for one file per frame."""


@dataclass(frozen=True)
class Reader:
    """How a file becomes a geometry."""

    description: str
    read: str
    """"module:function" with the signature `(path: Path, merge: bool) -> Geometry`; see `read_geometry` for `merge`.
    Whatever it raises reaches the user as one `InputError`; sizes and values are validated by the caller."""


@dataclass(frozen=True)
class Writer:
    """How geometries, whole motions, or both become a file."""

    description: str
    shape: str = ""
    """"module:function" with the signature `(geometry: Geometry, path: Path) -> bytes`. It also writes motions, one
    file per frame."""
    motion: str = ""
    """"module:function" with the signature `(file: IO[bytes], motion: Motion, times, fit) -> None`, as `write_motion`,
    for all frames in one file. Where there is a `shape` too, a single frame is written as a shape."""
    compares: bool = False
    """Whether `motion` also takes `truth`, a `RecordedMotion`, for errors against it."""


POINT_TEXT = Reader("points, one per line", "odeform.formats.points:read_xyz")

READERS: dict[str, Reader] = {
    ".asc": POINT_TEXT,
    ".csv": POINT_TEXT,
    ".glb": Reader("binary glTF scene, joined into one mesh", "odeform.formats.gltf.reader:read_gltf"),
    ".gltf": Reader("glTF scene, joined into one mesh", "odeform.formats.gltf.reader:read_gltf"),
    ".ksplat": Reader("Gaussian splats (GaussianSplats3D)", "odeform.formats.splat_ksplat:read_ksplat"),
    ".las": Reader("points of a laser scan", "odeform.formats.las:read_las"),
    ".laz": Reader("points of a laser scan, compressed", "odeform.formats.las:read_las"),
    ".msh": Reader("Gmsh mesh, its surface", "odeform.formats.gmsh:read_msh"),
    ".obj": Reader("Wavefront mesh", "odeform.formats.obj:read_obj"),
    ".off": Reader("Object File Format mesh", "odeform.formats.off:read_off"),
    ".pcd": Reader("points of the Point Cloud Library", "odeform.formats.pcd:read_pcd"),
    ".ply": Reader("mesh, points, or Gaussian splats (INRIA or SuperSplat)", "odeform.formats.ply_files:read_ply"),
    ".pts": POINT_TEXT,
    ".sog": Reader("Gaussian splats (PlayCanvas)", "odeform.formats.splat_sog:read_sog"),
    ".splat": Reader("Gaussian splats (antimatter15)", "odeform.formats.splat_antimatter:read_splat"),
    ".spz": Reader("Gaussian splats (Niantic)", "odeform.formats.splat_spz:read_spz"),
    ".stl": Reader("mesh", "odeform.formats.stl:read_stl"),
    ".txt": POINT_TEXT,
    ".vtk": Reader("VTK data set, its surface", "odeform.formats.vtk_files:read_vtk"),
    ".vtp": Reader("VTK polygons", "odeform.formats.vtk_files:read_vtk"),
    ".vtu": Reader("VTK mesh, its surface", "odeform.formats.vtk_files:read_vtk"),
    ".xyz": POINT_TEXT,
}

WRITERS: dict[str, Writer] = {
    ".csv": Writer("curves over time", motion="odeform.formats.motion_csv:write_csv", compares=True),
    ".ply": Writer("mesh, points, or Gaussian splats", shape="odeform.formats.ply_files:ply_bytes"),
    ".obj": Writer("mesh", shape="odeform.formats.meshes:mesh_bytes"),
    ".stl": Writer("mesh", shape="odeform.formats.meshes:mesh_bytes"),
    ".glb": Writer(
        "mesh, animated", shape="odeform.formats.meshes:mesh_bytes", motion="odeform.formats.gltf_motion:write_glb"
    ),
    ".npz": Writer("NumPy arrays of all frames", motion="odeform.formats.motion_npz:write_npz"),
    ".webp": Writer("film", motion="odeform.formats.motion_film:write_webp"),
}


def writers() -> Mapping[str, Writer]:
    """Maps each suffix to its writer: `WRITERS`, and those of whole motions that installed packages declare.

    Their entry points are in the group `odeform.motion_writers`: the name is the suffix, the object the function.
    """
    return {**WRITERS, **_declared()}


@cache
def _declared() -> Mapping[str, Writer]:
    found = sorted(entry_points(group="odeform.motion_writers"), key=lambda entry: entry.name)
    return {entry.name: Writer(f"by {entry.module}", motion=entry.value) for entry in found}


def shape_formats() -> dict[str, str]:
    """Suffix -> description of the formats that hold one geometry (`write_shape`)."""
    return {suffix: writer.description for suffix, writer in writers().items() if writer.shape}


def motion_formats() -> dict[str, str]:
    """Suffix -> description of the formats that hold a whole motion in one file (`write_motion`)."""
    return {suffix: writer.description for suffix, writer in writers().items() if writer.motion}


def motion_endings() -> str:
    """The names that `write_motion` takes, for help texts and errors."""
    return f"{_either(motion_formats())}, or {_either(shape_formats())} with {FRAME} in the name (one file per frame)"


def load_function(target: str) -> Callable[..., Any]:
    """Loads the function that "module:function" names."""
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)


def _either(names: Mapping[str, Any]) -> str:
    *first, last = names
    return f"{', '.join(first)} or {last}" if first else last
