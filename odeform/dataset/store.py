"""Sequences on disk: one folder, an index `dataset.json`, one `.npz` a sequence.

Format 1. The index holds the schema, what is fixed, and for each sequence its file, SHA-256, split, parameters and
status; arrays are `times (T,)`, `vertices (T, N, 3)` float32, `faces (F, 3)`, `weights (N,)`. Sequences are read
one at a time. Everything is written aside and renamed, so an interrupted run leaves valid files.
"""

import hashlib
import json
import os
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import Sequence

__all__ = ["Dataset", "Entry", "assign_splits", "open_dataset", "save_sequence", "write_aside", "write_index"]

FORMAT = 1
INDEX = "dataset.json"


@dataclass(frozen=True)
class Entry:
    """One sequence of the index. `status` is "ok", or why the simulator gave none."""

    name: str
    split: str
    parameters: dict[str, float]
    sha256: str = ""
    status: str = "ok"


@dataclass(frozen=True)
class Dataset:
    """An opened data set; holds the index, reads sequences when asked."""

    root: Path
    schema: Schema
    entries: tuple[Entry, ...]
    fixed: dict[str, float] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)

    def select(self, split: str) -> list[Entry]:
        """Sound entries of "train", "val", "test" or "all"."""
        if split not in ("train", "val", "test", "all"):
            raise InputError(f"split: expected train, val, test or all, got {split!r}")
        return [e for e in self.entries if e.status == "ok" and split in ("all", e.split)]

    def read(self, entry: Entry) -> Sequence:
        path = self.root / f"{entry.name}.npz"
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        if hashlib.sha256(data).hexdigest() != entry.sha256:
            raise InputError(f"{path}: checksum does not match {INDEX}; the file is damaged or was changed")
        with np.load(path, allow_pickle=False) as arrays:
            return Sequence(
                arrays["times"],
                arrays["vertices"],
                arrays["faces"],
                arrays["weights"],
                dict(entry.parameters),
                entry.name,
            )

    def sequences(self, split: str) -> Iterator[Sequence]:
        return (self.read(entry) for entry in self.select(split))


def write_aside(path: Path, data: bytes) -> None:
    """Write a file so that at any moment either the old or the new one is there, whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(aside, 0o644)
        os.replace(aside, path)
    except BaseException:
        Path(aside).unlink(missing_ok=True)
        raise


def save_sequence(root: Path, name: str, sequence: Sequence) -> str:
    """Store one sequence; returns its SHA-256."""
    import io

    buffer = io.BytesIO()
    np.savez(
        buffer,
        times=sequence.times,
        vertices=sequence.vertices.astype(np.float32),
        faces=sequence.faces.astype(np.int32),
        weights=sequence.weights,
    )
    data = buffer.getvalue()
    write_aside(root / f"{name}.npz", data)
    return hashlib.sha256(data).hexdigest()


def assign_splits(count: int, seed: int) -> list[str]:
    """70 % train, 10 % val, 20 % test, drawn at random."""
    train, val = round(0.7 * count), round(0.1 * count)
    labels = np.array(["train"] * train + ["val"] * val + ["test"] * (count - train - val))
    return [str(label) for label in np.random.default_rng(seed).permutation(labels)]


def write_index(dataset: Dataset) -> None:
    index = {
        "format": FORMAT,
        "schema": dataset.schema.to_json(),
        "fixed": dataset.fixed,
        "provenance": dataset.provenance,
        "sequences": [asdict(entry) for entry in dataset.entries],
    }
    write_aside(dataset.root / INDEX, json.dumps(index, indent=1).encode())


def open_dataset(path: str | Path) -> Dataset:
    """The data set in that folder."""
    root = Path(path)
    try:
        index = json.loads((root / INDEX).read_text())
    except OSError as error:
        raise InputError(f"{root}: expected a data set folder with {INDEX}: {error.strerror}") from None
    except ValueError:
        raise InputError(f"{root / INDEX}: not valid JSON") from None
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise InputError(f"{root / INDEX}: expected an index of format {FORMAT}")
    try:
        entries = tuple(Entry(**entry) for entry in index["sequences"])
        return Dataset(root, Schema.from_json(index["schema"]), entries, index["fixed"], index["provenance"])
    except (KeyError, TypeError) as error:
        raise InputError(f"{root / INDEX}: missing or wrong field {error}") from None
