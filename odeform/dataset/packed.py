"""Data sets in one small file: pose and POD coefficients, quantised, differenced in time and compressed.

A zip archive of stored members: `dataset.json` (the index, as in a folder; LZMA), `common.safetensors` (reference
points, modes, faces, weights) and one per sequence, so that one is read without the others. Every frame is a best-fit
rigid motion of the reference plus a sum of modes that are orthonormal over the vertices: a coefficient is an RMS
displacement, and quantisation steps of `quantum` metres have a known error.

The codec is not numcodecs', whose delta filter has one order for all series; the order is chosen per series here.
"""

import hashlib
import io
import lzma
import struct
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from odeform.dataset.index import Dataset, Entry, Reader, index_from_json, index_to_json
from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid, rotation_from_vector, unwrapped_vectors
from odeform.io import atomic_write
from odeform.progress import Progress
from odeform.types import Arrays, Floats, MotionSequence

__all__ = ["SUFFIX", "open_packed", "pack"]

SUFFIX = ".odp"
HEADER = struct.Struct("<IId")  # frames, series, rate in Hz
ORDERS = 4  # of differences in time, zeroth to third
INDEX, COMMON = "dataset.json", "common.safetensors"
LIMIT = 1 << 28  # bytes of one member, decompressed
POSE = 6


def _squeeze(values: NDArray[np.int64], rate: float) -> bytes:
    """(T, S) integers -> bytes: differences of the order that is cheapest for each series, byte planes, LZMA."""
    residuals = [values]
    for _ in range(1, ORDERS):
        residuals.append(np.diff(residuals[-1], axis=0, prepend=0))
    cost = np.array([np.log2(1.0 + np.abs(r)).sum(axis=0) for r in residuals])
    orders = cost.argmin(axis=0)
    chosen = np.stack([residuals[order][:, s] for s, order in enumerate(orders)])
    limits = np.iinfo(np.int32)
    if chosen.min() < limits.min or chosen.max() > limits.max:
        raise InputError("pack: the tolerance is too small for motions this large")
    planes = chosen.astype("<i4").view(np.uint8).reshape(*chosen.shape, 4)
    body = orders.astype(np.uint8).tobytes() + np.moveaxis(planes, -1, 0).tobytes()
    return lzma.compress(HEADER.pack(*values.shape, rate) + body, preset=9)


def _decompress(data: bytes) -> bytes:
    return lzma.LZMADecompressor(memlimit=LIMIT).decompress(data, max_length=LIMIT)


def _expand(data: bytes) -> tuple[NDArray[np.int64], float]:
    """The inverse of `_squeeze`. Raises `LZMAError`, `struct.error` or `ValueError` for damaged bytes."""
    body = _decompress(data)
    frames, series, rate = HEADER.unpack_from(body)
    if not (frames and series and 0.0 < rate < float("inf")):
        raise ValueError("no frames, or no frame rate")
    orders, planes = np.split(np.frombuffer(body, np.uint8, offset=HEADER.size), [series])
    if orders.max() >= ORDERS:
        raise ValueError("invalid order of differences")
    residuals = np.ascontiguousarray(np.moveaxis(planes.reshape(4, series, frames), 0, -1)).view("<i4")[..., 0]
    values = residuals.astype(np.int64)
    for s, order in enumerate(orders):
        for _ in range(int(order)):
            values[s] = np.cumsum(values[s])
    return values.T, rate


def _moving(sequence: MotionSequence, reference: Floats) -> tuple[Floats, Floats]:
    """Pose (T, 6) of the reference in each frame, and the deformation (T, 3 N) in body axes."""
    even = np.full(len(reference), 1.0 / len(reference))
    rotation, shift = best_rigid(reference, sequence.vertices, even)
    centre = even @ reference
    local = (sequence.vertices - (centre + shift)[:, None]) @ rotation - (reference - centre)
    return np.concatenate([shift, unwrapped_vectors(rotation)], axis=1), local.reshape(len(local), -1)


