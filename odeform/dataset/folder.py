"""Sequences in a folder, as the simulator writes them: an index `dataset.json`, one `.npz` a sequence.

The index holds the schema, what is fixed, and for each sequence its SHA-256, split, parameters and status; arrays are
`times (T,)`, `vertices (T, N, 3)` float32, `faces (F, 3)`, `weights (N,)`. Every file is written under a temporary
name and renamed, so an interrupted run leaves valid files.
"""

import hashlib
import io
from pathlib import Path

import numpy as np

from odeform.dataset.index import Dataset, Entry, Reader, index_from_json, index_to_json
from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.types import MotionSequence

__all__ = ["INDEX", "folder_reader", "open_folder", "save_sequence", "write_index"]

INDEX = "dataset.json"


def folder_reader(root: Path) -> Reader:
    def read(entry: Entry) -> MotionSequence:
        path = root / f"{entry.name}.npz"
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        if hashlib.sha256(data).hexdigest() != entry.sha256:
            raise InputError(f"{path}: checksum does not match {INDEX}; the file is damaged or was changed")
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return MotionSequence(
                arrays["times"],
                arrays["vertices"],
                arrays["faces"],
                arrays["weights"],
                dict(entry.parameters),
                entry.name,
            )

    return read


def save_sequence(root: Path, name: str, sequence: MotionSequence) -> str:
    """Store one sequence; returns its SHA-256."""
    buffer = io.BytesIO()
    np.savez(
        buffer,
        times=sequence.times,
        vertices=sequence.vertices.astype(np.float32),
        faces=sequence.faces.astype(np.int32),
        weights=sequence.weights,
    )
    data = buffer.getvalue()
    atomic_write(root / f"{name}.npz", data)
    return hashlib.sha256(data).hexdigest()


def write_index(dataset: Dataset) -> None:
    atomic_write(dataset.root / INDEX, index_to_json(dataset))


def open_folder(root: Path) -> Dataset:
    try:
        data = (root / INDEX).read_bytes()
    except OSError as error:
        raise InputError(f"{root}: expected a data set folder with {INDEX}: {error.strerror}") from None
    return index_from_json(data, root / INDEX, root, lambda _: folder_reader(root))
