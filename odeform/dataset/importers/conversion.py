"""Conversion of an importer's source to a data set."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.dataset.folder import folder_reader, save_sequence, write_index
from odeform.dataset.importers.source import Source, SourceSequence
from odeform.dataset.importers.units import METRES, body_size, size_doubts
from odeform.dataset.index import Dataset, Entry, assign_splits
from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.progress import Progress
from odeform.schema import Parameter, Schema, Window
from odeform.types import Mesh, MotionSequence

__all__ = ["convert_source"]

SAME = 1e-6  # relative to the value or to one: parameters that differ by less do not vary


def convert_source(
    source: Source, out: Path, seed: int = 0, unit: str = "m", renamed: Callable[[str], str] = str
) -> Dataset:
    """Write a source as a data set into the folder `out`.

    Parameters that do not vary become `fixed`. Splits are those of the source, or drawn 70/10/20 by `seed` if any
    sequence lacks one. Lengths are in `unit`, but of sequences that say their own. A sequence that cannot be read is
    listed with the reason, `renamed` as all that a user reads. Raises `InputError` if none can be read, if no parameter
    varies, or if the meshes differ.
    """
    if not source.sequences:
        raise InputError("import: expected at least one sequence")
    schema, fixed = _schema(source)
    splits = [found.split for found in source.sequences]
    drawn = not all(splits)
    if drawn:
        splits = assign_splits(len(splits), seed)
    doubts = list(source.doubts)
    provenance = {**source.provenance, "rate_hz": source.rate, **({"split_seed": seed} if drawn else {})}
    if unit != "m" and any(found.metric for found in source.sequences):
        doubts.append(f"the unit {unit} is not used where files say their own")
    provenance |= {} if unit == "m" else {"unit": unit}
    entries: list[Entry] = []
    mesh: Mesh | None = None
    progress = Progress("import", len(splits))
    for found, split in zip(source.sequences, splits, strict=True):
        parameters = schema.complete({p.name: found.parameters[p.name] for p in schema.parameters})
        entry = Entry(found.name, split, parameters)
        try:
            sequence = _read(found, source.rate, 1.0 if found.metric else METRES[unit])
        except InputError as error:
            entries.append(replace(entry, status=renamed(str(error))))
            progress.advance(note=entries[-1].status)
            continue
        if mesh is None:
            provenance["size_m"] = body_size(sequence.vertices[0])
            doubts += size_doubts(provenance["size_m"], found.name, "m" if found.metric else unit)
        mesh = mesh or sequence.rest
        if np.array_equal(sequence.vertices, np.broadcast_to(sequence.vertices[0], sequence.vertices.shape)):
            doubts.append(f"{found.name}: nothing moves: all {len(sequence.vertices)} frames are the same")
        _require_same_mesh(mesh, sequence.rest, found.name)
        entries.append(replace(entry, sha256=save_sequence(out, found.name, sequence)))
        progress.advance()
    progress.close()
    if mesh is None:
        raise InputError(f"import: none of {len(entries)} sequences can be read; {entries[0].status}")
    provenance |= {"notes": list(map(renamed, doubts))} if doubts else {}
    dataset = Dataset(out, schema, tuple(entries), folder_reader(out), fixed, provenance)
    write_index(dataset)
    return dataset


def _read(found: SourceSequence, rate: float, metres: float) -> MotionSequence:
    vertices, faces = found.read()
    vertices = vertices if metres == 1.0 else metres * vertices
    if not np.isfinite(vertices).all():
        frame, vertex, _ = np.argwhere(~np.isfinite(vertices))[0]
        raise InputError(f"{found.name}: expected finite vertices, frame {frame} has another number at vertex {vertex}")
    weights = surface_weights(Mesh(vertices[0], faces))
    return MotionSequence(np.arange(len(vertices)) / rate, vertices.astype(np.float32), faces, weights, name=found.name)


def _require_same_mesh(mesh: Mesh, other: Mesh, name: str) -> None:
    """A model learns one body: the same vertices and faces in all sequences."""
    if mesh.points.shape != other.points.shape or not np.array_equal(mesh.faces, other.faces):
        sizes = " and ".join(f"{len(m.points)} vertices, {len(m.faces)} faces" for m in (mesh, other))
        raise InputError(
            f"import: {name} has another mesh than sequences before it ({sizes}): import one object at a time"
        )


def _schema(source: Source) -> tuple[Schema, dict[str, float]]:
    """The schema of the parameters that vary, and the values of those that do not."""
    names = list(source.sequences[0].parameters)
    for found in source.sequences:
        if list(found.parameters) != names:
            raise InputError(f"import: {found.name} has parameters {', '.join(found.parameters)}, others {names}")
        if found.frames < 2:
            raise InputError(f"import: {found.name}: expected at least 2 frames, got {found.frames}")
    values = {name: np.array([found.parameters[name] for found in source.sequences]) for name in names}
    varied, fixed = [], {}
    for name, column in values.items():
        low, high = float(column.min()), float(column.max())
        if not np.isfinite(column).all():
            raise InputError(f"import: parameter {name}: expected finite numbers")
        if high - low <= SAME * max(abs(low), abs(high), 1.0):
            fixed[name] = float(column[0])
            continue
        logarithmic = name in source.log_scaled and low > 0.0
        middle = float(np.sqrt(low * high)) if logarithmic else 0.5 * (low + high)
        scale = "log" if logarithmic else "linear"
        varied.append(Parameter(name, source.units.get(name, ""), low, high, middle, scale))
    if not varied:
        raise InputError(
            f"import: expected a parameter that varies, got constant {', '.join(names) or 'no parameters'}"
        )
    count = min(found.frames for found in source.sequences)
    window = Window(0.0, (count - 1) / source.rate, source.rate)
    return Schema(source.scene, tuple(varied), window, notes=source.notes), fixed
