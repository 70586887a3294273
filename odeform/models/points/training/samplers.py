"""Draws the points, sequences and frames that a point network is trained and validated on: a sampler for each kind."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import torch

from odeform.dataset.subsampling import observed_frames
from odeform.dataset.training_data import FILLED_WEIGHT
from odeform.models.points.arithmetic import Net
from odeform.models.points.occupancy_flow import conditioning
from odeform.models.points.point_network import PointBatch, PointNet
from odeform.models.points.training.point_data import PointData
from odeform.models.points.training.torch_arithmetic import Torch

__all__ = ["SAMPLERS", "Sample", "Sampler"]

SEGMENT = 8  # frames of the first roll-outs
GROWN = 0.6  # fraction of training after which roll-outs span the whole window


@dataclass(frozen=True)
class Sample:
    """Sequences (B,) and points (B,) at frames (F, B), by index."""

    sequence: torch.Tensor
    point: torch.Tensor
    frames: torch.Tensor


class Sampler(ABC):
    """The motions of one split as tensors on a device, and how they are sampled for a network."""

    def __init__(self, network: PointNet, data: PointData, split: str, device: torch.device) -> None:
        self.network, self.device = network, device
        self.theta = torch.as_tensor(data.theta[split]).float().to(device)
        self.moved = torch.as_tensor(data.moved[split]).to(device)
        self.observed = torch.where(torch.as_tensor(data.observed[split]), 1.0, FILLED_WEIGHT).to(device)
        frames, counted = observed_frames(data.observed[split])
        self.visible, self.counts = torch.as_tensor(frames), torch.as_tensor(counted.sum(axis=1))
        self.x = torch.as_tensor(data.x).to(device)
        weights = torch.as_tensor(data.weights).float().to(device)
        self.centre = torch.einsum("n,stni->sti", weights, self.moved)
        self.finer = data.frame.part_scale / data.frame.scale
        self.given = data.given
        self.last = self.moved.shape[1] - 1

    @abstractmethod
    def draw_frames(self, fraction: float, generator: torch.Generator) -> torch.Tensor:
        """(F, B) random frames for a training step at this fraction of the training."""

    @abstractmethod
    def all_frames(self, sequence: torch.Tensor, point: torch.Tensor) -> Sample:
        """Returns every frame of the motions of points (B,) of sequences (B,), for validation."""

    def draw(self, fraction: float, generator: torch.Generator) -> Sample:
        """A random training step at this fraction of the training."""
        frames = self.draw_frames(fraction, generator)
        sequences, _, points, _ = self.moved.shape
        batch = frames.shape[1]
        sequence = _below(sequences, generator, batch)
        frames = self.to_visible(sequence, frames)
        return Sample(sequence, _below(points, generator, batch), frames)

    def to_visible(self, sequence: torch.Tensor, frames: torch.Tensor) -> torch.Tensor:
        """Returns the frames to train on in place of drawn ones: here the same."""
        return frames

    def batch(self, sample: Sample) -> tuple[PointBatch, torch.Tensor, torch.Tensor]:
        """Returns the inputs, and the true displacements (F, B, 3) of the points and of the body's centre."""
        sequence, point, frames = (index.to(self.device) for index in (sample.sequence, sample.point, sample.frames))
        truth, centre = self.moved[sequence, frames, point], self.centre[sequence, frames]
        return self.inputs(sequence, point, frames, truth), truth, centre

    def inputs(
        self, sequence: torch.Tensor, point: torch.Tensor, frames: torch.Tensor, truth: torch.Tensor
    ) -> PointBatch:
        """Network inputs for `frames` (F, B) of points (B,) of sequences (B,); `truth` (F, B, 3) are displacements."""
        times = frames.float() / self.last
        return PointBatch(self.x[point], self.theta[sequence], times, truth[0], self.finer)

    def weights(self, sample: Sample) -> torch.Tensor:
        """(F, B, 1) weights with mean one: frames that a spline filled in count for little."""
        weights = self.observed[sample.sequence.to(self.device), sample.frames.to(self.device)][..., None]
        return weights / weights.mean()


