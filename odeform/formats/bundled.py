"""Shapes by path or by bundled name, with the region of each that moves."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.formats.reading import read_geometry
from odeform.geometry.parts import split
from odeform.geometry.region import Region, read_region
from odeform.geometry.similarity import Similarity
from odeform.io import bundled
from odeform.types import Geometry

__all__ = ["bundled_shapes", "moving_part", "read_shape", "region_beside"]


def bundled_shapes() -> dict[str, Path]:
    """Name -> file of the bundled splats."""
    return {path.stem: path for path in sorted(bundled("splats").glob("*.spz"))}


def region_beside(path: Path) -> Path:
    """The file of the region that moves of a shape: NAME.region.json beside NAME.ply."""
    return path.with_suffix(".region.json")


def read_shape(name: str | Path) -> tuple[Geometry, Region | None]:
    """Read a file or a bundled shape, and its region if there is one, both in the units and axes of the file.

    Raises `InputError` as `read_geometry` does.
    """
    path = Path(name)
    if not path.is_file():
        path = bundled_shapes().get(str(name), path)
    geometry = read_geometry(path)
    beside = region_beside(path)
    if not beside.is_file():
        return geometry, None
    # a region is in the coordinates of the file, also where those of the points are relative to an offset
    return geometry, read_region(beside).transformed(Similarity(shift=-np.array(geometry.offset)))


def moving_part(geometry: Geometry, region: Region | None) -> Geometry:
    """The part of a shape that moves; `notes` say how much of a scene that is. `InputError` for an empty region."""
    if region is None:
        return geometry
    part, _ = split(geometry, region)
    note = f"{len(part.points):,} of {len(geometry.points):,} points are within the region, and are the body"
    return replace(part, notes=(*part.notes, note))
