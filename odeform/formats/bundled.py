"""Shapes by path or by name, those that travel with the package; and the part of each that is to move."""

from pathlib import Path

from odeform.formats.reading import read_geometry
from odeform.geometry.region import Region, read_region
from odeform.io import bundled
from odeform.types import Geometry

__all__ = ["bundled_shapes", "read_shape", "region_beside"]


def bundled_shapes() -> dict[str, Path]:
    """The splats that travel with the package, by name."""
    return {path.stem: path for path in sorted(bundled("splats").glob("*.spz"))}


def region_beside(path: Path) -> Path:
    """Where the region is kept that holds what moves of a shape: NAME.region.json beside NAME.ply."""
    return path.with_suffix(".region.json")


def read_shape(name: str | Path) -> tuple[Geometry, Region | None]:
    """The shape of a file, or the bundled one of that name, and the region kept beside it, in its units and axes."""
    path = Path(name)
    if not path.is_file():
        path = bundled_shapes().get(str(name), path)
    geometry = read_geometry(path)
    beside = region_beside(path)
    return geometry, read_region(beside) if beside.is_file() else None
