"""Whole motions as NumPy arrays in `.npz` files, under the names that people give them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from odeform.dataset.arrays import array_names, read_arrays
from odeform.errors import InputError
from odeform.types import Faces, Frames, Times

__all__ = ["MotionArrays", "read_motion_arrays"]

TIMES = ("times", "time", "t", "timestamps")
VERTICES = ("vertices", "positions", "points", "verts", "vertex_positions")
FACES = ("faces", "triangles", "f")
OTHERS = ("weights", "parameters")


@dataclass(frozen=True, eq=False)
class MotionArrays:
    """Holds what an archive of a motion contains.

    Attributes:
        vertices: (T, N, 3).
        times: (T,) in double precision, or None.
        faces: (F, 3), or None.
        others: The arrays `weights` and `parameters`, as far as they are there.
        counted: Whether the times are integers, which may count frames instead of seconds.
        unused: The names of further arrays.
    """

    vertices: Frames
    times: Times | None
    faces: Faces | None
    others: dict[str, np.ndarray]
    counted: bool
    unused: tuple[str, ...]


def read_motion_arrays(data: bytes, where: str) -> MotionArrays:
    """Reads the motion in the bytes of an `.npz` file; `where` leads the message of an `InputError`."""
    names = array_names(data, where)
    chosen = {wanted[0]: _chosen(wanted, names, where) for wanted in (TIMES, VERTICES, FACES)}
    if not chosen["vertices"]:
        raise InputError(f"{where}: expected an array vertices (T, N, 3), got {', '.join(sorted(names)[:8]) or 'none'}")
    others = [name for name in OTHERS if name in names]
    arrays = read_arrays(data, where, [*filter(None, chosen.values()), *others])
    vertices = arrays[chosen["vertices"]]
    if vertices.ndim != 3 or vertices.shape[2] != 3 or vertices.dtype.kind not in "fiu":
        raise InputError(
            f"{where}: expected {chosen['vertices']} (T, N, 3) of numbers, got {vertices.dtype} {vertices.shape}"
        )
    times = arrays.get(chosen["times"])
    if times is not None:
        times = times.reshape(-1) if times.shape in ((len(vertices), 1), (1, len(vertices))) else times
        if times.shape != (len(vertices),) or times.dtype.kind not in "fiu":
            raise InputError(
                f"{where}: expected {chosen['times']} ({len(vertices)},), one for each frame, "
                f"got {times.dtype} {times.shape}"
            )
    return MotionArrays(
        vertices if vertices.dtype.kind == "f" else vertices.astype(float),
        None if times is None else times.astype(float),
        arrays.get(chosen["faces"]),
        {name: arrays[name] for name in others},
        times is not None and times.dtype.kind in "iu",
        tuple(sorted(names - set(arrays))),
    )


def _chosen(wanted: Sequence[str], names: set[str], where: str) -> str:
    """The first name of `wanted` that is there, or nothing. The first of all is the project's own."""
    found = [name for name in wanted if name in names]
    if len(found) > 1 and found[0] != wanted[0]:
        raise InputError(f"{where}: expected one array {wanted[0]}, got {' and '.join(found)}")
    return found[0] if found else ""
