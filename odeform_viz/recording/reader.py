"""What a recording holds, and how it is read back: plain values and arrays. Nothing is unpickled."""

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

__all__ = [
    "END",
    "FORMAT",
    "HEADER",
    "MOTION",
    "PROVENANCE",
    "REQUEST",
    "REST",
    "SHOWN",
    "WORLD",
    "Recording",
    "read_recording",
]

FORMAT = 1

# timelines
SHOWN = "shown"  # the frames on screen, counted
MOTION = "motion_time"  # seconds of the motion

# entities; those of columns lie under them as column_KEY/form_N, N counting the shapes that a column has had
HEADER = "recording"  # format and versions
REQUEST = "request"  # for each frame what it takes to compute it again
OLD_REQUEST = "wish"  # its name in recordings of earlier versions
END = "end"  # how many frames; only a recording that was closed has it
PROVENANCE = "provenance"
REST = "rest"
WORLD = "world"

TEXT = "TextDocument:text"
POSITIONS = ("Mesh3D:vertex_positions", "Points3D:positions")


@dataclass(eq=False)
class Recording:
    """Read back from `path`. Columns go by name, `column_KEY/form_N`; frames are counted from 0.

    `requests` are those of frames, as `{"time", "quality", "parameters", "columns"}`; `columns` says for each name that
    is shown which frame's points it shows. `rest` are points (N, 3) in metres and `faces` (F, 3) those of meshes;
    `poses` (4, 4) in metres by name and frame. `frames` is how many there were at the end; None if there was no end.
    """

    path: Path
    header: Mapping[str, Any] = field(default_factory=dict)
    columns: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    requests: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    rest: dict[str, Points] = field(default_factory=dict)
    faces: dict[str, Faces] = field(default_factory=dict)
    poses: dict[tuple[str, int], Floats] = field(default_factory=dict)
    frames: int | None = None

    def points(self) -> Iterator[tuple[str, int, Points]]:
        """Name, frame and points (N, 3) in metres before the pose, one at a time: they may be more than fits memory."""
        for chunk in _chunks(self.path, list(POSITIONS)):
            kind, _, name = chunk.entity_path.strip("/").partition("/")
            if kind == WORLD and not chunk.is_static:
                batch = chunk.to_record_batch()
                for component in set(POSITIONS) & set(batch.schema.names):
                    for frame, row in _rows(batch, component):
                        yield name.removesuffix("/body"), frame, _floats(row, 3)


def read_recording(path: str | Path) -> Recording:
    """All but the points of frames. `InputError` in one line for what is no recording of ODeform, or is damaged."""
    recording = Recording(Path(path))
    try:
        for chunk in _chunks(recording.path):
            _take(recording, chunk)
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise _refused(path, f"damaged: {error}") from None
    if not recording.header:
        raise _refused(path, "a Rerun recording, but none of ODeform that can be replayed")
    return recording


def _refused(path: str | Path, why: object) -> InputError:
    return InputError(f"recording {path}: {why}")


def _chunks(path: Path, components: list[str] | None = None) -> Iterator[Chunk]:
    if not path.is_file():
        raise _refused(path, "there is no such file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that there is no footer, where the process was killed
            stream = RrdReader(path).stream()
        yield from stream if components is None else stream.filter(components=components)
    except (RuntimeError, ValueError) as error:
        cut = "exceeds file size" in str(error)
        why = "truncated in the middle of a message" if cut else f"not a Rerun recording, or damaged: {error}"
        raise _refused(path, why) from None


def _take(recording: Recording, chunk: Chunk) -> None:
    """What one chunk holds of a recording."""
    kind, _, name = chunk.entity_path.strip("/").partition("/")
    batch = chunk.to_record_batch()
    held = set(batch.schema.names)
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
    elif kind == WORLD and "Mesh3D:triangle_indices" in held:
        faces = batch.column("Mesh3D:triangle_indices")[0].values.flatten().to_numpy()
        recording.faces[name.removesuffix("/body")] = faces.astype(np.int64).reshape(-1, 3)
    elif kind == WORLD and "Transform3D:mat3x3" in held:
        shifts = dict(_rows(batch, "Transform3D:translation"))
        for frame, row in _rows(batch, "Transform3D:mat3x3"):
            pose = np.eye(4)
            pose[:3, :3] = _floats(row, 3).T  # Rerun writes matrices by columns
            pose[:3, 3] = _floats(shifts[frame], 3)[0]
            recording.poses[name.removesuffix("/body"), frame] = pose


def _header(path: Path, header: Mapping[str, Any]) -> Mapping[str, Any]:
    found = header.get("odeform_recording")
    if found != FORMAT:
        raise _refused(path, f"expected format {FORMAT}, got {found!r}, of odeform {header['versions'].get('odeform')}")
    return header


def _rows(batch: pa.RecordBatch, component: str) -> Iterator[tuple[int, pa.ListScalar]]:
    """Frame and value where there is one."""
    column = batch.column(component)
    for frame, row in zip(batch.column(SHOWN).to_pylist(), column, strict=True):
        if row.values is not None and len(row.values):
            yield frame, row


def _text(row: pa.ListScalar) -> str:
    return row.values[0].as_py()


def _floats(row: pa.ListScalar, width: int) -> Points:
    return row.values.flatten().to_numpy().reshape(-1, width)
