"""What comes after descent: random features for each decoder, and the readout of all in double precision.

The large weights of a solve over many features cancel: single precision would leave its rounding. Features that bend
sharply enough for a contact can do as they like between frames, so the solve also sees, with a small weight, the cubic
spline through the truth halfway between them.
"""

import copy

import torch
from scipy.interpolate import CubicSpline

from odeform.model.reduced import POSE
from odeform.training.readout import NormalEquations, random_layer
from odeform.training.trainer import CHUNK, Trainer

__all__ = ["widen"]


def _halves(truth: torch.Tensor) -> torch.Tensor:
    """(T + 1, B, outputs) at the frames -> (2 T + 1, B, outputs), halfway between them by a cubic spline."""
    frames = torch.arange(len(truth), dtype=torch.float64)
    between = CubicSpline(frames, truth.cpu().numpy())(frames[:-1] + 0.5)
    all_of = truth.repeat_interleave(2, dim=0)[:-1].clone()
    all_of[1::2] = torch.as_tensor(between)
    return all_of


def _weights(truth: torch.Tensor, between: float, deformed: float) -> torch.Tensor:
    """(2 T + 1, B) of the truth in mm, (2 T + 1, B, 6 + K)."""
    size = truth[..., POSE:].square().sum(dim=-1).sqrt()
    weights = torch.where(size > 0.1 * size.amax(dim=0), deformed, 1.0).to(truth)
    weights[1::2] *= between
    return weights


@torch.no_grad()
def widen(trainer: Trainer) -> None:
    """Add the random features that leave least of the validation sequences; solve for the readout.

    The network is in double precision afterwards.
    """
    trainer.double()
    net, config = trainer.net, trainer.config
    net.widen(config.random_features)
    states = {split: trainer.paths(split) for split in ("train", "val")}
    truth = {split: _halves(trainer.truth[split]) for split in states}
    times = trainer.frame / 2.0 * torch.arange(len(truth["val"]), device=trainer.device)
    told = {split: net.told(times, trainer.theta[split]) for split in states}
    rows = torch.arange(len(trainer.theta["train"])).split(CHUNK)
    for branch, decoder, place, out in zip(net.config.branches, net.decoders, net.places, trainer.outputs, strict=True):
        deformed = config.deformed if branch == "local" else 1.0
        weights = {split: _weights(truth[split] * trainer.metric.scale, config.between, deformed) for split in truth}
        assert decoder.random is not None
        seen = [decoder.seen(states["train"][::2, r][..., place], told["train"][::2, r]).flatten(0, 1) for r in rows]
        best, kept = float("inf"), decoder.state_dict()
        for sharpness in config.sharpnesses:
            generator = torch.Generator(trainer.device).manual_seed(config.seed)
            sizes = net.config.parameters, net.config.components, config.random_features
            decoder.random.load_state_dict(random_layer(seen, *sizes, sharpness, generator))
            equations = NormalEquations()
            for r in rows:
                features = decoder.features(states["train"][:, r][..., place], told["train"][:, r])
                equations.add(features, truth["train"][:, r][..., out], weights["train"][:, r])
            held_out = decoder.features(states["val"][..., place], told["val"])
            for ridge in config.ridges:
                decoder.readout.weight.data = equations.solve(ridge)
                missed = (decoder.readout(held_out) - truth["val"][..., out]) * trainer.metric.scale[out]
                error = float((weights["val"][..., None] * missed**2).sum())
                if error < best:
                    best, kept = error, copy.deepcopy(decoder.state_dict())
        decoder.load_state_dict(kept)
