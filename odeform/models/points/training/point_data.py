"""Prepares what models of points are trained on: the displacements of all vertices of all sequences."""

from dataclasses import dataclass, replace

import numpy as np

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import inputs_identity
from odeform.errors import InputError
from odeform.motion.point_motion import MeanMotion, PointFrame
from odeform.motion.reduced_space import to_canonical
from odeform.schema import Schema, Window
from odeform.types import Bools, Floats, Vector

__all__ = ["PointData", "displacements", "prepare_points"]


@dataclass(frozen=True, eq=False)
class PointData:
    """Parameters and displacements of the splits train and val."""

    schema: Schema
    """Schema with the window of the training; its rate is that of the observed frames, for models that are given
    some."""
    frame: PointFrame
    mean: MeanMotion
    """The mean motion of the training sequences."""
    x: Floats
    """(N, 3) rest points, float32, as inputs of networks."""
    weights: Floats
    """(N,) fraction of the mass at each vertex."""
    theta: dict[str, Floats]
    """(S, P) parameters in [-1, 1] by split."""
    moved: dict[str, Floats]
    """(S, T, N, 3) float32 displacements from the mean motion by split, in units of the frame's scale."""
    observed: dict[str, Bools]
    """(S, T) by split: True where the frame is of the data, False where a spline fills it in."""
    identity: str
    """SHA-256 of all inputs: the sequences, the frames, those that are given."""
    given: int = 1
    """Frames from one observed frame to the next, for models that interpolate between them; 1 for all others."""


def prepare_points(dataset: Dataset, subsampling: FrameSubsampling | None = None, given: int = 1) -> PointData:
    """Displacements in canonical axes of all training and validation sequences; frames that are left out are filled in
    by a cubic spline.

    For models that are given every k-th frame (`given`), the window ends with such a frame, and has their rate.
    `InputError` for a split without sequences, and for sequences of different meshes.
    """
    subsampling = subsampling or FrameSubsampling()
    count = subsampling.count(dataset.schema) if given == 1 else replace(subsampling, every=given).count(dataset.schema)
    first = next(dataset.sequences("train"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence in split train")
    anchor = first.weights @ first.vertices[0].astype(float)
    rest = to_canonical(first.vertices[0], anchor, dataset.schema.azimuth(first.parameters))
    theta, moved, observed = {}, {}, {}
    for split in ("train", "val"):
        theta[split], moved[split] = displacements(dataset, split, subsampling, count, anchor, len(rest))
        observed[split] = subsampling.observed(count, len(theta[split]))
    times = np.arange(count) / dataset.schema.window.rate
    largest = max(float(np.linalg.norm(motion, axis=-1).max()) for motion in moved["train"])
    shifts = np.mean([np.einsum("n,tni->ti", first.weights, motion) for motion in moved["train"]], axis=0)
    for split in moved:
        moved[split] -= shifts[:, None].astype(np.float32)
    frame = _frame(rest, first.weights, anchor, moved["train"], largest)
    for split in moved:
        moved[split] /= np.float32(frame.scale)
    window = Window(float(times[0]), float(times[-1]), 1.0 / float(times[1] - times[0]) / given)
    schema = replace(dataset.schema, window=window, needs_observations=given > 1)
    mean = MeanMotion(times, shifts)
    identity = inputs_identity(dataset, subsampling, count, given)
    return PointData(schema, frame, mean, frame.inputs(rest), first.weights, theta, moved, observed, identity, given)


def displacements(
    dataset: Dataset, split: str, subsampling: FrameSubsampling, count: int, anchor: Vector, points: int
) -> tuple[Floats, Floats]:
    """Parameters (S, P) and displacements from rest (S, T, N, 3) in metres, canonical, float32."""
    rate = dataset.schema.window.rate
    theta, moved = [], []
    for index, recorded in enumerate(dataset.sequences(split)):
        sequence = recorded.frames((count - 1) / rate, rate)
        if sequence.vertices.shape[1] != points:
            raise InputError(f"{sequence.name}: expected {points} vertices as in the others, got another mesh")
        turned = to_canonical(sequence.vertices, anchor, dataset.schema.azimuth(sequence.parameters))
        kept = (turned - turned[0])[subsampling.kept(count, index)]
        moved.append(subsampling.interpolated(kept, count, index).astype(np.float32))
        theta.append(dataset.schema.vector(sequence.parameters))
    if not theta:
        raise InputError(f"{dataset.root}: no sequence in split {split}")
    return np.stack(theta), np.stack(moved)


def _frame(rest: Floats, weights: Floats, anchor: Vector, moved: Floats, largest: float) -> PointFrame:
    """Fits the frame to rest points (N, 3) and training displacements (S, T, N, 3) from the mean motion, metres."""
    squares = within = 0.0
    for motion in moved.astype(float):
        squares += (motion**2).mean() / len(moved)
        centre = np.einsum("n,tni->ti", weights, motion)[:, None]
        within += ((motion - centre) ** 2).mean() / len(moved)
    x, y, z = (float(value) for value in anchor)
    gyration_radius = float(np.sqrt((weights[:, None] * rest**2).sum()))
    reach = float(np.linalg.norm(rest, axis=1).max())
    return PointFrame((x, y, z), gyration_radius, reach, largest, float(np.sqrt(squares)), float(np.sqrt(within)))
