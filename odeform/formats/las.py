"""Laser scans: .las, and compressed .laz."""

from pathlib import Path

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.types import PointCloud

__all__ = ["read_las"]

POINT_BYTES = 120  # of memory while reading
DEEP = 255  # colors above have 16 bits, as the format says; some programs write 8


def read_las(path: Path, merge: bool) -> PointCloud:
    """Points in double precision, as scans have coordinates of maps, with their colors.

    Raises:
        InputError: For a damaged file, or one with fewer points than it says.
    """
    import laspy

    where = f"geometry {path}"
    with path.open("rb") as head:
        magic = head.read(4)
    if magic != b"LASF":
        raise InputError(f"{where}: expected a file that starts with LASF")
    try:
        with laspy.open(path) as file:
            count = file.header.point_count
            size = path.stat().st_size
            if count > size:  # the best compression leaves more than a byte of a point
                raise InputError(f"{where}: {size:,} bytes cannot hold {count:,} points: truncated?")
            require_memory(where, f"{count:,} points", count * POINT_BYTES)
            scan = file.read()
    except InputError:
        raise
    except Exception as error:
        # laspy and its decompressor raise anything on a broken file
        raise InputError(f"{where}: damaged or truncated .las or .laz: {error}") from None
    if len(scan.points) != count:
        raise InputError(f"{where}: expected {count:,} points, got {len(scan.points):,}: truncated?")
    points = np.stack([np.asarray(scan.x), np.asarray(scan.y), np.asarray(scan.z)], axis=1)
    colors, names = None, set(scan.point_format.dimension_names)
    if {"red", "green", "blue"} <= names and count:
        values = np.stack([np.asarray(scan[name]) for name in ("red", "green", "blue")], axis=1)
        if values.any():
            colors = (values >> 8 if values.max() > DEEP else values).astype(np.uint8)
    return PointCloud(points, colors)
