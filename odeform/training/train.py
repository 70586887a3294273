"""From a data set to a scored checkpoint, for every model that can be trained."""

import platform
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.evaluation.residuals import validation_residuals
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.simulation.scenes.registry import find_scene
from odeform.training.methods import Run, is_resumable, train_model
from odeform.training.request import TrainRequest
from odeform.types import Arrays, Mesh

__all__ = ["print_line", "rest_of", "train"]


def rest_of(dataset: Dataset) -> Mesh:
    """The body that viewers show: the scene's fine mesh, or for imported data that of the first training sequence."""
    scene = find_scene(dataset.schema.scene)
    if scene is not None:
        return scene.rest_mesh()
    first = next(dataset.sequences("train"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence in split train")
    return first.rest


def print_line(line: str) -> None:
    """Report progress on standard error."""
    print(line, file=sys.stderr, flush=True)


def train(
    dataset: Dataset,
    out: str | Path,
    model: str = "odeform",
    *,
    minutes: float = 30.0,
    steps: int | None = None,
    seed: int = 0,
    window: tuple[int, int] | None = None,
    every: int = 1,
    stagger: bool = False,
    resume: bool = False,
    parts: Iterable[tuple[int, int]] = (),
    report: Callable[[str], None] = print_line,
) -> Predictor:
    """Train a model on a data set, score it on the test split, and write a checkpoint.

    Args:
        dataset: What `open_dataset` or `simulate` returned.
        out: The checkpoint to write. While `odeform` trains, its state is kept in `OUT.part`.
        model: One of `odeform.models.registry.TRAINABLE`: `odeform`, or a baseline by its name.
        minutes: Budget of processor time, trials included, unless `steps` is given.
        steps: Number of training steps, in place of `minutes`: repeatable on any machine.
        seed: Seeds initial weights and batches.
        window: Half-open range of frames to train on; default: all.
        every: Train on every n-th frame.
        stagger: Start every n-th frame at a different frame in each sequence, so that the sequences interleave.
        resume: Continue the interrupted training of which `OUT.part` is the state.
        parts: Half-open ranges of frames to score separately as well.
        report: Called with each line of progress; default: prints it to standard error.

    Returns:
        The trained predictor, as `load(out)` returns it, with its scores in `predictor.checkpoint.scores`.

    Raises:
        InputError: An unknown model, a number out of range, frames that the data do not have, or nothing to resume.

    Examples:
        >>> import dataclasses, odeform
        >>> dataset = odeform.open_dataset("mass-elastic")
        >>> few = dataclasses.replace(dataset, entries=dataset.entries[::20])
        >>> predictor = odeform.train(few, "drop.safetensors", "nearest", every=10, report=lambda line: None)
        >>> predictor.model, predictor.checkpoint.scores["sequences"]
        ('nearest', 4)
    """
    request = TrainRequest(model, seed, minutes, steps, window, every, stagger, resume)
    part = Path(f"{out}.part")
    if resume and not (is_resumable(model) and part.exists()):
        raise InputError(f"resume: expected {part}, which an interrupted training of odeform leaves")
    begin = time.process_time()
    trained = train_model(Run(dataset, request, _body(dataset), part, report))
    # the processor time of all sittings of a resumed training
    seconds = trained.config.get("val", {}).get("seconds", time.process_time() - begin)
    provenance = {**_provenance(dataset, request, seconds), **trained.provenance}
    scores = _write_scored(replace(trained, provenance=provenance), out, dataset, parts)
    part.unlink(missing_ok=True)
    report(f"test: pooled RMSE {scores['rmse_pooled_mm']:.3f} mm; written to {out}")
    return load(out)


def _write_scored(
    checkpoint: Checkpoint, out: str | Path, dataset: Dataset, parts: Iterable[tuple[int, int]]
) -> dict[str, Any]:
    """Write the checkpoint with its residuals on validation and its scores on the test split; return the scores."""
    write_checkpoint(out, checkpoint)
    checkpoint = replace(checkpoint, arrays={**checkpoint.arrays, **validation_residuals(load(out), dataset)})
    write_checkpoint(out, checkpoint)
    scores = evaluate(load(out), dataset, "test", parts=parts)
    write_checkpoint(out, replace(checkpoint, scores=scores))
    return scores


def _body(dataset: Dataset) -> Arrays:
    rest = rest_of(dataset)
    return {
        "rest.points": np.asarray(rest.points, dtype=np.float32),
        "rest.faces": np.asarray(rest.faces, dtype=np.int32),
    }


def _provenance(dataset: Dataset, request: TrainRequest, seconds: float) -> dict[str, Any]:
    return {
        "command": [_data_command(dataset.provenance), request.command],
        "dataset": dataset.provenance,
        "fixed": dataset.fixed,
        "seed": request.seed,
        "training_seconds": round(seconds, 1),
        "machine": platform.processor() or platform.machine(),
        "versions": {name: version(name) for name in ("odeform", "numpy", "torch")},
    }


def _data_command(made: dict[str, Any]) -> str:
    if "imported" in made:
        return f"odeform import {made['imported']} --out DIR"
    command = f"odeform simulate {made.get('scene')} --out DIR --count {made.get('count')} --seed {made.get('seed')}"
    command += f" --rate {made['rate_hz']:g}" if "rate_hz" in made else ""
    return command + (" --corners" if made.get("corners") else "")
