"""Speed and accuracy of a model of several pushed objects: `odeform bench contact-force`."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from odeform.benchmark.timing import milliseconds, quantiles
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.scores import Scores
from odeform.models.modal.model import EXACT
from odeform.models.per_object import PerObject
from odeform.motion.base import Motion
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence

__all__ = ["bench_objects"]

SEQUENCES = 12  # of the test split of each object
FIRST = 0.03  # s: a frame in the middle of the push


def bench_objects(predictor: PerObject, dataset: Dataset | None) -> dict[str, Any]:
    """Measures the rows of each object: time and error of each quality, time of a frame, and of the simulator.

    A new motion is the trajectory after a change of the push, with its deformations around the contact, and all frames
    of the window at all vertices; `first_ms` is with a single frame. Solver errors compare it with an integration in
    much smaller steps, model errors with the truth. `InputError` without a data set.
    """
    if dataset is None:
        raise InputError("bench: expected a data set of pushed objects: --data DIR")
    rows, simulated = [], []
    for name in predictor.schema.objects:
        truths = list(dataset.sequences("test", name))[:SEQUENCES]
        simulated.append(_simulator(predictor, truths[0], name))
        exact = [predictor.solve(None, truth.parameters, EXACT).vertices(truth.times) for truth in truths]
        for quality in predictor.qualities:
            rows.append(_row(predictor, name, quality, truths, exact))
    return {"sequences": SEQUENCES, "qualities": rows, "simulator": simulated}


def _row(
    predictor: PerObject, name: str, quality: str, truths: Sequence[MotionSequence], exact: Sequence[np.ndarray]
) -> dict[str, Any]:
    motions: list[Motion] = []

    def push(index: int) -> None:
        truth = truths[index % len(truths)]
        motion = predictor.solve(None, truth.parameters, quality)
        motion.vertices(truth.times)
        motions.append(motion)

    def begin(index: int) -> None:
        predictor.solve(None, truths[index].parameters, quality).vertices(FIRST)

    whole = quantiles(milliseconds(push, len(truths), warm=1))
    first = quantiles(milliseconds(begin, len(truths), warm=1))
    scrub = quantiles(milliseconds(lambda i: motions[0].vertices(0.19 * np.modf(0.618 * i)[0]), 50))
    errors, scores = [], Scores()
    for motion, truth, fine in zip(motions[1:], truths, exact, strict=True):
        found = motion.vertices(truth.times)
        errors.append(np.square(found.astype(float) - fine)[1:].mean())
        counted = np.ones(len(truth.times), dtype=bool)
        scores.add(found, truth, counted, ~counted)
    return {
        "object": name,
        "quality": quality,
        "points": len(predictor.rest_of({"object": name}).points),
        "steps": float(np.median([motion.stats.steps for motion in motions])),
        "ms_p50": whole["p50"],
        "ms_p95": whole["p95"],
        "first_ms": first["p50"],
        "frame_ms": scrub["p50"],
        "solver_error_mm": 1e3 * float(np.sqrt(np.mean(errors))),
        "model_error_mm": scores.result()["rmse_pooled_mm"],
    }


def _simulator(predictor: PerObject, truth: MotionSequence, name: str) -> dict[str, Any]:
    """Seconds of one simulation, and how many times faster the model is."""
    simulate = get_scene(predictor.schema.scene).simulate
    begin = time.perf_counter()
    try:
        simulate(truth.parameters)
    except ModuleNotFoundError as error:
        return {"object": name, "skipped": f"no {error.name}"}
    seconds = time.perf_counter() - begin
    ours = milliseconds(lambda _: predictor.solve(None, truth.parameters).vertices(truth.times), 5)
    return {"object": name, "simulator_s": seconds, "speedup": 1e3 * seconds / float(np.median(ours))}
