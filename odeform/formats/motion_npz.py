"""All frames of a motion as NumPy arrays in one compressed archive."""

import json
import zipfile
from collections.abc import Callable
from typing import IO

import numpy as np

from odeform.errors import InputError
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.motion.base import Motion
from odeform.motion.caveats import caveats
from odeform.types import Floats, GaussianSplats, Mesh

__all__ = ["write_npz"]

LEVEL = 1  # of compression: floats hardly shrink at any level


def write_npz(file: IO[bytes], motion: Motion, times: Floats, fit: FittedShape | None) -> None:
    """Writes `times` (T,) s, `parameters` as JSON, and `vertices` (T, N, 3) m float32 with `faces` (F, 3), or for
    splats `centers` (T, N, 3) and `covariances` (T, N, 3, 3).

    `notes`, as JSON, is a list of sentences: what has to be known of the motion (`odeform.motion.caveats`), such as
    that its shape was not trained. With `fit`, lengths are in the units of its file, and only the part that moves is
    written. Like `numpy.savez_compressed`, but one frame at a time: moving splats may exceed the memory.
    """
    back = fit.transform.inverse if fit else Similarity()
    geometry = motion.geometry
    small = {"times": times, "parameters": np.array(json.dumps(dict(motion.parameters)))}
    small["notes"] = np.array(json.dumps(caveats(motion, times)))
    splats = isinstance(geometry, GaussianSplats)
    if not splats:
        small["faces"] = np.asarray(geometry.faces if isinstance(geometry, Mesh) else np.zeros((0, 3)), dtype=np.int32)

    def points(time: float) -> Floats:
        return back.points(motion.vertices(time))

    def covariances(time: float) -> Floats:
        return back.covariances(motion.covariances(time))

    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, array in small.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, array)
        _write_frames(archive, "centers" if splats else "vertices", points, times)
        if splats:
            _write_frames(archive, "covariances", covariances, times)


def _write_frames(archive: zipfile.ZipFile, name: str, frame: Callable[[float], Floats], times: Floats) -> None:
    """One array (T, ...) float32, of which `frame(time)` computes the rows."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        for index, time in enumerate(times):
            with np.errstate(over="ignore"):
                array = np.ascontiguousarray(frame(float(time)), dtype="<f4")
            if not np.isfinite(array).all():
                raise InputError(f"{name} at {time:g} s: too large for 32-bit numbers in the units of the file")
            if index == 0:
                header = {"descr": "<f4", "fortran_order": False, "shape": (len(times), *array.shape)}
                np.lib.format.write_array_header_1_0(member, header)
            member.write(array.data)
