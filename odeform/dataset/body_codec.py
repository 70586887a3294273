"""The motions of one mesh as integers: pose, POD coefficients, and corrections where a vertex would be off by too much.

Every frame is a best-fit rigid motion of the reference plus a sum of modes that are orthonormal over the vertices: a
coefficient is an RMS displacement, and quantisation steps of `quantum` metres have a known error. Few modes and
corrections of the vertices that they miss take less space than the modes that would reach every vertex.
"""

import lzma
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import load, save
from scipy.linalg import eigh

from odeform.budget import require_memory
from odeform.dataset.integers import decompressed, expanded, from_planes, planes_of, squeezed
from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid, rotation_from_vector, unwrapped_vectors
from odeform.types import Arrays, Faces, Floats, Frames, MotionSequence, Perpoint, Points, Rotations

__all__ = ["BodyCodec", "fit_codec"]

POSE = 6
COORDINATE_BYTES = 60  # of memory for a coordinate of a frame while a sequence is decoded
LENGTH = struct.Struct("<I")  # bytes of the coefficients; corrections follow
MOST_MODES = 320
# in tolerances:
TRUNCATION = 0.12  # RMS of the deformation that the modes leave out, per coordinate
NOISE = 0.18  # RMS of the rounding of all coefficients at a vertex
MODE_ROUNDING = 0.05  # step of a mode, at its largest coefficient
CORRECTED = 0.9  # distance from which a vertex is corrected, and the step of corrections: at most 0.78 remain


@dataclass(frozen=True, eq=False)
class BodyCodec:
    """Encodes and decodes motions of a mesh of N points, by K modes.

    `points` (N, 3) m is the reference, `modes` (3 N, K) have unit mean square over the vertices, and `quantum` and
    `correction` are the steps of coefficients and corrections in metres; without corrections the latter is 0.
    """

    points: Points
    modes: Floats
    faces: Faces
    weights: Perpoint
    quantum: float
    correction: float = 0.0

    @cached_property
    def _steps(self) -> Floats:
        """(6 + K,) quantisation steps: metres, and radians that move the farthest vertex by as many metres."""
        reach = np.linalg.norm(self.points - self.points.mean(axis=0), axis=1).max()
        return self.quantum / np.concatenate([np.ones(3), np.full(3, reach), np.ones(self.modes.shape[1])])

    @cached_property
    def _dual(self) -> Floats:
        """(3 N, K) what deformations are projected on: stored modes are rounded, and no longer orthonormal."""
        return self.modes @ np.linalg.inv(self.modes.T @ self.modes)

    def encode(self, sequence: MotionSequence, rate: float) -> bytes:
        """Encodes a sequence of this mesh, evenly spaced at `rate` Hz from time 0."""
        pose, local = _moving(sequence, self.points)
        values = np.rint(np.concatenate([pose, local @ self._dual], axis=1) / self._steps)
        series = squeezed(values.astype(np.int64), rate)
        if not self.correction:
            return LENGTH.pack(len(series)) + series
        rounded = values[:, :POSE] * self._steps[:POSE]
        local = _local(sequence.vertices, self.points, rotation_from_vector(rounded[:, 3:]), rounded[:, :3])
        residual = (local - self._local(values)).reshape(len(local), -1, 3)
        far = np.linalg.norm(residual, axis=2) > self.correction
        if not far.any():
            return LENGTH.pack(len(series)) + series
        corrections = np.rint(residual * far[..., None] / self.correction).astype(np.int64)
        body = lzma.compress(planes_of(corrections.reshape(len(local), -1)), preset=9)
        return LENGTH.pack(len(series)) + series + body

    def decode(self, data: bytes) -> tuple[Floats, Floats]:
        """Decodes times (T,) s and vertices (T, N, 3) m. Raises `LZMAError`, `struct.error` or `ValueError`."""
        (length,) = LENGTH.unpack_from(data)
        return self.decode_series(data[LENGTH.size : LENGTH.size + length], data[LENGTH.size + length :])

    def decode_series(self, series: bytes, corrections: bytes = b"") -> tuple[Floats, Floats]:
        """Decodes the two parts of the bytes as `decode` does: returns (T,) s and (T, N, 3) m."""
        values, rate = expanded(series)
        if values.shape[1] != len(self._steps):
            raise ValueError(f"expected {len(self._steps)} series, got {values.shape[1]}")
        size = len(values) * self.points.size
        require_memory("sequence", f"{len(values):,} frames of {len(self.points):,} vertices", COORDINATE_BYTES * size)
        local = self._local(values)
        if corrections:
            planes = np.frombuffer(decompressed(corrections), np.uint8)
            local += self.correction * from_planes(planes, (len(values), self.points.size))
        pose, centre = (values * self._steps)[:, :POSE], self.points.mean(axis=0)
        turned = (self.points - centre + local.reshape(len(local), -1, 3)) @ rotation_from_vector(pose[:, 3:]).swapaxes(
            1, 2
        )
        return np.arange(len(values)) / rate, (turned + (centre + pose[:, :3])[:, None]).astype(np.float32)

    def _local(self, values: NDArray[Any]) -> Floats:
        """(T, 3 N) deformation in body axes of the integers (T, 6 + K)."""
        return (values * self._steps)[:, POSE:] @ self.modes.T

    def to_bytes(self, mode_steps: Floats) -> bytes:
        """All but the settings, which `from_bytes` reads; modes are stored in multiples of `mode_steps` (K,)."""
        integers = np.rint(self.modes / mode_steps).astype(np.int64).T
        planes = np.frombuffer(planes_of(integers), np.uint8)
        arrays: Arrays = {"points": self.points, "faces": self.faces, "weights": self.weights}
        return lzma.compress(save({**arrays, "modes": planes, "mode_steps": mode_steps}), preset=9)

    @classmethod
    def from_bytes(cls, data: bytes, settings: dict[str, Any]) -> "BodyCodec":
        """Inverts `to_bytes`. Raises `LZMAError`, `SafetensorError`, `KeyError` or `ValueError`."""
        arrays = load(decompressed(data))
        steps, count = arrays["mode_steps"], arrays["points"].size
        modes = from_planes(arrays["modes"], (len(steps), count)).T * steps
        return cls.checked({**arrays, "modes": modes}, settings)

    @classmethod
    def checked(cls, arrays: Arrays, settings: dict[str, Any]) -> "BodyCodec":
        """Reads arrays and settings of a file. Raises `ValueError` where they do not belong together."""
        quantum, correction = float(settings["quantum_m"]), float(settings.get("correction_m", 0.0))
        count = len(arrays["weights"])
        shapes = {name: arrays[name].shape for name in ("points", "modes", "faces", "weights")}
        expected = {"points": (count, 3), "modes": (3 * count, shapes["modes"][-1]), "faces": (len(arrays["faces"]), 3)}
        if shapes != {**expected, "weights": (count,)} or not 0.0 < quantum < 1.0 or not 0.0 <= correction < 1.0:
            raise ValueError(f"arrays of shapes {shapes}, quantum {quantum}, correction {correction}")
        points, modes = (arrays[name].astype(float) for name in ("points", "modes"))
        return cls(points, modes, arrays["faces"], arrays["weights"], quantum, correction)


