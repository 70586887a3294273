"""Training of networks that move each point by itself: the same procedure for all of them.

Adam on points of randomly drawn sequences, with a warm-up and a cosine decay of the learning rate, clipped gradients,
and the weights with the best validation error. Learning rate and width are chosen by validation among a few trials,
each a fifth as long as the final training.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import torch

from odeform.checkpoint import Checkpoint
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.models.points.point_model import PointModel, point_checkpoint
from odeform.models.points.point_network import PointNet, Trial, sum_of
from odeform.models.points.training.learner import PointLearner
from odeform.models.points.training.point_data import PointData, prepare_points
from odeform.models.points.training.samplers import SAMPLERS, Sample, Sampler
from odeform.models.training.descent import Budget, descend, small_batches
from odeform.models.training.loss import Loss, torch_device
from odeform.models.training.part import read_part, write_part
from odeform.models.training.run import Run
from odeform.types import Arrays

__all__ = [
    "BETWEEN",
    "FRACTION",
    "all_validated",
    "best_of_trials",
    "fit_points",
    "network_checkpoint",
    "parts_loss",
    "train_points",
]

FRACTION = 0.2  # length of a trial, relative to the final training
BETWEEN = 20  # steps between two validations, at least
AHEAD = 1.0  # windows beyond the trained one, each of which takes as long as that
VALIDATED = 256  # validation motions of a point


def parts_loss(
    parts: list[torch.Tensor], truth: torch.Tensor, centre: torch.Tensor, weights: torch.Tensor, finer: Any
) -> torch.Tensor:
    """The sum over parts (F, B, 3) of their mean squared error, weighted (F, B, 1), in units of each part's scale.

    Of several parts the first is the motion of the whole body, `centre` (F, B, 3), and the second what is left of the
    `truth`, whose scale is `finer` times that of the data.
    """
    targets = [truth] if len(parts) == 1 else [centre, truth - centre]
    sizes = [1.0] if len(parts) == 1 else [1.0, finer]
    squares = [
        weights * ((part - target) / size) ** 2 for part, target, size in zip(parts, targets, sizes, strict=True)
    ]
    return torch.stack([part.mean() for part in squares]).sum()


def all_validated(split: Sampler) -> Sample:
    """Every frame of validation sequences in turn, each of one point: the same in every trial."""
    sequences, _, points, _ = split.moved.shape
    generator = torch.Generator().manual_seed(0)
    drawn = torch.randint(0, points, (VALIDATED,), generator=generator)
    return split.all_frames(torch.arange(VALIDATED) % sequences, drawn)


class _Learner(PointLearner):
    """One training of a network that moves each point by itself."""

    def __init__(
        self, network: PointNet, data: PointData, trial: Trial, seed: int, device: torch.device, loss: Loss | None
    ) -> None:
        super().__init__(network.sizes(data.theta["train"].shape[1], trial.width), trial.rate, seed, device)
        self.network, self.scale_mm, self.given_loss = network, 1e3 * data.frame.scale, loss
        sampler = SAMPLERS[network.sampling]
        self.train_split, self.val_split = (sampler(network, data, split, device) for split in ("train", "val"))
        self.validated_on = all_validated(self.val_split)

    def loss(self, fraction: float) -> torch.Tensor:
        train = self.train_split
        sample = train.draw(fraction, self.generator)
        batch, truth, centre = train.batch(sample)
        weights = train.weights(sample)
        parts = self.network.predict(self.net, batch)
        if self.given_loss is not None:
            guessed, known = (1e-3 * self.scale_mm * y for y in (sum_of(parts), truth))
            return self.given_loss(guessed, known, weights.expand_as(truth)[..., 0])
        return parts_loss(parts, truth, centre, weights, train.finer)

    def error(self) -> float:
        sample = self.validated_on
        batch, truth, _ = self.val_split.batch(sample)
        squares = (sum_of(self.network.predict(self.net, batch)) - truth).square()
        return self.scale_mm * float((self.val_split.weights(sample) * squares).mean().sqrt())


def fit_points(network: PointNet, data: PointData, run: Run) -> Checkpoint:
    """Choose among the trials, train, and return the checkpoint, without the body that viewers show.

    The state is kept in `run.part` after each validation; a resumed training continues from there bit-exactly.
    """
    device = torch_device(run.device)
    training = {"model": run.request.model, "data": data.identity, "given": data.given, "seed": run.request.seed}

    def learner(trial: Trial) -> PointLearner:
        return _Learner(network, data, trial, run.request.seed, device, run.loss)

    weights, config = best_of_trials(network.trials, learner, training, run)
    return network_checkpoint(run.request.model, network, data, weights, {**config, "every": data.given})


def best_of_trials(
    choices: Sequence[Trial], learner_of: Callable[[Trial], PointLearner], training: Mapping[str, Any], run: Run
) -> tuple[Arrays, dict[str, Any]]:
    """Trains by the trial that is best on validation: the weights, and what a checkpoint tells of their training.

    A single choice needs no trial. `training` describes the training to whoever resumes it.
    """
    request, tried = run.request, choices if len(choices) > 1 else ()
    budget, whole = Budget(60.0 * request.minutes, request.steps), 1.0 / (1.0 + FRACTION * len(tried))
    training = {**training, "of": [asdict(trial) for trial in choices]}
    known: dict[str, Any] = {"trials": [], "seconds": 0.0, "learner": {}}
    if request.resume and run.part is not None:
        known = read_part(run.part, training)
        run.report(f"continues after {known['seconds'] / 60.0:.1f} min, with trial {len(known['trials']) + 1}")
    trials, begin = known["trials"], time.process_time() - known["seconds"]

    def keep(learner: dict[str, Any]) -> None:
        if run.part is not None:
            state = {"trials": trials, "seconds": time.process_time() - begin, "learner": learner}
            write_part(run.part, training, state)

    def learn(trial: Trial, budget: Budget, title: str) -> PointLearner:
        learner = learner_of(trial)
        if known["learner"]:
            learner.restore(known["learner"])
            known["learner"] = {}
        descend(learner, budget, lambda line: run.report(f"{title}: {line}"), lambda: keep(learner.state()), BETWEEN)
        return learner

    with small_batches():
        for trial in tried[len(trials) :]:
            title = f"trial of rate {trial.rate:g}, width {trial.width}"
            learner = learn(trial, budget.part(FRACTION * whole), title)
            trials.append({**asdict(trial), "steps": learner.done, "val": learner.best[0]})
            keep({})
        best = choices[int(np.argmin([trial["val"] for trial in trials]))] if trials else choices[0]
        learner = learn(best, budget.part(whole), f"rate {best.rate:g}, width {best.width}")
    error, weights = learner.best
    val = {"val_rmse_mm": error, "steps": learner.done, "seconds": time.process_time() - begin}
    return weights, {**asdict(best), "trials": trials, "val": val}


def network_checkpoint(
    model: str, network: PointNet, data: PointData, weights: Arrays, config: dict[str, Any]
) -> Checkpoint:
    """The checkpoint of weights that were trained on `data`, without the body that viewers show."""
    schema = data.schema
    if network.sampling != "between":
        # networks of the time, or of the last frame, continue beyond the window
        schema = replace(schema, window=replace(schema.window, reach=AHEAD))
    return point_checkpoint(model, schema, data.frame, data.mean, weights, config)


def train_points(model: type[PointModel], run: Run) -> Checkpoint:
    """Train a model of points on the data of `run`.

    `InputError` for a model that interpolates between frames, and is not told to leave any out.
    """
    request, between = run.request, model.network.sampling == "between"
    if between and request.every < 2:
        raise InputError(f"{request.model}: interpolates between observed frames; expected --every of at least 2")
    every, given = (1, request.every) if between else (request.every, 1)
    subsampling = FrameSubsampling(request.window, every, request.stagger and not between)
    data = prepare_points(run.dataset, subsampling, given)
    run.report(f"{request.model} on {len(data.theta['train'])} sequences of {data.moved['train'].shape[1]} frames")
    checkpoint = fit_points(model.network, data, run)
    return replace(checkpoint, arrays=run.with_body(checkpoint.arrays, data.theta["train"]))
