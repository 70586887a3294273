"""Scores of a model on a data set."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.bootstrap import mean_interval
from odeform.evaluation.scores import Comparison, Mask, Scores, mean_of
from odeform.models.base import Predictor
from odeform.models.registry import observations
from odeform.motion.base import Motion
from odeform.schema import OBJECT, Schema, Window
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Frames, MotionSequence

__all__ = ["check_scene", "evaluate"]


def check_scene(predictor: Predictor, dataset: Dataset) -> None:
    """`InputError` for a model that was trained on another scene than that of the data."""
    trained, scene = predictor.schema.scene, dataset.schema.scene
    if trained != scene:
        raise InputError(f"{predictor.model} was trained on scene {trained}, not {scene}")


def evaluate(
    predictor: Predictor,
    dataset: Dataset,
    split: str = "test",
    window: tuple[int, int] | None = None,
    quality: str | SolverSettings = "balanced",
    parts: Iterable[tuple[int, int]] = (),
) -> dict[str, Any]:
    """Score a model on a split of a data set; `odeform.evaluation.scores` defines the scores.

    Args:
        predictor: A model of the data's scene. One that cannot extrapolate is scored on its trained window only; data
            that end before that window begins are taken to be cut out of longer motions, and to start where it does.
        dataset: Motions with known parameters. Of several objects, those that the model knows are scored.
        split: "train", "val", "test" or "all".
        window: Half-open range of frames to score, counted at the scene's rate; default: all.
        quality: Name of one of the predictor's solver settings, or solver settings.
        parts: Further half-open ranges of frames, scored as `FIRST:LAST`.

    Returns:
        Scores by name: errors in mm (`rmse_mm`, `mae_mm`, `rmse_pooled_mm`, `vertex_mm`, ...) and ratios (`relative`,
        `deformation_relative`, `coverage_90`). Without a window, the impact of a scene is also scored as `impact`. In a
        scene with objects, `per_object` has the scores of each by name, and `mean_of_objects` their means.
        `motions_covered_90` is the fraction of motions within the error band at all frames, and `motions_tenths` the
        same in each tenth of the motions, sorted by each parameter; `coverage_tenths` has the fraction of frames there.

    Raises:
        InputError: Another scene, an empty split, or a window without frames to score.

    Examples:
        >>> import odeform
        >>> dataset = odeform.open_dataset("mass-elastic")
        >>> scores = odeform.evaluate(odeform.load("mass-elastic/pod-rbf"), dataset, "val", window=(0, 10))
        >>> scores["sequences"], scores["rmse_pooled_mm"] < 1.0
        (50, True)
    """
    check_scene(predictor, dataset)
    if known := [name for name in dataset.objects if name in predictor.schema.objects]:
        dataset = dataset.of(*known)
    schema = dataset.schema
    behind = not predictor.extrapolates and predictor.schema.window.start > schema.window.stop
    clock = predictor.schema.window.start if behind else 0.0
    spans = _spans(predictor, schema, window, clock)
    spans |= {f"{part[0]}:{part[1]}": _spans(predictor, schema, part, clock)["whole"] for part in parts}
    scores = {name: Scores() for name in spans}
    objects: dict[str, Scores] = {}
    covered: list[tuple[dict[str, Any], float]] = []
    whole: list[float] = []
    for recorded in dataset.sequences(split):
        compared = _compared(predictor, dataset, recorded, quality, clock, spans)
        for name, comparison in compared.items():
            scores[name].add(*comparison)
        covered.append((recorded.parameters, _fraction_covered(*compared["whole"])))
        whole.append(float(covered[-1][1] >= 1.0) if np.isfinite(covered[-1][1]) else np.nan)
        if body := recorded.parameters.get(OBJECT):
            objects.setdefault(body, Scores()).add(*compared["whole"])
    result = scores["whole"].result()
    result |= {name: scored.result() for name, scored in scores.items() if name != "whole"}
    result["per_object"] = {name: scored.result() for name, scored in objects.items()}
    if objects:
        mean = mean_of(list(result["per_object"].values()))
        mean["rmse_pooled_95"] = mean_interval([scored.motions for scored in objects.values()])
        result["mean_of_objects"] = mean
    result["parameters"] = _learned_numbers(predictor)
    result["coverage_tenths"] = _tenths(covered)
    result["motions_covered_90"] = None if np.isnan(whole).any() else float(np.mean(whole))
    result["motions_tenths"] = _tenths([(row, inside) for (row, _), inside in zip(covered, whole, strict=True)])
    return result


def _fraction_covered(
    _predicted: Frames, _truth: MotionSequence, counted: Mask, _between: Mask, covered: Floats
) -> float:
    """The fraction of one motion's counted frames within the error band; frame 0 is given, and NaN means no band."""
    return float(covered[1:][counted[1:]].mean())