def fit_codec(sequences: Callable[[], Iterator[MotionSequence]], tolerance: float) -> tuple[BodyCodec, bytes]:
    """The codec of motions of one mesh that keeps every vertex within `tolerance` metres, and its bytes.

    Reads all sequences twice. Raises `InputError` if their numbers of vertices differ.
    """
    first = next(sequences())
    reference = first.vertices[0].astype(float)
    modes, energy = _pod(sequences(), reference)
    left = np.sqrt((energy.sum() - np.cumsum(energy)).clip(0.0) / 3.0)
    enough = left[: len(modes.T)] <= TRUNCATION * tolerance
    modes = modes[:, : int(enough.argmax()) + 1] if enough.any() else modes
    largest = np.full(modes.shape[1], np.finfo(float).tiny)
    for sequence in sequences():
        coefficients = _moving(sequence, reference)[1] @ modes / len(reference)
        largest = np.maximum(largest, np.abs(coefficients).max(axis=0))
    steps = np.minimum(MODE_ROUNDING * tolerance / largest, 1.0)
    quantum = NOISE * tolerance * np.sqrt(12.0 / (modes.shape[1] + POSE))
    rounded = np.rint(modes / steps) * steps
    faces = first.faces.astype(np.int32)
    codec = BodyCodec(reference, rounded, faces, first.weights, float(quantum), CORRECTED * tolerance)
    return codec, codec.to_bytes(steps)


def _moving(sequence: MotionSequence, reference: Floats) -> tuple[Floats, Floats]:
    """Pose (T, 6) of the reference in each frame, and the deformation (T, 3 N) in body axes."""
    even = np.full(len(reference), 1.0 / len(reference))
    rotation, shift = best_rigid(reference, sequence.vertices, even)
    local = _local(sequence.vertices, reference, rotation, shift)
    return np.concatenate([shift, unwrapped_vectors(rotation)], axis=1), local


def _local(vertices: Frames, reference: Floats, rotation: Rotations, shift: Floats) -> Floats:
    """(T, 3 N) deformation in body axes, given rotations (T, 3, 3) and shifts (T, 3) of the centre."""
    centre = reference.mean(axis=0)
    return ((vertices - (centre + shift)[:, None]) @ rotation - (reference - centre)).reshape(len(vertices), -1)


def _pod(sequences: Iterator[MotionSequence], reference: Floats) -> tuple[Floats, Floats]:
    """Computes POD modes (3 N, K), K <= `MOST_MODES`, orthonormal in the mean over vertices, and all mean squares
    (3 N,)."""
    total, frames = np.zeros((reference.size, reference.size)), 0
    for sequence in sequences:
        if sequence.vertices.shape[1:] != reference.shape:
            raise InputError(f"{sequence.name}: expected {len(reference)} vertices, as in the other sequences")
        _, local = _moving(sequence, reference)
        total += local.T @ local
        frames += len(local)
    size = reference.size
    values, vectors = eigh(total, subset_by_index=(max(size - MOST_MODES, 0), size - 1))
    rest = max(float(np.trace(total)) - float(values.sum()), 0.0)
    energy = np.concatenate([np.maximum(values[::-1], 0.0), [rest]]) / (frames * len(reference))
    return vectors[:, ::-1] * np.sqrt(len(reference)), energy
