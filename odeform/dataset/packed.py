"""Data sets in one small file: quantised poses and POD coefficients, and corrections of single vertices.

A zip archive of stored members: `dataset.json` (the index, as in a folder; LZMA), one member for each mesh (reference
points, modes, faces, weights: `common`, or `common/OBJECT` in a scene with objects; LZMA), and one per sequence, so
that one is read without the others. `odeform.dataset.body_codec` describes the coding. The first format, still read,
has one mesh, uncompressed as `common.safetensors`, and no corrections.
"""

import hashlib
import io
import lzma
import struct
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load

from odeform.dataset.arrays import checked_sequence
from odeform.dataset.body_codec import BodyCodec, fit_codec
from odeform.dataset.index import Dataset, Entry, Reader, index_from_json, index_to_json
from odeform.dataset.integers import LIMIT, decompressed
from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.progress import Progress
from odeform.schema import OBJECT
from odeform.types import MotionSequence

__all__ = ["SUFFIX", "open_packed", "pack"]

SUFFIX = ".odp"
INDEX, COMMON, FIRST_COMMON = "dataset.json", "common", "common.safetensors"
VERSION = 2


def pack(dataset: Dataset, out: Path, tolerance: float = 2e-5) -> dict[str, Any]:
    """Write a compressed copy in which every vertex of every frame is within `tolerance` metres.

    Returns, as the index of the file does, the tolerance, the RMSE over all sequences, the largest of one sequence, and
    the largest error of a vertex, in metres, and the settings of each mesh. Raises `InputError` if the meshes of one
    object differ, or if the tolerance is below the precision of the data.
    """
    if not 0.0 < tolerance < float("inf"):
        raise InputError(f"pack: expected a positive tolerance, got {tolerance:g} m")
    selected = dataset.select("all")
    if not selected:
        raise InputError(f"{dataset.root}: no sequence to pack")
    members: dict[str, bytes] = {}
    bodies, errors, worst = {}, [], 0.0
    progress = Progress(f"pack {dataset.schema.scene}", len(selected))
    for name in dataset.objects or ("",):
        one = dataset.of(name) if name else dataset
        codec, members[_common(name)] = fit_codec(lambda one=one: one.sequences("all"), tolerance)
        bodies[name] = {"quantum_m": codec.quantum, "correction_m": codec.correction, "modes": codec.modes.shape[1]}
        for entry in one.select("all"):
            members[entry.name], mse, largest = _encoded(dataset, entry, codec)
            if largest > tolerance:
                raise InputError(f"{entry.name}: the tolerance is too small: {1e3 * largest:g} mm were reached")
            worst = max(worst, largest)
            errors.append(mse)
            progress.advance()
    progress.close()
    entries = tuple(
        replace(e, sha256=hashlib.sha256(members[e.name]).hexdigest()) if e.name in members else e
        for e in dataset.entries
    )
    described = {
        "version": VERSION,
        "tolerance_m": tolerance,
        "rmse_m": float(np.sqrt(np.mean(errors))),
        "largest_rmse_m": float(np.sqrt(max(errors))),
        "largest_error_m": worst,
        "bodies": bodies,
    }
    index = lzma.compress(index_to_json(replace(dataset, entries=entries), codec=described), preset=9)
    _write_archive(out, {INDEX: index, **members})
    return described


def _common(name: str) -> str:
    """The member of a mesh."""
    return f"{COMMON}/{name}" if name else COMMON


def _encoded(dataset: Dataset, entry: Entry, codec: BodyCodec) -> tuple[bytes, float, float]:
    """The bytes of a sequence, its mean square error over all coordinates in m^2, and the largest of a vertex in m."""
    sequence = dataset.read(entry)
    same_weights = np.allclose(sequence.weights, codec.weights, rtol=0.0, atol=1e-9)
    if not (np.array_equal(sequence.faces, codec.faces) and same_weights):
        raise InputError(f"{entry.name}: expected the same mesh as in the other sequences")
    count = len(sequence.times)
    rate = (count - 1) / float(sequence.times[-1]) if count > 1 else dataset.schema.window.rate
    if not np.allclose(sequence.times, np.arange(count) / rate, atol=1e-9):
        raise InputError(f"{entry.name}: expected evenly spaced frames from time 0")
    data = codec.encode(sequence, rate)
    error = codec.decode(data)[1].astype(float) - sequence.vertices
    return data, float((error**2).mean()), float(np.linalg.norm(error, axis=-1).max())


def _write_archive(out: Path, members: dict[str, bytes]) -> None:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        for name, data in members.items():
            # a fixed date: equal data give equal files
            file.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)
    atomic_write(out, archive.getvalue())


def open_packed(path: Path) -> Dataset:
    """Open a packed data set. Raises `InputError` for a missing or damaged file; sequences are checked when read."""

    def member(name: str) -> bytes:
        try:
            with zipfile.ZipFile(path) as file:
                info = file.getinfo(name)
                # members are stored uncompressed: sizes are known before anything is decompressed
                if info.compress_type != zipfile.ZIP_STORED or info.file_size > LIMIT:
                    raise InputError(f"{path}: {name}: expected a stored member, as `odeform pack` writes")
                return file.read(name)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror or error}") from None
        except (zipfile.BadZipFile, KeyError, NotImplementedError, RuntimeError, EOFError, ValueError):
            raise InputError(f"{path}: not a packed data set, or damaged: no readable {name}") from None

    try:
        return index_from_json(decompressed(member(INDEX)), path, path, lambda index: _reader(path, member, index))
    except InputError:
        raise
    except (ValueError, IndexError, KeyError, TypeError, SafetensorError, lzma.LZMAError, EOFError) as error:
        raise InputError(f"{path}: damaged: {error}") from None


def _reader(path: Path, member: Callable[[str], bytes], index: dict[str, Any]) -> Reader:
    """Reads sequences of either version. Raises what damaged meshes raise."""
    described = index["codec"]
    first = "version" not in described
    if first:
        codecs = {"": BodyCodec.checked(load(member(FIRST_COMMON)), described)}
    elif described["version"] == VERSION:
        bodies = described["bodies"].items()
        codecs = {name: BodyCodec.from_bytes(member(_common(name)), settings) for name, settings in bodies}
    else:
        raise ValueError(f"expected version {VERSION} of the format, got {described['version']}")

    def read(entry: Entry) -> MotionSequence:
        data = member(entry.name)
        if hashlib.sha256(data).hexdigest() != entry.sha256:
            raise InputError(f"{path}: checksum of {entry.name} does not match: the file is damaged")
        try:
            codec = codecs[entry.parameters.get(OBJECT, "")]
            times, vertices = codec.decode_series(data) if first else codec.decode(data)
        except (KeyError, IndexError, EOFError, OverflowError, lzma.LZMAError, struct.error, ValueError) as error:
            raise InputError(f"{path}: {entry.name} cannot be decoded: {error}") from None
        sequence = MotionSequence(times, vertices, codec.faces, codec.weights, dict(entry.parameters), entry.name)
        return checked_sequence(sequence, f"{path}: {entry.name}")

    return read
