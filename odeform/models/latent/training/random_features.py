"""The end of a training: random features for each decoder, and a final readout in double precision.

The large weights of a solve over many features cancel, so single precision would leave rounding errors. Features that
are sharp enough for a contact are unconstrained between frames; the solve therefore also fits, with a small weight, the
cubic spline through the truth halfway between them.
"""

import copy
import math
import time
from dataclasses import dataclass

import numpy as np
import torch
from scipy.interpolate import CubicSpline

from odeform.models.latent.network import Decoder
from odeform.models.latent.training.readout import NormalEquations, random_layer
from odeform.models.latent.training.trainer import CHUNK, Trainer
from odeform.motion.reduced_space import POSE

__all__ = ["affordable", "widen"]

THIN = 5  # only every n-th time is used to choose the sharpness; odd, so that frames and halves alternate


def _halves(truth: torch.Tensor) -> torch.Tensor:
    """(T + 1, B, outputs) at the frames -> (2 T + 1, B, outputs), halfway between them by a cubic spline."""
    frames = torch.arange(len(truth), dtype=torch.float64)
    between = CubicSpline(frames, truth.cpu().numpy())(frames[:-1] + 0.5)
    all_of = truth.repeat_interleave(2, dim=0)[:-1].clone()
    all_of[1::2] = torch.as_tensor(between)
    return all_of


def _weights(truth: torch.Tensor, observed: torch.Tensor, between: float, deformed: float) -> torch.Tensor:
    """Weights (2 T + 1, B) from the truth in mm (2 T + 1, B, 6 + K) and the weights `observed` (T + 1, B) of frames."""
    size = truth[..., POSE:].square().sum(dim=-1).sqrt()
    weights = torch.where(size > 0.1 * size.amax(dim=0), deformed, 1.0).to(truth)
    weights[::2] *= observed
    weights[1::2] *= between * torch.minimum(observed[:-1], observed[1:])
    return weights


def affordable(trainer: Trainer, seconds: float) -> int:
    """How many random features can be solved for in `seconds` of processor time, nearly all of which goes into products
    of features with themselves."""
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
    """The data that one decoder is fitted to, by split, at frames and halfway between them: states
    (2 T + 1, B, latent), conditions, outputs and their scale in mm, weights."""

    decoder: Decoder
    states: dict[str, torch.Tensor]
    conditions: dict[str, torch.Tensor]
    truth: dict[str, torch.Tensor]
    weights: dict[str, torch.Tensor]
    scale: torch.Tensor

    def inputs(self, rows: list[torch.Tensor]) -> list[torch.Tensor]:
        """The inputs of random features, at frames, for each chunk of sequences."""
        states, conditions = self.states["train"][::2], self.conditions["train"][::2]
        return [self.decoder.random_inputs(states[:, r], conditions[:, r]).flatten(0, 1) for r in rows]


def _solve(
    fit: _DecoderFit, layer: dict[str, torch.Tensor], ridges: tuple[float, ...], rows: list[torch.Tensor], thin: int
) -> tuple[float, dict[str, torch.Tensor]]:
    """The validation error and the decoder of the best ridge, with these random features, fitted on every `thin`-th
    time."""
    decoder, equations = fit.decoder, NormalEquations()
    assert decoder.random is not None
    decoder.random.load_state_dict(layer)
    states, conditions, truth, weights = (
        part["train"][::thin] for part in (fit.states, fit.conditions, fit.truth, fit.weights)
    )
    for r in rows:
        equations.add(decoder.features(states[:, r], conditions[:, r]), truth[:, r], weights[:, r])
    features, found = decoder.features(fit.states["val"], fit.conditions["val"]), []
    for ridge in ridges:
        decoder.readout.weight.data = equations.solve(ridge)
        residual = (decoder.readout(features) - fit.truth["val"]) * fit.scale
        error = float((fit.weights["val"][..., None] * residual**2).sum())
        found.append((error, copy.deepcopy(decoder.state_dict())))
    return min(found, key=lambda one: one[0])


@torch.no_grad()
def widen(trainer: Trainer, count: int) -> None:
    """Add `count` random features to each decoder, of the sharpness with the smallest validation error, and solve for
    the readout. The network is in double precision afterwards.
    """
    trainer.double()
    net, config, scale = trainer.net, trainer.config, trainer.metric.scale
    net.widen(count)
    states = {split: trainer.paths(split) for split in ("train", "val")}
    truth = {split: _halves(trainer.truth[split]) for split in states}
    times = trainer.frame / 2.0 * torch.arange(len(truth["val"]), device=trainer.device)
    conditions = {split: net.conditions(times, trainer.theta[split]) for split in states}
    rows = list(torch.arange(len(trainer.theta["train"])).split(CHUNK))
    parts = zip(net.config.branches, net.decoders, net.config.states, trainer.outputs, strict=True)
    for branch, decoder, state, out in parts:
        deformed = config.deformed if branch == "local" else 1.0
        fit = _DecoderFit(
            decoder,
            {split: states[split][..., state] for split in states},
            conditions,
            {split: truth[split][..., out] for split in states},
            {
                split: _weights(truth[split] * scale, trainer.observed[split], config.between, deformed)
                for split in states
            },
            scale[out],
        )
        inputs, layers = fit.inputs(rows), []
        for sharpness in config.sharpnesses:
            generator = torch.Generator(trainer.device).manual_seed(config.seed)
            sizes = net.config.parameters, net.config.components, count
            layers.append(random_layer(inputs, *sizes, sharpness, generator))
        if len(layers) > 1:
            layers = [min(layers, key=lambda layer, fit=fit: _solve(fit, layer, config.ridges, rows, THIN)[0])]
        decoder.load_state_dict(_solve(fit, layers[0], config.ridges, rows, 1)[1])