def _tenths(covered: Sequence[tuple[dict[str, Any], float]]) -> dict[str, list[float]]:
    """Averages the fraction in each tenth of the motions, sorted by each parameter that is a number; empty with fewer
    than ten motions, or without a band."""
    fractions = np.array([fraction for _, fraction in covered])
    if len(fractions) < 10 or np.isnan(fractions).any():
        return {}
    columns = {name: [row[name] for row, _ in covered] for name, value in covered[0][0].items() if np.isscalar(value)}
    numbers = {name: np.asarray(column) for name, column in columns.items() if not isinstance(column[0], str)}
    return {
        name: [float(part.mean()) for part in np.array_split(fractions[np.argsort(column, kind="stable")], 10)]
        for name, column in numbers.items()
    }


def _learned_numbers(predictor: Predictor) -> int:
    """The number of values in a checkpoint without the body, the training parameters and the validation errors."""
    data = ("rest.", "training.", "val.")
    arrays = predictor.checkpoint.arrays.items()
    return sum(int(array.size) for key, array in arrays if not key.rpartition("/")[2].startswith(data))


def _compared(
    predictor: Predictor,
    dataset: Dataset,
    recorded: MotionSequence,
    quality: str | SolverSettings,
    clock: float,
    spans: dict[str, tuple[float, float]],
) -> dict[str, Comparison]:
    """The prediction of one sequence beside it, in each span."""
    window, trained = dataset.schema.window, predictor.schema.window
    whole = recorded.until(window.stop)
    needed = _within(whole.times, *spans.values())
    truth = replace(whole, times=whole.times[needed], vertices=whole.vertices[needed])
    # quantities that are fixed in the data may be parameters of the model
    parameters = {**predictor.schema.known(dataset.fixed), **truth.parameters}
    motion = predictor.solve(
        predictor.to_body_frame(truth.rest, parameters),
        parameters,
        quality,
        until=float(clock + truth.times[-1]),
        observed=observations(predictor.schema, whole),
    )
    predicted = motion.vertices(clock + truth.times)
    on_frames = _on_frames(truth.times, window)
    between = ~_on_frames(clock + truth.times, trained) & (clock + truth.times < trained.stop)
    covered, out = _covered(predictor, motion, predicted, truth), {}
    for name, span in spans.items():
        inside = _within(truth.times, span)
        part = replace(truth, times=truth.times[inside], vertices=truth.vertices[inside])
        out[name] = (predicted[inside], part, on_frames[inside], between[inside], covered[inside])
    return out


def _on_frames(times: Floats, window: Window) -> Mask:
    """(T,) which times lie on frames of the window's rate."""
    phase = (times - window.start) * window.rate
    return np.abs(phase - np.round(phase)) < 1e-3


def _spans(
    predictor: Predictor, schema: Schema, window: tuple[int, int] | None, clock: float
) -> dict[str, tuple[float, float]]:
    """Half-open spans of the data's time in seconds that are scored: `whole`, and `impact` for scenes with one.

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
        if predictor.final_only:
            begin = max(begin, trained.stop - clock - 0.01 / rate)
        if end <= begin:
            raise InputError(f"window {window}: {predictor.model} covers only {trained.start:g} to {trained.stop:g} s")
    spans = {"whole": (begin, end)}
    if schema.impact and window is None and not predictor.final_only:
        spans["impact"] = schema.impact
    return spans


def _within(times: Floats, *spans: tuple[float, float]) -> Mask:
    """(T,) which times are scored: frame 0 and those in the half-open spans of seconds."""
    kept = np.any([(times > first - 1e-6) & (times < last - 1e-6) for first, last in spans], axis=0)
    kept[0] = True
    return kept


def _covered(predictor: Predictor, motion: Motion, predicted: Frames, truth: MotionSequence) -> Floats:
    """(T,) 1 where the RMSE is within the model's 90 % error band, otherwise 0; NaN for a model without a band."""
    band = predictor.error_band(truth.parameters, truth.times, lambda: motion.size_mm)
    if band is None:
        return np.full(len(predicted), np.nan)
    rmse = 1e3 * np.sqrt(((predicted.astype(float) - truth.vertices) ** 2).mean(axis=(1, 2)))
    return (rmse <= band[:, 1]).astype(float)
