"""From sequences to what the models learn from: one reduced trajectory for each."""

import hashlib
import json
from dataclasses import dataclass, replace

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.model.reduced import ReducedSpace, decompose, fit_modes, make_space, to_canonical
from odeform.schema import Schema, Window
from odeform.types import Floats, Mesh

__all__ = ["TrainingData", "prepare"]

TRUNCATION = 5e-3
MOST_MODES = 64


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
    truncation_mm: dict[str, float]
    """RMS of the deformation that the modes leave out, for each split."""
    identity: str
    """SHA-256 of all that went in: the sequences, the frames, the number of modes."""


def prepare(
    dataset: Dataset, modes: int | None = None, window: tuple[int, int] | None = None, every: int = 1
) -> TrainingData:
    """Decompose all training and validation sequences; fit the deformation basis on the training ones alone.

    Without `modes`, as few as leave `TRUNCATION` of the RMS deformation of the validation sequences.
    """
    schema = dataset.schema
    if window is not None and window[0] != 0:
        raise InputError(f"window {window[0]}:{window[1]}: expected to start at frame 0, where the body is at rest")
    stop = schema.window.stop if window is None else min((window[1] - 1) / schema.window.rate, schema.window.stop)
    count = round(stop * schema.window.rate) + 1
    if every < 1 or len(range(0, count, every)) < 4:
        raise InputError(f"every {every}: expected at least 4 frames to learn from among {count}")
    poses, locals_, theta = {}, {}, {}
    rest = weights = anchor = times = faces = None
    for split in ("train", "val"):
        poses[split], locals_[split], vectors = [], [], []
        for recorded in dataset.sequences(split):
            sequence = recorded.until(stop, every)
            if anchor is None:
                anchor = sequence.weights @ sequence.vertices[0].astype(float)
                weights, times, faces = sequence.weights, sequence.times, sequence.faces
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
    kept = {split: np.mean([(c**2).mean(axis=0) for c in coefficients[split]], axis=0) for split in locals_}
    if modes is None:
        enough = total["val"] - np.cumsum(kept["val"]) <= TRUNCATION**2 * total["val"]
        modes = int(enough.argmax()) + 1 if enough.any() else MOST_MODES
    largest = (
        max(float(np.linalg.norm(pose[:, :3], axis=1).max()) for pose in poses["train"]),
        max(float(np.linalg.norm(c[:, :modes], axis=1).max()) for c in coefficients["train"]),
    )
    space = replace(make_space(Mesh(rest, faces), shapes[..., :modes], weights, anchor), largest=largest)
    reduced, truncation = {}, {}
    for split in ("train", "val"):
        pairs = zip(poses[split], coefficients[split], strict=True)
        reduced[split] = np.stack([np.concatenate([pose, c[:, :modes]], axis=1) for pose, c in pairs])
        truncation[split] = float(1e3 * np.sqrt(max(total[split] - kept[split][:modes].sum(), 0.0)))
    rate = 1.0 / float(times[1] - times[0])
    schema = replace(schema, window=Window(float(times[0]), float(times[-1]), rate))
    used = [[entry.name, entry.sha256] for split in ("train", "val") for entry in dataset.select(split)]
    identity = hashlib.sha256(json.dumps([used, count, every, modes]).encode()).hexdigest()
    return TrainingData(schema, space, times, rest, weights, theta, reduced, truncation, identity)
