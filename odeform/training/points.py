"""Training of networks that move each point by itself: one way for all of them.

Adam on points of sequences drawn at random, its rate warmed up and then falling by a cosine, gradients clipped, and the
weights kept that are best on validation. Rate and width are chosen once by validation, among a few trials of a fifth
of the length each.
"""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import torch
from torch.nn.functional import linear, silu

from odeform.checkpoint import Checkpoint
from odeform.dataset.subsampling import observed_frames
from odeform.dataset.training_data import UNKNOWN
from odeform.models.baselines.arithmetic import Net, layer_shapes
from odeform.models.baselines.occupancy_flow import told
from odeform.models.baselines.point_model import point_checkpoint
from odeform.models.baselines.point_network import PointNet, Rows, Trial, sum_of
from odeform.schema import REACH
from odeform.training.loop import small_batches
from odeform.training.point_data import PointData
from odeform.types import Arrays

__all__ = ["Budget", "Torch", "fit_points"]

SHARE = 0.2  # of the final training's length, which a trial takes
WARM = 0.03  # of the length, in which the rate rises
CLIP = 1.0
LOOKS = 25  # at validation, over the length
SELDOM = 20  # steps between two looks, at least
WATCHED = 256  # validation motions of a point that are looked at
SEGMENT = 8  # frames of the first roll-outs
GROWN = 0.6  # share of the length after which roll-outs go over the whole window


class Torch:
    """The arithmetic of training."""

    def linear(self, x: Any, weight: Any, bias: Any) -> Any:
        return linear(x, weight, bias)

    def join(self, parts: list[Any]) -> Any:
        return torch.cat(parts, dim=-1)

    def stack(self, parts: list[Any]) -> Any:
        return torch.stack(parts)

    def act(self, name: str, x: Any) -> Any:
        return silu(x) if name == "silu" else getattr(torch, name)(x)


@dataclass(frozen=True)
class Budget:
    """Of a training with its trials: processor time in seconds, unless a number of steps is given."""

    seconds: float
    steps: int | None = None

    def part(self, share: float) -> "Budget":
        return Budget(share * self.seconds, None if self.steps is None else max(round(share * self.steps), 1))


def initial_weights(shapes: list[tuple[str, tuple[int, ...]]], seed: int) -> dict[str, torch.Tensor]:
    """Uniform within one over the root of the inputs of a layer, as `torch.nn.Linear` draws them."""
    generator, out = torch.Generator().manual_seed(seed), {}
    inputs = 1
    for name, shape in shapes:
        inputs = shape[1] if name.endswith("weight") else inputs
        out[name] = (2.0 * torch.rand(shape, generator=generator) - 1.0) / math.sqrt(inputs)
    return out


class _Split:
    """The motions of a split, as tensors on a device."""

    def __init__(self, data: PointData, split: str, device: torch.device) -> None:
        self.theta = torch.as_tensor(data.theta[split]).float().to(device)
        self.moved = torch.as_tensor(data.moved[split]).to(device)
        self.known = torch.where(torch.as_tensor(data.known[split]), 1.0, UNKNOWN).to(device)
        frames, shows = observed_frames(data.known[split])
        self.shown, self.counts = torch.as_tensor(frames), torch.as_tensor(shows.sum(axis=1))
        self.x = torch.as_tensor(data.x).to(device)
        weights = torch.as_tensor(data.weights).float().to(device)
        self.centre = torch.einsum("n,stni->sti", weights, self.moved)
        self.finer = data.frame.part_scale / data.frame.scale
        self.given, self.device = data.given, device

    def weights(self, sequence: torch.Tensor, frames: torch.Tensor) -> torch.Tensor:
        """(F, B, 1), of mean one, of frames (F, B) of sequences (B,)."""
        known = self.known[sequence.to(self.device), frames.to(self.device)][..., None]
        return known / known.mean()

    def known_frames(self, sequence: torch.Tensor, frames: torch.Tensor) -> torch.Tensor:
        """Frames that the sequences (B,) show and that are not the first, for numbers (1, B) from 1 on."""
        return self.shown[sequence, 1 + (frames - 1) % (self.counts[sequence] - 1)]

    def rows(self, sequence: torch.Tensor, point: torch.Tensor, frames: torch.Tensor) -> tuple[Rows, Any, Any]:
        """Of sequences and points (B,) at frames (F, B): what is asked, and the true displacements of the points and
        of the centre, (F, B, 3)."""
        sequence, point, frames = (index.to(self.device) for index in (sequence, point, frames))
        truth, centre = self.moved[sequence, frames, point], self.centre[sequence, frames]
        last = self.moved.shape[1] - 1
        if self.given > 1:
            return self._between(sequence, point, frames, last), truth, centre
        times = frames.float() / last
        return Rows(self.x[point], self.theta[sequence], times, truth[0], self.finer), truth, centre

    def _between(self, sequence: torch.Tensor, point: torch.Tensor, frames: torch.Tensor, last: int) -> Rows:
        """As `rows`, of intervals between two given frames, which the first and the last of `frames` are."""
        begin = frames[0]
        four = [self.moved[sequence, (begin + shift * self.given).clamp(0, last), point] for shift in (-1, 0, 1, 2)]
        length = torch.full_like(four[0][:, :1], self.given / last)
        times = (frames - begin).float() / self.given
        return Rows(self.x[point], told(Net({}, Torch()), four, length), times, four[1], self.finer)


