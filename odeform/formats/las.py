"""Laser scans: .las, and compressed .laz.

ASPRS, "LAS Specification 1.4 - R15" (2019).
"""

import struct
from pathlib import Path
from typing import Any

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.types import PointCloud

__all__ = ["read_las"]

POINT_BYTES = 120  # of memory while reading
DEEP = 255  # colors above have 16 bits, as the format says; some programs write 8
COMPRESSED = 0x80  # bit of the point format
HEADER = 227  # bytes, of the shortest version
LASZIP = 22204
"""Record of how points are compressed; from byte `PARTS` on it has their number of parts, and kind, size and version of
each."""
PARTS = 32
CHUNK = 20  # bytes: at least one point of each chunk is stored as it is
PANIC = "PanicException"
"""Class of the errors by which the decompressor, which is written in Rust, says that it stopped."""


def read_las(path: Path, merge: bool) -> PointCloud:
    """Points in double precision, as scans have coordinates of maps, with their colors.

    Raises:
        InputError: For a damaged file, or one with fewer points than it says.
    """
    where = f"geometry {path}"
    _require_sound(path, where)
    try:
        scan = _read(path, where)
    except (InputError, MemoryError):
        raise
    except BaseException as error:
        # laspy and its decompressor raise anything on a broken file
        if not isinstance(error, Exception) and type(error).__name__ != PANIC:
            raise
        raise InputError(f"{where}: damaged or truncated .las or .laz: {error}") from None
    points = np.stack([np.asarray(scan.x), np.asarray(scan.y), np.asarray(scan.z)], axis=1)
    colors, names = None, set(scan.point_format.dimension_names)
    if {"red", "green", "blue"} <= names and len(points):
        values = np.stack([np.asarray(scan[name]) for name in ("red", "green", "blue")], axis=1)
        if values.any():
            colors = (values >> 8 if values.max() > DEEP else values).astype(np.uint8)
    return PointCloud(points, colors)


def _read(path: Path, where: str) -> Any:
    import laspy

    # the parallel backend allocates whatever a damaged file asks for
    with laspy.open(path, laz_backend=laspy.LazBackend.Lazrs) as file:
        count = file.header.point_count
        size = path.stat().st_size
        if count > size:  # the best compression leaves more than a byte of a point
            raise InputError(f"{where}: {size:,} bytes cannot hold {count:,} points: truncated?")
        if file.header.are_points_compressed:
            _require_whole_points(file.header, where)
        present = (size - file.header.offset_to_point_data) // file.header.point_format.size
        if present < count and not file.header.are_points_compressed:
            raise InputError(f"{where}: expected {count:,} points, got {max(present, 0):,}: truncated?")
        require_memory(where, f"{count:,} points", count * POINT_BYTES)
        scan = file.read()
    if len(scan.points) != count:
        raise InputError(f"{where}: expected {count:,} points, got {len(scan.points):,}: truncated?")
    return scan


def _require_whole_points(header: Any, where: str) -> None:
    """Raise `InputError` where the compressed parts of a point are not as long as a point: the decompressor would stop,
    and print where."""
    for record in header.vlrs:
        if record.record_id == LASZIP:
            parts = record.record_data[PARTS + 2 :]
            count = int.from_bytes(record.record_data[PARTS : PARTS + 2], "little")
            sizes = [size for _, size, _ in struct.iter_unpack("<HHH", parts[: min(6 * count, len(parts) // 6 * 6)])]
            size = header.point_format.size
            if sum(sizes) != size:
                raise InputError(f"{where}: expected compressed points of {size} bytes, got {sum(sizes)}: damaged?")


def _require_sound(path: Path, where: str) -> None:
    """Raise `InputError` for another file, and a table of compressed chunks that claims more than the file can hold."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(375)
        if head[:4] != b"LASF":
            raise InputError(f"{where}: expected a file that starts with LASF, got {head[:4]!r}: not a laser scan?")
        if len(head) < HEADER:
            raise InputError(f"{where}: expected a header of {HEADER} bytes, got {len(head)}: truncated?")
        start, records, kind = struct.unpack_from("<IIB", head, 96)
        if start > size or records > size:
            raise InputError(f"{where}: expected points from byte {start:,} on, got {size:,} bytes: truncated?")
        if not kind & COMPRESSED:
            return
        file.seek(start)
        (table,) = struct.unpack("<q", file.read(8).ljust(8, b"\0"))
        if table == -1:  # a stream that could not be rewound has it at its end
            file.seek(max(size - 8, 0))
            (table,) = struct.unpack("<q", file.read(8).ljust(8, b"\0"))
        if not start <= table <= size - 8:
            raise InputError(f"{where}: expected a table of chunks at byte {table:,}, got {size:,} bytes: truncated?")
        file.seek(table + 4)
        (chunks,) = struct.unpack("<I", file.read(4))
        if chunks > size // CHUNK:
            raise InputError(f"{where}: {size:,} bytes cannot hold {chunks:,} compressed chunks: damaged?")
