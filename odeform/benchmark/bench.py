"""What a prediction costs on this machine and what it is worth: `odeform bench`."""

import os
import platform
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from odeform.benchmark.ablations import ablations
from odeform.benchmark.comparisons import comparisons
from odeform.benchmark.precision import Place, find_places, measure, work_precision
from odeform.benchmark.probes import ball, random_parameters, round_splats
from odeform.benchmark.roofline import limits, scaling
from odeform.benchmark.startup import startup
from odeform.benchmark.timing import as_viewed, milliseconds, quantiles
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.models.odeform.model import ODeform
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load_reduced
from odeform.motion.evaluated_basis import evaluate_basis
from odeform.motion.reduced_motion import as_reduced

__all__ = ["bench", "report"]

POINTS = 5_000
SPLATS = 100_000
SIZES = (500, 1_000, 10_000, 100_000, 1_000_000)


def _latency(predictor: ReducedModel) -> dict[str, Any]:
    """Cold: a change of parameters, of the heading, which needs the basis anew. Warm: a time of a known motion."""
    shape, window = ball(POINTS, predictor), predictor.schema.window
    parameters = random_parameters(predictor, 60)
    motions = [as_reduced(predictor.solve(shape, p)) for p in parameters]
    moments = np.random.default_rng(1).uniform(window.start, window.stop, 300).tolist()
    headings = np.random.default_rng(2).uniform(-np.pi, np.pi, 20)
    splats = predictor.solve(round_splats(SPLATS, predictor))

    def show_splats(index: int) -> None:
        splats.vertices(moments[index])
        splats.covariances(moments[index])

    timed = {
        "parameter_change_ms": milliseconds(lambda i: predictor.solve(shape, parameters[i % 60]), 120),
        "scrub_ms": milliseconds(lambda i: motions[0].vertices(moments[i]), 300 - 3),
        f"splats_{SPLATS // 1000}k_ms": milliseconds(show_splats, 40),
        "basis_ms": milliseconds(lambda i: evaluate_basis(shape, motions[0].space, float(headings[i % 20])), 20),
        "solve_ms": np.array([motion.stats.wall_ms for motion in motions[3:]]),
        "coordinates_ms": milliseconds(lambda i: motions[1].trajectory.reduced(np.array([moments[i]])), 300 - 3),
    }
    if isinstance(predictor, ODeform):
        evaluated = predictor.evaluate_basis(shape, predictor.schema.azimuth(parameters[0]))
        thetas = [predictor.schema.vector(predictor.schema.complete(p)) for p in parameters]
        timed["encode_ms"] = milliseconds(lambda i: predictor.problem(thetas[i % 60], evaluated, np.float32), 60)
    return {"points": POINTS, **{name: quantiles(samples) for name, samples in timed.items()}}


def _solver(model: ODeform, places: list[Place]) -> dict[str, Any]:
    default = places[0]
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
            for p in places
        },
        "work_precision": work_precision(model, places),
        "qualities": qualities,
        "ms_per_evaluation": ms_per_evaluation,
        "frontier": [{**point.to_json(), "ms": point.evaluations * ms_per_evaluation} for point in model.frontier],
    }


def bench(checkpoint: str, data: str | None = None) -> dict[str, Any]:
    """All measurements of one model; `data` is the truth, by default the bundled data set of its scene."""
    predictor = load_reduced(checkpoint)
    scene = predictor.schema.scene
    data = data or (scene if scene in bundled_datasets() else None)
    dataset = None if data is None else open_dataset(data)
    machine = {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }
    result = {"machine": machine, "model": predictor.model, "scene": scene, "sha256": predictor.checkpoint.sha256}
    places: list[Place] = []
    with as_viewed():
        result |= {"data": data, "latency": _latency(predictor)}
        if isinstance(predictor, ODeform):
            places = find_places(predictor, dataset)
            result |= _solver(predictor, places)
        return {
            **result,
            "knobs": ablations(predictor),
            "limits": limits(predictor),
            "startup": startup(checkpoint),
            "scaling": scaling(predictor, SIZES),
            "peers": comparisons(predictor, dataset, places),
        }


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _table(title: str, rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> list[str]:
    cells = [list(columns), *([_cell(row.get(column)) for column in columns] for row in rows)]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in cells]
    return ["", title, *lines]


def _setting(row: Mapping[str, Any]) -> str:
    return f"h = {1e3 * row['step']:.3g} ms" if "step" in row else f"tol {row['tolerance']:.0e}"


def report(result: Mapping[str, Any]) -> str:
    """The figures as tables."""
    machine, latency = result["machine"], result["latency"]
    lines = [
        f"{result['model']} of {result['scene']} on {machine['cores']} cores of {machine['processor']}; load at the "
        f"start {_cell(machine['load'])}; truth: {result['data'] or 'none at hand'}"
    ]
    stages = [{"stage": key, **value} for key, value in latency.items() if isinstance(value, Mapping)]
    lines += _table(f"latency at {latency['points']} points, ms", stages, ("stage", "p50", "p95"))
    columns = ("at", "solver", "setting", "dtype", "evaluations", "ms_p50", "ms_p95", "solver_error_mm")
    if "qualities" in result:
        rows = [{**row, "at": name, "setting": _setting(row)} for name, row in result["qualities"].items()]
        lines += _table("qualities, at the default parameters", rows, columns)
        for name, place in result["places"].items():
            rows = [{**row, "setting": _setting(row)} for row in result["work_precision"] if row["at"] == name]
            lines += _table(
                f"work and precision at the {name}: model error {_cell(place['model_error_mm'])} mm on "
                f"{len(place['model_error_on'])} test sequences nearby, reference sure to "
                f"{place['reference_unsure_mm']:.1g} mm",
                rows,
                columns[1:],
            )
    if result.get("frontier"):
        rows = [{**row, "setting": _setting(row)} for row in result["frontier"]]
        columns = ("method", "setting", "evaluations", "ms", "solver_error_mm")
        lines += _table("frontier (validation split)", rows, columns)
    lines += _table("other ablations, a frame", result["knobs"], ("knob", "points", "ms", "saves_ms", "error_mm"))
    rows = [{"limit": key, "measured": value} for key, value in result["limits"].items()]
    lines += _table("limits of the machine", rows, ("limit", "measured"))
    lines += _table("a new process, seconds", [result["startup"]], tuple(result["startup"]))
    lines += _table("scaling, a frame", result["scaling"], ("points", "solve_ms", "basis_ms", "decode_ms"))
    rows = [{"peer": name, **row} for name, row in result["peers"].items()]
    measured = [row for row in rows if "skipped" not in row]
    lines += _table("comparisons", measured, ("peer", "points", "frames", "ms", "ours_ms", "speedup", "error_mm"))
    lines += [f"{row['peer']}: skipped, {row['skipped']}" for row in rows if "skipped" in row]
    if "tried" in (simulator := result["peers"].get("mujoco, equal error", {})):
        lines += _table(
            f"simulations tried; ours is off by {simulator['ours_error_mm']:.3g} mm on the same "
            f"{len(simulator['sequences'])} sequences and pays off after {simulator['pays_off_after']} queries",
            simulator["tried"],
            ("step", "segments", "ms", "error_mm", "failed"),
        )
    return "\n".join(lines)
