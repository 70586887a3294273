"""The arrays of a sequence in a file, checked before they are used: a data set may come from anywhere."""

import io
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from tokenize import TokenError

import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.types import MotionSequence

__all__ = ["array_names", "check_arrays", "checked_sequence", "read_arrays"]

ARRAYS = ("times", "vertices", "faces", "weights")
FARTHEST = 1e9  # m
COPIES = 4  # of its arrays that the use of a sequence takes


def array_names(data: bytes, where: str) -> set[str]:
    """Returns the names of the arrays in an `.npz` archive. `InputError`, which `where` leads, for other files."""
    if data[:2] != b"PK":
        raise InputError(f"{where}: damaged: expected an .npz archive, got {len(data):,} other bytes")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {name.removesuffix(".npy") for name in archive.namelist()}
    except (zipfile.BadZipFile, NotImplementedError, ValueError, OSError) as error:
        raise InputError(f"{where}: damaged: {error}") from None


def read_arrays(data: bytes, where: str, names: Sequence[str] = ARRAYS) -> dict[str, np.ndarray]:
    """Reads arrays of an `.npz` archive by name.

    Sizes are checked before an array is read. Nothing is unpickled. `InputError`, which `where` leads, for other files.
    """
    try:
        array_names(data, where)  # or says what is damaged
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(archive.getinfo(f"{name}.npy").file_size for name in names)
        require_memory(where, f"{size:,} bytes of arrays", COPIES * size)
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            read = {name: arrays[name] for name in names}
        if strange := [name for name, array in read.items() if not isinstance(array, np.ndarray)]:
            raise InputError(f"{where}: damaged: {', '.join(strange)}: expected an array")
        return read
    except InputError:
        raise
    except (KeyError, ValueError, TypeError, EOFError, OSError, MemoryError, OverflowError) as error:
        if "allow_pickle" in str(error):
            raise InputError(f"{where}: expected arrays of numbers, got Python objects, which are not read") from None
        raise InputError(f"{where}: damaged: {error}") from None
    except (zipfile.BadZipFile, zlib.error, TokenError, NotImplementedError, RuntimeError, SyntaxError) as error:
        raise InputError(f"{where}: damaged: {error}") from None


def checked_sequence(sequence: MotionSequence, where: str) -> MotionSequence:
    """Returns the same sequence. `InputError`, which `where` leads, if its arrays do not fit together or are not
    finite."""
    check_arrays({name: np.asarray(getattr(sequence, name)) for name in ARRAYS}, where)
    return sequence


def check_arrays(arrays: Mapping[str, np.ndarray], where: str) -> None:
    """Raise `InputError`, which `where` leads, if the arrays of a sequence do not fit together or are not finite."""
    times, vertices, faces, weights = (arrays[name] for name in ARRAYS)
    if vertices.ndim != 3 or vertices.shape[2] != 3 or vertices.shape[1] < 2 or vertices.dtype.kind != "f":
        raise InputError(f"{where}: expected vertices (T, N, 3), got {vertices.dtype} {vertices.shape}")
    frames, count = vertices.shape[:2]
    if times.shape != (frames,) or weights.shape != (count,) or frames < 2:
        raise InputError(
            f"{where}: expected at least 2 frames, with times ({frames},) and weights ({count},), got times "
            f"{times.shape} and weights {weights.shape}"
        )
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise InputError(f"{where}: expected faces (F, 3) of integers, got {faces.dtype} {faces.shape}")
    if faces.min(initial=0) < 0 or faces.max(initial=0) >= count:
        raise InputError(f"{where}: faces refer to vertices that do not exist")
    floats = (times, weights, vertices)
    if not all(array.dtype.kind == "f" and np.isfinite(array).all() for array in floats):
        raise InputError(f"{where}: expected finite times, weights and vertices")
    if not (np.diff(times) > 0.0).all() or np.abs(vertices).max() > FARTHEST:
        raise InputError(f"{where}: expected times that increase, and vertices within {FARTHEST:g} m")
