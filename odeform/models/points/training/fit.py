"""Training of networks that move each point by itself: the same procedure for all of them.

Adam on points of randomly drawn sequences, with a warm-up and a cosine decay of the learning rate, clipped gradients,
and the weights with the best validation error. Learning rate and width are chosen by validation among a few trials,
each a fifth as long as the final training.
"""

import math
import time
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import torch

from odeform.checkpoint import Checkpoint
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.models.layers import layer_shapes
from odeform.models.points.arithmetic import Net
from odeform.models.points.point_model import PointModel, point_checkpoint
from odeform.models.points.point_network import PointNet, Trial, sum_of
from odeform.models.points.training.point_data import PointData, prepare_points
from odeform.models.points.training.samplers import SAMPLERS, Sample, Sampler
from odeform.models.points.training.torch_arithmetic import Torch
from odeform.models.training.descent import Budget, cosine_decay, descend, small_batches
from odeform.models.training.loss import Loss, torch_device
from odeform.models.training.part import read_part, write_part
from odeform.models.training.run import Run
from odeform.types import Arrays

__all__ = [
    "BETWEEN",
    "CLIP",
    "FRACTION",
    "WARM",
    "all_validated",
    "fit_points",
    "initial_weights",
    "network_checkpoint",
    "parts_loss",
    "train_points",
]

FRACTION = 0.2  # length of a trial, relative to the final training
WARM = 0.03  # fraction of the length in which the learning rate rises
CLIP = 1.0  # norm of the gradient
BETWEEN = 20  # steps between two validations, at least
AHEAD = 1.0  # windows beyond the trained one, each of which takes as long as that
VALIDATED = 256  # validation motions of a point


def initial_weights(shapes: list[tuple[str, tuple[int, ...]]], seed: int) -> dict[str, torch.Tensor]:
    """Draws weights, uniform within 1 / sqrt(inputs of the layer), as `torch.nn.Linear` draws them."""
    generator, out = torch.Generator().manual_seed(seed), {}
    inputs = 1
    for name, shape in shapes:
        inputs = shape[1] if name.endswith("weight") else inputs
        out[name] = (2.0 * torch.rand(shape, generator=generator) - 1.0) / math.sqrt(inputs)
    return out


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


class _Learner:
    """One training of one network."""

    def __init__(
        self, network: PointNet, data: PointData, trial: Trial, seed: int, device: torch.device, loss: Loss | None
    ) -> None:
        self.network, self.trial, self.scale_mm, self.given_loss = network, trial, 1e3 * data.frame.scale, loss
        sampler = SAMPLERS[network.sampling]
        self.train_split, self.val_split = (sampler(network, data, split, device) for split in ("train", "val"))
        shapes = list(layer_shapes(network.sizes(data.theta["train"].shape[1], trial.width)))
        self.weights = {name: w.to(device).requires_grad_() for name, w in initial_weights(shapes, seed).items()}
        self.net = Net(self.weights, Torch())
        self.optimiser = torch.optim.Adam(self.weights.values(), lr=trial.rate)
        self.generator = torch.Generator().manual_seed(seed + 1)
        self.validated_on = all_validated(self.val_split)
        self.best = (math.inf, self._snapshot())
        self.done, self.elapsed = 0, 0.0

    def _snapshot(self) -> Arrays:
        return {name: weight.detach().cpu().numpy().copy() for name, weight in self.weights.items()}

    def _loss(self, fraction: float) -> torch.Tensor:
        train = self.train_split
        sample = train.draw(fraction, self.generator)
        batch, truth, centre = train.batch(sample)
        weights = train.weights(sample)
        parts = self.network.predict(self.net, batch)
        if self.given_loss is not None:
            guessed, known = (1e-3 * self.scale_mm * y for y in (sum_of(parts), truth))
            return self.given_loss(guessed, known, weights.expand_as(truth)[..., 0])
        return parts_loss(parts, truth, centre, weights, train.finer)

    def advance(self, fraction: float) -> float:
        """One step of descent at this fraction of the length; returns its loss."""
        warm_up = min(1.0, (fraction + 1e-3) / WARM)
        self.optimiser.param_groups[0]["lr"] = self.trial.rate * warm_up * cosine_decay(fraction)
        self.optimiser.zero_grad()
        loss = self._loss(fraction)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(self.weights.values(), CLIP)
        if torch.isfinite(norm):
            self.optimiser.step()
        self.done += 1
        return float(loss.detach())

    @torch.no_grad()
    def validate(self) -> float:
        """Pooled RMSE in mm on validation; keeps the weights if they are the best so far."""
        sample = self.validated_on
        batch, truth, _ = self.val_split.batch(sample)
        squares = (sum_of(self.network.predict(self.net, batch)) - truth).square()
        error = self.scale_mm * float((self.val_split.weights(sample) * squares).mean().sqrt())
        if error < self.best[0]:
            self.best = (error, self._snapshot())
        return error

    def state(self) -> dict[str, Any]:
        """All that `restore` needs to go on bit-exactly."""
        best = {name: torch.from_numpy(value) for name, value in self.best[1].items()}
        weights = {name: weight.detach() for name, weight in self.weights.items()}
        state = {"weights": weights, "optimiser": self.optimiser.state_dict(), "best": best, "error": self.best[0]}
        return {**state, "generator": self.generator.get_state(), "done": self.done, "elapsed": self.elapsed}

    @torch.no_grad()
    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        for name, weight in self.weights.items():
            weight.copy_(state["weights"][name])
        self.optimiser.load_state_dict(state["optimiser"])
        self.generator.set_state(state["generator"])
        self.best = state["error"], {name: value.numpy() for name, value in state["best"].items()}
        self.done, self.elapsed = state["done"], state["elapsed"]


