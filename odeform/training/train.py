"""From a data set to a checkpoint, for every model that learns from parameters."""

import platform
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.evaluation.residuals import validation_residuals
from odeform.models.base import Predictor
from odeform.models.baselines.direct import Direct
from odeform.models.baselines.nearest import fit_nearest
from odeform.models.baselines.node import Node
from odeform.models.baselines.occupancy_flow import OccupancyFlow
from odeform.models.baselines.odeform_per_point import OdeformPerPoint
from odeform.models.baselines.pod_rbf import fit_pod_rbf
from odeform.models.baselines.rnn import Rnn
from odeform.models.odeform.model import PREFIX
from odeform.models.registry import load
from odeform.simulation.scenes.registry import find_scene
from odeform.training.continuation import with_continuation
from odeform.training.point_data import prepare_points
from odeform.training.pruning import without_modes
from odeform.training.qualities import with_qualities
from odeform.training.request import TrainRequest
from odeform.types import Arrays, Mesh

__all__ = ["MODELS", "POINTS", "print_line", "rest_of", "train"]

POINTS = {model.model: model for model in (OdeformPerPoint, Node, Rnn, Direct, OccupancyFlow)}
MODELS = ("odeform", *POINTS, "pod-rbf", "nearest")


def rest_of(dataset: Dataset) -> Mesh:
    """The body as viewers show it: the scene's fine mesh, or of imported data the first training sequence's own."""
    scene = find_scene(dataset.schema.scene)
    if scene is not None:
        return scene.rest_mesh()
    first = next(dataset.sequences("train"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence in split train")
    return first.rest


def _learn_reduced(
    dataset: Dataset, request: TrainRequest, report: Callable[[str], None], body: Arrays, part: Path
) -> Checkpoint:
    """Models of pose and deformation."""
    data = prepare(dataset, None, FrameSubsampling(request.window, request.every, request.stagger))
    modes = data.space.basis.modes
    report(
        f"{request.model} on {len(data.theta['train'])} sequences of {len(data.times)} frames; "
        f"{modes} modes leave {data.truncation_mm['val']:.3f} mm of the deformation (val)"
    )
    if request.model == "odeform":
        arrays, settings = _fit_odeform(data, request, report, part)
    else:
        arrays, settings = {"pod-rbf": fit_pod_rbf, "nearest": fit_nearest}[request.model](data)
    checkpoint = Checkpoint(
        model=request.model,
        schema=data.schema,
        config={"space": data.space.to_json(), **settings},
        arrays={**arrays, **data.space.arrays(), **body, "training.theta": data.theta["train"].astype(np.float32)},
        provenance={"truncation_mm": data.truncation_mm},
    )
    if request.model != "odeform":
        return checkpoint
    checkpoint, data = without_modes(checkpoint, data)
    report(f"{data.space.basis.modes} of {modes} modes are needed")
    return with_continuation(with_qualities(checkpoint, data), data)


def _fit_odeform(
    data: TrainingData, request: TrainRequest, report: Callable[[str], None], part: Path
) -> tuple[Arrays, dict[str, Any]]:
    from odeform.training.config import TrainConfig
    from odeform.training.loop import network_weights, train_network
    from odeform.training.start import build_network

    net = build_network(data, request.seed)
    config = TrainConfig(request.minutes, request.steps, seed=request.seed)
    val = train_network(net, data, config, report, part, request.resume)
    settings = {"network": asdict(net.config), "qualities": {}, "training": asdict(config), "val": val}
    return {PREFIX + name: value for name, value in network_weights(net).items()}, settings


def _learn_points(dataset: Dataset, request: TrainRequest, report: Callable[[str], None], body: Arrays) -> Checkpoint:
    """Models of where each point goes."""
    from odeform.training.points import Budget, fit_points

    between = POINTS[request.model].network.teaching == "between"
    if between and request.every < 2:
        raise InputError(f"{request.model}: moves between given frames, expected --every of at least 2")
    every, given = (1, request.every) if between else (request.every, 1)
    data = prepare_points(dataset, FrameSubsampling(request.window, every, request.stagger and not between), given)
    report(f"{request.model} on {len(data.theta['train'])} sequences of {data.moved['train'].shape[1]} frames")
    budget = Budget(60.0 * request.minutes, request.steps)
    checkpoint = fit_points(request.model, POINTS[request.model].network, data, budget, request.seed, report)
    arrays = {**checkpoint.arrays, **body, "training.theta": data.theta["train"].astype(np.float32)}
    return replace(checkpoint, arrays=arrays)


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
        model: One of `odeform`, `odeform-per-point`, `node`, `rnn`, `direct`, `occupancy-flow`, `pod-rbf`, `nearest`.
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
    """
    request = TrainRequest(model, seed, minutes, steps, window, every, stagger, resume)
    if model not in MODELS:
        raise InputError(f"unknown model {model!r}: expected one of {', '.join(MODELS)}")
    part = Path(f"{out}.part")
    if resume and (model != "odeform" or not part.exists()):
        raise InputError(f"resume: expected {part}, which an interrupted training of odeform leaves")
    begin = time.process_time()
    body = _body(dataset)
    if model in POINTS:
        learned = _learn_points(dataset, request, report, body)
    else:
        learned = _learn_reduced(dataset, request, report, body, part)
    # over all sittings of a resumed training
    seconds = learned.config.get("val", {}).get("seconds", time.process_time() - begin)
    provenance = {**_provenance(dataset, request, seconds), **learned.provenance}
    scores = _write_scored(replace(learned, provenance=provenance), out, dataset, parts)
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
