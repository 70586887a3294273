"""How far predictions are from the truth, in the units and averages that the field uses.

All scores leave out frame 0, which is given. "Pooled" scores average over all coordinates of all frames of all
sequences; the others average over coordinates of a frame first, then over frames and sequences, as the paper does (so
that the mean RMSE squared lies below the mean MSE).
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid
from odeform.models.base import Predictor
from odeform.models.registry import observations
from odeform.schema import Schema, Window
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Frames, MotionSequence, Perpoint, Points

__all__ = ["Scores", "evaluate"]


def _deformation(vertices: Frames, rest: Points, weights: Perpoint) -> Frames:
    """(T, N, 3) displacements from the rest that remain after the best rigid motion of each frame."""
    rest = rest.astype(float)
    rotation, shift = best_rigid(rest, vertices, weights)
    centre = weights @ rest
    back = np.einsum("tji,tnj->tni", rotation, vertices - (shift + centre)[:, None])
    return back - (rest - centre)


Mask = NDArray[np.bool_]


class Scores:
    """Collects predictions (T, N, 3) metres against sequences, one at a time."""

    def __init__(self) -> None:
        self._mse: list[Floats] = []
        self._mae: list[Floats] = []
        self._distance: list[Floats] = []
        self._between: list[Floats] = []
        self._moved: list[Floats] = []
        self._residual = self._reference = 0.0

    def add(self, predicted: Frames, truth: MotionSequence, counted: Mask, between: Mask) -> None:
        """`counted` (T,) are the frames that scores average over, without frame 0, which is given; `between` those
        off the frames that the model was trained on."""
        error = 1e3 * (predicted.astype(float) - truth.vertices)
        grid = counted.copy()
        grid[0] = False
        squares = (error**2).mean(axis=(1, 2))
        self._mse.append(squares[grid])
        self._mae.append(np.abs(error).mean(axis=(1, 2))[grid])
        self._distance.append(np.linalg.norm(error, axis=2).mean(axis=1)[grid])
        self._between.append(squares[between])
        self._moved.append(1e6 * ((truth.vertices - truth.vertices[0]).astype(float) ** 2).mean(axis=(1, 2))[grid])
        rest = truth.vertices[0]
        true_local = _deformation(truth.vertices, rest, truth.weights)
        size = (true_local**2).sum(axis=2).mean(axis=1)
        large = grid & (np.sqrt(size) > 0.1 * np.sqrt(size[grid].max(initial=0.0)))
        difference = _deformation(predicted, rest, truth.weights) - true_local
        self._residual += float((difference[large] ** 2).sum(axis=2).mean(axis=1).sum())
        self._reference += float(size[large].sum())

    def result(self) -> dict[str, Any]:
        """`off_grid_rmse_mm` is the pooled RMSE between the trained frames (None without any)."""
        if not self._mse:
            raise InputError("evaluate: expected at least one sequence")
        mse, mae, between = (np.concatenate(rows) for rows in (self._mse, self._mae, self._between))
        pooled, moved = float(np.sqrt(mse.mean())), float(np.sqrt(np.concatenate(self._moved).mean()))
        even = len({len(row) for row in self._mse}) == 1
        return {
            "rmse_mm": float(np.sqrt(mse).mean()),
            "mae_mm": float(mae.mean()),
            "mse_mm2": float(mse.mean()),
            "rmse_pooled_mm": pooled,
            "mae_pooled_mm": float(mae.mean()),
            "mse_pooled_mm2": float(mse.mean()),
            "vertex_mm": float(np.concatenate(self._distance).mean()),
            "relative": pooled / moved if moved else None,
            "deformation_relative": float(np.sqrt(self._residual / self._reference)) if self._reference else None,
            "off_grid_rmse_mm": float(np.sqrt(between.mean())) if between.size else None,
            "per_frame_rmse_mm": np.sqrt(np.mean(np.stack(self._mse), axis=0)).tolist() if even else [],
            "sequences": len(self._mse),
        }


def _on_frames(times: Floats, window: Window) -> Mask:
    """Which times lie on the frames of a window's rate."""
    phase = (times - window.start) * window.rate
    return np.abs(phase - np.round(phase)) < 1e-3


