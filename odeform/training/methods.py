"""How each kind of model is trained. The class of a model decides, so that a new one of a known kind needs no entry."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError
from odeform.models.baselines.fitted_model import FittedModel
from odeform.models.baselines.pe_gnn import PeGnn
from odeform.models.baselines.point_model import PointModel
from odeform.models.continuation import LATER_ERRORS
from odeform.models.odeform.model import ODeform
from odeform.models.per_object import joined
from odeform.models.registry import TRAINABLE, model_class
from odeform.models.rolling.model import RollingODeform
from odeform.schema import REACH
from odeform.solver.integrate import SolverSettings
from odeform.training.body import body_arrays
from odeform.training.continuation import with_continuation
from odeform.training.correction import with_correction
from odeform.training.graphs import fit_graphs
from odeform.training.mechanical import fit_mechanical
from odeform.training.odeform import fit_odeform
from odeform.training.point_data import prepare_points
from odeform.training.points import Budget, fit_points
from odeform.training.pruning import without_modes
from odeform.training.qualities import Validation, with_qualities
from odeform.training.request import TrainRequest
from odeform.training.rolling import fit_rolling_body, later_errors
from odeform.training.saved_laws import SavedLaws
from odeform.types import Arrays

__all__ = ["Run", "is_resumable", "train_model"]

WITH_KINKS = SolverSettings("dopri5", tolerance=1e-8, dtype="float64")  # finer ones take thousands of steps at contacts
WHOLE, RINGING = 2, 12  # frames after a push, up to which the correction of a body that rolls is whole, and fades
NARROW = 1e-3  # of a scene's range, by which that of an object is wider than its data


@dataclass(frozen=True, eq=False)
class Run:
    """One training: what is trained on which data, with the `body` (its points and faces) that viewers show."""

    dataset: Dataset
    request: TrainRequest
    body: Arrays
    part: Path
    """The file of an interrupted training."""
    report: Callable[[str], None]

    def reduced_data(self, patterns: bool = False) -> TrainingData:
        """The data set in reduced coordinates, with the frames that the request asks for; reports its size."""
        request = self.request
        data = prepare(self.dataset, None, FrameSubsampling(request.window, request.every, request.stagger), patterns)
        modes, rolling = data.space.basis.modes, data.space.rolling
        self.report(
            f"{request.model} on {len(data.theta['train'])} sequences of {len(data.times)} frames; "
            f"{modes} POD mode{'s' if modes > 1 else ''}"
            f"{f', or {rolling.patterns} in axes that do not roll with the body' if rolling else ''}; "
            f"the rest of the deformation is {data.truncation_mm['val']:.3f} mm RMS on validation"
        )
        return data


def train_model(run: Run) -> Checkpoint:
    """Train the requested model by the method of its nearest base class; `InputError` for a name that cannot be
    trained."""
    name = run.request.model
    if name not in TRAINABLE:
        raise InputError(f"unknown model {name!r}: expected one of {', '.join(TRAINABLE)}")
    if run.dataset.objects and name == ODeform.model:
        return _train_mechanical(run)
    method = next(METHODS[kind] for kind in model_class(name).__mro__ if kind in METHODS)
    return _train_each(run, method) if run.dataset.objects else method(run)


def _train_mechanical(run: Run) -> Checkpoint:
    request, dataset = run.request, _cut(run)
    laws = SavedLaws(run.part, dataset, request.seed, request.resume)
    return fit_mechanical(dataset, laws, request.seed, run.report, "correction" not in request.without)


def _cut(run: Run) -> Dataset:
    """The data of pushed objects up to the last frame asked for. `InputError` for frames that are left out."""
    request, dataset = run.request, run.dataset
    if request.every > 1 or request.stagger or request.steps is not None or set(request.without) - {"correction"}:
        raise InputError(
            "odeform on pushed objects: expected no --every, --stagger or --steps, and --without correction at most"
        )
    window = dataset.schema.window
    last = (FrameSubsampling(request.window).count(dataset.schema) - 1) / window.rate
    return replace(dataset, schema=replace(dataset.schema, window=replace(window, stop=last)))


def is_resumable(model: str) -> bool:
    """Whether an interrupted training of this model can be continued."""
    return issubclass(model_class(model), ODeform)


def _train_each(run: Run, method: Callable[[Run], Checkpoint]) -> Checkpoint:
    """A model for each object, with an equal share of the budget. Its parameters are normalised by their own ranges."""
    objects, request = run.dataset.objects, run.request
    steps = None if request.steps is None else max(request.steps // len(objects), 1)
    request = replace(request, minutes=request.minutes / len(objects), steps=steps)
    parts = {}
    for name in objects:
        dataset = _with_own_ranges(run.dataset.of(name))
        report = partial(_report_of, name, run.report)
        parts[name] = method(replace(run, dataset=dataset, request=request, body=body_arrays(dataset), report=report))
    return joined(run.dataset.schema, parts)


def _with_own_ranges(dataset: Dataset) -> Dataset:
    """Data whose schema has the ranges of its training sequences: contacts differ with the body, and so do forces."""
    rows = [entry.parameters for entry in dataset.select("train")]
    if not rows:
        raise InputError(f"{dataset.root}: no sequence of {dataset.schema.objects[0]} in split train")
    ranges = []
    for p in dataset.schema.parameters:
        values = [float(row[p.name]) for row in rows]
        slack = NARROW * (p.high - p.low) if p.scale == "linear" else 0.0
        low, high = min(values) - slack, max(values) + slack
        own = replace(p, low=low, high=high, default=min(max(p.default, low), high)) if low < high else p
        ranges.append(p if p.role == "azimuth" else own)
    return replace(dataset, schema=replace(dataset.schema, parameters=tuple(ranges)))


def _report_of(name: str, report: Callable[[str], None], line: str) -> None:
    report(f"{name}: {line}")


def _train_odeform(run: Run) -> Checkpoint:
    data = run.reduced_data()
    modes = data.space.basis.modes
    arrays, settings = fit_odeform(data, run.request, run.report, run.part)
    checkpoint = _reduced_checkpoint(run, data, arrays, settings)
    if "correction" not in run.request.without:
        checkpoint = with_correction(checkpoint, data)
    checkpoint, data = without_modes(checkpoint, data)
    run.report(f"{data.space.basis.modes} of {modes} modes are needed")
    checkpoint = with_qualities(checkpoint, Validation.of(data))
    return with_continuation(ODeform(checkpoint), data)


def _train_rolling(run: Run) -> Checkpoint:
    data = run.reduced_data(patterns=True)
    arrays, settings = fit_rolling_body(data, run.request, run.report)
    checkpoint = _reduced_checkpoint(run, data, arrays, settings)
    schema = replace(checkpoint.schema, window=replace(checkpoint.schema.window, reach=REACH))
    checkpoint = replace(checkpoint, schema=schema)
    if "correction" not in run.request.without:
        free = data.first_free
        fading = (free + WHOLE, min(free + RINGING, len(data.times) - 1)) if free else None
        checkpoint = with_correction(checkpoint, data, fading)
    checkpoint = with_qualities(checkpoint, Validation.of(data), WITH_KINKS)
    if (later := later_errors(RollingODeform(checkpoint), data)) is None:
        return checkpoint
    return replace(checkpoint, arrays={**checkpoint.arrays, LATER_ERRORS: later.astype(np.float32)})


def _fit(run: Run) -> Checkpoint:
    model, data = model_class(run.request.model), run.reduced_data(patterns=True)
    assert issubclass(model, FittedModel)
    return with_continuation(model(_reduced_checkpoint(run, data, *model.fit(data))), data)


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


def _train_graphs(run: Run) -> Checkpoint:
    request = run.request
    data = prepare_points(run.dataset, FrameSubsampling(request.window))
    run.report(f"{request.model} on the last frames of {len(data.theta['train'])} sequences")
    rest = next(run.dataset.sequences("train")).rest
    checkpoint = fit_graphs(data, rest, Budget(60.0 * request.minutes, request.steps), request.seed, run.report)
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
    RollingODeform: _train_rolling,
    FittedModel: _fit,
    PeGnn: _train_graphs,
    PointModel: _train_points,
}
"""By base class."""
