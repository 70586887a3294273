"""How each kind of model is trained. The class of a model decides, so that a new one of a known kind needs no entry."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError
from odeform.models.baselines.fitted_model import FittedModel
from odeform.models.baselines.point_model import PointModel
from odeform.models.odeform.model import ODeform
from odeform.models.registry import TRAINABLE, model_class
from odeform.training.continuation import with_continuation
from odeform.training.odeform import fit_odeform
from odeform.training.point_data import prepare_points
from odeform.training.points import Budget, fit_points
from odeform.training.pruning import without_modes
from odeform.training.qualities import with_qualities
from odeform.training.request import TrainRequest
from odeform.types import Arrays

__all__ = ["Run", "is_resumable", "train_model"]


@dataclass(frozen=True, eq=False)
class Run:
    """One training: what is trained on which data, with the `body` (its points and faces) that viewers show."""

    dataset: Dataset
    request: TrainRequest
    body: Arrays
    part: Path
    """The file of an interrupted training."""
    report: Callable[[str], None]

    def reduced_data(self) -> TrainingData:
        """The data set in reduced coordinates, with the frames that the request asks for; reports its size."""
        request = self.request
        data = prepare(self.dataset, None, FrameSubsampling(request.window, request.every, request.stagger))
        modes = data.space.basis.modes
        self.report(
            f"{request.model} on {len(data.theta['train'])} sequences of {len(data.times)} frames; "
            f"{modes} POD mode{'s' if modes > 1 else ''}; "
            f"the rest of the deformation is {data.truncation_mm['val']:.3f} mm RMS on validation"
        )
        return data


def train_model(run: Run) -> Checkpoint:
    """Train the requested model by the method of its nearest base class; `InputError` for a name that cannot be
    trained."""
    name = run.request.model
    if name not in TRAINABLE:
        raise InputError(f"unknown model {name!r}: expected one of {', '.join(TRAINABLE)}")
    return next(METHODS[kind] for kind in model_class(name).__mro__ if kind in METHODS)(run)


def is_resumable(model: str) -> bool:
    """Whether an interrupted training of this model can be continued."""
    return issubclass(model_class(model), ODeform)


def _train_odeform(run: Run) -> Checkpoint:
    data = run.reduced_data()
    modes = data.space.basis.modes
    arrays, settings = fit_odeform(data, run.request, run.report, run.part)
    checkpoint, data = without_modes(_reduced_checkpoint(run, data, arrays, settings), data)
    run.report(f"{data.space.basis.modes} of {modes} modes are needed")
    return with_continuation(with_qualities(checkpoint, data), data)


def _fit(run: Run) -> Checkpoint:
    model, data = model_class(run.request.model), run.reduced_data()
    assert issubclass(model, FittedModel)
    return _reduced_checkpoint(run, data, *model.fit(data))


def _train_points(run: Run) -> Checkpoint:
    request, model = run.request, model_class(run.request.model)
    assert issubclass(model, PointModel)
    between = model.network.sampling == "between"
    if between and request.every < 2:
        raise InputError(f"{request.model}: interpolates between observed frames; expected --every of at least 2")
    every, given = (1, request.every) if between else (request.every, 1)
    subsampling = FrameSubsampling(request.window, every, request.stagger and not between)
    data = prepare_points(run.dataset, subsampling, given)
    run.report(f"{request.model} on {len(data.theta['train'])} sequences of {data.moved['train'].shape[1]} frames")
    budget = Budget(60.0 * request.minutes, request.steps)
    checkpoint = fit_points(request.model, model.network, data, budget, request.seed, run.report)
    arrays = {**checkpoint.arrays, **run.body, "training.theta": data.theta["train"].astype(np.float32)}
    return replace(checkpoint, arrays=arrays)


def _reduced_checkpoint(run: Run, data: TrainingData, arrays: Arrays, settings: dict[str, object]) -> Checkpoint:
    theta = data.theta["train"].astype(np.float32)
    return Checkpoint(
        model=run.request.model,
        schema=data.schema,
        config={"space": data.space.to_json(), **settings},
        arrays={**arrays, **data.space.arrays(), **run.body, "training.theta": theta},
        provenance={"truncation_mm": data.truncation_mm},
    )


METHODS: dict[type, Callable[[Run], Checkpoint]] = {
    ODeform: _train_odeform,
    FittedModel: _fit,
    PointModel: _train_points,
}
"""By base class."""
