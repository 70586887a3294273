"""Training of the ODeform network: multiple shooting first, whole roll-outs after.

Segments of ten frames, each started by a small network from the observed motion, train in parallel and give the field
its shape; roll-outs from the encoder alone, over a growing horizon, then do most of the work.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from odeform.model.config import ModelConfig
from odeform.model.data import TrainingData
from odeform.model.network import ODeformNet, mlp
from odeform.model.reduced import POSE
from odeform.solver.adjoint import solve_backprop
from odeform.solver.integrate import Quality
from odeform.training.losses import AutomaticWeights, Metric
from odeform.types import Arrays

__all__ = ["TrainConfig", "build_network", "network_weights", "train_network"]


@dataclass(frozen=True)
class TrainConfig:
    """How to train."""

    minutes: float = 30.0
    """Wall time."""
    seed: int = 0
    batch: int = 60
    """Sequences in a step."""
    segment: int = 10
    """Frames of a shooting segment."""
    shooting: float = 0.05
    """Share of the time for multiple shooting."""
    rate: float = 2e-3
    """Learning rate at the start of each phase; falls by a cosine to nothing."""
    tie: float = 0.1
    """Weight of the gap between a segment's end and the next one's start."""
    change: float = 3.0
    """Frames for which an error of the speed counts as if it went on."""
    floor: float = 0.1
    """Frames count by 1 / (their displacement + this share of the largest): the kick itself moves little, but is
    what people look at."""
    report: float = 20.0
    """Seconds between lines of progress."""


def build_network(data: TrainingData, seed: int) -> ODeformNet:
    """A fresh network, whitened by the training data alone."""
    torch.manual_seed(seed)
    train = data.reduced["train"]
    rigid = "rigid" in data.schema.parts
    config = ModelConfig(parameters=data.theta["train"].shape[1], modes=train.shape[-1] - POSE, rigid=rigid)
    net = ODeformNet(config)
    spread = np.sqrt((train**2).mean(axis=(0, 1)))
    gains = np.concatenate(
        [np.full(3, np.linalg.norm(spread[:3])), np.full(3, np.linalg.norm(spread[3:6])), spread[6:]]
    )
    net.gains.copy_(torch.as_tensor(np.maximum(gains, 1e-9)))
    # fields of order one should cross the latent space in a few frames, not in a second
    net.time_scale.fill_(0.05)
    shape = _shape(data)
    for encoder in net.encoders:
        encoder.standardise([shape])
    return net


def _shape(data: TrainingData) -> tuple[torch.Tensor, torch.Tensor]:
    return torch.as_tensor(data.rest / data.space.arm).float(), torch.as_tensor(data.weights).float()


class _Trainer:
    def __init__(self, net: ODeformNet, data: TrainingData, config: TrainConfig) -> None:
        self.net, self.config = net, config
        self.metric = Metric(net.gains, data.space.arm)
        self.balance = AutomaticWeights(2)
        gains = net.gains.double().numpy()
        self.truth = {k: torch.as_tensor(v / gains).float() for k, v in data.reduced.items()}
        self.theta = {k: torch.as_tensor(v).float() for k, v in data.theta.items()}
        self.step = float(data.times[1] - data.times[0])
        self.quality = Quality("rk4", step=self.step)
        size = np.linalg.norm(data.reduced["train"][..., :3], axis=-1).mean(axis=0)
        emphasis = 1.0 / (size + config.floor * size.max())
        self.emphasis = torch.as_tensor(emphasis / emphasis.mean()).float()
        speed = np.gradient(data.reduced["train"], self.step, axis=1)
        self.speed = torch.as_tensor(speed / np.sqrt((speed**2).mean(axis=(0, 1)) + 1e-12)).float()
        outputs = self.truth["train"].shape[-1]
        self.starter = mlp([2 * outputs + net.config.parameters, 256, 256, net.config.state], nn.SiLU)
        self.shape = _shape(data)
        self.generator = torch.Generator().manual_seed(config.seed)

    def _roll(self, start: torch.Tensor, theta: torch.Tensor, frames: int) -> torch.Tensor:
        return solve_backprop(lambda _, z: self.net.slope(z, theta), start, self.quality, frames)

    def shooting_loss(self, rows: torch.Tensor) -> torch.Tensor:
        truth, theta, length = self.truth["train"][rows], self.theta["train"][rows], self.config.segment
        first = self.net.encode(self.shape, theta)
        at = torch.arange(length, truth.shape[1] - 1, length)
        at = at[at + length < truth.shape[1]]
        cues = torch.cat([truth[:, at], self.speed[rows][:, at], theta[:, None].expand(-1, len(at), -1)], dim=-1)
        starts = torch.cat([first[:, None], self.starter(cues)], dim=1)
        count = starts.shape[1]
        states = self._roll(starts.flatten(0, 1), theta.repeat_interleave(count, dim=0), length)
        states = states.unflatten(1, (len(rows), count))
        predicted = self.net.decode(states) - self.net.decode(first)[None, :, None]
        frames = torch.arange(count)[None] * length + torch.arange(length + 1)[:, None]
        rigid, points = self.metric(predicted, truth[:, frames].transpose(0, 1))
        gap = ((states[-1, :, :-1] - starts[:, 1:]) ** 2).mean()
        return self.balance(rigid, points) + self.config.tie * gap

    def rollout(
        self, split: str, rows: torch.Tensor, frames: int, plain: bool = False
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """L_rigid and L_points over the first `frames`; `plain` without emphasis and changes, as scores are."""
        truth, theta = self.truth[split][rows][:, : frames + 1], self.theta[split][rows]
        first = self.net.encode(self.shape, theta)
        states = self._roll(first, theta, frames)
        predicted = (self.net.decode(states) - self.net.decode(first)).transpose(0, 1)
        if plain:
            return self.metric(predicted, truth)
        return self.metric(predicted, truth, self.emphasis[: frames + 1], self.config.change)

    @torch.no_grad()
    def errors_mm(self, split: str) -> tuple[float, float]:
        """Pooled RMSE over coordinates, in mm: of the rigid part and of the deformation."""
        rows = torch.arange(len(self.theta[split]))
        losses = self.rollout(split, rows, self.truth[split].shape[1] - 1, plain=True)
        return tuple(float((loss / 3.0).sqrt()) for loss in losses)  # pyright: ignore[reportReturnType]

    def phase(self, seconds: float, shooting: bool, report: Callable[[str], None]) -> None:
        modules = [self.net, *([self.starter] if shooting else [])]
        weights = [p for module in modules for p in module.parameters()]
        balance = {"params": list(self.balance.parameters()), "weight_decay": 0.0}
        optimiser = torch.optim.AdamW([{"params": weights}, balance], lr=self.config.rate, weight_decay=1e-4)
        total = self.truth["train"].shape[1] - 1
        begin = printed = time.monotonic()
        steps = 0
        while (elapsed := time.monotonic() - begin) < seconds:
            share = elapsed / seconds
            warm = min(1.0, steps / 20.0)
            rate = warm * self.config.rate * 0.5 * (1.0 + np.cos(np.pi * share))
            optimiser.param_groups[0]["lr"] = rate
            optimiser.param_groups[1]["lr"] = rate * AutomaticWeights.RATE
            rows = torch.randperm(len(self.theta["train"]), generator=self.generator)[: self.config.batch]
            if shooting:
                loss = self.shooting_loss(rows)
            else:
                # the horizon grows over the first third of the phase
                frames = min(total, round(total * (0.25 + 2.25 * share)))
                loss = self.balance(*self.rollout("train", rows, frames))
            optimiser.zero_grad()
            loss.backward()
            norm = nn.utils.clip_grad_norm_(weights, 1.0)
            if torch.isfinite(norm):
                optimiser.step()
            steps += 1
            now = time.monotonic()
            if now - printed > self.config.report:
                printed = now
                rigid, local = self.errors_mm("val")
                name = "shooting" if shooting else "roll-out"
                trained, _ = self.errors_mm("train")
                report(
                    f"{name} {100 * share:.0f} %, step {steps}: val rigid {rigid:.2f} mm (train {trained:.2f}), "
                    f"deformation {local:.3f} mm"
                )


def train_network(
    net: ODeformNet, data: TrainingData, config: TrainConfig, report: Callable[[str], None] = print
) -> dict[str, float]:
    """Train in place; returns validation errors in mm.

    Denormal numbers slow such a run thirty-fold on some processors, so they are flushed.
    """
    torch.set_flush_denormal(True)
    torch.manual_seed(config.seed)
    trainer = _Trainer(net, data, config)
    seconds = 60.0 * config.minutes
    trainer.phase(config.shooting * seconds, True, report)
    trainer.phase((1.0 - config.shooting) * seconds, False, report)
    rigid, local = trainer.errors_mm("val")
    return {"val_rigid_rmse_mm": rigid, "val_deformation_rmse_mm": local}


def network_weights(net: ODeformNet) -> Arrays:
    return {name: value.detach().cpu().numpy() for name, value in net.state_dict().items()}