class _Learner:
    """One training of one network."""

    def __init__(self, network: PointNet, data: PointData, trial: Trial, seed: int, device: torch.device) -> None:
        self.network, self.trial, self.scale_mm = network, trial, 1e3 * data.frame.scale
        self.splits = {split: _Split(data, split, device) for split in ("train", "val")}
        shapes = list(layer_shapes(network.sizes(data.theta["train"].shape[1], trial.width)))
        self.weights = {name: w.to(device).requires_grad_() for name, w in initial_weights(shapes, seed).items()}
        self.net = Net(self.weights, Torch())
        self.optimiser = torch.optim.Adam(self.weights.values(), lr=trial.rate)
        self.generator = torch.Generator().manual_seed(seed + 1)
        self.watched = self._draw_watched()
        self.best = (math.inf, self._snapshot())
        self.done = 0

    def _snapshot(self) -> Arrays:
        return {name: weight.detach().cpu().numpy().copy() for name, weight in self.weights.items()}

    def _below(self, limit: int, *shape: int) -> torch.Tensor:
        return torch.randint(0, limit, shape, generator=self.generator)

    def _draw_watched(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Validation sequences in turn, and a point of each: the same in every trial."""
        sequences, _, points, _ = self.splits["val"].moved.shape
        generator = torch.Generator().manual_seed(0)
        return torch.arange(WATCHED) % sequences, torch.randint(0, points, (WATCHED,), generator=generator)

    def _frames(self, share: float) -> torch.Tensor:
        """(F, B) frames to learn from in a step."""
        network, last = self.network, self.splits["train"].moved.shape[1] - 1
        if network.teaching == "moments":
            return 1 + self._below(last, 1, network.work)
        if network.teaching == "between":
            given = self.splits["train"].given
            return torch.arange(given + 1)[:, None] + self._below(last - given + 1, 1, network.work // given)
        length = round(min(last, SEGMENT + (last - SEGMENT) * share / GROWN))
        stride = network.strides[min(int(share * len(network.strides)), len(network.strides) - 1)]
        if stride == 1:
            ahead = torch.arange(length + 1)
        else:
            # rest, the frame after it, and from a random one on every so many
            ahead = torch.arange(int(2 + self._below(stride, 1)), length + 1, stride)
            ahead = torch.cat([torch.tensor([0, 1]), ahead])
        batch = max(network.work // len(ahead), 16)
        if network.teaching == "whole":
            return ahead[:, None].expand(-1, batch)
        return ahead[:, None] + self._below(last - length + 1, 1, batch)

    def _loss(self, share: float) -> torch.Tensor:
        train, frames = self.splits["train"], self._frames(share)
        sequences, _, points, _ = train.moved.shape
        batch = frames.shape[1]
        sequence = self._below(sequences, batch)
        if self.network.teaching == "moments":
            frames = train.known_frames(sequence, frames)
        rows, truth, centre = train.rows(sequence, self._below(points, batch), frames)
        weights = train.weights(sequence, frames)
        parts = self.network.predict(self.net, rows)
        # of several parts the first is the way of the body as a whole: each is held to what it stands for
        targets = [truth] if len(parts) == 1 else [centre, truth - centre]
        sizes = [1.0] if len(parts) == 1 else [1.0, train.finer]
        wrong = [
            weights * ((part - target) / size) ** 2 for part, target, size in zip(parts, targets, sizes, strict=True)
        ]
        return torch.stack([squares.mean() for squares in wrong]).sum()

    def advance(self, share: float) -> float:
        """One step of descent at this share of the length; returns its loss."""
        falling = 0.5 * (1.0 + math.cos(math.pi * share))
        self.optimiser.param_groups[0]["lr"] = self.trial.rate * min(1.0, (share + 1e-3) / WARM) * falling
        self.optimiser.zero_grad()
        loss = self._loss(share)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(self.weights.values(), CLIP)
        if torch.isfinite(norm):
            self.optimiser.step()
        self.done += 1
        return float(loss.detach())

    @torch.no_grad()
    def look(self) -> float:
        """Pooled RMSE in mm on validation; weights that are the best so far are kept."""
        val = self.splits["val"]
        sequence, point = self.watched
        frames = torch.arange(val.moved.shape[1])[:, None].expand(-1, WATCHED)
        if self.network.teaching == "between":
            starts = torch.arange(0, len(frames) - 1, val.given)
            frames = torch.arange(val.given + 1)[:, None] + starts.repeat_interleave(WATCHED)
            sequence, point = (index.repeat(len(starts)) for index in self.watched)
        elif self.network.teaching == "moments":
            frames = frames[1:].reshape(1, -1)
            sequence, point = (index.repeat(frames.shape[1] // WATCHED) for index in self.watched)
        rows, truth, _ = val.rows(sequence, point, frames)
        squares = (sum_of(self.network.predict(self.net, rows)) - truth).square()
        error = self.scale_mm * float((val.weights(sequence, frames) * squares).mean().sqrt())
        if error < self.best[0]:
            self.best = (error, self._snapshot())
        return error

    def train(self, budget: Budget, report: Callable[[str], None]) -> None:
        begin, looked, share, looks = time.process_time(), 0, 0.0, 0
        while share < 1.0:
            loss = self.advance(share)
            spent = time.process_time() - begin
            share = self.done / budget.steps if budget.steps is not None else spent / budget.seconds
            if share >= 1.0 or (share * LOOKS >= looks + 1 and self.done >= looked + SELDOM):
                looks, looked = int(share * LOOKS), self.done
                error = self.look()
                report(f"{100 * share:.0f} %, step {self.done}: loss {loss:.3g}, {error:.3f} mm (val)")


def fit_points(
    model: str, network: PointNet, data: PointData, budget: Budget, seed: int, report: Callable[[str], None]
) -> Checkpoint:
    """The checkpoint of a network that was tuned and trained, but for the body that viewers show."""
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    whole = 1.0 / (1.0 + SHARE * len(network.trials))
    trials, begin = [], time.process_time()

    def learn(trial: Trial, budget: Budget, said: str) -> _Learner:
        learner = _Learner(network, data, trial, seed, device)
        learner.train(budget, lambda line: report(f"{said}: {line}"))
        return learner

    with small_batches():
        for trial in network.trials:
            said = f"trial of rate {trial.rate:g}, width {trial.width}"
            learner = learn(trial, budget.part(SHARE * whole), said)
            trials.append({**asdict(trial), "steps": learner.done, "val": learner.best[0]})
        best = network.trials[int(np.argmin([trial["val"] for trial in trials]))]
        learner = learn(best, budget.part(whole), f"rate {best.rate:g}, width {best.width}")
    error, weights = learner.best
    val = {"val_rmse_mm": error, "steps": learner.done, "seconds": time.process_time() - begin}
    config = {**asdict(best), "every": data.given, "trials": trials, "val": val}
    schema = data.schema
    if network.teaching != "between":
        # where a network of the time, or of the last frame, takes a point later is for it to say
        schema = replace(schema, window=replace(schema.window, reach=REACH))
    return point_checkpoint(model, schema, data.frame, data.mean, weights, config)
