"""The columns of the page: models under the sliders, models pinned at parameters of their own, and the truth."""

import itertools
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from odeform.errors import InputError
from odeform.geometry.shape import FittedShape
from odeform.loads.registry import PUSH, load_of_scene
from odeform.models.base import Predictor
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.schema import Parameters, Schema
from odeform.simulation.recorded import read_truth
from odeform.types import Geometry
from odeform_viz.words import parameter_title

__all__ = ["Column", "Columns", "columns_under", "truth_column"]

MOST = 12  # columns; nobody can tell more of them apart


@dataclass(frozen=True, eq=False)
class Column:
    """One motion among others, under the sliders or `pinned` at parameters.

    It is that of a model, one that is predicted already, or a recorded sequence.
    """

    label: str
    source: Predictor | Motion | RecordedMotion
    geometry: Geometry
    pinned: Mapping[str, float] | None = None
    origin: str = ""
    """The checkpoint's name or path as the user gave it, or DATASET/NAME of a sequence; empty if it is in no file."""
    fit: FittedShape | None = None
    """How a loaded shape was fitted to the trained body; None for the trained body itself."""
    visible: bool = True
    key: int = -1
    """Assigned by `Columns`; constant while a column is hidden, shown or given another shape."""
    color_index: int = -1
    """Assigned by `Columns`: the lowest that no other model has, so that each keeps a colour of its own."""
    fitted: bool = False
    """Whether its parameters were estimated from the truth: it is compared with it whatever they are."""
    rank: float | None = None
    """Its place from 0 to 1 in a sweep of an ordered parameter, whose columns have ordered colours; None outside."""

    @property
    def loaded(self) -> bool:
        """Whether the shape was loaded, in place of the trained body."""
        return self.fit is not None

    @property
    def truth(self) -> RecordedMotion | None:
        """The recorded motion; None for a model's column."""
        return self.source if isinstance(self.source, RecordedMotion) else None

    @property
    def predictor(self) -> Predictor | None:
        """The model; None for a recorded motion, and for one that is predicted already."""
        return self.source if isinstance(self.source, Predictor) else None


class Columns:
    """The current columns: changed by callbacks on any thread, read as immutable snapshots."""

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._columns: tuple[Column, ...] = ()
        self._lock = threading.Lock()
        self._keys = itertools.count()

    @property
    def all(self) -> tuple[Column, ...]:
        """A snapshot of all columns, hidden ones included, in display order."""
        return self._columns

    @property
    def truth(self) -> Column | None:
        """The recorded sequence, if there is one."""
        return next((column for column in self._columns if column.truth), None)

    def add(self, *columns: Column) -> None:
        """Append columns. Labels already taken are numbered; a sequence replaces the one before.

        `InputError` for a model of another scene, or for too many columns.
        """
        with self._lock:
            kept = list(self._columns)
            for column in columns:
                missing = self._missing_parameters(column)
                if column.truth is not None:
                    kept = [c for c in kept if c.truth is None]
                note = f" (no {', '.join(missing)})" if missing else ""
                label = column.label if note in column.label else column.label + note
                taken = {c.color_index for c in kept if c.predictor}
                color_index = next(n for n in itertools.count() if n not in taken)
                label = _unused(label, {c.label for c in kept})
                kept.append(replace(column, label=label, key=next(self._keys), color_index=color_index))
            if len(kept) > MOST:
                raise InputError(f"{len(kept)} columns: expected at most {MOST}; remove some first")
            self._columns = tuple(kept)

    def _missing_parameters(self, column: Column) -> list[str]:
        """The sliders that have no effect on a model. `InputError` for a model of another scene."""
        schema = column.source.schema
        if schema.scene != self._schema.scene:
            raise InputError(
                f"cannot compare {column.label}: its scene is {schema.scene}, expected {self._schema.scene}"
            )
        names = {p.name for p in schema.parameters} | set(column.truth.setting if column.truth else ())
        return [parameter_title(p) for p in self._schema.parameters if p.name not in names]

    def remove(self, key: int) -> None:
        """Remove a column, if it still exists."""
        with self._lock:
            self._columns = tuple(c for c in self._columns if c.key != key)

    def replace_all(self, columns: Sequence[Column]) -> None:
        """Replace all columns, with new keys. `InputError` as `add`; then nothing has changed."""
        fresh = Columns(self._schema)
        fresh._keys = self._keys
        fresh.add(*columns)
        with self._lock:
            self._columns = fresh._columns

    def change(self, changed: Callable[[Sequence[Column]], Sequence[Column]]) -> None:
        """Replace the columns by what `changed` makes of them, with the same keys and in the same order."""
        with self._lock:
            self._columns = tuple(changed(self._columns))

    def set_visible(self, key: int, visible: bool) -> None:
        """Show or hide a column, if it still exists."""
        with self._lock:
            self._columns = tuple(replace(c, visible=visible) if c.key == key else c for c in self._columns)

    def set_shape(self, fit: FittedShape | None) -> None:
        """Give all models another shape; None for the body that each was trained on."""
        with self._lock:
            self._columns = tuple(
                replace(c, geometry=_shape(c.predictor, fit), fit=fit) if c.predictor else c for c in self._columns
            )

    def follow(self, parameters: Parameters) -> None:
        """Give models of several objects the trained body that `parameters` select, or those they are pinned at."""
        with self._lock:
            followed = tuple(_followed(column, parameters) for column in self._columns)
            if any(new is not old for new, old in zip(followed, self._columns, strict=True)):
                self._columns = followed

    @classmethod
    def of(cls, columns: Sequence[Column]) -> "Columns":
        """Makes columns of the first one's scene. `InputError` for models of different scenes."""
        out = cls(columns[0].source.schema)
        out.add(*columns)
        return out


def _followed(column: Column, parameters: Parameters) -> Column:
    predictor = column.predictor
    if predictor is None or column.loaded or not predictor.schema.objects:
        return column
    body = predictor.settled(parameters if column.pinned is None else column.pinned)
    return column if column.geometry is body else replace(column, geometry=body)


def _shape(predictor: Predictor, fit: FittedShape | None) -> Geometry:
    """What is drawn of a shape that was loaded, or of a model's own body."""
    return predictor.shown(fit.geometry if fit else predictor.rest)


def _unused(label: str, taken: set[str]) -> str:
    names = itertools.chain([label], (f"{label} #{n}" for n in itertools.count(2)))
    return next(name for name in names if name not in taken)


def columns_under(columns: Sequence[Column], load: str) -> list[Column]:
    """The models of columns under another load of `odeform.loads`, where they can be, each with its own body.

    Truths, predicted motions, and models that know one scene only are left out. `InputError` if nothing is left.
    """
    out = []
    for column in columns:
        predictor = column.predictor
        if predictor is None or column.pinned is not None or load not in predictor.loads:
            continue
        found, base = predictor.under(load), column.origin.removesuffix(f":{_load_of(predictor)}")
        origin = base if load == PUSH or not base else f"{base}:{load}"
        out.append(replace(column, source=found, geometry=_shape(found, column.fit), origin=origin))
    if not out:
        raise InputError(f"load {load!r}: no model of the page computes its bodies under it")
    return out


def _load_of(predictor: Predictor) -> str:
    load = load_of_scene(predictor.schema.scene)
    return PUSH if load is None else load.name


def truth_column(origin: str) -> Column:
    """The sequence DATASET/NAME of a folder, a packed file, or a scene's bundled data set.

    `InputError` where there is no such data set or sequence.
    """
    motion = read_truth(origin)
    return Column("truth", motion, motion.geometry, origin=origin)
