"""One training of a network of points by descent: Adam, with the weights that are best on validation."""

import math
from abc import ABC, abstractmethod
from typing import Any

import torch

from odeform.models.layers import Sizes, layer_shapes
from odeform.models.points.arithmetic import Net
from odeform.models.points.training.torch_arithmetic import Torch
from odeform.models.training.descent import cosine_decay
from odeform.types import Arrays

__all__ = ["CLIP", "WARM", "PointLearner", "initial_weights"]

WARM = 0.03  # fraction of the length in which the learning rate rises
CLIP = 1.0  # norm of the gradient


def initial_weights(shapes: list[tuple[str, tuple[int, ...]]], seed: int) -> dict[str, torch.Tensor]:
    """Draws weights, uniform within 1 / sqrt(inputs of the layer), as `torch.nn.Linear` draws them."""
    generator, out = torch.Generator().manual_seed(seed), {}
    inputs = 1
    for name, shape in shapes:
        inputs = shape[1] if name.endswith("weight") else inputs
        out[name] = (2.0 * torch.rand(shape, generator=generator) - 1.0) / math.sqrt(inputs)
    return out


class PointLearner(ABC):
    """The weights of one network and their optimiser. A subclass knows the data."""

    def __init__(self, sizes: Sizes, rate: float, seed: int, device: torch.device) -> None:
        """`rate` is the learning rate after the warm-up."""
        self.rate = rate
        first = initial_weights(list(layer_shapes(sizes)), seed)
        self.weights = {name: weight.to(device).requires_grad_() for name, weight in first.items()}
        self.net = Net(self.weights, Torch())
        self.optimiser = torch.optim.Adam(self.weights.values(), lr=rate)
        self.generator = torch.Generator().manual_seed(seed + 1)
        self.best = (math.inf, self._snapshot())
        self.done, self.elapsed = 0, 0.0

    @abstractmethod
    def loss(self, fraction: float) -> torch.Tensor:
        """Returns the loss of a random draw of the training data, at this fraction of the length."""

    @abstractmethod
    def error(self) -> float:
        """Returns the pooled RMSE on validation in mm."""

    def _snapshot(self) -> Arrays:
        return {name: weight.detach().cpu().numpy().copy() for name, weight in self.weights.items()}

    def advance(self, fraction: float) -> float:
        """One step of descent at this fraction of the length; returns its loss."""
        warm_up = min(1.0, (fraction + 1e-3) / WARM)
        self.optimiser.param_groups[0]["lr"] = self.rate * warm_up * cosine_decay(fraction)
        self.optimiser.zero_grad()
        loss = self.loss(fraction)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(self.weights.values(), CLIP)
        if torch.isfinite(norm):
            self.optimiser.step()
        self.done += 1
        return float(loss.detach())

    @torch.no_grad()
    def validate(self) -> float:
        """Pooled RMSE in mm on validation; keeps the weights if they are the best so far."""
        error = self.error()
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
