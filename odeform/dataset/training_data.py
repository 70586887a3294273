"""Prepares what reduced models are trained on: one reduced trajectory for each sequence of a data set."""

import hashlib
import json
from dataclasses import dataclass, replace

import numpy as np

from odeform.arrays import row_steps
from odeform.dataset.index import Dataset
from odeform.dataset.patterns import fit_rolling
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.motion.basis import DisplacementBasis
from odeform.motion.reduced_space import ReducedSpace, decompose, fit_modes, make_space, to_canonical
from odeform.schema import Schema, Window
from odeform.types import Basis, Bools, Floats, Mesh, MotionSequence, Perpoint, Times, Vector

__all__ = ["FILLED_WEIGHT", "ROUNDING", "TrainingData", "inputs_identity", "prepare"]

SPLITS = ("train", "val")
TRUNCATION = 5e-3  # fraction of the RMS deformation that may be left out
MOST_MODES = 64
ROUNDING = 1e-6
"""Metres, or radians: what checkpoints may change predictions by, as they keep arrays in steps (`odeform.arrays`)."""
PULSE = "pulse_s"  # of a scene's fixed values: how long a force drives the body
FILLED_WEIGHT = 1e-3
"""Weight in training of a frame that a spline fills in: it constrains what no observed frame does."""


@dataclass(frozen=True, eq=False)
class TrainingData:
    """Parameters and reduced motions of the splits train and val."""

    schema: Schema
    """The scene's schema, with the window and frame rate of the training."""
    space: ReducedSpace
    times: Floats
    """(T,) seconds of the frames."""
    rest: Floats
    """(N, 3) canonical rest points of the training mesh, metres."""
    weights: Floats
    """(N,) mass fraction at each vertex."""
    theta: dict[str, Floats]
    """(S, P) parameters in [-1, 1] by split."""
    reduced: dict[str, Floats]
    """(S, T, y) metres and radians by split: the coordinates of `space`."""
    observed: dict[str, Bools]
    """(S, T) by split: True where the frame is of the data, False where a spline fills it in."""
    truncation_mm: dict[str, float]
    """RMS of the deformation that the modes leave out, by split."""
    identity: str
    """SHA-256 of all inputs: the sequences, the frames, the number of modes."""
    first_free: int = 0
    """The first frame from which on nothing but the ground drives the body."""


@dataclass(frozen=True, eq=False)
class _Body:
    """The training mesh as it rests: canonical `rest`, mass `weights` (N,), `anchor` (3,) in the scene; and the
    `times` (T,) of all frames."""

    rest: Mesh
    weights: Perpoint
    anchor: Vector
    times: Times


@dataclass(frozen=True, eq=False)
class _Motions:
    """The sequences of a split: `theta` (S, P), and of each its pose (T, 6) and its deformation (T, N, 3)."""

    theta: Floats
    poses: list[Floats]
    deformations: list[Floats]

    def coefficients(self, modes: Basis, weights: Perpoint) -> list[Floats]:
        """(T, K) of each sequence, by the modes (N, 3, K)."""
        fractions = weights[:, None]
        return [np.einsum("tni,nik->tk", motion * fractions, modes) for motion in self.deformations]

    def mean_square(self, weights: Perpoint) -> float:
        """Mean square deformation over the body, the frames and the sequences, m^2."""
        fractions = weights[:, None]
        return float(np.mean([(fractions * motion**2).sum(axis=(1, 2)).mean() for motion in self.deformations]))


