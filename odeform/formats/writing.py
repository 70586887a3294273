"""Writing geometries and motions, in the formats of the registry."""

from dataclasses import replace
from pathlib import Path

from odeform.errors import InputError
from odeform.formats.registry import FRAME, WRITERS, Writer, load_function, motion_endings, shape_formats
from odeform.geometry.harmonics import rotated_harmonics
from odeform.geometry.shape import FittedShape
from odeform.io import atomic_open, atomic_write
from odeform.motion.base import Motion
from odeform.types import Floats, GaussianSplats, Geometry

__all__ = ["shape_at", "write_motion", "write_shape"]


def write_shape(geometry: Geometry, out: str | Path) -> None:
    """Write a geometry as it is; the suffix of `out` selects the format (`shape_formats()`).

    Raises `InputError` for an unknown suffix, and where the format cannot hold this kind of geometry.
    """
    path = Path(out)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None or not writer.shape:
        raise InputError(f"{out}: expected a name ending in one of {', '.join(shape_formats())}")
    atomic_write(path, load_function(writer.shape)(geometry, path))


def write_motion(motion: Motion, times: Floats, out: str | Path, fit: FittedShape | None = None) -> None:
    """Write the frames of `motion` at `times` (T,) s; the suffix of `out` selects the format.

    `.npz` holds all frames. A name with `{frame}` in it, for instance `ball_{frame}.ply`, gives one file per frame in
    any format of `shape_formats()`. With `fit`, lengths, position and axes are those of its file, and files of single
    frames include the part that stands still. Raises `InputError` for any other name.
    """
    path = Path(out)
    writer = WRITERS.get(path.suffix.lower(), Writer(""))
    if writer.shape and FRAME in path.name:
        for frame, time in enumerate(times):
            file = path.with_name(path.name.replace(FRAME, f"{frame:05d}"))
            write_shape(shape_at(motion, float(time), fit), file)
    elif writer.motion:
        with atomic_open(path) as file:
            load_function(writer.motion)(file, motion, times, fit)
    else:
        raise InputError(f"{out}: expected a name ending in {motion_endings()}")


def shape_at(motion: Motion, time: float, fit: FittedShape | None = None) -> Geometry:
    """The geometry at `time` in seconds, in scene axes; with `fit` in those of its file, the still part included."""
    moved = replace(motion.geometry, points=motion.vertices(time))
    if isinstance(moved, GaussianSplats):
        # colours turn with the body as a whole
        harmonics = rotated_harmonics(moved.harmonics, motion.pose(time)[:3, :3])
        moved = replace(moved, covariances=motion.covariances(time), harmonics=harmonics)
    return fit.to_file(moved) if fit else moved
