"""From a data set to a scored checkpoint, for every model that can be trained."""

import platform
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.evaluation.residuals import trained_depth, validation_residuals
from odeform.identification.discrepancy import LEAST, calibrate
from odeform.io import require_writable
from odeform.models.base import Predictor
from odeform.models.model import Model
from odeform.models.names import ALIASES
from odeform.models.registry import load, model_class
from odeform.models.training.body import body_arrays
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run, train_model
from odeform.schema import OBJECT
from odeform.types import Arrays

__all__ = ["print_line", "train", "write_scored"]


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
    sequences: int | None = None,
    without: Iterable[str] = (),
    objects: Iterable[str] = (),
    parts: Iterable[tuple[int, int]] = (),
    report: Callable[[str], None] = print_line,
) -> Predictor:
    """Train a model on a data set, score it on the test split, and write a checkpoint.

    Args:
        dataset: What `open_dataset` or `simulate` returned.
        out: The checkpoint to write. The state of a training that can be resumed is kept in `OUT.part`.
        model: One of `odeform.models.registry.TRAINABLE`: a family of ODeform, or a baseline, by its name.
        minutes: Budget of processor time, trials included, unless `steps` is given.
        steps: Number of training steps, in place of `minutes`: repeatable on any machine.
        seed: Seeds initial weights and batches.
        window: Half-open range of frames to train on; default: all.
        every: Train on every n-th frame.
        stagger: Start every n-th frame at a different frame in each sequence, so that the sequences interleave.
        resume: Continue the interrupted training of which `OUT.part` is the state.
        sequences: Train on the first n training sequences, of each object if there are several; default: all.
        without: Parts of the model to leave out: names of its class's `ablations`.
        objects: The objects to train on and to score, of a scene with several; default: all.
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
    model = "modal" if model == "odeform" and dataset.schema.objects else ALIASES.get(model, model)
    request = TrainRequest(
        model, seed, minutes, steps, window, every, stagger, resume, sequences, tuple(without), tuple(objects)
    )
    part = Path(f"{out}.part")
    require_writable(Path(out))
    if resume and not (model_class(model).resumable and part.exists()):
        raise InputError(f"resume: expected {part}, which an interrupted training leaves")
    begin = time.process_time()
    if names := request.objects or dataset.objects:
        dataset = dataset.of(*names)
    dataset = dataset if sequences is None else _first(dataset, sequences)
    trained = train_model(Run(dataset, request, body_arrays(dataset), part, report))
    # the processor time of all sittings of a resumed training
    seconds = trained.config.get("val", {}).get("seconds", time.process_time() - begin)
    provenance = {**_provenance(dataset, request, seconds), **trained.provenance}
    scores = write_scored(replace(trained, provenance=provenance), out, dataset, parts)
    part.unlink(missing_ok=True)
    report(f"test: pooled RMSE {scores['rmse_pooled_mm']:.3f} mm; written to {out}")
    return load(out)


def _first(dataset: Dataset, count: int) -> Dataset:
    """The data set with the first `count` training sequences of each object, and all sequences of other splits.
    `InputError` where there are fewer."""
    known: dict[Any, list[Entry]] = {}
    for entry in dataset.select("train"):
        known.setdefault(entry.parameters.get(OBJECT), []).append(entry)
    most = min(map(len, known.values()), default=0)
    if count > most:
        raise InputError(f"sequences: expected at most {most}, got {count}")
    left_out = {entry.name for entries in known.values() for entry in entries[count:]}
    return replace(dataset, entries=tuple(entry for entry in dataset.entries if entry.name not in left_out))


def write_scored(
    checkpoint: Checkpoint, out: str | Path, dataset: Dataset, parts: Iterable[tuple[int, int]] = ()
) -> dict[str, Any]:
    """Write the checkpoint with its residuals on validation and its scores on the test split; return the scores."""
    # errors are those of motions that are watched over
    for measure in (trained_depth, validation_residuals, _calibration):
        write_checkpoint(out, checkpoint)
        checkpoint = replace(checkpoint, arrays={**checkpoint.arrays, **measure(load(out), dataset)})
    write_checkpoint(out, checkpoint)
    scores = evaluate(load(out), dataset, "test", parts=parts)
    write_checkpoint(out, replace(checkpoint, scores=scores))
    return scores


def _calibration(predictor: Predictor, dataset: Dataset) -> Arrays:
    """What `identify` needs to know of the error of an ODE; of baselines it is measured when it is asked for."""
    if not isinstance(predictor, Model) or len(dataset.select("val")) < LEAST:
        return {}
    return calibrate(predictor, dataset).arrays()


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
    count = made.get("count")
    each = set(count.values()) if isinstance(count, dict) else {count}
    command = f"odeform simulate {made.get('scene')} --out DIR --count {each.pop() if len(each) == 1 else count}"
    command += f" --seed {made.get('seed')}"
    command += f" --rate {made['rate_hz']:g}" if "rate_hz" in made else ""
    command += " --corners" if made.get("corners") else ""
    ranges = " ".join(f"{name}={low}:{high}" for name, (low, high) in made.get("ranges", {}).items())
    return command + (f" --range {ranges}" if ranges else "")
