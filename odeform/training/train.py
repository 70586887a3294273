"""From a data set to a checkpoint, for every model that learns from parameters."""

import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from odeform.baselines.nearest import fit_nearest
from odeform.baselines.pod_rbf import fit_pod_rbf
from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.evaluation.residuals import validation_residuals
from odeform.model.data import TrainingData, prepare
from odeform.model.odeform import PREFIX
from odeform.predictor import load
from odeform.training.qualities import with_qualities
from odeform.types import Arrays, Mesh

__all__ = ["MODELS", "TrainRequest", "train"]

MODELS = ("odeform", "pod-rbf", "nearest")


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
    resume: bool = False


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


def train(
    dataset: Dataset, rest: Mesh, out: str | Path, request: TrainRequest, report: Callable[[str], None]
) -> Checkpoint:
    """Train one model, score it on the test split, write the checkpoint.

    `rest` is the body as viewers show it, as it rests in the scene.
    """
    if request.model not in MODELS:
        raise InputError(f"unknown model {request.model!r}: expected one of {', '.join(MODELS)}")
    part = Path(f"{out}.part")
    if request.resume and (request.model != "odeform" or not part.exists()):
        raise InputError(f"--resume: expected {part}, which an interrupted training of odeform leaves")
    begin = time.monotonic()
    data = prepare(dataset, None, request.window, request.every)
    modes = data.space.basis.modes
    report(
        f"{request.model} on {len(data.theta['train'])} sequences of {len(data.times)} frames; "
        f"{modes} modes leave {data.truncation_mm['val']:.3f} mm of the deformation (val)"
    )
    if request.model == "odeform":
        arrays, settings = _fit_odeform(data, request, report, part)
    else:
        arrays, settings = {"pod-rbf": fit_pod_rbf, "nearest": fit_nearest}[request.model](data)
    provenance = {
        "command": _command(dataset, request),
        "dataset": dataset.provenance,
        "fixed": dataset.fixed,
        "seed": request.seed,
        # over all sittings of a resumed training
        "training_seconds": round(settings["val"]["seconds"] if "val" in settings else time.monotonic() - begin, 1),
        "machine": platform.processor() or platform.machine(),
        "versions": {name: version(name) for name in ("odeform", "numpy", "torch")},
        "truncation_mm": data.truncation_mm,
    }
    checkpoint = Checkpoint(
        model=request.model,
        schema=data.schema,
        config={"space": data.space.to_json(), **settings},
        arrays={
            **arrays,
            **data.space.arrays(),
            # viewers show where the model was taught
            "training.theta": data.theta["train"].astype(np.float32),
            "rest.points": np.asarray(rest.points, dtype=np.float32),
            "rest.faces": np.asarray(rest.faces, dtype=np.int32),
        },
        provenance=provenance,
    )
    if request.model == "odeform":
        checkpoint = with_qualities(checkpoint, data)
    write_checkpoint(out, checkpoint)
    arrays = {**checkpoint.arrays, **validation_residuals(load(out), dataset)}
    checkpoint = replace(checkpoint, arrays=arrays)
    write_checkpoint(out, checkpoint)
    scores = evaluate(load(out), dataset, "test")
    scored = replace(checkpoint, scores=scores)
    write_checkpoint(out, scored)
    part.unlink(missing_ok=True)
    report(f"test: pooled RMSE {scores['rmse_pooled_mm']:.3f} mm; written to {out}")
    return scored


def _command(dataset: Dataset, request: TrainRequest) -> list[str]:
    made = dataset.provenance
    simulate = f"odeform simulate {made.get('scene')} --out DIR --count {made.get('count')} --seed {made.get('seed')}"
    simulate += f" --rate {made['rate_hz']:g}" if "rate_hz" in made else ""
    simulate += " --corners" if made.get("corners") else ""
    options = f" --model {request.model} --seed {request.seed}"
    if request.model == "odeform":
        options += f" --minutes {request.minutes:g}" if request.steps is None else f" --steps {request.steps}"
    options += f" --window {request.window[0]}:{request.window[1]}" if request.window else ""
    options += f" --every {request.every}" if request.every > 1 else ""
    return [simulate, f"odeform train DIR --out FILE{options}"]