def _steps(common: Arrays, quantum: float) -> Floats:
    """(6 + K,) quantisation steps: metres, and radians that move the farthest vertex by as many metres."""
    points = common["points"]
    reach = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
    return quantum / np.concatenate([np.ones(3), np.full(3, reach), np.ones(common["modes"].shape[1])])


def _decode(data: bytes, common: Arrays, quantum: float) -> tuple[Floats, Floats]:
    """Times (T,) s and vertices (T, N, 3) m."""
    values, rate = _expand(data)
    steps = _steps(common, quantum)
    if values.shape[1] != len(steps):
        raise ValueError(f"expected {len(steps)} series, got {values.shape[1]}")
    y = values * steps
    points = common["points"]
    centre = points.mean(axis=0)
    local = (y[:, POSE:] @ common["modes"].T.astype(float)).reshape(len(y), -1, 3)
    turned = (points - centre + local) @ rotation_from_vector(y[:, 3:POSE]).swapaxes(1, 2)
    return np.arange(len(y)) / rate, (turned + (centre + y[:, :3])[:, None]).astype(np.float32)


def _modes(dataset: Dataset, reference: Floats) -> tuple[Floats, Floats]:
    """(3 N, 3 N) POD modes, orthonormal in the mean over vertices, and the mean square displacement of each (3 N,)."""
    total, frames = np.zeros((reference.size, reference.size)), 0
    for sequence in dataset.sequences("all"):
        if sequence.vertices.shape[1:] != reference.shape:
            raise InputError(f"{sequence.name}: expected {len(reference)} vertices, as in the other sequences")
        _, local = _moving(sequence, reference)
        total += local.T @ local
        frames += len(local)
    values, vectors = np.linalg.eigh(total / (frames * len(reference)))
    return vectors[:, ::-1] * np.sqrt(len(reference)), np.maximum(values[::-1], 0.0)


class _TooCoarse(Exception):
    """A vertex exceeds the tolerance. The argument is the part of its error, in tolerances, that comes from left-out
    modes."""


