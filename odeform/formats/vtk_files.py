"""Files of VTK: `.vtk`, `.vtu` and `.vtp`."""

from pathlib import Path

from odeform.budget import MEMORY, read_limited, require_memory
from odeform.errors import InputError
from odeform.formats.vtk_grid import Grid, geometry_of
from odeform.formats.vtk_legacy import read_legacy
from odeform.formats.vtk_xml import read_xml_grid
from odeform.types import Geometry

__all__ = ["read_grid", "read_vtk"]

TEXT, BINARY = 40, 12
"""Memory that reading takes for each byte of a file, at most: a number in text is a word of Python first."""
HEAD = 4096  # bytes that tell whether a file is text


def read_vtk(path: Path, merge: bool) -> Geometry:
    """Reads the surface in a file of VTK, in the units of the file: of volumes the outer faces."""
    where = f"geometry {path}"
    return geometry_of(read_grid(path, where), where)


def read_grid(path: Path, where: str) -> Grid:
    """Points, cells and fields of vectors. Raises `InputError`, which `where` leads, for files that are damaged, or of
    VTK but no mesh."""
    try:
        data = read_limited(path, where, MEMORY // BINARY)
    except OSError as error:
        raise InputError(f"{where}: cannot be read: {error.strerror}") from None
    as_text = b"ASCII" in data[:HEAD] or b'format="ascii"' in data[:HEAD]
    require_memory(where, f"{len(data):,} bytes of VTK", (TEXT if as_text else BINARY) * len(data))
    return read_legacy(data, where) if data.lstrip()[:1] != b"<" else read_xml_grid(data, where)
