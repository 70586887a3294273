"""From sequences to what models of points learn from: the displacements of all vertices."""

from dataclasses import dataclass, replace

import numpy as np

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.motion.point_motion import MeanMotion, PointFrame
from odeform.motion.reduced_space import to_canonical
from odeform.schema import Schema, Window
from odeform.types import Bools, Floats, Vector

__all__ = ["PointData", "prepare_points"]


@dataclass(frozen=True, eq=False)
class PointData:
    """`theta` (S, P) in [-1, 1] and `moved` (S, T, N, 3) float32, for train and val: displacements from the mean motion
    of the training sequences, in units of the frame's scale."""

    schema: Schema
    frame: PointFrame
    mean: MeanMotion
    x: Floats
    """(N, 3) rest points, float32, as networks see them."""
    weights: Floats
    """(N,) share of the mass at each vertex."""
    theta: dict[str, Floats]
    moved: dict[str, Floats]
    known: dict[str, Bools]
    """(S, T) whether the frame is of the data, as of `TrainingData`."""
    given: int = 1
    """Frames from one given frame to the next; 1 for models that are given none."""


def prepare_points(dataset: Dataset, subsampling: FrameSubsampling | None = None, given: int = 1) -> PointData:
    """Displacements in canonical axes of all training and validation sequences; between frames that are known by a
    cubic spline.

    For models that are `given` every k-th frame, the window ends with a given frame, and has their rate.
    """
    subsampling = subsampling or FrameSubsampling()
    count = subsampling.count(dataset.schema) if given == 1 else replace(subsampling, every=given).count(dataset.schema)
    first = next(dataset.sequences("train"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence in split train")
    anchor = first.weights @ first.vertices[0].astype(float)
    rest = to_canonical(first.vertices[0], anchor, dataset.schema.azimuth(first.parameters))
    theta, moved, known = {}, {}, {}
    for split in ("train", "val"):
        theta[split], moved[split] = _read(dataset, split, subsampling, count, anchor, len(rest))
        known[split] = subsampling.known(count, len(theta[split]))
    times = np.arange(count) / dataset.schema.window.rate
    largest = max(float(np.linalg.norm(motion, axis=-1).max()) for motion in moved["train"])
    shifts = np.mean([np.einsum("n,tni->ti", first.weights, motion) for motion in moved["train"]], axis=0)
    mean = MeanMotion(times, shifts)
    for split in moved:
        moved[split] -= shifts[:, None].astype(np.float32)
    frame = _frame(rest, first.weights, anchor, moved["train"], largest)
    for split in moved:
        moved[split] /= np.float32(frame.scale)
    rate = 1.0 / float(times[1] - times[0]) / given
    schema = replace(
        dataset.schema, window=Window(float(times[0]), float(times[-1]), rate), needs_observations=given > 1
    )
    return PointData(schema, frame, mean, frame.seen(rest), first.weights, theta, moved, known, given)


def _read(
    dataset: Dataset, split: str, subsampling: FrameSubsampling, count: int, anchor: Vector, points: int
) -> tuple[Floats, Floats]:
    rate = dataset.schema.window.rate
    theta, moved = [], []
    for index, recorded in enumerate(dataset.sequences(split)):
        sequence = recorded.frames((count - 1) / rate, rate)
        if sequence.vertices.shape[1] != points:
            raise InputError(f"{sequence.name}: expected {points} vertices as in the others, got another mesh")
        turned = to_canonical(sequence.vertices, anchor, dataset.schema.azimuth(sequence.parameters))
        shown = (turned - turned[0])[subsampling.kept(count, index)]
        moved.append(subsampling.filled(shown, count, index).astype(np.float32))
        theta.append(dataset.schema.vector(sequence.parameters))
    if not theta:
        raise InputError(f"{dataset.root}: no sequence in split {split}")
    return np.stack(theta), np.stack(moved)


def _frame(rest: Floats, weights: Floats, anchor: Vector, moved: Floats, largest: float) -> PointFrame:
    """From rest points (N, 3) and training displacements (S, T, N, 3) from the mean motion, metres."""
    squares = within = 0.0
    for motion in moved.astype(float):
        squares += (motion**2).mean() / len(moved)
        centre = np.einsum("n,tni->ti", weights, motion)[:, None]
        within += ((motion - centre) ** 2).mean() / len(moved)
    x, y, z = (float(value) for value in anchor)
    gyration_radius = float(np.sqrt((weights[:, None] * rest**2).sum()))
    reach = float(np.linalg.norm(rest, axis=1).max())
    return PointFrame((x, y, z), gyration_radius, reach, largest, float(np.sqrt(squares)), float(np.sqrt(within)))
