"""A motion sampled into frames, and the files that take frames."""

import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import IO

import numpy as np
import trimesh

from odeform.errors import InputError
from odeform.formats.splat_inria import inria_bytes
from odeform.geometry.harmonics import rotated_harmonics
from odeform.geometry.shape import Fit
from odeform.geometry.similarity import Similarity
from odeform.io import atomic_open, atomic_write
from odeform.motion.base import Motion
from odeform.types import Floats, GaussianSplats, Geometry, Mesh

__all__ = ["parse_times", "write_motion"]

LIMIT = 1_000_000  # frames
FAST = 1  # level of compression: floats hardly shrink, whatever time one gives them


def parse_times(text: str) -> Floats:
    """START:STOP:STEP in seconds, half-open, like `numpy.arange`."""
    try:
        start, stop, step = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"times: expected START:STOP:STEP in seconds, got {text!r}") from None
    if not (np.isfinite([start, stop, step]).all() and step > 0.0 and 0.0 <= start < stop):
        raise InputError(f"times: expected 0 <= START < STOP and STEP > 0, got {text!r}")
    if (stop - start) / step > LIMIT:
        raise InputError(f"times: {text!r} asks for more than {LIMIT} frames")
    return np.arange(start, stop, step)


def write_motion(motion: Motion, times: Floats, out: str | Path, fit: Fit | None = None) -> None:
    """Write frames to `out`: `.npz`, or `.ply` with `{frame}` in its name (splats as INRIA's code does).

    A shape that was fitted goes back to the units and place of its file; a `.ply` also has what stands still.
    """
    path = Path(out)
    suffix = path.suffix.lower()
    if suffix == ".npz":
        with atomic_open(path) as file:
            _write_npz(file, motion, times, fit.place.inverse if fit else Similarity())
    elif suffix == ".ply" and "{frame}" in path.name:
        for frame, time in enumerate(times):
            atomic_write(path.with_name(path.name.replace("{frame}", f"{frame:05d}")), _ply(motion, float(time), fit))
    else:
        raise InputError(f"--out {out}: expected a name ending in .npz, or in .ply with {{frame}} in it")


def _write_npz(file: IO[bytes], motion: Motion, times: Floats, back: Similarity) -> None:
    """An archive like those of `numpy.savez_compressed`, a frame at a time: splats in motion may outgrow memory."""
    geometry = motion.geometry
    small = {"times": times, "parameters": np.array(json.dumps(dict(motion.parameters)))}
    splats = isinstance(geometry, GaussianSplats)
    if not splats:
        small["faces"] = np.asarray(geometry.faces if isinstance(geometry, Mesh) else np.zeros((0, 3)), dtype=np.int32)

    def points(time: float) -> Floats:
        return back.points(motion.vertices(time))

    def covariances(time: float) -> Floats:
        return back.covariances(motion.covariances(time))

    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=FAST) as archive:
        for name, array in small.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, array)
        _write_frames(archive, "centers" if splats else "vertices", points, times)
        if splats:
            _write_frames(archive, "covariances", covariances, times)


def _write_frames(archive: zipfile.ZipFile, name: str, frame: Callable[[float], Floats], times: Floats) -> None:
    """(T, ...) float32, of which `frame` gives what is known of one time."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        for index, time in enumerate(times):
            array = np.ascontiguousarray(frame(float(time)), dtype="<f4")
            if index == 0:
                header = {"descr": "<f4", "fortran_order": False, "shape": (len(times), *array.shape)}
                np.lib.format.write_array_header_1_0(member, header)
            member.write(array.data)


def _ply(motion: Motion, time: float, fit: Fit | None) -> bytes:
    moved = _moved(motion, time)
    shape = fit.undo(moved) if fit else moved
    if isinstance(shape, GaussianSplats):
        return inria_bytes(shape)
    if isinstance(shape, Mesh):
        out: trimesh.Trimesh | trimesh.PointCloud = trimesh.Trimesh(shape.points, shape.faces, process=False)
    else:
        out = trimesh.PointCloud(shape.points)
    data = out.export(file_type="ply")
    return data if isinstance(data, bytes) else str(data).encode()


def _moved(motion: Motion, time: float) -> Geometry:
    geometry = motion.geometry
    moved = replace(geometry, points=motion.vertices(time))
    if not isinstance(moved, GaussianSplats):
        return moved
    # colours turn with the body as a whole
    harmonics = rotated_harmonics(moved.harmonics, motion.pose(time)[:3, :3])
    return replace(moved, covariances=motion.covariances(time), harmonics=harmonics)
