"""Speed and accuracy of a model on this machine: `odeform bench`."""

import os
import platform
from typing import Any

import numpy as np

from odeform.benchmark.batch import batch_speed
from odeform.benchmark.comparisons import comparisons
from odeform.benchmark.objects import bench_objects
from odeform.benchmark.precision import OperatingPoint, measure, operating_points, work_precision
from odeform.benchmark.probes import random_parameters, round_mesh, round_splats
from odeform.benchmark.roofline import roofline, scaling
from odeform.benchmark.timing import as_viewed, milliseconds, quantiles
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.models.model import Model
from odeform.models.per_object import PerObject
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load
from odeform.motion.evaluated_basis import evaluate_basis
from odeform.motion.reduced_motion import as_reduced

__all__ = ["bench"]

POINTS = 5_000
SPLATS = 100_000
SIZES = (500, 1_000, 10_000, 100_000, 1_000_000)


def _latency(predictor: ReducedModel) -> dict[str, Any]:
    """Milliseconds of each stage: cold after a change of parameters or azimuth, warm for a time of a solved motion."""
    shape, window = round_mesh(POINTS, predictor), predictor.schema.window
    parameters = random_parameters(predictor, 60)
    motions = [as_reduced(predictor.solve(shape, p)) for p in parameters]
    moments = np.random.default_rng(1).uniform(window.start, window.stop, 300).tolist()
    azimuths = np.random.default_rng(2).uniform(-np.pi, np.pi, 20)
    splats = predictor.solve(round_splats(SPLATS, predictor))

    def show_splats(index: int) -> None:
        splats.vertices(moments[index])
        splats.covariances(moments[index])

    timed = {
        "parameter_change_ms": milliseconds(lambda i: predictor.solve(shape, parameters[i % 60]), 120),
        "scrub_ms": milliseconds(lambda i: motions[0].vertices(moments[i]), 300 - 3),
        f"splats_{SPLATS // 1000}k_ms": milliseconds(show_splats, 40),
        "basis_ms": milliseconds(lambda i: evaluate_basis(shape, motions[0].space, float(azimuths[i % 20])), 20),
        "solve_ms": np.array([motion.stats.wall_ms for motion in motions[3:]]),
        "coordinates_ms": milliseconds(lambda i: motions[1].trajectory.reduced(np.array([moments[i]])), 300 - 3),
    }
    if isinstance(predictor, Model):
        evaluated = predictor.evaluate_basis(shape, predictor.schema.azimuth(parameters[0]))
        thetas = [predictor.schema.vector(predictor.schema.complete(p)) for p in parameters]
        timed["encode_ms"] = milliseconds(lambda i: predictor.problem(thetas[i % 60], evaluated, np.float32), 60)
    return {"points": POINTS, **{name: quantiles(samples) for name, samples in timed.items()}}


def _solver(model: Model, points: list[OperatingPoint]) -> dict[str, Any]:
    default = points[0]
    qualities = {name: measure(model, default, quality) for name, quality in model.qualities.items()}
    ms_per_evaluation = float(np.median([row["ms_p50"] / row["evaluations"] for row in qualities.values()]))
    return {
        "places": {
            p.name: {
                "parameters": p.parameters,
                "reference_unsure_mm": p.unsure_mm,
                "model_error_mm": p.model_error_mm,
                "model_error_on": p.sequences,
            }
            for p in points
        },
        "work_precision": work_precision(model, points),
        "qualities": qualities,
        "ms_per_evaluation": ms_per_evaluation,
        "frontier": [{**point.to_json(), "ms": point.evaluations * ms_per_evaluation} for point in model.frontier],
    }


def bench(checkpoint: str, data: str | None = None) -> dict[str, Any]:
    """All measurements of one model, as JSON; `data` is the data set of the truth (default: the bundled one)."""
    predictor = load(checkpoint)
    scene = predictor.schema.scene
    data = data or (scene if scene in bundled_datasets() else None)
    dataset = None if data is None else open_dataset(data)
    machine = {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }
    result = {"machine": machine, "model": predictor.model, "scene": scene, "sha256": predictor.checkpoint.sha256}
    points: list[OperatingPoint] = []
    with as_viewed():
        if isinstance(predictor, PerObject):
            return {
                **result,
                "data": data,
                "objects": bench_objects(predictor, dataset),
                "batch": batch_speed(predictor),
            }
        if not isinstance(predictor, ReducedModel):
            raise InputError(f"bench: expected a model of reduced coordinates, got {predictor.model}")
        result |= {"data": data, "latency": _latency(predictor)}
        if isinstance(predictor, Model):
            points = operating_points(predictor, dataset)
            result |= _solver(predictor, points)
        return {
            **result,
            "batch": batch_speed(predictor),
            "limits": roofline(predictor),
            "scaling": scaling(predictor, SIZES),
            "peers": comparisons(predictor, dataset, points),
        }
