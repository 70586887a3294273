"""Reads a recording back as plain values and arrays. Nothing is unpickled."""

import json
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import Chunk, RrdReader

from odeform.errors import InputError
from odeform.types import Faces, Floats, Points
from odeform_viz.recording.entities import (
    COEFFICIENTS,
    END,
    FORMAT,
    FRAME,
    HEADER,
    MODES,
    OLD_FORMAT,
    OLD_REQUEST,
    POINTS,
    PROVENANCE,
    REQUEST,
    REST,
    WORLD,
)
from odeform_viz.recording.modes import decode

__all__ = ["Recording", "read_recording"]

TEXT = "TextDocument:text"
POSITIONS = ("Mesh3D:vertex_positions", "Points3D:positions")
SCALARS = "Scalars:scalars"


@dataclass(eq=False)
class Recording:
    """The contents of `path`. Columns are keyed by name, `column_KEY/form_N`; frames are counted from 0."""

    path: Path
    header: Mapping[str, Any] = field(default_factory=dict)
    """Format and versions of packages."""
    columns: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    """The provenance of each column."""
    requests: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    """Reads `{"time", "quality", "parameters", "columns"}` of each frame.

    `columns` gives, for each visible column, the frame in which its points were logged.
    """
    rest: dict[str, Points] = field(default_factory=dict)
    """(N, 3) m: the points of each column at rest."""
    faces: dict[str, Faces] = field(default_factory=dict)
    """(F, 3): the faces of columns that are meshes."""
    modes: dict[str, dict[int, Points]] = field(default_factory=dict)
    """Reads a mode (N, 3) of each column's deformations, by the frame that added it; see `recording.modes`."""
    coefficients: dict[tuple[str, int], Floats] = field(default_factory=dict)
    """(M,) in m, of the first M modes: the points of a column in a frame."""
    poses: dict[tuple[str, int], Floats] = field(default_factory=dict)
    """(4, 4), in m: the pose of a column in a frame."""
    frames: int | None = None
    """The number of frames; None if the recording was not closed."""

    def points(self) -> Iterator[tuple[str, int, Points]]:
        """Column, frame and points (N, 3) in m before the pose, one by one: they may not fit into memory."""
        modes = {name: np.array([some[frame] for frame in sorted(some)]) for name, some in self.modes.items()}
        for name, frame in sorted(self.coefficients, key=lambda key: (key[1], key[0])):
            coefficients, known = self.coefficients[name, frame], modes.get(name, np.zeros((0, 1, 3)))
            if len(coefficients) <= len(known):  # the last ones of a killed process may be lost
                yield name, frame, decode(self.rest[name], known, coefficients)
        kind = WORLD if self.header["odeform_recording"] == OLD_FORMAT else POINTS
        for chunk in _chunks(self.path, list(POSITIONS)):
            found, _, name = chunk.entity_path.strip("/").partition("/")
            if found == kind and not chunk.is_static:
                batch = chunk.to_record_batch()
                for component in set(POSITIONS) & set(batch.schema.names):
                    for frame, row in _rows(batch, component):
                        yield name.removesuffix("/body"), frame, _floats(row, 3)


def read_recording(path: str | Path) -> Recording:
    """Read everything but the points of frames. `InputError` for other files and for damaged ones."""
    recording = Recording(Path(path))
    try:
        for chunk in _chunks(recording.path):
            _read_chunk(recording, chunk)
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise _refused(path, f"damaged: {error}") from None
    if not recording.header:
        raise _refused(path, "a Rerun recording, but not one of ODeform")
    return recording


def _refused(path: str | Path, why: object) -> InputError:
    return InputError(f"recording {path}: {why}")


def _chunks(path: Path, components: list[str] | None = None) -> Iterator[Chunk]:
    if not path.is_file():
        raise _refused(path, "there is no such file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a killed process leaves no footer
            stream = RrdReader(path).stream()
        yield from stream if components is None else stream.filter(components=components)
    except (RuntimeError, ValueError) as error:
        cut = "exceeds file size" in str(error)
        why = "truncated in the middle of a message" if cut else f"not a Rerun recording, or damaged: {error}"
        raise _refused(path, why) from None


def _read_chunk(recording: Recording, chunk: Chunk) -> None:
    """Add the contents of one chunk to a recording."""
    kind, _, name = chunk.entity_path.strip("/").partition("/")
    batch = chunk.to_record_batch()
    components = set(batch.schema.names)
    if kind in (REQUEST, OLD_REQUEST):
        recording.requests.update({frame: json.loads(_text(row)) for frame, row in _rows(batch, TEXT)})
    elif kind == HEADER:
        recording.header = _header(recording.path, json.loads(_text(batch.column(TEXT)[0])))
    elif kind == END:
        recording.frames = int(json.loads(_text(batch.column(TEXT)[0]))["frames"])
    elif kind == PROVENANCE:
        recording.columns[name] = json.loads(_text(batch.column(TEXT)[0]))
    elif kind == REST:
        recording.rest[name] = _floats(batch.column(POSITIONS[1])[0], 3)
    elif kind == MODES:
        rows = _rows(batch, POSITIONS[1])
        recording.modes.setdefault(name, {}).update({frame: _floats(row, 3) for frame, row in rows})
    elif kind == COEFFICIENTS:
        rows = _rows(batch, SCALARS)
        recording.coefficients.update({(name, frame): row.values.to_numpy()[:-1] for frame, row in rows})
    elif kind == WORLD and name.endswith("/body") and "Mesh3D:triangle_indices" in components:
        faces = batch.column("Mesh3D:triangle_indices")[0].values.flatten().to_numpy()
        recording.faces[name.removesuffix("/body")] = faces.astype(np.int64).reshape(-1, 3)
    elif kind == WORLD and "Transform3D:mat3x3" in components:
        shifts = dict(_rows(batch, "Transform3D:translation"))
        for frame, row in _rows(batch, "Transform3D:mat3x3"):
            pose = np.eye(4)
            pose[:3, :3] = _floats(row, 3).T  # Rerun stores matrices by columns
            pose[:3, 3] = _floats(shifts[frame], 3)[0]
            recording.poses[name.removesuffix("/body"), frame] = pose


def _header(path: Path, header: Mapping[str, Any]) -> Mapping[str, Any]:
    found = header.get("odeform_recording")
    if found not in (OLD_FORMAT, FORMAT):
        made_by = header["versions"].get("odeform")
        raise _refused(
            path, f"expected format {OLD_FORMAT} or {FORMAT}, got format {found!r}, written by odeform {made_by}"
        )
    return header


def _rows(batch: pa.RecordBatch, component: str) -> Iterator[tuple[int, pa.ListScalar]]:
    """Frame and value of the rows that have a value."""
    column = batch.column(component)
    for frame, row in zip(batch.column(FRAME).to_pylist(), column, strict=True):
        if row.values is not None and len(row.values):
            yield frame, row


def _text(row: pa.ListScalar) -> str:
    return row.values[0].as_py()


def _floats(row: pa.ListScalar, width: int) -> Points:
    return row.values.flatten().to_numpy().reshape(-1, width)