def prepare(
    dataset: Dataset,
    modes: int | DisplacementBasis | None = None,
    subsampling: FrameSubsampling | None = None,
    patterns: bool = False,
) -> TrainingData:
    """Decompose all training and validation sequences; fit the deformation basis to the training sequences alone.

    `modes` is their number, or the basis of a model that is trained already. Without it, the fewest that leave out at
    most `TRUNCATION` of the RMS deformation of the validation sequences. With `patterns`, deformations of a body that
    rolls are in axes that do not turn with it (`odeform.motion.rolling`), where that takes fewer.
    `InputError` for a split without sequences, and for sequences of different meshes.
    """
    subsampling = subsampling or FrameSubsampling()
    count = subsampling.count(dataset.schema)
    body = _body(dataset, count)
    motions = {split: _decomposed(dataset, split, subsampling, count, body) for split in SPLITS}
    if isinstance(modes, DisplacementBasis):
        basis, modes = modes.values(body.rest.points).astype(float), modes.modes
    else:
        basis = fit_modes(motions["train"].deformations, body.weights, modes or MOST_MODES)
    coefficients = {split: motions[split].coefficients(basis, body.weights) for split in SPLITS}
    total = {split: motions[split].mean_square(body.weights) for split in SPLITS}
    by_mode = {split: np.mean([(c**2).mean(axis=0) for c in coefficients[split]], axis=0) for split in SPLITS}
    kept = _needed_modes(total["val"], by_mode["val"]) if modes is None else modes
    shift = _largest([pose[:, :3] for pose in motions["train"].poses])
    deformation = _largest([c[:, :kept] for c in coefficients["train"]])
    space = make_space(body.rest, basis[..., :kept], body.weights, body.anchor)
    steps = row_steps(np.sqrt(by_mode["train"][:kept]), ROUNDING)
    space = replace(space, largest=(shift, deformation), basis=replace(space.basis, steps=steps))
    reduced = {}
    for split in SPLITS:
        pairs = zip(motions[split].poses, coefficients[split], strict=True)
        trajectories = [np.concatenate([pose, c[:, :kept]], axis=1) for pose, c in pairs]
        reduced[split] = np.stack([subsampling.interpolated(y, count, index) for index, y in enumerate(trajectories)])
    if patterns:
        train, val = (reduced[split].reshape(-1, reduced[split].shape[2]) for split in SPLITS)
        space = replace(space, rolling=fit_rolling(space, body.rest.points, body.weights, train, val, TRUNCATION))
        reduced = {split: np.stack([space.with_patterns(y) for y in reduced[split]]) for split in SPLITS}
    left_out = {split: max(total[split] - by_mode[split][:kept].sum(), 0.0) for split in SPLITS}
    return TrainingData(
        schema=_trained_schema(dataset.schema, body.times, subsampling),
        space=space,
        times=body.times,
        rest=body.rest.points,
        weights=body.weights,
        theta={split: motions[split].theta for split in SPLITS},
        reduced=reduced,
        observed={split: subsampling.observed(count, len(reduced[split])) for split in SPLITS},
        truncation_mm={split: float(1e3 * np.sqrt(left_out[split])) for split in SPLITS},
        identity=inputs_identity(dataset, subsampling, count, kept),
        first_free=int(np.searchsorted(body.times, float(dataset.fixed.get(PULSE, 0.0)) - 1e-9)),
    )


def _frames(dataset: Dataset, recorded: MotionSequence, count: int) -> MotionSequence:
    """The first `count` frames at the rate of the data set."""
    rate = dataset.schema.window.rate
    return recorded.frames((count - 1) / rate, rate)


def _body(dataset: Dataset, count: int) -> _Body:
    """Takes the body from the first training sequence."""
    first = next(dataset.sequences("train"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence in split train")
    sequence = _frames(dataset, first, count)
    anchor = sequence.weights @ sequence.vertices[0].astype(float)
    rest = to_canonical(sequence.vertices[0], anchor, dataset.schema.azimuth(sequence.parameters))
    return _Body(Mesh(rest, sequence.faces), sequence.weights, anchor, sequence.times)


def _decomposed(dataset: Dataset, split: str, subsampling: FrameSubsampling, count: int, body: _Body) -> _Motions:
    schema, points = dataset.schema, len(body.rest.points)
    theta, poses, deformations = [], [], []
    for index, recorded in enumerate(dataset.sequences(split)):
        whole = _frames(dataset, recorded, count)
        kept = subsampling.kept(count, index)
        sequence = replace(whole, times=whole.times[kept], vertices=whole.vertices[kept])
        if sequence.vertices.shape[1] != points:
            raise InputError(f"{sequence.name}: expected {points} vertices as in the others, got another mesh")
        pose, deformation = decompose(sequence, body.anchor, schema.azimuth(sequence.parameters))
        poses.append(pose)
        deformations.append(deformation)
        theta.append(schema.vector(sequence.parameters))
    if not theta:
        raise InputError(f"{dataset.root}: no sequence in split {split}")
    return _Motions(np.stack(theta), poses, deformations)


def _needed_modes(total: float, by_mode: Floats) -> int:
    """The fewest modes that leave out at most `TRUNCATION` of the deformation, from mean squares by mode (K,)."""
    enough = total - np.cumsum(by_mode) <= TRUNCATION**2 * total
    return int(enough.argmax()) + 1 if enough.any() else MOST_MODES


def _largest(motions: list[Floats]) -> float:
    """The largest norm of the vectors (T, n)."""
    return max(float(np.linalg.norm(motion, axis=1).max()) for motion in motions)


def _trained_schema(schema: Schema, times: Times, subsampling: FrameSubsampling) -> Schema:
    rate = schema.window.rate if subsampling.stagger else schema.window.rate / subsampling.every
    return replace(schema, window=Window(float(times[0]), float(times[-1]), rate))


def inputs_identity(dataset: Dataset, subsampling: FrameSubsampling, count: int, modes: int) -> str:
    """Returns the SHA-256 of all inputs of a training: the sequences, the frames, and the number of modes, or of given
    frames."""
    used = [[entry.name, entry.sha256] for split in SPLITS for entry in dataset.select(split)]
    inputs = [used, count, subsampling.every, subsampling.stagger, modes]
    return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()
