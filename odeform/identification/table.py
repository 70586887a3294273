"""Identification over a split with known parameters, scored as in the paper's Table V (one at a time there)."""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.identification.discrepancy import NOMINAL, Discrepancy, calibrate, stored_discrepancy
from odeform.identification.identify import Identification, Identified, identify
from odeform.identification.observation import Observation, View, observe
from odeform.models.base import Predictor
from odeform.parallel import parallel_map
from odeform.progress import Progress
from odeform.schema import Parameter, Parameters

__all__ = ["identify_split", "report"]

CALIBRATION = "val"


def identify_split(
    predictor: Predictor, dataset: Dataset, split: str = "test", limit: int | None = None, view: View | None = None
) -> dict[str, Any]:
    """Scores, and a row for each of the first `limit` sequences, observed by `view` (default: everything).

    Runs on all cores: `seconds` is wall time per sequence over all of them, and in a row the time of that sequence.
    Raises `InputError` for another scene, an empty split, or too few sequences to calibrate on.
    """
    if predictor.schema.scene != dataset.schema.scene:
        raise InputError(f"{predictor.model} was trained on scene {predictor.schema.scene}, not {dataset.schema.scene}")
    view_used = view or View()
    entries = dataset.select(split)[:limit]
    if not entries:
        raise InputError(f"{dataset.root}: no sequence in split {split}")
    if split in (CALIBRATION, "all"):
        print(f"note: the intervals are calibrated on split {CALIBRATION}, which is also scored", file=sys.stderr)
    discrepancy = _calibrated(predictor, dataset)
    observed = [(entry, observe(dataset.read(entry), predictor.schema, view_used)) for entry in entries]
    work = partial(_identified, type(predictor), predictor.checkpoint, discrepancy)
    begin = time.perf_counter()
    rows = parallel_map(f"identify {dataset.schema.scene}", work, observed)
    seconds = (time.perf_counter() - begin) / len(rows)
    return {
        "model": predictor.model,
        "scene": dataset.schema.scene,
        "split": split,
        "view": asdict(view_used),
        "sequences": len(rows),
        "seconds": seconds,
        "parameters": {p.name: _scores(p, rows) for p in predictor.schema.learned},
        "rows": rows,
    }


def _identified(
    model: Callable[[Checkpoint], Predictor],
    checkpoint: Checkpoint,
    discrepancy: Discrepancy,
    observed: tuple[Entry, Observation],
) -> dict[str, Any]:
    entry, observation = observed
    return _row(entry.name, entry.parameters, identify(model(checkpoint), observation, discrepancy))


def _calibrated(predictor: Predictor, dataset: Dataset) -> Discrepancy:
    """Reads the discrepancy of the checkpoint, else measures it on the data set."""
    if (stored := stored_discrepancy(predictor)) is not None:
        return stored
    progress = Progress("calibrate", 100)
    done = 0

    def report_fraction(fraction: float) -> None:
        nonlocal done
        ahead = int(100 * fraction) - done
        progress.advance(ahead)
        done += ahead

    discrepancy = calibrate(predictor, dataset, CALIBRATION, report_fraction)
    progress.close()
    return discrepancy


def _row(name: str, truth: Parameters, found: Identification) -> dict[str, Any]:
    values = {key: {"true": truth[key], **_found_json(one)} for key, one in found.parameters.items()}
    return {"name": name, "parameters": values, "misfit": found.misfit, "seconds": found.seconds}


def _found_json(one: Identified) -> dict[str, Any]:
    return {"found": one.value, "low": one.low, "high": one.high, "identifiable": one.identifiable}


def _scores(parameter: Parameter, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Errors over all rows, in the parameter's unit and in halves of the trained range, and coverage of the intervals.

    Coverage is over rows where the parameter is identifiable; `identifiable` is their fraction.
    """
    found = [row["parameters"][parameter.name] for row in rows]
    difference = [parameter.normalise(one["found"]) - parameter.normalise(one["true"]) for one in found]
    covered = [one["low"] <= one["true"] <= one["high"] for one in found if one["identifiable"]]
    return {
        "mae": float(np.mean([abs(one["found"] - one["true"]) for one in found])),
        "unit": parameter.unit,
        "mae_normalised": float(np.abs(difference).mean()),
        "largest_normalised": float(np.abs(difference).max()),
        "coverage_90": float(np.mean(covered)) if covered else None,
        "identifiable": len(covered) / len(found),
    }


def report(result: dict[str, Any]) -> str:
    """Returns the result as a text table."""
    view = result["view"]
    points = f"{view['points']} points" if view["points"] else "all points"
    frames = f"{view['frames']} frames" if view["frames"] else "all frames"
    lines = [
        f"{result['scene']}, {result['model']}: {result['sequences']} sequences of {result['split']}, "
        f"{points}, {frames}, {view['noise_mm']:g} mm of noise; {result['seconds']:.2f} s each",
        f"{'':<12}{'MAE':>16}{'of half range':>16}{'largest':>10}{f'in {NOMINAL:.0%}':>10}{'identifiable':>14}",
    ]
    for name, one in result["parameters"].items():
        mae = f"{one['mae']:.4g} {one['unit']}"
        covered = "-" if one["coverage_90"] is None else f"{one['coverage_90']:.0%}"
        lines.append(
            f"{name:<12}{mae:>16}{one['mae_normalised']:>16.4f}{one['largest_normalised']:>10.3f}"
            f"{covered:>10}{one['identifiable']:>14.0%}"
        )
    return "\n".join(lines)
