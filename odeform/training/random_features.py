"""What comes after descent: random features for each decoder, and the readout of all in double precision.

The large weights of a solve over many features cancel: single precision would leave its rounding. Features that bend
sharply enough for a contact can do as they like between frames, so the solve also sees, with a small weight, the cubic
spline through the truth halfway between them.
"""

import copy
import math
import time
from dataclasses import dataclass

import numpy as np
import torch
from scipy.interpolate import CubicSpline

from odeform.models.odeform.network import Decoder
from odeform.motion.reduced_space import POSE
from odeform.training.readout import NormalEquations, random_layer
from odeform.training.trainer import CHUNK, Trainer

__all__ = ["affordable", "widen"]

THIN = 5  # of moments, all but one of so many are left out where sharpness is chosen; odd: halves of frames take turns


def _halves(truth: torch.Tensor) -> torch.Tensor:
    """(T + 1, B, outputs) at the frames -> (2 T + 1, B, outputs), halfway between them by a cubic spline."""
    frames = torch.arange(len(truth), dtype=torch.float64)
    between = CubicSpline(frames, truth.cpu().numpy())(frames[:-1] + 0.5)
    all_of = truth.repeat_interleave(2, dim=0)[:-1].clone()
    all_of[1::2] = torch.as_tensor(between)
    return all_of


def _weights(truth: torch.Tensor, known: torch.Tensor, between: float, deformed: float) -> torch.Tensor:
    """(2 T + 1, B) of the truth in mm, (2 T + 1, B, 6 + K); of its frames, those `known` (T + 1, B)."""
    size = truth[..., POSE:].square().sum(dim=-1).sqrt()
    weights = torch.where(size > 0.1 * size.amax(dim=0), deformed, 1.0).to(truth)
    weights[::2] *= known
    weights[1::2] *= between * torch.minimum(known[:-1], known[1:])
    return weights


def affordable(trainer: Trainer, seconds: float) -> int:
    """How many random features can be solved for in so much processor time: products of features with themselves
    take nearly all of it."""
    config, net = trainer.config, trainer.net
    if trainer.device.type != "cpu":
        return config.random_features
    sample, begin = np.ones((2048, 2048)), time.process_time()
    for _ in range(3):
        np.matmul(sample.T, sample)
    unit = (time.process_time() - begin) / 3 / 2048**3
    rows = (2 * trainer.frames + 1) * len(trainer.theta["train"])
    passes = (1.0 + len(config.sharpnesses) / THIN) * len(net.decoders)
    features = math.sqrt(seconds / (unit * rows * passes))
    least = max(decoder.readout.in_features for decoder in net.decoders)
    return min(max(round(features - least), 1), config.random_features)


@dataclass(frozen=True)
class _DecoderFit:
    """What one decoder learns from, of each split, at frames and halfway between them: states (2 T + 1, B, latent),
    what it is told, outputs and their scale in mm, weights."""

    decoder: Decoder
    states: dict[str, torch.Tensor]
    told: dict[str, torch.Tensor]
    truth: dict[str, torch.Tensor]
    weights: dict[str, torch.Tensor]
    scale: torch.Tensor

    def seen(self, rows: list[torch.Tensor]) -> list[torch.Tensor]:
        """What random features are made of, at frames, for each of the chunks of sequences."""
        states, told = self.states["train"][::2], self.told["train"][::2]
        return [self.decoder.seen(states[:, r], told[:, r]).flatten(0, 1) for r in rows]


def _solve(
    lesson: _DecoderFit, layer: dict[str, torch.Tensor], ridges: tuple[float, ...], rows: list[torch.Tensor], thin: int
) -> tuple[float, dict[str, torch.Tensor]]:
    """The error on validation and the decoder of the best ridge, with these random features; learned from every so
    manyth moment."""
    decoder, equations = lesson.decoder, NormalEquations()
    assert decoder.random is not None
    decoder.random.load_state_dict(layer)
    states, told, truth, weights = (
        part["train"][::thin] for part in (lesson.states, lesson.told, lesson.truth, lesson.weights)
    )
    for r in rows:
        equations.add(decoder.features(states[:, r], told[:, r]), truth[:, r], weights[:, r])
    features, found = decoder.features(lesson.states["val"], lesson.told["val"]), []
    for ridge in ridges:
        decoder.readout.weight.data = equations.solve(ridge)
        missed = (decoder.readout(features) - lesson.truth["val"]) * lesson.scale
        error = float((lesson.weights["val"][..., None] * missed**2).sum())
        found.append((error, copy.deepcopy(decoder.state_dict())))
    return min(found, key=lambda one: one[0])


@torch.no_grad()
def widen(trainer: Trainer, count: int) -> None:
    """Add `count` random features to each decoder, those that leave least of the validation sequences; solve for the
    readout.

    The network is in double precision afterwards.
    """
    trainer.double()
    net, config, scale = trainer.net, trainer.config, trainer.metric.scale
    net.widen(count)
    states = {split: trainer.paths(split) for split in ("train", "val")}
    truth = {split: _halves(trainer.truth[split]) for split in states}
    times = trainer.frame / 2.0 * torch.arange(len(truth["val"]), device=trainer.device)
    told = {split: net.told(times, trainer.theta[split]) for split in states}
    rows = list(torch.arange(len(trainer.theta["train"])).split(CHUNK))
    for branch, decoder, place, out in zip(net.config.branches, net.decoders, net.places, trainer.outputs, strict=True):
        deformed = config.deformed if branch == "local" else 1.0
        lesson = _DecoderFit(
            decoder,
            {split: states[split][..., place] for split in states},
            told,
            {split: truth[split][..., out] for split in states},
            {
                split: _weights(truth[split] * scale, trainer.observed[split], config.between, deformed)
                for split in states
            },
            scale[out],
        )
        seen, layers = lesson.seen(rows), []
        for sharpness in config.sharpnesses:
            generator = torch.Generator(trainer.device).manual_seed(config.seed)
            sizes = net.config.parameters, net.config.components, count
            layers.append(random_layer(seen, *sizes, sharpness, generator))
        if len(layers) > 1:
            layers = [min(layers, key=lambda layer, of=lesson: _solve(of, layer, config.ridges, rows, THIN)[0])]
        decoder.load_state_dict(_solve(lesson, layers[0], config.ridges, rows, 1)[1])