def pack(dataset: Dataset, out: Path, tolerance: float = 2e-5) -> dict[str, float]:
    """Write a compressed copy in which every vertex of every frame is within `tolerance` metres.

    Returns the number of modes, the quantum, the largest RMSE of a sequence and the largest error of a vertex, all in
    metres. Raises `InputError` if the meshes differ, or if no compression keeps the tolerance.
    """
    if not 0.0 < tolerance < float("inf"):
        raise InputError(f"pack: expected a positive tolerance, got {tolerance:g} m")
    first = next(dataset.sequences("all"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence to pack")
    reference = first.vertices[0].astype(float)
    modes, energy = _modes(dataset, reference)
    left = np.sqrt((energy.sum() - np.cumsum(energy)).clip(0.0) / 3.0)
    truncation, noise = 0.2 * tolerance, 0.6 * tolerance
    for _ in range(12):
        count = int(np.argmax(left <= truncation)) + 1 if left.min() <= truncation else len(left)
        # rounding errors of coefficients add up at a vertex like noise, which rarely exceeds six deviations
        quantum = noise * np.sqrt(12.0 / (count + POSE)) / 6.0
        common = {
            "points": reference,
            "modes": modes[:, :count].astype(np.float32),
            "faces": first.faces.astype(np.int32),
            "weights": first.weights,
        }
        try:
            blobs, rmse, worst = _encode(dataset, common, quantum, tolerance)
            break
        except _TooCoarse as error:
            if error.args[0] > 0.6:
                truncation *= 0.5
            else:
                noise *= 0.8
    else:
        raise InputError(f"{dataset.root}: no compression within {1e3 * tolerance:g} mm")
    entries = tuple(
        replace(e, sha256=hashlib.sha256(blobs[e.name]).hexdigest()) if e.name in blobs else e for e in dataset.entries
    )
    codec = {"quantum_m": quantum, "modes": count, "largest_rmse_m": rmse, "largest_error_m": worst}
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        index = lzma.compress(index_to_json(replace(dataset, entries=entries), codec=codec), preset=9)
        for name, data in ((INDEX, index), (COMMON, save(common)), *blobs.items()):
            # a fixed date: equal data give equal files
            file.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)
    atomic_write(out, archive.getvalue())
    return codec


def _encode(
    dataset: Dataset, common: Arrays, quantum: float, tolerance: float
) -> tuple[dict[str, bytes], float, float]:
    """The bytes of each sequence, the largest RMSE of a sequence and the largest error of a vertex, in metres."""
    blobs: dict[str, bytes] = {}
    rmse = worst = 0.0
    selected = dataset.select("all")
    progress = Progress(f"pack {dataset.schema.scene}", len(selected))
    steps = _steps(common, quantum)
    for entry in selected:
        sequence = dataset.read(entry)
        same_weights = np.allclose(sequence.weights, common["weights"], rtol=0.0, atol=1e-9)
        if not (np.array_equal(sequence.faces, common["faces"]) and same_weights):
            raise InputError(f"{entry.name}: expected the same mesh as in the other sequences")
        count = len(sequence.times)
        rate = (count - 1) / float(sequence.times[-1]) if count > 1 else dataset.schema.window.rate
        if not np.allclose(sequence.times, np.arange(count) / rate, atol=1e-9):
            raise InputError(f"{entry.name}: expected evenly spaced frames from time 0")
        pose, local = _moving(sequence, common["points"])
        coefficients = local @ common["modes"].astype(float) / len(common["points"])
        y = np.concatenate([pose, coefficients], axis=1)
        blobs[entry.name] = _squeeze(np.rint(y / steps).astype(np.int64), rate)
        error = _decode(blobs[entry.name], common, quantum)[1].astype(float) - sequence.vertices
        largest = float(np.linalg.norm(error, axis=-1).max())
        if largest > tolerance:
            missed = (local - coefficients @ common["modes"].T).reshape(count, -1, 3)
            raise _TooCoarse(float(np.linalg.norm(missed, axis=-1).max()) / tolerance)
        rmse, worst = max(rmse, float(np.sqrt((error**2).mean()))), max(worst, largest)
        progress.advance()
    progress.close()
    return blobs, rmse, worst


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
        except (zipfile.BadZipFile, KeyError, NotImplementedError, RuntimeError, EOFError):
            raise InputError(f"{path}: not a packed data set, or damaged: no readable {name}") from None

    def reader(index: dict[str, Any]) -> Reader:
        quantum = float(index["codec"]["quantum_m"])
        common = load(member(COMMON))
        count = len(common["weights"])
        shapes = {name: common[name].shape for name in ("points", "modes", "faces", "weights")}
        expected = {"points": (count, 3), "modes": (3 * count, shapes["modes"][-1]), "faces": (len(common["faces"]), 3)}
        if shapes != {**expected, "weights": (count,)} or not 0.0 < quantum < 1.0:
            raise ValueError(f"arrays of shapes {shapes}, quantum {quantum}")

        def read(entry: Entry) -> MotionSequence:
            data = member(entry.name)
            if hashlib.sha256(data).hexdigest() != entry.sha256:
                raise InputError(f"{path}: checksum of {entry.name} does not match: the file is damaged")
            try:
                times, vertices = _decode(data, common, quantum)
            except (lzma.LZMAError, struct.error, ValueError) as error:
                raise InputError(f"{path}: {entry.name} cannot be decoded: {error}") from None
            parameters = dict(entry.parameters)
            return MotionSequence(times, vertices, common["faces"], common["weights"], parameters, entry.name)

        return read

    try:
        return index_from_json(_decompress(member(INDEX)), path, path, reader)
    except InputError:
        raise
    except (ValueError, IndexError, SafetensorError, lzma.LZMAError, EOFError) as error:
        raise InputError(f"{path}: damaged: {error}") from None
