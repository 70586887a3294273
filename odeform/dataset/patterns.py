"""Patterns of deformation that stay where they are while the body rolls: fitted to motions, kept where they are few."""

from bisect import bisect_left

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import rotation_from_vector
from odeform.motion.basis import DisplacementBasis, fit_basis
from odeform.motion.reduced_space import POSE, ReducedSpace
from odeform.motion.rolling import Rolling, fourier_series
from odeform.types import Basis, Floats, Perpoint, Points, Rotations, Vector

__all__ = ["fit_rolling"]

TURNED = 1.0  # rad; bodies that turn by less are not rolling
ASIDE = 1e-2  # fraction of the rotation that may be about other axes
SAMPLED = 2000  # frames to which patterns are fitted
MOST = 64  # patterns
ANGLES = 128
SERIES = 1e-3  # fraction of M that its Fourier series may leave out
FEWER = 0.75  # of the modes: patterns are kept if they are at most as many


def fit_rolling(
    space: ReducedSpace,
    rest: Points,
    weights: Perpoint,
    train: Float[np.ndarray, "frames y"],
    val: Float[np.ndarray, "others y"],
    tolerance: float,
) -> Rolling | None:
    """Patterns of the training frames (F, 6 + K), as many as leave out `tolerance` of the RMS deformation of the
    validation frames. None where the body does not turn about one axis, or modes are hardly more.

    `rest` (N, 3) are the canonical points of the body and `weights` their mass fractions.
    """
    axis = _axis(train[:, 3:POSE])
    if axis is None or not train[:, POSE:].any():
        return None
    turns = rotation_from_vector(np.linspace(0.0, 2.0 * np.pi, ANGLES, endpoint=False)[:, None] * axis)
    patterns = _patterns(space, axis, train)
    rolling = Rolling(axis, fourier_series(_products(space.basis, patterns, rest, weights, turns), SERIES))
    most = min(int(FEWER * space.basis.modes), rolling.patterns)
    # what is left out shrinks with each pattern
    count = 1 + bisect_left(range(1, most + 1), -tolerance, key=lambda n: -_left_out(rolling.first(n), val))
    return None if count > most else rolling.first(count)


def _axis(vectors: Float[np.ndarray, "frames 3"]) -> Vector | None:
    """The axis about which a body with these rotation vectors turns; None if it does not turn, or about several."""
    _, sizes, axes = np.linalg.svd(vectors, full_matrices=False)
    turned = np.abs(vectors @ axes[0]).max() >= TURNED
    return axes[0] * np.sign(axes[0].sum()) if turned and sizes[1] <= ASIDE * sizes[0] else None


def _patterns(space: ReducedSpace, axis: Vector, frames: Floats) -> DisplacementBasis:
    """The principal patterns of frames (F, 6 + K), as fields on the body at rest."""
    basis, rng = space.basis, np.random.default_rng(0)
    points, modes = space.gyration_radius * basis.centers, frames[:, POSE:]
    sizes = np.square(modes).sum(axis=1)
    # large deformations are more likely to be among them, and count as much less
    chosen = rng.choice(len(frames), SAMPLED, p=np.sqrt(sizes) / np.sqrt(sizes).sum())
    fields = np.empty((SAMPLED, 3 * len(points)))
    for row, index in enumerate(chosen):
        turn = rotation_from_vector((frames[index, 3:POSE] @ axis) * axis)
        field = (basis.values(points @ turn) @ modes[index]) @ turn.T
        fields[row] = field.ravel() / sizes[index] ** 0.25
    _, _, rows = np.linalg.svd(fields, full_matrices=False)
    found = rows[:MOST].reshape(-1, len(points), 3).transpose(1, 2, 0)
    return fit_basis(points, np.sqrt(len(points)) * found, basis.scale)


def _products(
    basis: DisplacementBasis, patterns: DisplacementBasis, rest: Points, weights: Perpoint, turns: Rotations
) -> Floats:
    """M at the rotations (A, 3, 3) -> (A, K, S), its columns orthonormal in the mean over all angles."""
    modes = basis.values(rest).astype(float) * weights[:, None, None]
    flat = modes.reshape(-1, modes.shape[2]).T
    out = np.stack([flat @ _turned(patterns, rest, turn).reshape(flat.shape[1], -1) for turn in turns])
    mean = np.einsum("akj,akl->jl", out, out) / len(turns)
    mean[np.diag_indices_from(mean)] += 1e-9 * np.trace(mean)
    return out @ np.linalg.inv(np.linalg.cholesky(mean)).T


def _turned(patterns: DisplacementBasis, rest: Points, turn: Rotations) -> Basis:
    """(N, 3, S): the patterns at the points of a body that has turned, in axes of the body."""
    return np.einsum("ji,njs->nis", turn, patterns.values(rest @ turn.T))


def _left_out(rolling: Rolling, frames: Floats) -> float:
    """Fraction of the RMS deformation of frames (F, 6 + K) that the patterns leave out."""
    vectors, modes = frames[:, 3:POSE], frames[:, POSE:]
    residual = rolling.coefficients(vectors, rolling.amplitudes(vectors, modes)) - modes
    return float(np.linalg.norm(residual) / np.linalg.norm(modes))
