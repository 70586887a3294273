"""What stands side by side: models under the sliders, models pinned at parameters of their own, the truth."""

import itertools
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.geometry.shape import Fit
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.schema import Schema
from odeform.types import Geometry

__all__ = ["Column", "Columns", "truth_column"]

MOST = 12  # columns; more than that nobody tells apart


@dataclass(frozen=True, eq=False)
class Column:
    """One motion beside the others: of a model or a record, of a shape, at the sliders or `pinned`."""

    label: str
    source: Predictor | RecordedMotion
    geometry: Geometry
    pinned: Mapping[str, float] | None = None
    origin: str = ""
    """The checkpoint's name or path as it was asked for, or DATASET/NAME of a record; empty for what was made here."""
    fit: Fit | None = None
    """How a shape that was not trained came to lie where the body does; None for the body itself."""
    shown: bool = True
    key: int = -1
    """Given by `Columns`; the same while a column is shown and hidden."""
    place: int = -1
    """Given by `Columns`: the lowest that no other model has, for a colour of its own while it lasts."""

    @property
    def foreign(self) -> bool:
        """Whether the shape is another than the body that was trained."""
        return self.fit is not None

    @property
    def truth(self) -> RecordedMotion | None:
        return self.source if isinstance(self.source, RecordedMotion) else None

    @property
    def predictor(self) -> Predictor | None:
        return None if isinstance(self.source, RecordedMotion) else self.source


class Columns:
    """The columns at hand, changed by callbacks of any thread and read as snapshots."""

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._columns: tuple[Column, ...] = ()
        self._lock = threading.Lock()
        self._keys = itertools.count()

    @property
    def all(self) -> tuple[Column, ...]:
        return self._columns

    def add(self, *columns: Column) -> None:
        """At the end; labels already taken are numbered. A record replaces the one before: there is one truth."""
        with self._lock:
            kept = list(self._columns)
            for column in columns:
                lacks = self._lacks(column)
                if column.truth is not None:
                    kept = [c for c in kept if c.truth is None]
                note = f" (no {', '.join(lacks)})" if lacks else ""
                label = column.label if note in column.label else column.label + note
                taken = {c.place for c in kept if c.predictor}
                place = next(n for n in itertools.count() if n not in taken)
                label = _unused(label, {c.label for c in kept})
                kept.append(replace(column, label=label, key=next(self._keys), place=place))
            if len(kept) > MOST:
                raise InputError(f"{len(kept)} columns: expected at most {MOST}; remove some first")
            self._columns = tuple(kept)

    def _lacks(self, column: Column) -> list[str]:
        """The sliders that a model does not heed. `InputError` for another scene."""
        schema = column.source.schema
        if schema.scene != self._schema.scene:
            raise InputError(f"cannot compare {column.label}: it is of scene {schema.scene}, not {self._schema.scene}")
        heeded = {p.name for p in schema.parameters}
        return [p.name for p in self._schema.parameters if p.name not in heeded]

    def remove(self, key: int) -> None:
        with self._lock:
            self._columns = tuple(c for c in self._columns if c.key != key)

    def restart(self, columns: Sequence[Column]) -> None:
        """Other columns in place of all; unchanged if one of them is refused."""
        fresh = Columns(self._schema)
        fresh._keys = self._keys
        fresh.add(*columns)
        with self._lock:
            self._columns = fresh._columns

    def show(self, key: int, shown: bool) -> None:
        with self._lock:
            self._columns = tuple(replace(c, shown=shown) if c.key == key else c for c in self._columns)

    def reshape(self, fit: Fit | None) -> None:
        """Another shape for all models; None for the body that each was trained on."""
        with self._lock:
            self._columns = tuple(
                replace(c, geometry=fit.geometry if fit else c.predictor.rest, fit=fit) if c.predictor else c
                for c in self._columns
            )

    @classmethod
    def of(cls, columns: Sequence[Column]) -> "Columns":
        """`InputError` for models of different scenes."""
        out = cls(columns[0].source.schema)
        out.add(*columns)
        return out


def _unused(label: str, taken: set[str]) -> str:
    names = itertools.chain([label], (f"{label} #{n}" for n in itertools.count(2)))
    return next(name for name in names if name not in taken)


def truth_column(origin: str) -> Column:
    """A sequence by DATASET/NAME: of a folder, of a packed file, or of a scene's bundled copy."""
    root, _, name = origin.rpartition("/")
    dataset = open_dataset(root or ".")
    entry = next((e for e in dataset.select("all") if e.name == name.removesuffix(".npz")), None)
    if entry is None:
        raise InputError(f"sequence {origin}: {dataset.root} has no sequence {name!r}")
    motion = RecordedMotion(dataset.schema, dataset.read(entry), dataset.fixed)
    return Column("truth", motion, motion.geometry, origin=origin)