def fit_points(network: PointNet, data: PointData, run: Run) -> Checkpoint:
    """Choose among the trials, train, and return the checkpoint, without the body that viewers show.

    The state is kept in `run.part` after each validation; a resumed training continues from there bit-exactly.
    """
    request, device = run.request, torch_device(run.device)
    budget, whole = Budget(60.0 * request.minutes, request.steps), 1.0 / (1.0 + FRACTION * len(network.trials))
    sizes = [asdict(trial) for trial in network.trials]
    training = {"model": request.model, "data": data.identity, "given": data.given, "seed": request.seed, "of": sizes}
    known: dict[str, Any] = {"trials": [], "seconds": 0.0, "learner": {}}
    if request.resume and run.part is not None:
        known = read_part(run.part, training)
        run.report(f"continues after {known['seconds'] / 60.0:.1f} min, with trial {len(known['trials']) + 1}")
    trials, begin = known["trials"], time.process_time() - known["seconds"]

    def keep(learner: dict[str, Any]) -> None:
        if run.part is not None:
            state = {"trials": trials, "seconds": time.process_time() - begin, "learner": learner}
            write_part(run.part, training, state)

    def learn(trial: Trial, budget: Budget, title: str) -> _Learner:
        learner = _Learner(network, data, trial, request.seed, device, run.loss)
        if known["learner"]:
            learner.restore(known["learner"])
            known["learner"] = {}
        descend(learner, budget, lambda line: run.report(f"{title}: {line}"), lambda: keep(learner.state()), BETWEEN)
        return learner

    with small_batches():
        for trial in network.trials[len(trials) :]:
            title = f"trial of rate {trial.rate:g}, width {trial.width}"
            learner = learn(trial, budget.part(FRACTION * whole), title)
            trials.append({**asdict(trial), "steps": learner.done, "val": learner.best[0]})
            keep({})
        best = network.trials[int(np.argmin([trial["val"] for trial in trials]))]
        learner = learn(best, budget.part(whole), f"rate {best.rate:g}, width {best.width}")
    error, weights = learner.best
    val = {"val_rmse_mm": error, "steps": learner.done, "seconds": time.process_time() - begin}
    config = {**asdict(best), "every": data.given, "trials": trials, "val": val}
    return network_checkpoint(request.model, network, data, weights, config)


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
