"""Trains networks of points for several bodies at once: their weights are stacked, so that a GPU is not idle."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch

from odeform.models.layers import layer_shapes
from odeform.models.points.arithmetic import Net
from odeform.models.points.point_network import PointBatch, PointNet, Trial, sum_of
from odeform.models.points.training.fit import all_validated, parts_loss
from odeform.models.points.training.learner import CLIP, WARM, initial_weights
from odeform.models.points.training.point_data import PointData
from odeform.models.points.training.samplers import SAMPLERS, Sample, Sampler
from odeform.models.points.training.torch_arithmetic import Torch
from odeform.models.training.descent import cosine_decay
from odeform.types import Arrays

__all__ = ["Lane", "Stacked"]

MEMORY, SPREAD, LEAST = 0.9, 0.999, 1e-8  # of Adam, as in PyTorch

Tensors = dict[str, torch.Tensor]


@dataclass(frozen=True)
class Lane:
    """One of the networks: which body it is of, and with which trial's settings it is trained."""

    body: int
    trial: Trial


class Stacked:
    """One training of several networks of one width, each as `fit_points` trains it alone, to rounding.

    All draw the same random numbers, so that frames are the same for all. The step is recorded once for each count of
    frames, and replayed: its many small kernels would take longer to launch than to compute.
    """

    def __init__(
        self, network: PointNet, data: Sequence[PointData], lanes: Sequence[Lane], seed: int, device: torch.device
    ) -> None:
        """`data` are those of the bodies; all lanes have one width."""
        self.network, self.lanes, self.seed, self._device = network, tuple(lanes), seed, device
        self._bodies = sorted({lane.body for lane in lanes})
        sampler = SAMPLERS[network.sampling]
        self._train, self._val = (
            [sampler(network, data[body], split, device) for body in self._bodies] for split in ("train", "val")
        )
        self._order = torch.tensor([self._bodies.index(lane.body) for lane in lanes], device=device)
        self._scale_mm = np.array([1e3 * data[lane.body].frame.scale for lane in lanes])
        self._shapes = list(layer_shapes(network.sizes(data[0].theta["train"].shape[1], lanes[0].trial.width)))
        self._rates = torch.tensor([lane.trial.rate for lane in lanes], device=device)[:, None]
        self._finer = torch.tensor([self._train[i].finer for i in self._order.tolist()], device=device)
        self._graphs: dict[torch.Size, tuple[Tensors, torch.Tensor, torch.cuda.CUDAGraph]] = {}
        self._pool = torch.cuda.graph_pool_handle() if device.type == "cuda" else None
        numbers = sum(math.prod(shape) for _, shape in self._shapes)
        self._flat = torch.zeros(len(lanes), numbers, device=device).requires_grad_()
        self._flat.grad = torch.zeros_like(self._flat)
        self.restart()

    @torch.no_grad()
    def restart(self) -> None:
        """Begin again from the initial weights."""
        first = initial_weights(self._shapes, self.seed)
        self._flat.copy_(torch.cat([first[name].flatten() for name, _ in self._shapes]).expand_as(self._flat))
        self._first, self._second = torch.zeros_like(self._flat), torch.zeros_like(self._flat)
        self._generators = [torch.Generator().manual_seed(self.seed + 1) for _ in self._bodies]
        self.best = np.full(len(self.lanes), np.inf)
        self._kept = self._flat.detach().clone()
        self.done, self.elapsed = 0, 0.0

    def weights(self, lane: int) -> Arrays:
        """The best weights of a lane on validation, by name."""
        row = self._kept[lane].cpu()
        ends = np.cumsum([0, *(math.prod(shape) for _, shape in self._shapes)])
        return {
            name: row[a:b].reshape(shape).numpy()
            for (name, shape), (a, b) in zip(self._shapes, pairwise(ends), strict=True)
        }

    def advance(self, fraction: float) -> float:
        """One step of descent at this fraction of the length; returns the mean loss of the lanes."""
        draws = zip(self._train, self._generators, strict=True)
        losses = self._descend(self._inputs(self._train, [sampler.draw(fraction, rng) for sampler, rng in draws]))
        gradient = self._flat.grad
        assert gradient is not None
        self.done += 1
        with torch.no_grad():
            norm = gradient.norm(dim=1, keepdim=True)
            gradient.mul_(torch.clamp(CLIP / (norm + 1e-6), max=1.0))
            gradient.nan_to_num_(0.0, 0.0, 0.0)
            self._first.lerp_(gradient, 1.0 - MEMORY)
            self._second.mul_(SPREAD).addcmul_(gradient, gradient, value=1.0 - SPREAD)
            spread = (self._second / (1.0 - SPREAD**self.done)).sqrt_().add_(LEAST)
            length = min(1.0, (fraction + 1e-3) / WARM) * cosine_decay(fraction) / (1.0 - MEMORY**self.done)
            self._flat.sub_(length * self._rates * self._first / spread)
        return float(losses.mean())

    @torch.no_grad()
    def validate(self) -> float:
        """Pooled RMSE in mm on validation, the mean over lanes; keeps each lane's weights if they are its best."""
        samples = [all_validated(sampler) for sampler in self._val]
        inputs = self._inputs(self._val, samples)
        squares = torch.func.vmap(self._squares)(self._named(), inputs, self._finer)
        errors = self._scale_mm * squares.sqrt().double().cpu().numpy()
        better = torch.as_tensor(errors < self.best, device=self._device)
        self._kept = torch.where(better[:, None], self._flat.detach(), self._kept)
        self.best = np.fmin(self.best, errors)
        return float(errors.mean())

    def _inputs(self, samplers: Sequence[Sampler], samples: Sequence[Sample]) -> Tensors:
        """What the lanes learn from, (L, ...) each."""
        found = []
        for sampler, sample in zip(samplers, samples, strict=True):
            batch, truth, centre = sampler.batch(sample)
            weights = sampler.weights(sample)
            found.append((batch.x, batch.theta, batch.times, batch.begin, truth, centre, weights))
        names = ("x", "theta", "times", "begin", "truth", "centre", "weights")
        stacked = (torch.stack(each)[self._order] for each in zip(*found, strict=True))
        return dict(zip(names, stacked, strict=True))

    def _named(self) -> Tensors:
        parts = self._flat.split([math.prod(shape) for _, shape in self._shapes], dim=1)
        return {name: part.reshape(-1, *shape) for (name, shape), part in zip(self._shapes, parts, strict=True)}

    def _predicted(
        self, weights: Mapping[str, torch.Tensor], inputs: Tensors, finer: torch.Tensor
    ) -> list[torch.Tensor]:
        batch = PointBatch(inputs["x"], inputs["theta"], inputs["times"], inputs["begin"], finer)
        return self.network.predict(Net(weights, Torch()), batch)

    def _loss(self, weights: Mapping[str, torch.Tensor], inputs: Tensors, finer: torch.Tensor) -> torch.Tensor:
        parts = self._predicted(weights, inputs, finer)
        return parts_loss(parts, inputs["truth"], inputs["centre"], inputs["weights"], finer)

    def _squares(self, weights: Mapping[str, torch.Tensor], inputs: Tensors, finer: torch.Tensor) -> torch.Tensor:
        away = sum_of(self._predicted(weights, inputs, finer)) - inputs["truth"]
        return (inputs["weights"] * away.square()).mean()

    def _gradient(self, inputs: Tensors) -> torch.Tensor:
        """The losses (L,); their derivatives are in the weights' `grad`."""
        assert self._flat.grad is not None
        self._flat.grad.zero_()
        losses = torch.func.vmap(self._loss)(self._named(), inputs, self._finer)
        losses.sum().backward()
        return losses.detach()

    def _descend(self, inputs: Tensors) -> torch.Tensor:
        if self._pool is None:
            return self._gradient(inputs)
        shape = inputs["times"].shape
        if shape not in self._graphs:
            self._graphs[shape] = self._record(inputs)
        given, losses, graph = self._graphs[shape]
        for name, value in inputs.items():
            given[name].copy_(value)
        graph.replay()
        return losses

    def _record(self, inputs: Tensors) -> tuple[Tensors, torch.Tensor, torch.cuda.CUDAGraph]:
        given = {name: value.clone() for name, value in inputs.items()}
        stream = torch.cuda.Stream()
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):  # a first run allocates what cannot be allocated while recording
            self._gradient(given)
        torch.cuda.current_stream().wait_stream(stream)
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph, pool=self._pool):
            losses = self._gradient(given)
        return given, losses, graph
