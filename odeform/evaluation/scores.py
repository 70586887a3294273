"""Distances between predictions and the truth, in the units and averages of the field.

All scores leave out frame 0, which is given. "Pooled" scores average over all coordinates of all frames of all
sequences. The others average over the coordinates of a frame first, then over frames and sequences, as the paper does
(arXiv:2607.20670), so that the mean RMSE squared lies below the mean MSE.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.evaluation.bootstrap import Motions, pooled_interval
from odeform.geometry.rigid import best_rigid
from odeform.types import Floats, Frames, MotionSequence, Perpoint, Points

__all__ = ["Comparison", "Mask", "Scores", "mean_of"]

Mask = NDArray[np.bool_]
Comparison = tuple[Frames, MotionSequence, Mask, Mask, Floats]
"""The arguments of `Scores.add`."""
AVERAGED = (
    *("rmse_mm", "mae_mm", "mse_mm2", "rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2", "vertex_mm"),
    *("relative", "deformation_relative", "off_grid_rmse_mm", "coverage_90", "median_mm"),
)


def _deformation(vertices: Frames, rest: Points, weights: Perpoint) -> Frames:
    """(T, N, 3) displacements from rest in metres that the best rigid motion of each frame leaves."""
    rest = rest.astype(float)
    rotation, shift = best_rigid(rest, vertices, weights)
    centre = weights @ rest
    back = np.einsum("tji,tnj->tni", rotation, vertices - (shift + centre)[:, None])
    return back - (rest - centre)


class Scores:
    """Accumulates the errors of predictions, one sequence at a time."""

    def __init__(self) -> None:
        self._mse: list[Floats] = []
        self._mae: list[Floats] = []
        self._distance: list[Floats] = []
        self._between: list[Floats] = []
        self._moved: list[Floats] = []
        self._covered: list[Floats] = []
        self._residual = self._reference = 0.0

    @property
    def motions(self) -> Motions:
        """Sums of squares in mm^2 over the frames of each motion, and the numbers of its frames."""
        return np.array([row.sum() for row in self._mse]), np.array([float(len(row)) for row in self._mse])

    def add(
        self,
        predicted: Frames,
        truth: MotionSequence,
        counted: Mask,
        between: Mask,
        covered: Float[np.ndarray, " times"] | None = None,
    ) -> None:
        """Add a prediction (T, N, 3) in metres of the sequence `truth`.

        Scores average over the frames `counted` (T,), except frame 0. The frames `between` (T,) lie between those that
        the model was trained on, and are scored separately. `covered` (T,) is 1 where the error is within the model's
        error band, else 0; NaN or None without a band.
        """
        error = 1e3 * (predicted.astype(float) - truth.vertices)
        grid = counted.copy()
        grid[0] = False
        squares = (error**2).mean(axis=(1, 2))
        self._mse.append(squares[grid])
        self._mae.append(np.abs(error).mean(axis=(1, 2))[grid])
        self._distance.append(np.linalg.norm(error, axis=2).mean(axis=1)[grid])
        self._between.append(squares[between])
        self._covered.append((np.full(len(grid), np.nan) if covered is None else covered)[grid])
        self._moved.append(1e6 * ((truth.vertices - truth.vertices[0]).astype(float) ** 2).mean(axis=(1, 2))[grid])
        rest = truth.vertices[0]
        true_local = _deformation(truth.vertices, rest, truth.weights)
        size = (true_local**2).sum(axis=2).mean(axis=1)
        large = grid & (np.sqrt(size) > 0.1 * np.sqrt(size[grid].max(initial=0.0)))
        difference = _deformation(predicted, rest, truth.weights) - true_local
        self._residual += float((difference[large] ** 2).sum(axis=2).mean(axis=1).sum())
        self._reference += float(size[large].sum())

    def result(self) -> dict[str, Any]:
        """All scores by name, in millimetres or as ratios. `InputError` if nothing was added.

        `off_grid_rmse_mm` is the pooled RMSE between the trained frames, None without any; `rmse_pooled_95` the 95 %
        bootstrap interval of `rmse_pooled_mm`; `motions_mm` the RMSE of each motion, and `median_mm` its median.
        """
        if not self._mse:
            raise InputError("evaluate: expected at least one sequence")
        mse, mae, between = (np.concatenate(rows) for rows in (self._mse, self._mae, self._between))
        pooled, moved = float(np.sqrt(mse.mean())), float(np.sqrt(np.concatenate(self._moved).mean()))
        covered = np.concatenate(self._covered)
        even = len({len(row) for row in self._mse}) == 1
        single = [float(np.sqrt(row.mean())) for row in self._mse]
        return {
            "rmse_mm": float(np.sqrt(mse).mean()),
            "mae_mm": float(mae.mean()),
            "mse_mm2": float(mse.mean()),
            "rmse_pooled_mm": pooled,
            "rmse_pooled_95": pooled_interval(self.motions),
            "median_mm": float(np.median(single)),
            "motions_mm": single,
            "mae_pooled_mm": float(mae.mean()),
            "mse_pooled_mm2": float(mse.mean()),
            "vertex_mm": float(np.concatenate(self._distance).mean()),
            "relative": pooled / moved if moved else None,
            "deformation_relative": float(np.sqrt(self._residual / self._reference)) if self._reference else None,
            "off_grid_rmse_mm": float(np.sqrt(between.mean())) if between.size else None,
            "coverage_90": None if np.isnan(covered).any() else float(covered.mean()),
            "per_frame_rmse_mm": np.sqrt(np.mean(np.stack(self._mse), axis=0)).tolist() if even else [],
            "sequences": len(self._mse),
        }


def mean_of(results: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The mean of each score over several results, each with equal weight; None for a score that one of them lacks."""
    rows = {name: [result[name] for result in results] for name in AVERAGED}
    return {name: None if None in row else float(np.mean(row)) for name, row in rows.items()}
