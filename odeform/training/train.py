"""Trains every model that can be: from a data set to a scored checkpoint."""

import platform
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.evaluation.residuals import trained_depth, validation_residuals
from odeform.identification.discrepancy import LEAST, calibrate
from odeform.io import require_writable
from odeform.models.base import Predictor
from odeform.models.model import Model
from odeform.models.names import ALIASES
from odeform.models.registry import load, load_model, model_class
from odeform.models.training.body import body_arrays
from odeform.models.training.loss import Loss
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run, train_model
from odeform.schema import OBJECT
from odeform.simulation.scenes.registry import surroundings_of
from odeform.types import Arrays

__all__ = ["fit", "print_line", "provenance_of", "scored", "train"]


def print_line(line: str) -> None:
    """Report progress on standard error."""
    print(line, file=sys.stderr, flush=True)


def fit(
    dataset: Dataset,
    model: str = "odeform",
    *,
    minutes: float = 30.0,
    steps: int | None = None,
    seed: int = 0,
    window: tuple[int, int] | None = None,
    every: int = 1,
    stagger: bool = False,
    resume: str | Path | None = None,
    sequences: int | None = None,
    without: Iterable[str] = (),
    objects: Iterable[str] = (),
    parts: Iterable[tuple[int, int]] = (),
    loss: Loss | None = None,
    device: str | None = None,
    report: Callable[[str], None] = print_line,
) -> Predictor:
    """Train a model on a data set, and score it on the test split. Nothing is written but the file `resume`.

    `predictor.save(path)` keeps the result. `train` does the same, and writes a checkpoint.

    Args:
        dataset: What `open_dataset`, `simulate` or `dataset_from_arrays` returned.
        model: One of `odeform.models.registry.TRAINABLE`, or a name that was given to `register_model`.
        minutes: Budget of processor time, trials included, unless `steps` is given.
        steps: Number of training steps, in place of `minutes`: repeatable on any machine.
        seed: Seeds initial weights and batches.
        window: Half-open range of frames to train on; default: all.
        every: Train on every n-th frame.
        stagger: Start every n-th frame at a different frame in each sequence, so that the sequences interleave.
        resume: A file that keeps the state of the training, which continues from there if the file exists. Models that
            are solved for in closed form need none, and `pe-gnn` has none.
        sequences: Train on the first n training sequences, of each object if there are several; default: all.
        without: Parts of the model to leave out: names of its class's `ablations`.
        objects: The objects to train on and to score, of a scene with several; default: all.
        parts: Half-open ranges of frames to score separately as well.
        loss: `loss(predicted, truth, weights)` -> a scalar tensor, in place of the model's own, for models that are
            trained by descent: predicted and true coordinates (..., n) in metres, and the weights (...) of each. Of
            reduced models n is 6 + K: shift, rotation times the radius of gyration, coefficients of the modes; of
            models that move each point by itself, 3. `rolling` and `modal` are fitted by least squares and take none.
            The readout of `latent` is solved for by least squares in each step; a loss shapes all that comes before.
        device: Where a descent runs, as PyTorch names it ("cpu", "cuda"); default: a GPU if there is one.
        report: Called with each line of progress; default: prints it to standard error.

    Returns:
        The trained predictor, with its scores in `predictor.checkpoint.scores`.

    Raises:
        InputError: An unknown model, a number out of range, frames that the data do not have, a state of another
            training, or a loss, device or file for a model that has no use for it.

    Examples:
        >>> import dataclasses, odeform
        >>> dataset = odeform.open_dataset("mass-elastic")
        >>> few = dataclasses.replace(dataset, entries=dataset.entries[::20])
        >>> predictor = odeform.fit(few, "nearest", every=10, report=lambda line: None)
        >>> predictor.save("drop.safetensors")
    """
    model = _family(model, dataset)
    part = None if resume is None else Path(resume)
    if part is not None and not model_class(model).resumable:
        raise InputError(f"resume: a training of {model} keeps no state that could be continued; expected None")
    resumed = part is not None and part.exists()
    request = TrainRequest(
        model, seed, minutes, steps, window, every, stagger, resumed, sequences, tuple(without), tuple(objects)
    )
    begin = time.process_time()
    if names := request.objects or dataset.objects:
        dataset = dataset.of(*names)
    around = surroundings_of(dataset.schema)  # older data sets do not say
    dataset = replace(dataset, schema=replace(dataset.schema, surroundings=around))
    dataset = dataset if sequences is None else _first(dataset, sequences)
    trained = train_model(Run(dataset, request, body_arrays(dataset), part, report, loss, device))
    # the processor time of all sittings of a resumed training
    seconds = trained.config.get("val", {}).get("seconds", time.process_time() - begin)
    provenance = {**provenance_of(dataset, request, seconds), **trained.provenance}
    checkpoint = scored(replace(trained, provenance=provenance), dataset, parts)
    beyond = "" if window is None else f", with frames outside of {window[0]}:{window[1]}"
    report(f"test: pooled RMSE {checkpoint.scores['rmse_pooled_mm']:.3f} mm{beyond}")
    return load_model(checkpoint)


