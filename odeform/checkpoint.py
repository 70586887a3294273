"""Checkpoints: one safetensors file of arrays, with everything else as JSON in its metadata. Nothing is unpickled.

Arrays in steps (`odeform.arrays`) are packed in the file, and plain numbers to whoever reads it.
"""

import hashlib
import json
import math
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from odeform.arrays import STEP, packed, unpacked
from odeform.budget import read_limited
from odeform.errors import InputError
from odeform.io import atomic_write, bundled, parse_json, safetensors_metadata
from odeform.loads.registry import split_load
from odeform.schema import Schema
from odeform.types import Arrays

__all__ = [
    "Checkpoint",
    "arrays_of_object",
    "bundled_checkpoints",
    "checkpoint_bytes",
    "read_checkpoint",
    "resolve_checkpoint",
    "write_checkpoint",
]

FORMAT = 1
LIMIT = 1 << 29  # bytes; no checkpoint is larger, and no array of one
INDICES = ("faces", "elements")  # arrays whose names end so are indices of points
PACKED_BYTES = 4  # of an entry of an array that was packed


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """Holds what a model is read from. `model` is its name in `odeform.models.names`; `provenance` says how it was
    trained.

    `scores` are those on the test split, as `odeform evaluate` prints them.
    """

    model: str
    schema: Schema
    config: dict[str, Any]
    arrays: Arrays
    provenance: dict[str, Any] = field(default_factory=dict)
    scores: dict[str, Any] = field(default_factory=dict)
    sha256: str = ""
    size_bytes: int = 0


def arrays_of_object(arrays: Arrays, name: str) -> Arrays:
    """Those that belong to one object of a scene with several, without its name: they are stored as OBJECT/ARRAY."""
    prefix = f"{name}/"
    return {key.removeprefix(prefix): array for key, array in arrays.items() if key.startswith(prefix)}


def write_checkpoint(path: str | Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint atomically: `path` holds either the old file or the whole new one.

    All but the arrays are plain JSON values; numpy scalars become such.
    """
    arrays = {name: np.asarray(array, order="C") for name, array in checkpoint.arrays.items()}
    in_steps = {name: list(arrays[name].shape) for name in sorted(arrays) if f"{name}{STEP}" in arrays}
    meta = {
        "format": FORMAT,
        "model": checkpoint.model,
        "schema": checkpoint.schema.to_json(),
        "config": checkpoint.config,
        "provenance": checkpoint.provenance,
        "scores": checkpoint.scores,
        **({"packed": in_steps} if in_steps else {}),
    }
    metadata = {"odeform": json.dumps(meta, default=_plain)}  # one key: safetensors writes several in no fixed order
    arrays |= {name: packed(arrays[name], arrays[f"{name}{STEP}"]) for name in in_steps}
    arrays |= {name: array.astype(np.uint16) for name, array in arrays.items() if _is_short(name, array)}
    atomic_write(Path(path), save(arrays, metadata))


def _is_short(name: str, array: np.ndarray) -> bool:
    """Whether these are indices that two bytes hold; they are read as four again."""
    if not name.endswith(INDICES) or array.dtype.kind not in "iu":
        return False
    return array.size > 0 and int(array.min()) >= 0 and int(array.max()) < 1 << 16


def _plain(value: Any) -> Any:
    """A numpy scalar as JSON holds it."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"checkpoint: expected plain JSON values besides the arrays, got {type(value).__name__}")


def checkpoint_bytes(path: Path) -> bytes:
    """The content of the file; `InputError` where it cannot be read or is too large for a checkpoint."""
    try:
        return read_limited(path, f"checkpoint {path}", LIMIT)
    except OSError as error:
        raise InputError(f"checkpoint {path}: {error.strerror}") from None


def read_checkpoint(path: str | Path) -> Checkpoint:
    """Read and validate a checkpoint file; `InputError` in one line for anything else."""
    path = Path(path)
    data = checkpoint_bytes(path)
    try:
        arrays = load(data)
        metadata = safetensors_metadata(data)
    except (SafetensorError, KeyError, ValueError, TypeError, AttributeError):
        raise InputError(f"checkpoint {path}: not a safetensors file, or truncated") from None
    if "odeform" not in metadata:
        raise InputError(f"checkpoint {path}: expected an ODeform checkpoint, got another safetensors file")
    broken = [n for n, a in arrays.items() if a.dtype.kind == "f" and not np.isfinite(a).all()]
    if broken:
        raise InputError(f"checkpoint {path}: {broken[0]} contains numbers that are not finite")
    try:
        meta = parse_json(metadata["odeform"], f"checkpoint {path}: metadata")
        if meta["format"] != FORMAT:
            raise InputError(f"checkpoint {path}: expected format {FORMAT}, got {meta['format']!r}")
        _unpack(arrays, meta.get("packed", {}), str(path))
        arrays |= {name: array.astype(np.int32) for name, array in arrays.items() if _is_short(name, array)}
        return Checkpoint(
            model=str(meta["model"]),
            schema=Schema.from_json(meta["schema"]),
            config=dict(meta["config"]),
            arrays=arrays,
            provenance=dict(meta["provenance"]),
            scores=dict(meta["scores"]),
            sha256=hashlib.sha256(data).hexdigest(),
            size_bytes=len(data),
        )
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"checkpoint {path}: damaged metadata: {error}") from None


def _unpack(arrays: Arrays, shapes: dict[str, Any], path: str) -> None:
    """Replace the packed ones of the arrays by what they hold. `InputError` where one is damaged or too large."""
    for name, shape in shapes.items():
        if min(shape, default=0) < 0 or math.prod(shape) * PACKED_BYTES > LIMIT:
            raise InputError(f"checkpoint {path}: {name}: expected at most {LIMIT >> 20} MiB, got shape {shape}")
        try:
            arrays[name] = unpacked(arrays[name], shape, arrays[f"{name}{STEP}"])
        except (zlib.error, ValueError, TypeError) as error:
            raise InputError(f"checkpoint {path}: {name}: damaged: {error}") from None


def bundled_checkpoints() -> dict[str, Path]:
    """The checkpoints that come with the package, by name SCENE/MODEL."""
    return {f"{path.parent.name}/{path.stem}": path for path in sorted(bundled("checkpoints").glob("*/*.safetensors"))}


def resolve_checkpoint(name: str) -> Path:
    """The bundled checkpoint of the name SCENE or SCENE/MODEL, or else the path, in both cases also with a load
    (`split_load`); `InputError` if there is neither."""
    known, (file, _) = bundled_checkpoints(), split_load(name)
    for key in (file, f"{file}/odeform"):
        if key in known:
            return known[key]
    if not Path(file).exists():
        raise InputError(f"checkpoint {name!r}: expected a file or one of the bundled {', '.join(known) or 'none'}")
    return Path(file)
