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
    """Write a geometry as it is; the suffix of `out` selects the format.

    Args:
        geometry: A shape of N points, in any unit.
        out: A file name with a suffix of `odeform.formats.registry.shape_formats()`.

    Raises:
        InputError: An unknown suffix, or a format that cannot hold this kind of geometry.

    Examples:
        >>> import odeform
        >>> motion = odeform.load("kick").solve()
        >>> odeform.write_shape(odeform.Mesh(motion.vertices(0.5), motion.geometry.faces), "ball.obj")
    """
    path = Path(out)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None or not writer.shape:
        raise InputError(f"{out}: expected a name ending in one of {', '.join(shape_formats())}")
    atomic_write(path, load_function(writer.shape)(geometry, path))


def write_motion(motion: Motion, times: Floats, out: str | Path, fit: FittedShape | None = None) -> None:
    """Write the frames of `motion` at `times` (T,) s; the suffix of `out` selects the format.

    `.npz` holds all frames. A name with `{frame}` in it, for instance `ball_{frame}.ply`, gives one file per frame in
    any format of `shape_formats()`.

    Args:
        motion: What `Predictor.solve` returned.
        times: (T,) seconds, in any order.
        out: A file name.
        fit: How the shape was brought into the scene. Lengths, position and axes are then those of its file, and files
            of single frames include the part that stands still.

    Raises:
        InputError: A name with an unknown suffix, or without `{frame}` where the format holds one frame.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> motion = odeform.load("kick").solve(parameters={"mass": 0.6})
        >>> odeform.write_motion(motion, np.arange(0.0, 0.3, 0.1), "motion.npz")
        >>> np.load("motion.npz")["vertices"].shape
        (3, 2306, 3)
        >>> odeform.write_motion(motion, np.array([0.0, 0.5]), "ball_{frame}.ply")
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
