"""How far predictions are from the truth, in the units and averages that the field uses.

All scores leave out frame 0, which is given. "Pooled" scores average over all coordinates of all frames of all
sequences; the others average over coordinates of a frame first, then over frames and sequences, as the paper does (so
that the mean RMSE squared lies below the mean MSE).
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.dataset.store import Dataset
from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid
from odeform.predictor import Predictor
from odeform.schema import Window
from odeform.types import Floats, Frames, Perpoint, Sequence

__all__ = ["evaluate", "score"]


def _deformation(vertices: Frames, weights: Perpoint) -> Frames:
    """(T, N, 3) displacements that remain after the best rigid motion of each frame."""
    rest = vertices[0].astype(float)
    rotation, shift = best_rigid(rest, vertices, weights)
    centre = weights @ rest
    back = np.einsum("tji,tnj->tni", rotation, vertices - (shift + centre)[:, None])
    return back - (rest - centre)


def score(pairs: Iterable[tuple[Floats, Sequence, NDArray[np.bool_]]]) -> dict[str, Any]:
    """Scores of predictions (T, N, 3) metres against sequences, with a mask (T,) of the frames that count on-grid.

    `off_grid_rmse_mm` is the pooled RMSE over the frames that the mask leaves out (None without any).
    """
    frame_mse, frame_mae, distance, off, moved = [], [], [], [], []
    residual = reference = 0.0
    for predicted, truth, on_grid in pairs:
        error = 1e3 * (predicted.astype(float) - truth.vertices)
        grid = on_grid.copy()
        grid[0] = False
        frame_mse.append((error**2).mean(axis=(1, 2))[grid])
        frame_mae.append(np.abs(error).mean(axis=(1, 2))[grid])
        distance.append(np.linalg.norm(error, axis=2).mean(axis=1)[grid])
        off.append((error**2).mean(axis=(1, 2))[~on_grid])
        moved.append(1e6 * ((truth.vertices - truth.vertices[0]).astype(float) ** 2).mean(axis=(1, 2))[grid])
        true_local = _deformation(truth.vertices, truth.weights)
        size = (true_local**2).sum(axis=2).mean(axis=1)
        large = grid & (np.sqrt(size) > 0.1 * np.sqrt(size.max()))
        difference = _deformation(predicted, truth.weights) - true_local
        residual += float((difference[large] ** 2).sum(axis=2).mean(axis=1).sum())
        reference += float(size[large].sum())
    if not frame_mse:
        raise InputError("evaluate: expected at least one sequence")
    mse, mae = np.concatenate(frame_mse), np.concatenate(frame_mae)
    off_all = np.concatenate(off)
    pooled = float(np.sqrt(mse.mean()))
    return {
        "rmse_mm": float(np.sqrt(mse).mean()),
        "mae_mm": float(mae.mean()),
        "mse_mm2": float(mse.mean()),
        "rmse_pooled_mm": pooled,
        "mae_pooled_mm": float(mae.mean()),
        "mse_pooled_mm2": float(mse.mean()),
        "vertex_mm": float(np.concatenate(distance).mean()),
        "relative": pooled / size if (size := float(np.sqrt(np.concatenate(moved).mean()))) else None,
        "deformation_relative": float(np.sqrt(residual / reference)) if reference else None,
        "off_grid_rmse_mm": float(np.sqrt(off_all.mean())) if off_all.size else None,
        "per_frame_rmse_mm": np.sqrt(np.mean(np.stack(frame_mse), axis=0)).tolist() if _even(frame_mse) else [],
        "sequences": len(frame_mse),
    }


def _even(rows: list[Floats]) -> bool:
    return len({len(row) for row in rows}) == 1


def _grid(times: Floats, window: Window) -> NDArray[np.bool_]:
    """Which times lie on the frames of a window's rate."""
    phase = (times - window.start) * window.rate
    return np.abs(phase - np.round(phase)) < 1e-3


def evaluate(
    predictor: Predictor, dataset: Dataset, split: str = "test", window: tuple[int, int] | None = None
) -> dict[str, Any]:
    """Scores of one model on a split, over frames `window` (half-open) of the data, at its `balanced` quality."""
    if predictor.schema.scene != dataset.schema.scene:
        raise InputError(f"{predictor.model} was trained on scene {predictor.schema.scene}, not {dataset.schema.scene}")

    frames = range(*(window or (1, 2)))
    if not any(frame > 0 for frame in frames):
        raise InputError(f"window {window}: expected frames after frame 0, which is given")

    def pairs() -> Iterable[tuple[Floats, Sequence, NDArray[np.bool_]]]:
        for whole in dataset.sequences(split):
            begin, end = window or (0, len(whole.times))
            if begin >= len(whole.times):
                raise InputError(f"window {window}: {whole.name} has {len(whole.times)} frames")
            keep = np.unique(np.concatenate([[0], np.arange(begin, min(end, len(whole.times)))]))
            truth = Sequence(
                whole.times[keep], whole.vertices[keep], whole.faces, whole.weights, whole.parameters, whole.name
            )
            motion = predictor.solve(truth.rest, truth.parameters, until=float(truth.times[-1]))
            yield motion.vertices(truth.times), truth, _grid(truth.times, predictor.schema.window)

    scores = score(pairs())
    scores["per_object"] = {}
    scores["parameters"] = sum(int(a.size) for k, a in predictor.checkpoint.arrays.items() if not k.startswith("rest."))
    return scores
