"""Data sets in a folder, as the simulator writes them: an index `dataset.json`, one `.npz` per sequence.

The index contains the schema, fixed quantities, and for each sequence its SHA-256, split, parameters and status. The
arrays are `times (T,)` s, `vertices (T, N, 3)` m float32, `faces (F, 3)` and `weights (N,)`. Files are written under a
temporary name and renamed, so an interrupted run leaves valid files.
"""

import hashlib
import io
from pathlib import Path

import numpy as np

from odeform.budget import MEMORY, read_limited
from odeform.dataset.arrays import checked_sequence, read_arrays
from odeform.dataset.index import Dataset, Entry, Reader, index_from_json, index_to_json
from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.types import MotionSequence

__all__ = ["INDEX", "encode_sequence", "folder_reader", "open_folder", "save_encoded", "save_sequence", "write_index"]

INDEX = "dataset.json"
LARGEST_INDEX = 1 << 26  # bytes


def folder_reader(root: Path) -> Reader:
    """Loads sequences from the folder `root`."""

    def read(entry: Entry) -> MotionSequence:
        path = root / f"{entry.name}.npz"
        try:
            if not path.resolve().is_relative_to(root.resolve()):
                raise InputError(f"{path}: outside of the data set")
            data = read_limited(path, str(path), MEMORY // 4)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        if hashlib.sha256(data).hexdigest() != entry.sha256:
            raise InputError(f"{path}: checksum does not match {INDEX}; the file is damaged or was changed")
        sequence = MotionSequence(**read_arrays(data, str(path)), parameters=dict(entry.parameters), name=entry.name)
        return checked_sequence(sequence, str(path))

    return read


def encode_sequence(sequence: MotionSequence) -> bytes:
    """The contents of a sequence's file. The same sequence gives the same bytes."""
    buffer = io.BytesIO()
    np.savez(
        buffer,
        times=sequence.times,
        vertices=sequence.vertices.astype(np.float32),
        faces=sequence.faces.astype(np.int32),
        weights=sequence.weights,
    )
    return buffer.getvalue()


def save_sequence(root: Path, name: str, sequence: MotionSequence) -> str:
    """Write one sequence to `<root>/<name>.npz` and return its SHA-256."""
    return save_encoded(root, name, encode_sequence(sequence))


def save_encoded(root: Path, name: str, data: bytes) -> str:
    """Write what `encode_sequence` returned as `save_sequence` does."""
    atomic_write(root / f"{name}.npz", data)
    return hashlib.sha256(data).hexdigest()


def write_index(dataset: Dataset) -> None:
    """Write `dataset.json` to the folder of the data set."""
    atomic_write(dataset.root / INDEX, index_to_json(dataset))


def open_folder(root: Path) -> Dataset:
    """Open the data set in the folder `root`. Raises `InputError` if there is none."""
    try:
        data = read_limited(root / INDEX, str(root / INDEX), LARGEST_INDEX)
    except OSError as error:
        raise InputError(f"{root}: expected a data set folder with {INDEX}: {error.strerror}") from None
    return index_from_json(data, root / INDEX, root, lambda _: folder_reader(root))
