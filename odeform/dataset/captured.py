"""A motion of one's own in an `.npz` file, to compare with and to fit."""

from typing import Any

import numpy as np

from odeform.dataset.arrays import check_arrays
from odeform.dataset.motion_arrays import read_motion_arrays
from odeform.dataset.resampling import even_times, is_even, resampled
from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.io import parse_json
from odeform.schema import Schema
from odeform.types import Mesh, MotionSequence

__all__ = ["read_captured"]


def read_captured(data: bytes, where: str, schema: Schema, body: Mesh) -> MotionSequence:
    """The motion in the bytes of an `.npz` file, in the frame of the scene; its first frame is the body at rest.

    The file has `times` (T,) s and `vertices` (T, N, 3) m. It may have `faces` (F, 3), which are those of `body` where
    they are missing, `weights` (N,), and `parameters` as JSON, as far as they are known: files of a data set and those
    that `odeform predict` writes can be read. Times count from the first frame; uneven ones are resampled.

    Raises:
        InputError: Arrays that are missing, do not fit together or are not finite; the message begins with `where`.
    """
    motion = read_motion_arrays(data, where)
    vertices, faces = motion.vertices, motion.faces
    if motion.times is None:
        raise InputError(f"{where}: expected an array times ({len(vertices)},) in seconds, one for each frame")
    if faces is None:
        if vertices.shape[1] != len(body.points):
            raise InputError(
                f"{where}: expected faces (F, 3), or as many vertices as the trained body has, {len(body.points)}; "
                f"got {vertices.shape[1]} vertices without faces"
            )
        faces = body.faces
    arrays = {"times": motion.times, "vertices": vertices, "weights": np.full(vertices.shape[1:2], 1.0), "faces": faces}
    check_arrays({**arrays, **{name: motion.others[name] for name in motion.others if name == "weights"}}, where)
    weights = motion.others.get("weights")
    if weights is None:
        weights = surface_weights(Mesh(vertices[0], faces))
    known = _parameters(motion.others, where, schema)
    times = even_times(motion.times, where)
    if not is_even(motion.times, times[1]):
        vertices = resampled(motion.times, vertices, times, where)
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
