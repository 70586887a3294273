"""Deformations as morph targets: a few displacement fields, and their weights in every frame."""

import numpy as np
from jaxtyping import Float

from odeform.types import Floats, Frames

__all__ = ["morph_targets"]

Targets = Float[np.ndarray, "targets points 3"]
Weights = Float[np.ndarray, "times targets"]


def morph_targets(displacements: Frames, tolerance: float) -> tuple[Targets, Weights]:
    """Displacements (T, N, 3) -> targets (K, N, 3) and weights (T, K), both float32, whose product they are.

    No point of any frame is off by more than `tolerance`, in the units of `displacements`. The targets are POD modes
    (Sirovich 1987, Q. Appl. Math. 45), each scaled so that its largest weight is 1. K is at most T: where the frames
    have nothing in common, every frame has a target. K is 0 where no point moves by more than the tolerance.
    """
    frames = np.asarray(displacements, dtype=float).reshape(len(displacements), -1)
    basis = np.linalg.eigh(frames @ frames.T)[1][:, ::-1]
    scale = np.abs(basis).max(axis=0)
    weights = (basis / scale).astype(np.float32)
    targets = (scale[:, None] * (basis.T @ frames)).astype(np.float32)
    fewest, enough = -1, len(frames)
    while enough - fewest > 1:
        count = (fewest + enough) // 2
        if _largest(frames - weights[:, :count].astype(float) @ targets[:count]) <= tolerance:
            enough = count
        else:
            fewest = count
    return targets[:enough].reshape(enough, *displacements.shape[1:]), np.ascontiguousarray(weights[:, :enough])


def _largest(residual: Floats) -> float:
    """Returns the largest distance of a point, of coordinates (T, 3 N)."""
    return float(np.sqrt((residual.reshape(-1, 3) ** 2).sum(axis=1).max(initial=0.0)))
