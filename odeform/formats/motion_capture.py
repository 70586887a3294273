"""Motion capture in C3D files: the paths of markers, read by the library c3d."""

import io
import warnings
from dataclasses import dataclass

import c3d
import numpy as np

from odeform.budget import require_memory
from odeform.errors import InputError
from odeform.types import Floats, Frames, Times

__all__ = ["Capture", "read_c3d"]

METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "in": 0.0254}
COMPUTED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
"""Lists of points that are no positions but results, which Vicon and others store among the markers."""
BYTES_PER_BYTE = 12  # of memory while reading: coordinates may be 16-bit integers


@dataclass(frozen=True, eq=False)
class Capture:
    """Paths of markers.

    Attributes:
        times: (T,) seconds from the first frame.
        points: (T, N, 3) metres, in the axes of the capture.
        labels: (N) the names of the markers.
        notes: What was left out.
    """

    times: Times
    points: Frames
    labels: tuple[str, ...]
    notes: tuple[str, ...]


def read_c3d(data: bytes, where: str, gaps: bool = False) -> Capture:
    """The markers in the bytes of a C3D file. Markers that are never seen are left out, as are angles and forces.

    With `gaps`, a marker's coordinates are not a number in frames that lack it.

    Raises:
        InputError: No C3D file, a damaged one, unknown units, or, without `gaps`, a marker that some frames lack;
            `where` leads.
    """
    if len(data) < 512 or data[1] != 0x50:
        raise InputError(f"{where}: expected a C3D file, whose second byte is 80, got {data[1:2].hex() or 'nothing'}")
    require_memory(where, f"{len(data):,} bytes of motion capture", BYTES_PER_BYTE * len(data))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            reader = c3d.Reader(io.BytesIO(data))
            labels, computed = _labels(reader), _computed(reader)
            unit, rate = _text(reader, "POINT:UNITS").lower(), float(reader.point_rate)
            count = reader.last_frame - reader.first_frame + 1
            frames = [points[:, :4] for _, points, _ in reader.read_frames(analog_transform=False)]
        except AssertionError as error:  # header and parameters contradict each other
            raise InputError(f"{where}: a damaged C3D file: {error}") from None
        except Exception:
            # the library raises anything on a broken file
            raise InputError(f"{where}: a damaged C3D file: its parameters cannot be read") from None
    if len(frames) < max(count, 2):
        raise InputError(f"{where}: expected {max(count, 2)} frames, got {len(frames)}: truncated?")
    if not 0.0 < rate < float("inf"):
        raise InputError(f"{where}: expected a frame rate in POINT:RATE, got {rate:g}")
    if unit and unit not in METRES:
        raise InputError(f"{where}: expected units {', '.join(METRES)} in POINT:UNITS, got {unit!r}")
    notes = [] if unit else ["no unit is given, taken as mm"]
    recorded = np.stack(frames)
    kept = _seen(recorded, labels, computed, notes, where, gaps)
    points = METRES[unit or "mm"] * recorded[:, kept, :3].astype(float)
    points[recorded[:, kept, 3] < 0.0] = np.nan
    names = tuple(labels[index] for index in kept)
    return Capture(np.arange(len(points)) / rate, points, names, tuple(notes))


def _seen(
    recorded: Floats, labels: list[str], computed: set[str], notes: list[str], where: str, gaps: bool
) -> list[int]:
    """The markers that all frames have, or with `gaps` some. The fourth number of a point is negative where it is not
    seen."""
    seen = recorded[:, :, 3] >= 0.0
    markers = [index for index, label in enumerate(labels) if label not in computed]
    kept = [index for index in markers if seen[:, index].any()]
    if len(markers) < len(labels):
        notes.append(f"{len(labels) - len(markers)} computed points, such as angles and forces, are left out")
    if len(kept) < len(markers):
        names = [labels[index] for index in markers if index not in kept]
        notes.append(f"never seen and left out: {', '.join(names[:5])}{' …' if len(names) > 5 else ''}")
    for index in kept if not gaps else []:
        if lacking := np.flatnonzero(~seen[:, index]).tolist():
            raise InputError(
                f"{where}: marker {labels[index]} is not seen in {len(lacking)} of {len(seen)} frames, first in frame "
                f"{lacking[0] + 1}: fill the gaps in the program of the capture, or leave the marker out"
            )
    if len(kept) < 2:
        raise InputError(f"{where}: expected at least 2 markers that are seen, got {len(kept)}")
    return kept


def _labels(reader: "c3d.Reader") -> list[str]:
    """One name for each point; those without one get their number."""
    found: list[str] = []
    for name in ("LABELS", *(f"LABELS{number}" for number in range(2, 100))):
        parameter = reader.get(f"POINT:{name}")
        if parameter is None:
            break
        found += [str(label).strip() for label in np.ravel(parameter.string_array)]
    found += [""] * (reader.point_used - len(found))
    return [label or f"point {number + 1}" for number, label in enumerate(found[: reader.point_used])]


def _computed(reader: "c3d.Reader") -> set[str]:
    lists = (reader.get(f"POINT:{name}") for name in COMPUTED)
    return {str(label).strip() for found in lists if found is not None for label in np.ravel(found.string_array)} - {""}


def _text(reader: "c3d.Reader", name: str) -> str:
    parameter = reader.get(name)
    return "" if parameter is None else parameter.string_value.strip(" \0")
