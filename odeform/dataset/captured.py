"""A motion of one's own in an `.npz` file, to compare with and to fit."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from odeform.dataset.arrays import check_arrays, read_arrays
from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.io import parse_json
from odeform.schema import Schema
from odeform.types import Floats, Mesh, MotionSequence

__all__ = ["read_captured"]

SHORTEST = 1e-9  # step between frames, relative to the whole
UNEVEN = 1e-3  # of a step: more, and frames are resampled


def read_captured(data: bytes, where: str, schema: Schema, body: Mesh) -> MotionSequence:
    """The motion in the bytes of an `.npz` file, in the frame of the scene; its first frame is the body at rest.

    The file has `times` (T,) s and `vertices` (T, N, 3) m. It may have `faces` (F, 3), which are those of `body` where
    they are missing, `weights` (N,), and `parameters` as JSON, as far as they are known: files of a data set and those
    that `odeform predict` writes can be read. Times count from the first frame; uneven ones are resampled.

    Raises:
        InputError: Arrays that are missing, do not fit together or are not finite; the message begins with `where`.
    """
    arrays = read_arrays(data, where, ("times", "vertices"), ("faces", "weights", "parameters"))
    vertices = arrays["vertices"]
    faces = arrays.get("faces")
    if faces is None:
        if vertices.ndim != 3 or vertices.shape[1] != len(body.points):
            raise InputError(
                f"{where}: expected faces (F, 3), or as many vertices as the trained body has, {len(body.points)}"
            )
        faces = body.faces
    weighed = "weights" in arrays
    arrays = {"weights": np.full(vertices.shape[1:2], 1.0), **arrays, "faces": faces}
    check_arrays(arrays, where)
    weights = arrays["weights"] if weighed else surface_weights(Mesh(vertices[0], faces))
    known = _parameters(arrays, where, schema)
    times = arrays["times"].astype(float)
    times = times - times[0]
    if np.diff(times).min() < SHORTEST * times[-1]:
        raise InputError(f"{where}: expected times that increase by at least {SHORTEST:g} of the whole in each frame")
    times, vertices = _even(times, vertices)
    return MotionSequence(times, vertices.astype(np.float32), faces, weights, known, where)


def _parameters(arrays: dict[str, np.ndarray], where: str, schema: Schema) -> dict[str, Any]:
    if "parameters" not in arrays:
        return {}
    known = parse_json(str(arrays["parameters"]), f"{where}: parameters")
    if not isinstance(known, dict):
        raise InputError(f"{where}: expected parameters by name, as a JSON object")
    known = schema.known(known)
    complete = schema.complete(known)
    return {name: complete[name] for name in known}


def _even(times: Floats, vertices: Floats) -> tuple[Floats, Floats]:
    even = np.linspace(0.0, times[-1], len(times))
    if np.abs(times - even).max() <= UNEVEN * even[1]:
        return even, vertices
    return even, CubicSpline(times, vertices)(even)