class Moments(Sampler):
    """Single frames."""

    def draw_frames(self, fraction: float, generator: torch.Generator) -> torch.Tensor:
        return 1 + _below(self.last, generator, 1, self.network.work)

    def to_visible(self, sequence: torch.Tensor, frames: torch.Tensor) -> torch.Tensor:
        # numbers from 1 on -> frames of that sequence that are observed and not the first
        return self.visible[sequence, 1 + (frames - 1) % (self.counts[sequence] - 1)]

    def all_frames(self, sequence: torch.Tensor, point: torch.Tensor) -> Sample:
        frames = torch.arange(1, self.last + 1)
        repeated = frames.repeat_interleave(len(sequence))[None]
        return Sample(sequence.repeat(self.last), point.repeat(self.last), repeated)


class Segments(Sampler):
    """Motions from a true state at any frame; they grow to the whole window in the course of training."""

    def draw_frames(self, fraction: float, generator: torch.Generator) -> torch.Tensor:
        length = self._length(fraction)
        ahead = self._ahead(fraction, length, generator)
        batch = max(self.network.work // len(ahead), 16)
        return ahead[:, None] + _below(self.last - length + 1, generator, 1, batch)

    def all_frames(self, sequence: torch.Tensor, point: torch.Tensor) -> Sample:
        return Sample(sequence, point, torch.arange(self.last + 1)[:, None].expand(-1, len(sequence)))

    def _length(self, fraction: float) -> int:
        return round(min(self.last, SEGMENT + (self.last - SEGMENT) * fraction / GROWN))

    def _ahead(self, fraction: float, length: int, generator: torch.Generator) -> torch.Tensor:
        strides = self.network.strides
        stride = strides[min(int(fraction * len(strides)), len(strides) - 1)]
        if stride == 1:
            return torch.arange(length + 1)
        # rest, the frame after it, and every stride-th frame from a random one on
        ahead = torch.arange(int(2 + _below(stride, generator, 1)), length + 1, stride)
        return torch.cat([torch.tensor([0, 1]), ahead])


class WholeMotions(Segments):
    """Motions from rest; they grow to the whole window in the course of training."""

    def draw_frames(self, fraction: float, generator: torch.Generator) -> torch.Tensor:
        ahead = self._ahead(fraction, self._length(fraction), generator)
        return ahead[:, None].expand(-1, max(self.network.work // len(ahead), 16))


class BetweenFrames(Sampler):
    """Motions between two neighbouring observed frames, which are the first and the last of a sample."""

    def draw_frames(self, fraction: float, generator: torch.Generator) -> torch.Tensor:
        batch = self.network.work // self.given
        return torch.arange(self.given + 1)[:, None] + _below(self.last - self.given + 1, generator, 1, batch)

    def all_frames(self, sequence: torch.Tensor, point: torch.Tensor) -> Sample:
        starts = torch.arange(0, self.last, self.given)
        frames = torch.arange(self.given + 1)[:, None] + starts.repeat_interleave(len(sequence))
        return Sample(sequence.repeat(len(starts)), point.repeat(len(starts)), frames)

    def inputs(
        self, sequence: torch.Tensor, point: torch.Tensor, frames: torch.Tensor, truth: torch.Tensor
    ) -> PointBatch:
        begin = frames[0]
        four = [self.moved[sequence, (begin + k * self.given).clamp(0, self.last), point] for k in (-1, 0, 1, 2)]
        length = torch.full_like(four[0][:, :1], self.given / self.last)
        times = (frames - begin).float() / self.given
        return PointBatch(self.x[point], conditioning(Net({}, Torch()), four, length), times, four[1], self.finer)


SAMPLERS: dict[str, type[Sampler]] = {
    "moments": Moments,
    "segments": Segments,
    "whole": WholeMotions,
    "between": BetweenFrames,
}
"""Samplers by `PointNet.sampling`."""


def _below(limit: int, generator: torch.Generator, *shape: int) -> torch.Tensor:
    return torch.randint(0, limit, shape, generator=generator)
