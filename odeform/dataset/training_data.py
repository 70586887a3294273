"""From sequences to what the models learn from: one reduced trajectory for each."""

import hashlib
import json
from dataclasses import dataclass, replace

import numpy as np

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.motion.reduced_space import ReducedSpace, decompose, fit_modes, make_space, to_canonical
from odeform.schema import Schema, Window
from odeform.types import Bools, Floats, Mesh

__all__ = ["UNKNOWN", "TrainingData", "prepare"]

TRUNCATION = 5e-3
MOST_MODES = 64
UNKNOWN = 1e-3
"""Weight of a frame that a spline through known ones fills in, in training: it holds what nothing else does."""


@dataclass(frozen=True, eq=False)
class TrainingData:
    """`theta` (S, P) in [-1, 1], `reduced` (S, T, 6 + K) in metres and radians, for train and val."""

    schema: Schema
    space: ReducedSpace
    times: Floats
    rest: Floats
    """(N, 3) canonical rest points of the training mesh, metres."""
    weights: Floats
    theta: dict[str, Floats]
    reduced: dict[str, Floats]
    known: dict[str, Bools]
    """(S, T) whether the frame is of the data, or a spline through those that are fills it in."""
    truncation_mm: dict[str, float]
    """RMS of the deformation that the modes leave out, for each split."""
    identity: str
    """SHA-256 of all that went in: the sequences, the frames, the number of modes."""


def _largest(motions: list[Floats]) -> float:
    """Norm of the largest of the vectors (T, n)."""
    return max(float(np.linalg.norm(motion, axis=1).max()) for motion in motions)


def prepare(dataset: Dataset, modes: int | None = None, subsampling: FrameSubsampling | None = None) -> TrainingData:
    """Decompose all training and validation sequences; fit the deformation basis on the training ones alone.

    Without `modes`, as few as leave `TRUNCATION` of the RMS deformation of the validation sequences.
    """
    schema, subsampling = dataset.schema, subsampling or FrameSubsampling()
    count = subsampling.count(schema)
    poses, locals_, theta = {}, {}, {}
    rest = weights = anchor = times = faces = None
    for split in ("train", "val"):
        poses[split], locals_[split], vectors = [], [], []
        for index, recorded in enumerate(dataset.sequences(split)):
            whole = recorded.frames((count - 1) / schema.window.rate, schema.window.rate)
            kept = subsampling.kept(count, index)
            sequence = replace(whole, times=whole.times[kept], vertices=whole.vertices[kept])
            if anchor is None:
                anchor = sequence.weights @ sequence.vertices[0].astype(float)
                weights, times, faces = sequence.weights, whole.times, sequence.faces
                rest = to_canonical(sequence.vertices[0], anchor, schema.azimuth(sequence.parameters))
            assert rest is not None
            if sequence.vertices.shape[1] != len(rest):
                raise InputError(f"{sequence.name}: expected {len(rest)} vertices as in the others, got another mesh")
            pose, local = decompose(sequence, anchor, schema.azimuth(sequence.parameters))
            poses[split].append(pose)
            locals_[split].append(local)
            vectors.append(schema.vector(sequence.parameters))
        if not vectors:
            raise InputError(f"{dataset.root}: no sequence in split {split}")
        theta[split] = np.stack(vectors)
    assert rest is not None
    assert weights is not None
    assert anchor is not None
    assert times is not None
    assert faces is not None
    shapes = fit_modes(locals_["train"], weights, modes or MOST_MODES)
    shares = weights[:, None]
    coefficients = {
        split: [np.einsum("tni,nik->tk", local * shares, shapes) for local in locals_[split]] for split in locals_
    }
    total = {split: np.mean([(shares * x**2).sum(axis=(1, 2)).mean() for x in locals_[split]]) for split in locals_}
    left = {split: np.mean([(c**2).mean(axis=0) for c in coefficients[split]], axis=0) for split in locals_}
    if modes is None:
        enough = total["val"] - np.cumsum(left["val"]) <= TRUNCATION**2 * total["val"]
        modes = int(enough.argmax()) + 1 if enough.any() else MOST_MODES
    largest = _largest([p[:, :3] for p in poses["train"]]), _largest([c[:, :modes] for c in coefficients["train"]])
    space = replace(make_space(Mesh(rest, faces), shapes[..., :modes], weights, anchor), largest=largest)
    reduced, known, truncation = {}, {}, {}
    for split in ("train", "val"):
        pairs = zip(poses[split], coefficients[split], strict=True)
        both = [np.concatenate([pose, c[:, :modes]], axis=1) for pose, c in pairs]
        reduced[split] = np.stack([subsampling.filled(y, count, index) for index, y in enumerate(both)])
        known[split] = subsampling.known(count, len(both))
        truncation[split] = float(1e3 * np.sqrt(max(total[split] - left[split][:modes].sum(), 0.0)))
    rate = schema.window.rate if subsampling.stagger else schema.window.rate / subsampling.every
    schema = replace(schema, window=Window(float(times[0]), float(times[-1]), rate))
    used = [[entry.name, entry.sha256] for split in ("train", "val") for entry in dataset.select(split)]
    asked = [used, count, subsampling.every, subsampling.stagger, modes]
    identity = hashlib.sha256(json.dumps(asked).encode()).hexdigest()
    return TrainingData(schema, space, times, rest, weights, theta, reduced, known, truncation, identity)
