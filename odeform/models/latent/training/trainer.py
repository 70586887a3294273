"""Gradient descent on roll-outs: one step at a time, on one device, with a state that can be saved and restored."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import nn

from odeform.dataset.subsampling import observed_frames
from odeform.dataset.training_data import FILLED_WEIGHT, TrainingData
from odeform.errors import InputError
from odeform.io import atomic_write, safetensors_metadata
from odeform.models.latent.network import ODeformNet
from odeform.models.latent.training.config import FREE, TrainConfig
from odeform.models.latent.training.losses import Metric, balanced
from odeform.models.latent.training.readout import NormalEquations
from odeform.models.latent.training.start import training_shape
from odeform.models.latent.training.tree import flatten, unflatten
from odeform.models.training.descent import cosine_decay
from odeform.models.training.loss import Loss
from odeform.motion.reduced_space import POSE

__all__ = ["CHUNK", "Trainer"]

CHUNK = 64  # sequences rolled out at once where no gradients are needed


def _soap(weights: list[nn.Parameter], rate: float) -> torch.optim.Optimizer:
    """Adam in the eigenbasis of Shampoo's preconditioner (Vyas et al. 2024). The loss of roll-outs is badly
    conditioned: SOAP takes hundreds of steps where Adam takes thousands."""
    from pytorch_optimizer import SOAP

    return SOAP(weights, lr=rate, weight_decay=1e-4)


class Trainer:
    """A network in training. Readouts of decoders are solved for in each step, everything else is descended in."""

    def __init__(
        self, net: ODeformNet, data: TrainingData, config: TrainConfig, device: torch.device, loss: Loss | None = None
    ) -> None:
        self.net, self.config, self.device, self.given_loss = net.to(device), config, device, loss
        self.metric = Metric(net.gains, data.space.gyration_radius)
        scales = net.gains.cpu().double().numpy()
        # frames first, as roll-outs have them
        self.truth = {
            k: torch.as_tensor(v / scales).float().transpose(0, 1).contiguous().to(device)
            for k, v in data.reduced.items()
        }
        train, val = (torch.as_tensor(data.observed[split]).T.contiguous().to(device) for split in ("train", "val"))
        self.observed = {"train": torch.where(train, 1.0, FILLED_WEIGHT), "val": val.float()}
        self.theta = {k: torch.as_tensor(v).float().to(device) for k, v in data.theta.items()}
        self.times = torch.as_tensor(data.times).float().to(device)
        self.visible, self.counted = (
            torch.as_tensor(v.T.copy()).to(device) for v in observed_frames(data.observed["train"])
        )
        # a solve costs as much as a roll-out, and every other frame of whole motions is as good as all; where fewer
        # frames are observed, the solve uses all of them, and a batch has more motions
        whole, few = len(self.times), len(self.visible)
        self.stride = 2 if 2 * few > whole else 1
        self.batch = max(config.batch, config.batch * whole // (2 * few))
        frame = float(data.times[1] - data.times[0])
        self.frame, self.substeps = frame, max(1, math.ceil(frame / config.longest - 1e-9))
        self.identity = data.identity
        points, areas = training_shape(data)
        self.shape = points.to(device), areas.to(device)
        self.frames = len(self.truth["train"]) - 1
        self.generator = torch.Generator().manual_seed(config.seed)
        for decoder in net.decoders:
            decoder.readout.requires_grad_(False)  # solved for
        self.weights = [w for w in net.parameters() if w.requires_grad]
        self.optimiser = _soap(self.weights, config.rate)
        self.outputs = [slice(0, POSE), slice(POSE, None)] if net.config.rigid else [slice(POSE, None)]
        self.done = 0
        self.elapsed = 0.0

    def states(self, theta: torch.Tensor, counts: list[int]) -> torch.Tensor:
        """(F + 1, B, state) at the start and after each frame, which is integrated in `counts` steps."""
        start = self.net.encode(self.shape, theta)
        steps = [self.frame / count for count in counts for _ in range(count)]
        return self.net.roll_out(start, theta, steps)[np.cumsum([0, *counts])]

    def draw_counts(self, frames: int) -> list[int]:
        """Steps for each frame, at random one more for some, so that the error of the steps cannot be exploited.

        Otherwise descent finds fields that fit the data at one step size and are ten times worse at another.
        """
        more = torch.randint(0, 2, (frames,), generator=self.generator)
        return (self.substeps + more).tolist()

    def loss(self, rows: torch.Tensor, frames: int) -> torch.Tensor:
        """The loss of a batch of sequences over the first `frames`, after its readout has been solved for."""
        theta = self.theta["train"][rows]
        early = self.visible[:, rows] <= frames
        some = early.any(dim=1)
        visible, weights = self.visible[some][:, rows].clamp(max=frames), (early & self.counted[:, rows])[some].float()
        motions = torch.arange(len(rows), device=self.device)
        truth = self.truth["train"][visible, rows]
        states = self.states(theta, self.draw_counts(frames))[visible, motions]
        conditions = self.net.conditions(self.times[: frames + 1], theta)[visible, motions]
        predicted = [states.new_zeros(*states.shape[:-1], POSE)] if not self.net.config.rigid else []
        for decoder, state, out in zip(self.net.decoders, self.net.config.states, self.outputs, strict=True):
            features = decoder.features(states[..., state], conditions)
            readout = NormalEquations()
            part = slice(None, None, self.stride)
            readout.add(features.detach()[part], truth[part][..., out], weights[part])
            decoder.readout.weight.data = readout.solve(self.config.ridge).to(features.dtype)
            predicted.append(decoder.readout(features))
        compared = torch.cat(predicted, dim=-1)[1:], truth[1:], weights[1:]
        if self.given_loss is not None:
            guessed, known = (1e-3 * self.metric.scale * y for y in compared[:2])
            return self.given_loss(guessed, known, compared[2])
        return balanced(*self.metric(*compared)[-len(self.outputs) :])

    def advance(self, fraction: float) -> None:
        """One step of descent, at this fraction of the training."""
        config = self.config
        start, grown = config.horizon
        frames = min(self.frames, round(self.frames * (start + (1.0 - start) * fraction / grown)))
        warm = min(1.0, (self.done + 1) / 20.0)
        self.optimiser.param_groups[0]["lr"] = warm * config.rate * cosine_decay(fraction)
        rows = torch.randperm(len(self.theta["train"]), generator=self.generator)[: self.batch]
        self.optimiser.zero_grad()
        self.loss(rows.to(self.device), max(frames, 2)).backward()
        norm = nn.utils.clip_grad_norm_(self.weights, 1.0)
        if torch.isfinite(norm):
            self.optimiser.step()
        self.done += 1

    @torch.no_grad()
    def paths(self, split: str) -> torch.Tensor:
        """States (2 T + 1, B, state) of all sequences, at frames and halfway between, with fine steps."""
        count = self.config.refine * self.substeps
        steps = [self.frame / 2.0 / count] * (2 * self.frames * count)
        chunks = self.theta[split].split(CHUNK)
        states = [self.net.roll_out(self.net.encode(self.shape, theta), theta, steps)[::count] for theta in chunks]
        return torch.cat(states, dim=1)

    @torch.no_grad()
    def solve_readout(self, ridge: float) -> None:
        """Solve for the readouts over all training sequences."""
        states, conditions = self.paths("train")[::2], self.net.conditions(self.times, self.theta["train"])
        for decoder, state, out in zip(self.net.decoders, self.net.config.states, self.outputs, strict=True):
            equations = NormalEquations()
            for rows in torch.arange(states.shape[1]).split(CHUNK):
                features = decoder.features(states[:, rows][..., state], conditions[:, rows])
                equations.add(features, self.truth["train"][:, rows][..., out], self.observed["train"][:, rows])
            decoder.readout.weight.data = equations.solve(ridge).to(decoder.readout.weight.dtype)

    @torch.no_grad()
    def errors_mm(self, split: str) -> tuple[float, float]:
        """Returns the pooled RMSE over coordinates, in mm: of the rigid part and of the deformation."""
        predicted = self.net.decode(self.paths(split)[::2], self.times, self.theta[split])
        residual = self.metric(predicted[1:], self.truth[split][1:], self.observed[split][1:])
        rigid, local = (torch.stack(residual) / 3.0).sqrt().tolist()
        return rigid, local

    def double(self) -> None:
        """Continue in double precision."""
        self.net.double()
        self.metric.double()
        self.truth, self.observed, self.theta = (
            {k: v.double() for k, v in x.items()} for x in (self.truth, self.observed, self.theta)
        )
        self.shape = self.shape[0].double(), self.shape[1].double()
        self.times = self.times.double()

    def _fingerprint(self) -> dict[str, Any]:
        """Lists what must be the same for a training to be resumed."""
        config = {k: v for k, v in asdict(self.config).items() if k not in FREE}
        network = {k: v for k, v in asdict(self.net.config).items() if k not in FREE}
        return {"data": self.identity, "network": network, "config": config}

    def save(self, path: Path) -> None:
        """Write the state, from which `restore` continues bit-exactly."""
        tensors = {f"net.{name}": value for name, value in self.net.state_dict().items()}
        optimiser = flatten(self.optimiser.state_dict(), tensors, "optimiser")
        tensors["generator"] = self.generator.get_state()
        meta = {**self._fingerprint(), "done": self.done, "elapsed": self.elapsed, "optimiser": optimiser}
        tensors = {name: value.contiguous() for name, value in tensors.items()}
        atomic_write(path, save(tensors, {"training": json.dumps(meta)}))

    def restore(self, path: Path) -> None:
        """Continue from a saved state; `InputError` where it is missing, damaged or of another training."""
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"--resume: {path}: {error.strerror}; expected an interrupted training") from None
        try:
            tensors = load(data)
            meta: dict[str, Any] = json.loads(safetensors_metadata(data)["training"])
            for part, expected in json.loads(json.dumps(self._fingerprint())).items():
                if meta[part] != expected:
                    raise InputError(
                        f"--resume: {path}: state of another training: expected {part} {expected}, got {meta[part]}"
                    )
            weights = {k.removeprefix("net."): v for k, v in tensors.items() if k.startswith("net.")}
            self.net.load_state_dict(weights)
            optimiser = unflatten(meta["optimiser"], tensors)
            optimiser["state"] = {int(index): state for index, state in optimiser["state"].items()}
            self.optimiser.load_state_dict(optimiser)
            self.generator.set_state(tensors["generator"])
            self.done, self.elapsed = int(meta["done"]), float(meta["elapsed"])
        except InputError:
            raise
        except (SafetensorError, KeyError, ValueError, TypeError, RuntimeError) as error:
            raise InputError(f"--resume: {path}: not a state of this training: {error}") from None
