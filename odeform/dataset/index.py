"""A data set: an index of sequences, and a reader of one sequence at a time."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import MotionSequence

__all__ = ["Dataset", "Entry", "Reader", "assign_splits", "index_from_json", "index_to_json"]

FORMAT = 1


@dataclass(frozen=True)
class Entry:
    """One sequence of the index. `status` is "ok", or the reason why its simulation failed."""

    name: str
    split: str
    parameters: dict[str, float]
    sha256: str = ""
    status: str = "ok"


@runtime_checkable
class Reader(Protocol):
    """Reads one sequence of a data set and checks its SHA-256."""

    def __call__(self, entry: Entry) -> MotionSequence: ...


@dataclass(frozen=True)
class Dataset:
    """An opened data set. It holds the index and reads sequences one at a time.

    Attributes:
        root: The folder or file.
        schema: Parameters and window of time of its scene.
        entries: One for each sequence, failed ones included.
        read: Reads the sequence of an entry.
        fixed: Physical quantities that are the same for all sequences, with units in their names.
        provenance: Where the data come from.

    Examples:
        >>> import odeform
        >>> dataset = odeform.open_dataset("kick")
        >>> len(dataset.select("test"))
        140
        >>> sequence = dataset.read(dataset.select("train")[0])
        >>> sequence.vertices.shape
        (121, 402, 3)
    """

    root: Path
    schema: Schema
    entries: tuple[Entry, ...]
    read: Reader = field(compare=False)
    fixed: dict[str, float] = field(default_factory=dict)
    """Quantities that are the same in all sequences, for instance a radius in m."""
    provenance: dict[str, Any] = field(default_factory=dict)

    def select(self, split: str) -> list[Entry]:
        """Entries of the split "train", "val", "test" or "all" whose simulation succeeded.

        Raises:
            InputError: An unknown split.
        """
        if split not in ("train", "val", "test", "all"):
            raise InputError(f"split: expected train, val, test or all, got {split!r}")
        return [e for e in self.entries if e.status == "ok" and split in ("all", e.split)]

    def sequences(self, split: str) -> Iterator[MotionSequence]:
        """The sequences of a split, read one at a time; see `select`."""
        return (self.read(entry) for entry in self.select(split))


def assign_splits(count: int, seed: int) -> list[str]:
    """70 % train, 10 % val, 20 % test, in random order."""
    train, val = round(0.7 * count), round(0.1 * count)
    labels = np.array(["train"] * train + ["val"] * val + ["test"] * (count - train - val))
    return [str(label) for label in np.random.default_rng(seed).permutation(labels)]


def index_to_json(dataset: Dataset, **more: Any) -> bytes:
    """The index as JSON, with `more` keys."""
    index = {
        "format": FORMAT,
        "schema": dataset.schema.to_json(),
        "fixed": dataset.fixed,
        "provenance": dataset.provenance,
        **more,
        "sequences": [asdict(entry) for entry in dataset.entries],
    }
    return json.dumps(index, indent=1).encode()


def index_from_json(data: bytes, where: Path, root: Path, reader: Any) -> Dataset:
    """The inverse of `index_to_json`; `reader(index)` makes the reader. Raises `InputError`, which names `where`."""
    try:
        index = json.loads(data)
    except ValueError:
        raise InputError(f"{where}: not valid JSON") from None
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise InputError(f"{where}: expected an index of format {FORMAT}")
    try:
        entries = tuple(Entry(**entry) for entry in index["sequences"])
        schema = Schema.from_json(index["schema"])
        return Dataset(root, schema, entries, reader(index), index["fixed"], index["provenance"])
    except (KeyError, TypeError) as error:
        raise InputError(f"{where}: missing or invalid field {error}") from None