def _spans(
    predictor: Predictor, schema: Schema, window: tuple[int, int] | None, clock: float
) -> dict[str, tuple[float, float]]:
    """Half-open spans of the data's time in seconds that are scored, `whole` and perhaps `impact`.

    The model's clock is ahead of the data's by `clock` seconds.
    """
    rate, stop, trained = schema.window.rate, schema.window.stop, predictor.schema.window
    begin, end = (0.0, stop + 1.0 / rate) if window is None else (window[0] / rate, window[1] / rate)
    if end <= 1.0 / rate + 1e-9:
        raise InputError(f"window {window}: expected frames after frame 0, which is given")
    if begin > stop + 1e-9:
        raise InputError(f"window {window}: scene {schema.scene} has {round(stop * rate) + 1} frames")
    if not predictor.extrapolates:
        begin, end = max(begin, trained.start - clock), min(end, trained.stop - clock + 0.5 / rate)
        if end <= begin:
            raise InputError(f"window {window}: {predictor.model} knows {trained.start:g} to {trained.stop:g} s alone")
    spans = {"whole": (begin, end)}
    if schema.impact and window is None:
        spans["impact"] = schema.impact
    return spans


def _within(times: Floats, *spans: tuple[float, float]) -> Mask:
    """Frame 0 and those of half-open spans of seconds: no other is scored."""
    kept = np.any([(times > first - 1e-6) & (times < last - 1e-6) for first, last in spans], axis=0)
    kept[0] = True
    return kept


def _covered(predictor: Predictor, predicted: Frames, truth: MotionSequence) -> Floats:
    """(T,) 1 where the RMSE is within what nine in ten are expected to keep to, else 0; not a number where the model
    expects none."""
    expected = predictor.error_band(truth.parameters, truth.times)
    if expected is None:
        return np.full(len(predicted), np.nan)
    rmse = 1e3 * np.sqrt(((predicted.astype(float) - truth.vertices) ** 2).mean(axis=(1, 2)))
    return (rmse <= expected[:, 1]).astype(float)


def evaluate(
    predictor: Predictor,
    dataset: Dataset,
    split: str = "test",
    window: tuple[int, int] | None = None,
    quality: str | SolverSettings = "balanced",
    parts: Iterable[tuple[int, int]] = (),
) -> dict[str, Any]:
    """Scores of one model on a split.

    Over the data's window, or its frames `window` (half-open; frames of the scene's rate, whatever that of the file). A
    model that knows its trained window alone is scored on that. Where the data end before it begins, they are taken to
    be that window cut out of longer ones, and begin where it does. A scene with an impact gets its scores apart, as
    `impact`, unless a window was asked for; other `parts`, half-open, theirs as `FIRST:LAST`.
    """
    schema, trained = dataset.schema, predictor.schema.window
    if predictor.schema.scene != schema.scene:
        raise InputError(f"{predictor.model} was trained on scene {predictor.schema.scene}, not {schema.scene}")
    stop = schema.window.stop
    clock = 0.0 if predictor.extrapolates or trained.start <= stop else trained.start
    spans = _spans(predictor, schema, window, clock)
    begin, end = spans["whole"]
    spans |= {f"{part[0]}:{part[1]}": _spans(predictor, schema, part, clock)["whole"] for part in parts}
    scores = {name: Scores() for name in spans}
    covered = []
    for recorded in dataset.sequences(split):
        whole = recorded.until(stop)
        asked = _within(whole.times, *spans.values())
        truth = replace(whole, times=whole.times[asked], vertices=whole.vertices[asked])
        # what the data leave fixed may be a parameter of the model
        given = {**predictor.schema.known(dataset.fixed), **truth.parameters}
        motion = predictor.solve(
            predictor.to_body_frame(truth.rest, given),
            given,
            quality,
            until=float(clock + truth.times[-1]),
            observed=observations(predictor.schema, whole),
        )
        predicted = motion.vertices(clock + truth.times)
        on_frames = _on_frames(truth.times, schema.window)
        scored = on_frames & (truth.times > max(begin - 1e-6, 0.0)) & (truth.times < end - 1e-6)
        covered.append(_covered(predictor, predicted, truth)[scored])
        between = ~_on_frames(clock + truth.times, trained) & (clock + truth.times < trained.stop)
        for name, span in spans.items():
            inside = _within(truth.times, span)
            part = replace(truth, times=truth.times[inside], vertices=truth.vertices[inside])
            scores[name].add(predicted[inside], part, on_frames[inside], between[inside])
    result = scores["whole"].result()
    result |= {name: scored.result() for name, scored in scores.items() if name != "whole"}
    result["per_object"] = {}
    # of frames of sequences: errors within what nine in ten are expected to keep to
    within = np.concatenate(covered)
    result["coverage_90"] = None if np.isnan(within).any() else float(within.mean())
    data = ("rest.", "training.", "val.")
    result["parameters"] = sum(int(a.size) for k, a in predictor.checkpoint.arrays.items() if not k.startswith(data))
    return result
