"""The displacement basis phi_k(x): a coordinate field, evaluated once per geometry.

A deformation is d(x, t) = sum_k c_k(t) phi_k(x). Each phi_k is a radial-basis network over the training surface,
sum_j w_jk |x - x_j|^3 + a_k + B_k x: exact at the training vertices, the smoothest field between them (it minimises
bending energy; Duchon 1977), with a closed-form gradient. Points farther from the anchor than six times the extent of
the trained body are pulled in along their ray, to at most nine times: far away, the sum would be all rounding.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float
from scipy.linalg import LinAlgError, LinAlgWarning, solve

from odeform.schema import soft_clip
from odeform.types import Basis, Floats, Perpoint, Points

__all__ = ["DisplacementBasis", "fit_basis"]

CHUNK = 512  # points evaluated at once: as many as stay in the cache with their distances from all centers


@dataclass(frozen=True, eq=False)
class DisplacementBasis:
    """`centers` (M, 3) in units of `scale` metres about the anchor, and the number of modes K."""

    centers: Float[np.ndarray, "centers 3"]
    modes: int
    scale: float
    solve: Callable[[], Floats]
    """Returns `weights`. It is called when they are first needed: a file may hold more bodies than are shown."""
    steps: Float[np.ndarray, " modes"] | None = None
    """(K,) m per m: the precision of each mode that is worth keeping in a file; None for full precision."""

    @cached_property
    def weights(self) -> Floats:
        """Solves for (M + 4, K * 3)."""
        return self.solve()

    def first(self, count: int) -> "DisplacementBasis":
        """Returns the basis of the first `count` modes."""
        steps = None if self.steps is None else self.steps[:count]
        return replace(self, modes=count, solve=partial(_first_weights, self, count), steps=steps)

    @cached_property
    def _far(self) -> float:
        return 6.0 * float(np.linalg.norm(self.centers, axis=1).max())

    def _near(self, points: Points) -> tuple[Points, Perpoint, Perpoint]:
        """Points in units of `scale`, their distances from the anchor, and the soft-clipped distances."""
        scaled = np.asarray(points, dtype=float) / self.scale
        away = np.maximum(np.linalg.norm(scaled, axis=1), np.finfo(float).tiny)
        return scaled, away, soft_clip(away, self._far, 0.5 * self._far)

    def values(self, points: Points, out: Float[np.ndarray, "modes points 3"] | None = None) -> Basis:
        """Evaluates phi at `points` (N, 3) metres about the anchor: (N, 3, K) float32.

        A view of an array with the modes first (`out`, if given), so that frames are c @ values at the speed of memory
        or arithmetic.
        """
        out = np.empty((self.modes, len(points), 3), dtype=np.float32) if out is None else out
        count = len(self.centers)
        features = np.ones((min(CHUNK, len(points)), count + 4))
        for at in range(0, len(points), CHUNK):
            chunk, away, near = self._near(points[at : at + CHUNK])
            chunk *= (near / away)[:, None]
            squares, kernel = _squares(chunk, self.centers), features[: len(chunk)]
            np.multiply(squares, np.sqrt(squares), out=kernel[:, :count])
            kernel[:, count + 1 :] = chunk
            out[:, at : at + CHUNK] = (kernel @ self.weights).reshape(len(chunk), self.modes, 3).swapaxes(0, 1)
        return out.transpose(1, 2, 0)

    def slopes(
        self, points: Points, directions: Float[np.ndarray, "points directions 3"]
    ) -> Float[np.ndarray, "modes directions 3 points"]:
        """Maps (grad phi) d at `points` (N, 3) along `directions` (N, M, 3) to (K, M, 3, N) float32, metre per metre.

        The modes come first, so that a frame is c @ slopes at memory speed.
        """
        out = np.empty((self.modes, directions.shape[1], 3, len(points)), dtype=np.float32)
        count = len(self.centers)
        for at in range(0, len(points), CHUNK):
            chunk, away, near = self._near(points[at : at + CHUNK])
            outward, across = chunk / away[:, None], (near / away)[:, None]
            outwards = 1.0 - (np.maximum(near / self._far - 1.0, 0.0) / 0.5)[:, None] ** 2  # of `soft_clip`
            chunk *= across
            distance = np.sqrt(_squares(chunk, self.centers))
            for column in range(directions.shape[1]):
                along = directions[at : at + CHUNK, column]
                along = across * along + (outwards - across) * (along * outward).sum(axis=1)[:, None] * outward
                ahead = (chunk * along).sum(axis=1)[:, None] - along @ self.centers.T
                value = (3.0 * distance * ahead) @ self.weights[:count] + along @ self.weights[count + 1 :]
                out[:, column, :, at : at + CHUNK] = value.reshape(len(chunk), self.modes, 3).transpose(1, 2, 0)
        out /= np.float32(self.scale)
        return out


Pairs = Float[np.ndarray, "points centers"]


def _squares(points: Points, centers: Float[np.ndarray, "centers 3"]) -> Pairs:
    """Squared distances, by products: fast, and exact to rounding of the coordinates, which are of order one."""
    one = np.concatenate([-2.0 * points, (points**2).sum(axis=1)[:, None], np.ones((len(points), 1))], axis=1)
    other = np.concatenate([centers, np.ones((len(centers), 1)), (centers**2).sum(axis=1)[:, None]], axis=1)
    squares = one @ other.T
    return np.maximum(squares, 0.0, out=squares)


def fit_basis(points: Points, modes: Basis, scale: float) -> DisplacementBasis:
    """Returns the basis with the values `modes` (N, 3, K) metres at the distinct `points` (N, 3) metres."""
    centers = np.asarray(points, dtype=float) / scale
    return DisplacementBasis(centers, modes.shape[2], scale, partial(_fitted_weights, centers, modes))


def _first_weights(basis: DisplacementBasis, count: int) -> Floats:
    return basis.weights[:, : 3 * count]


def _fitted_weights(centers: Float[np.ndarray, "centers 3"], modes: Float[np.ndarray, "centers 3 modes"]) -> Floats:
    """Solves for the weights of the basis with these values at its centers."""
    tail = np.concatenate([np.ones((len(centers), 1)), centers], axis=1)
    system = np.block([[_squares(centers, centers) ** 1.5, tail], [tail.T, np.zeros((4, 4))]])
    values = np.asarray(modes, dtype=float).swapaxes(1, 2).reshape(len(centers), -1)
    right = np.concatenate([values, np.zeros((4, values.shape[1]))])
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            return solve(system, right)
        except (LinAlgError, LinAlgWarning):
            # coplanar points leave part of the linear tail undetermined
            return np.linalg.lstsq(system, right, rcond=None)[0]
