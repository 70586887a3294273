"""From a data set to a checkpoint, for every model that learns from parameters."""

import platform
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
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
from odeform.models.baselines.direct import Direct
from odeform.models.baselines.nearest import fit_nearest
from odeform.models.baselines.node import Node
from odeform.models.baselines.occupancy_flow import OccupancyFlow
from odeform.models.baselines.odeform_per_point import OdeformPerPoint
from odeform.models.baselines.pod_rbf import fit_pod_rbf
from odeform.models.baselines.rnn import Rnn
from odeform.models.odeform.model import PREFIX
from odeform.models.registry import load
from odeform.simulation.scene import known_scenes
from odeform.training.continuation import with_continuation
from odeform.training.point_data import prepare_points
from odeform.training.pruning import without_modes
from odeform.training.qualities import with_qualities
from odeform.types import Arrays, Mesh

__all__ = ["MODELS", "POINTS", "TrainRequest", "rest_of", "train", "train_command"]

POINTS = {model.model: model for model in (OdeformPerPoint, Node, Rnn, Direct, OccupancyFlow)}
MODELS = ("odeform", *POINTS, "pod-rbf", "nearest")


@dataclass(frozen=True)
class TrainRequest:
    """What `odeform train` was asked for."""

    model: str = "odeform"
    seed: int = 0
    minutes: float = 30.0
    steps: int | None = None
    """Of training, in place of minutes."""
    window: tuple[int, int] | None = None
    every: int = 1
    stagger: bool = False
    """Every k-th frame of each sequence, but not the same of all."""
    resume: bool = False


def rest_of(dataset: Dataset) -> Mesh:
    """The body as viewers show it: the scene's fine mesh, or of imported data the first training sequence's own."""
    scene = known_scenes().get(dataset.schema.scene)
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


def train(
    dataset: Dataset,
    rest: Mesh,
    out: str | Path,
    request: TrainRequest,
    report: Callable[[str], None],
    parts: Iterable[tuple[int, int]] = (),
) -> Checkpoint:
    """Train one model, score it on the test split, also on `parts` of its frames, write the checkpoint.

    `rest` is the body as viewers show it, as it rests in the scene.
    """
    if request.model not in MODELS:
        raise InputError(f"unknown model {request.model!r}: expected one of {', '.join(MODELS)}")
    part = Path(f"{out}.part")
    if request.resume and (request.model != "odeform" or not part.exists()):
        raise InputError(f"--resume: expected {part}, which an interrupted training of odeform leaves")
    begin = time.process_time()
    body = {
        "rest.points": np.asarray(rest.points, dtype=np.float32),
        "rest.faces": np.asarray(rest.faces, dtype=np.int32),
    }
    if request.model in POINTS:
        learned = _learn_points(dataset, request, report, body)
    else:
        learned = _learn_reduced(dataset, request, report, body, part)
    provenance = {
        "command": _command(dataset, request),
        "dataset": dataset.provenance,
        "fixed": dataset.fixed,
        "seed": request.seed,
        # over all sittings of a resumed training
        "training_seconds": round(learned.config.get("val", {}).get("seconds", time.process_time() - begin), 1),
        "machine": platform.processor() or platform.machine(),
        "versions": {name: version(name) for name in ("odeform", "numpy", "torch")},
        **learned.provenance,
    }
    checkpoint = replace(learned, provenance=provenance)
    write_checkpoint(out, checkpoint)
    arrays = {**checkpoint.arrays, **validation_residuals(load(out), dataset)}
    checkpoint = replace(checkpoint, arrays=arrays)
    write_checkpoint(out, checkpoint)
    scores = evaluate(load(out), dataset, "test", parts=parts)
    scored = replace(checkpoint, scores=scores)
    write_checkpoint(out, scored)
    part.unlink(missing_ok=True)
    report(f"test: pooled RMSE {scores['rmse_pooled_mm']:.3f} mm; written to {out}")
    return scored


def _command(dataset: Dataset, request: TrainRequest) -> list[str]:
    made = dataset.provenance
    if "imported" in made:
        return [f"odeform import {made['imported']} --out DIR", train_command(request)]
    simulate = f"odeform simulate {made.get('scene')} --out DIR --count {made.get('count')} --seed {made.get('seed')}"
    simulate += f" --rate {made['rate_hz']:g}" if "rate_hz" in made else ""
    simulate += " --corners" if made.get("corners") else ""
    return [simulate, train_command(request)]


def train_command(request: TrainRequest) -> str:
    """What it is on the command line, without the files."""
    options = f" --model {request.model} --seed {request.seed}"
    if request.model == "odeform" or request.model in POINTS:
        options += f" --minutes {request.minutes:g}" if request.steps is None else f" --steps {request.steps}"
    options += f" --window {request.window[0]}:{request.window[1]}" if request.window else ""
    options += f" --every {request.every}" if request.every > 1 else ""
    options += " --stagger" if request.stagger else ""
    return f"odeform train DIR --out FILE{options}"