def train(
    dataset: Dataset,
    out: str | Path,
    model: str = "odeform",
    *,
    resume: bool = False,
    report: Callable[[str], None] = print_line,
    **settings: Any,
) -> Predictor:
    """Train a model on a data set, score it on the test split, and write a checkpoint.

    Args:
        dataset: What `open_dataset`, `simulate` or `dataset_from_arrays` returned.
        out: The checkpoint to write. The state of a training that can be resumed is kept in `OUT.part`.
        model: One of `odeform.models.registry.TRAINABLE`: a family of ODeform, or a baseline, by its name; or a name
            that was given to `register_model`.
        resume: Continue the interrupted training of which `OUT.part` is the state.
        report: Called with each line of progress; default: prints it to standard error.
        settings: All others of `fit`: `minutes`, `steps`, `seed`, `loss`, `device` ...

    Returns:
        The trained predictor, as `load(out)` returns it, with its scores in `predictor.checkpoint.scores`.

    Raises:
        InputError: As `fit`; nothing to resume; or a file that cannot be written.

    Examples:
        >>> import dataclasses, odeform
        >>> dataset = odeform.open_dataset("mass-elastic")
        >>> few = dataclasses.replace(dataset, entries=dataset.entries[::20])
        >>> predictor = odeform.train(few, "drop.safetensors", "nearest", every=10, report=lambda line: None)
        >>> predictor.model, predictor.checkpoint.scores["sequences"]
        ('nearest', 4)
    """
    part, model = Path(f"{out}.part"), _family(model, dataset)
    require_writable(Path(out))
    resumable = model_class(model).resumable
    if resume and not resumable:
        raise InputError(f"resume: a training of {model} keeps no state that could be continued; train it again")
    if resume and not part.exists():
        raise InputError(f"resume: expected {part}, which an interrupted training leaves")
    if part.exists() and not resume:
        report(f"starts over and overwrites {part} of an interrupted training (--resume would continue it)")
        part.unlink()
    predictor = fit(dataset, model, resume=part if resumable else None, report=report, **settings)
    predictor.save(out)
    part.unlink(missing_ok=True)
    report(f"written to {out}")
    return load(out)


def _family(model: str, dataset: Dataset) -> str:
    """The model that a name stands for: `odeform` is the family that suits the data."""
    return "modal" if model == "odeform" and dataset.schema.objects else ALIASES.get(model, model)


def scored(checkpoint: Checkpoint, dataset: Dataset, parts: Iterable[tuple[int, int]] = ()) -> Checkpoint:
    """Returns the checkpoint with its residuals on validation and its scores on the test split."""
    # errors are those of motions that are watched over
    for measure in (trained_depth, validation_residuals, _calibration):
        checkpoint = replace(checkpoint, arrays={**checkpoint.arrays, **measure(load_model(checkpoint), dataset)})
    return replace(checkpoint, scores=evaluate(load_model(checkpoint), dataset, "test", parts=parts))


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


def _calibration(predictor: Predictor, dataset: Dataset) -> Arrays:
    """Measures what `identify` needs to know of the error of an ODE; that of baselines is measured when needed."""
    if not isinstance(predictor, Model) or len(dataset.select("val")) < LEAST:
        return {}
    return calibrate(predictor, dataset).arrays()


def provenance_of(dataset: Dataset, request: TrainRequest, seconds: float) -> dict[str, Any]:
    """What a checkpoint tells of its training, which took `seconds` of processor time: commands, data, versions."""
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
