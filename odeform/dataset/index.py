"""A data set: an index of sequences, and a reader of one sequence at a time."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from odeform.errors import InputError
from odeform.io import parse_json
from odeform.schema import OBJECT, Schema
from odeform.types import MotionSequence

__all__ = ["Dataset", "Entry", "Reader", "assign_splits", "assign_splits_in_blocks", "index_from_json", "index_to_json"]

FORMAT = 1
BLOCK = 10  # sequences in which splits have their proportions


@dataclass(frozen=True)
class Entry:
    """One sequence of the index. `status` is "ok", or the reason why its simulation failed."""

    name: str
    split: str
    parameters: dict[str, Any]
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

    @property
    def objects(self) -> tuple[str, ...]:
        """Names of the objects with sequences, in the order of the schema; () for a scene of one body.

        All sequences of an object have one mesh.
        """
        present = {entry.parameters.get(OBJECT) for entry in self.select("all")}
        return tuple(name for name in self.schema.objects if name in present)

    def select(self, split: str, object: str | None = None) -> list[Entry]:
        """Selects entries of the split "train", "val", "test" or "all" whose simulation succeeded.

        `object` restricts them to one object of a scene with several.

        Raises:
            InputError: An unknown split or object.
        """
        if split not in ("train", "val", "test", "all"):
            raise InputError(f"split: expected train, val, test or all, got {split!r}")
        if object is not None:
            self.schema.check_object(object)
        return [
            entry
            for entry in self.entries
            if entry.status == "ok" and split in ("all", entry.split) and object in (None, entry.parameters.get(OBJECT))
        ]

    def of(self, *objects: str) -> "Dataset":
        """The sequences of these objects alone, failed ones included. `InputError` for an object that is not there."""
        wanted = {self.schema.check_object(name) for name in objects}
        schema = replace(self.schema, objects=tuple(name for name in self.schema.objects if name in wanted))
        entries = tuple(entry for entry in self.entries if entry.parameters.get(OBJECT) in wanted)
        return replace(self, schema=schema, entries=entries)

    def part(self, index: int, count: int) -> "Dataset":
        """Part `index` of `count`, from 1: every `count`-th entry of each split and object, failed ones included.
        `InputError` for another index."""
        if not 1 <= index <= count:
            raise InputError(f"part: expected 1 to {count}, got {index}")
        seen: Counter[tuple[str, Any]] = Counter()
        kept = []
        for entry in self.entries:
            group = entry.split, entry.parameters.get(OBJECT)
            if seen[group] % count == index - 1:
                kept.append(entry)
            seen[group] += 1
        return replace(self, entries=tuple(kept))

    def sequences(self, split: str, object: str | None = None) -> Iterator[MotionSequence]:
        """The sequences of a split, read one at a time; see `select`."""
        return (self.read(entry) for entry in self.select(split, object))


def assign_splits(count: int, seed: int) -> list[str]:
    """Assigns 70 % to train, 10 % to val, 20 % to test, in random order."""
    return _shuffled(count, np.random.default_rng(seed))


def assign_splits_in_blocks(count: int, seed: int, standard: int) -> list[str]:
    """Assigns splits as `assign_splits` does in each block of ten, up to `standard` sequences; the rest is for
    training.

    A longer list starts with the shorter one.
    """
    rng = np.random.default_rng(seed)
    blocks = -(-standard // BLOCK)
    labels = [label for _ in range(blocks) for label in _shuffled(BLOCK, rng)][:standard]
    return [*labels, *["train"] * (count - standard)][:count]


def _shuffled(count: int, rng: np.random.Generator) -> list[str]:
    train, val = round(0.7 * count), round(0.1 * count)
    labels = np.array(["train"] * train + ["val"] * val + ["test"] * (count - train - val))
    return [str(label) for label in rng.permutation(labels)]


def index_to_json(dataset: Dataset, **more: Any) -> bytes:
    """Returns the index as JSON, with `more` keys."""
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
    index = parse_json(data, str(where))
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise InputError(f"{where}: expected an index of format {FORMAT}")
    try:
        schema = Schema.from_json(index["schema"])
        entries = tuple(_entry(entry, schema) for entry in index["sequences"])
        fixed = {str(name): float(value) for name, value in index["fixed"].items()}
        return Dataset(root, schema, entries, reader(index), fixed, dict(index["provenance"]))
    except InputError as error:
        raise InputError(error if str(where) in str(error) else f"{where}: {error}") from None
    except (KeyError, TypeError, AttributeError, ValueError, OverflowError) as error:
        raise InputError(f"{where}: missing or invalid field {error}") from None


def _entry(raw: Mapping[str, Any], schema: Schema) -> Entry:
    entry = Entry(**raw)
    for text in (entry.name, entry.split, entry.sha256, entry.status):
        if not isinstance(text, str):
            raise TypeError(f"{text!r}: expected text")
    if not isinstance(entry.parameters, dict):
        raise TypeError(f"{entry.parameters!r}: expected parameters by name")
    if "\0" in entry.name:
        raise ValueError(f"{entry.name!r}: expected the name of a file")
    schema.complete(schema.known(entry.parameters))
    return entry
