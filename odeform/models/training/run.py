"""One training: what is trained, on which data, and how it reports."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError, counted
from odeform.models.per_object import joined
from odeform.models.registry import model_class
from odeform.models.training.body import body_arrays
from odeform.models.training.request import TrainRequest
from odeform.types import Arrays

if TYPE_CHECKING:
    from odeform.models.training.loss import Loss

__all__ = ["Run", "train_model", "with_ranges_of_data"]

NARROW = 1e-3  # of a scene's range, by which that of an object is wider than its data


@dataclass(frozen=True, eq=False)
class Run:
    """A request and its data set, with the `body` (its points and faces) that viewers show."""

    dataset: Dataset
    request: TrainRequest
    body: Arrays
    part: Path | None
    """The file that keeps the state of the training; None: it cannot be continued."""
    report: Callable[[str], None]
    loss: "Loss | None" = None
    """Replaces the model's own loss in a descent."""
    device: str | None = None
    """Device of a descent, as PyTorch names it; None: a GPU if there is one."""

    def __post_init__(self) -> None:
        model = model_class(self.request.model)
        for name, value in (("loss", self.loss), ("device", self.device)):
            if value is not None and not model.descends:
                raise InputError(
                    f"{name}: {self.request.model} is fitted by least squares on the processor, not by descent; "
                    f"expected no {name}"
                )

    def reduced_data(self, patterns: bool = False) -> TrainingData:
        """The data set in reduced coordinates, with the frames that the request asks for; reports its size."""
        request = self.request
        data = prepare(self.dataset, None, FrameSubsampling(request.window, request.every, request.stagger), patterns)
        modes, rolling = data.space.basis.modes, data.space.rolling
        self.report(
            f"{request.model} on {len(data.theta['train'])} sequences of {len(data.times)} frames; "
            f"{counted(modes, 'POD mode')}"
            f"{f', or {rolling.patterns} in axes that do not roll with the body' if rolling else ''}; "
            f"the rest of the deformation is {data.truncation_mm['val']:.3f} mm RMS on validation"
        )
        return data

    def reduced_checkpoint(self, data: TrainingData, arrays: Arrays, settings: Mapping[str, Any]) -> Checkpoint:
        """Returns the checkpoint of a model of reduced coordinates, with the arrays and settings of its own."""
        checkpoint = self.with_body({**arrays, **data.space.arrays()}, data.theta["train"])
        config = {"space": data.space.to_json(), **settings}
        return Checkpoint(
            self.request.model, data.schema, config, checkpoint, provenance={"truncation_mm": data.truncation_mm}
        )

    def with_body(self, arrays: Arrays, theta: np.ndarray) -> Arrays:
        """The arrays, the body that viewers show, and the training parameters (S, P) in [-1, 1]."""
        return {**arrays, **self.body, "training.theta": theta.astype(np.float32)}


def train_model(run: Run) -> Checkpoint:
    """Train the requested model: once, or for each object of a scene with several.

    `InputError` for a name that cannot be trained.
    """
    model = model_class(run.request.model)
    return _train_each(run) if run.dataset.objects and not model.knows_objects else model.train(run)


def _train_each(run: Run) -> Checkpoint:
    """A model for each object, with an equal fraction of the budget. Its parameters are normalised by their own
    ranges."""
    objects, request = run.dataset.objects, run.request
    steps = None if request.steps is None else max(request.steps // len(objects), 1)
    request = replace(request, minutes=request.minutes / len(objects), steps=steps)
    parts = {}
    for name in objects:
        dataset = with_ranges_of_data(run.dataset.of(name))

        def report(line: str, name: str = name) -> None:
            run.report(f"{name}: {line}")

        one = replace(run, dataset=dataset, request=request, body=body_arrays(dataset), report=report)
        parts[name] = model_class(request.model).train(one)
    return joined(run.dataset.schema, parts)


def with_ranges_of_data(dataset: Dataset) -> Dataset:
    """Data whose schema has the ranges of its training sequences: contacts differ with the body, and so do forces."""
    rows = [entry.parameters for entry in dataset.select("train")]
    if not rows:
        raise InputError(f"{dataset.root}: no sequence of {dataset.schema.objects[0]} in split train")
    ranges = []
    for p in dataset.schema.parameters:
        values = [float(row[p.name]) for row in rows]
        slack = NARROW * (p.high - p.low) if p.scale == "linear" else 0.0
        low, high = min(values) - slack, max(values) + slack
        narrowed = replace(p, low=low, high=high, default=min(max(p.default, low), high)) if low < high else p
        ranges.append(p if p.role == "azimuth" else narrowed)
    return replace(dataset, schema=replace(dataset.schema, parameters=tuple(ranges)))
