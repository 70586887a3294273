"""A motion as keyframes: a rigid motion about the centre, and morph targets for what remains."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from odeform.formats.morph_targets import Targets, Weights, morph_targets
from odeform.geometry.similarity import Similarity
from odeform.motion.base import Motion
from odeform.types import Floats, Points, Rotations, Times, Vectors

__all__ = ["Keyframes", "keyframes", "quaternions"]

Quaternions = Float[np.ndarray, "*times 4"]


@dataclass(frozen=True, eq=False)
class Keyframes:
    """x(t) = R(t) (rest + sum of weights(t) targets) + shift(t), in the units and axes of a file.

    Attributes:
        times: (T,) seconds.
        rotations: (T, 4) unit quaternions x, y, z, w, each next to the one before.
        shifts: (T, 3), where the centre is.
        rest: (N, 3) the shape at rest around its centre.
        targets: (K, N, 3) displacements.
        weights: (T, K) their weights, at most 1.
    """

    times: Times
    rotations: Quaternions
    shifts: Vectors
    rest: Points
    targets: Targets
    weights: Weights


def keyframes(motion: Motion, times: Times, back: Similarity, tolerance: float) -> Keyframes:
    """Makes the keyframes of `motion` at (T,) seconds; `back` goes from the scene to the file. No point is off by
    more than `tolerance` in metres of the scene."""
    poses, rest = motion.pose(times), np.asarray(motion.geometry.points, dtype=float)
    turns, centre = poses[:, :3, :3], rest.mean(axis=0)
    local = (np.asarray(motion.vertices(times), dtype=float) - poses[:, None, :3, 3]) @ turns

    def around(vectors: Floats) -> Floats:
        return back.factor * (vectors @ back.rotation.T)

    targets, weights = morph_targets(around(local - rest), tolerance * back.factor)
    return Keyframes(
        times,
        quaternions(back.rotation @ turns @ back.rotation.T),
        back.points(turns @ centre + poses[:, :3, 3]),
        around(rest - centre),
        targets,
        weights,
    )


def quaternions(rotations: Rotations) -> Quaternions:
    """(T, 3, 3) -> (T, 4) unit quaternions x, y, z, w, of the sign for which neighbours are nearest to each other."""
    out = Rotation.from_matrix(rotations).as_quat()
    flips = np.where((out[1:] * out[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    out[1:] *= np.cumprod(flips)[:, None]
    return out
