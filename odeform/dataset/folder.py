"""Data sets in a folder, as the simulator writes them: an index `dataset.json`, one `.npz` per sequence.

The index contains the schema, fixed quantities, and for each sequence its SHA-256, split, parameters and status. The
arrays are `times (T,)` s, `vertices (T, N, 3)` m float32, `faces (F, 3)` and `weights (N,)`. Files are written under a
temporary name and renamed, so an interrupted run leaves valid files.
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
    """Loads sequences from the folder `root`."""

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
    """Write one sequence to `<root>/<name>.npz` and return its SHA-256."""
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
    """Write `dataset.json` to the folder of the data set."""
    atomic_write(dataset.root / INDEX, index_to_json(dataset))


def open_folder(root: Path) -> Dataset:
    """Open the data set in the folder `root`. Raises `InputError` if there is none."""
    try:
        data = (root / INDEX).read_bytes()
    except OSError as error:
        raise InputError(f"{root}: expected a data set folder with {INDEX}: {error.strerror}") from None
    return index_from_json(data, root / INDEX, root, lambda _: folder_reader(root))
