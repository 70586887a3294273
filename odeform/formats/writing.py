"""Writing geometries and motions, in the formats of the registry."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.errors import InputError
from odeform.formats.annotation import annotated
from odeform.formats.registry import FRAME, Writer, load_function, motion_endings, shape_formats, writers
from odeform.geometry.harmonics import rotated_harmonics
from odeform.geometry.shape import FittedShape
from odeform.io import atomic_open, atomic_write
from odeform.motion.base import Motion, checked_times
from odeform.motion.caveats import caveats
from odeform.motion.recorded import RecordedMotion
from odeform.types import Floats, GaussianSplats, Geometry

__all__ = ["motion_files", "shape_at", "write_motion", "write_shape"]


def write_shape(geometry: Geometry, out: str | Path, notes: Sequence[str] = ()) -> None:
    """Write a geometry as it is; the suffix of `out` selects the format.

    Args:
        geometry: A shape of N points, in any unit.
        out: A file name with a suffix of `odeform.formats.registry.shape_formats()`.
        notes: Sentences that the file carries as comments; formats without a place for them leave them out.

    Raises:
        InputError: An unknown suffix, or a format that cannot hold this kind of geometry.

    Examples:
        >>> import odeform
        >>> motion = odeform.load("kick").solve()
        >>> odeform.write_shape(odeform.Mesh(motion.vertices(0.5), motion.geometry.faces), "ball.obj")
    """
    path = Path(out)
    writer = writers().get(path.suffix.lower())
    if writer is None or not writer.shape:
        raise InputError(f"{out}: expected a name ending in one of {', '.join(shape_formats())}")
    data = load_function(writer.shape)(geometry, path)
    atomic_write(path, annotated(data, path.suffix.lower(), notes))


def write_motion(
    motion: Motion,
    times: Floats | Sequence[float],
    out: str | Path,
    fit: FittedShape | None = None,
    truth: RecordedMotion | None = None,
) -> None:
    """Write the frames of `motion` at `times` (T,) s; the suffix of `out` selects the format.

    `.npz` holds all frames, and `.glb` is an animation of them (a single frame is a plain mesh). A name with `{frame}`
    in it, for instance `ball_{frame}.ply`, gives one file per frame in any format of `shape_formats()`. Each file says
    what has to be known of its motion (`odeform.motion.caveats`), such as that it is outside of what was trained.

    Args:
        motion: What `Predictor.solve` returned.
        times: (T,) seconds, in any order, as an array or a list.
        out: A file name.
        fit: How the shape was brought into the scene. Lengths, position and axes are then those of its file, and files
            of single frames include the part that stands still.
        truth: A record of the same parameters whose mesh `motion` moves; `.csv` then has errors against it.

    Raises:
        InputError: No times, a name with an unknown suffix, or without `{frame}` where the format holds one frame, or
            a format that holds no errors, with a `truth`.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> motion = odeform.load("kick").solve(parameters={"mass": 0.6})
        >>> odeform.write_motion(motion, np.arange(0.0, 0.3, 0.1), "motion.npz")
        >>> np.load("motion.npz")["vertices"].shape
        (3, 2306, 3)
        >>> odeform.write_motion(motion, np.array([0.0, 0.5]), "ball_{frame}.ply")
        >>> odeform.write_motion(motion, np.arange(0.0, 1.0, 0.02), "ball.glb")
    """
    path, times = Path(out), checked_times(np.asarray(times))
    if not len(times):
        raise InputError(f"{out}: times: expected at least one, in seconds, got none")
    files = motion_files(path, len(times), truth is not None)
    _require_finite(motion, times)
    writer = writers()[path.suffix.lower()]
    if writer.shape and (FRAME in path.name or len(times) == 1):
        for file, time in zip(files, times, strict=True):
            write_shape(shape_at(motion, float(time), fit), file, caveats(motion, np.array([time])))
        return
    with atomic_open(path) as file:
        load_function(writer.motion)(file, motion, times, fit, **({} if truth is None else {"truth": truth}))


def motion_files(out: str | Path, frames: int, compared: bool = False) -> list[Path]:
    """The files that `write_motion` writes for `frames` frames, `compared` with a truth.

    Raises:
        InputError: A name that it does not take.
    """
    path = Path(out)
    writer = writers().get(path.suffix.lower(), Writer(""))
    if compared and not writer.compares:
        able = ", ".join(suffix for suffix, writer in writers().items() if writer.compares)
        raise InputError(f"{out}: errors against a truth are written to {able} only")
    if writer.shape and FRAME in path.name:
        return [path.with_name(path.name.replace(FRAME, f"{frame:05d}")) for frame in range(frames)]
    if writer.motion:
        return [path]
    raise InputError(f"{out}: expected a name ending in {motion_endings()}")


def _require_finite(motion: Motion, times: Floats) -> None:
    """A damaged model is found before anything is written."""
    for time in np.unique(np.asarray(times)[[0, len(times) // 2, -1]]):
        if not np.isfinite(motion.vertices(float(time))).all():
            raise InputError(f"the motion is not finite at {time:g} s: a damaged model, or a shape far too large")


def shape_at(motion: Motion, time: float, fit: FittedShape | None = None) -> Geometry:
    """Returns the geometry at `time` in seconds, in scene axes; with `fit` in those of its file, the still part
    included."""
    moved = replace(motion.geometry, points=motion.vertices(time))
    if isinstance(moved, GaussianSplats):
        # colours turn with the body as a whole
        harmonics = rotated_harmonics(moved.harmonics, motion.pose(time)[:3, :3])
        moved = replace(moved, covariances=motion.covariances(time), harmonics=harmonics)
    return fit.to_file(moved) if fit else moved
