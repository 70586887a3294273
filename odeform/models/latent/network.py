"""The ODeform network (paper, Section III) in whitened reduced coordinates, for training and encoding.

Two encoders of P0 and theta, two neural ODEs, of which the local one depends on the global state, and two decoders.
There is one state per object, for any number of points.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import nn

from odeform.models.latent.config import ModelConfig
from odeform.models.latent.rollout import Branch, roll_out
from odeform.motion.reduced_space import POSE

__all__ = ["Decoder", "ODeformNet", "ShapeEncoder"]


def mlp(sizes: list[int], activation: type[nn.Module]) -> nn.Sequential:
    """Builds linear layers of these widths with the activation between them."""
    layers: list[nn.Module] = []
    for before, after in itertools.pairwise(sizes):
        layers += [nn.Linear(before, after), activation()]
    return nn.Sequential(*layers[:-1])


class ShapeEncoder(nn.Module):
    """E(P0, theta): five layers, two on each point, three after pooling (paper eq. 5).

    Points are pooled by an area-weighted mean, so neither their order nor their density matters. Pooled features are
    standardised over the training shapes; what does not vary among them carries no information and is dropped.
    """

    pooled_mean: torch.Tensor
    pooled_gain: torch.Tensor

    def __init__(self, sizes: dict[str, list[int]]) -> None:
        super().__init__()
        self.points = mlp(sizes["encoder.points"], nn.SiLU)
        self.head = mlp(sizes["encoder.head"], nn.SiLU)
        self.register_buffer("pooled_mean", torch.zeros(sizes["encoder.points"][-1]))
        self.register_buffer("pooled_gain", torch.zeros(sizes["encoder.points"][-1]))

    def pool(self, points: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
        """Maps (N, 3) points in units of the radius of gyration and (N,) weights summing to 1 to (width,)."""
        return weights @ self.points(points)

    @torch.no_grad()
    def standardise(self, shapes: list[tuple[torch.Tensor, torch.Tensor]]) -> None:
        """Set the standardisation from the training shapes."""
        pooled = torch.stack([self.pool(points, weights) for points, weights in shapes])
        spread = pooled.std(dim=0, correction=0)
        self.pooled_mean.copy_(pooled.mean(dim=0))
        # discretisations of one body differ by about 1e-3, which does not make them different shapes
        self.pooled_gain.copy_(torch.where(spread > 1e-2, 1.0 / spread.clamp_min(1e-12), 0.0))

    def forward(self, pooled: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        """Maps (B, width) pooled features and (B, P) parameters in [-1, 1] to (B, latent)."""
        features = (pooled - self.pooled_mean) * self.pooled_gain
        return self.head(torch.cat([features, theta], dim=-1))


class Decoder(nn.Module):
    """Features of a state, and their linear readout, which training solves for rather than descends to.

    It is conditioned on the time and the parameters as well: a smooth autonomous field leaves a contact of a few
    milliseconds and the second of flight after it in states that smooth features cannot tell apart; a clock can.
    Features are relative to those at the start, so that y(0) = 0 exactly and no bias is needed. Random features of all
    these inputs, if there are any, are drawn once the rest is trained (Rahimi & Recht 2008).
    """

    def __init__(self, sizes: dict[str, list[int]]) -> None:
        super().__init__()
        layers = [
            layer
            for before, after in itertools.pairwise(sizes["decoder.hidden"])
            for layer in (nn.Linear(before, after), nn.SiLU())
        ]
        self.hidden = nn.Sequential(*layers)
        self.random = mlp(sizes["decoder.random"], nn.Identity) if sizes["decoder.random"][-1] else None
        self.readout = nn.Linear(*sizes["decoder.readout"], bias=False)

    def features(self, states: torch.Tensor, conditions: torch.Tensor) -> torch.Tensor:
        """Maps (T, B, latent), (T, B, 1 + P) to (T, B, F), relative to the first of the T."""
        inputs = self.random_inputs(states, conditions)
        features = inputs[..., : -conditions.shape[-1]]
        if self.random is not None:
            features = torch.cat([features, nn.functional.silu(self.random(inputs))], dim=-1)
        return features - features[:1]

    def random_inputs(self, states: torch.Tensor, conditions: torch.Tensor) -> torch.Tensor:
        """Draws the inputs of random features, (T, B, latent + width + 1 + P): the state, its trained features, and the
        conditions."""
        return torch.cat([states, self.hidden(torch.cat([states, conditions], dim=-1)), conditions], dim=-1)


class ODeformNet(nn.Module):
    """Encoders (theta, P0) -> state(0), fields state -> slope, decoders states -> y in whitened units.

    The fields end in a linear layer on tanh units: their values are bounded, so states grow at most linearly in time.
    `gains` (y,) turn whitened outputs into metres and radians; `time_scale` is the field's unit of time in seconds.
    """

    gains: torch.Tensor
    time_scale: torch.Tensor
    flow: torch.Tensor
    visible_conditions: torch.Tensor

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        if config.rigid:
            sizes = config.sizes("rigid")
            self.rigid_encoder = ShapeEncoder(sizes)
            self.rigid_field = mlp(sizes["field"], nn.Tanh)
            self.rigid_decoder = Decoder(sizes)
        sizes = config.sizes("local")
        self.local_encoder = ShapeEncoder(sizes)
        self.local_field = mlp(sizes["field"], nn.Tanh)
        self.local_decoder = Decoder(sizes)
        self.register_buffer("gains", torch.ones(POSE + config.modes))
        self.register_buffer("time_scale", torch.ones(()))
        # factors of the fields and of the conditions of decoders, which an ablation sets to zero
        self.register_buffer("flow", torch.ones(()), persistent=False)
        self.register_buffer("visible_conditions", torch.ones(1 + config.parameters), persistent=False)

    def widen(self, count: int) -> None:
        """Make room for `count` random features in each decoder, in place."""
        self.config = replace(self.config, random_features=count)
        for branch, decoder in zip(self.config.branches, self.decoders, strict=True):
            like = decoder.readout.weight
            wider = Decoder(self.config.sizes(branch)).to(like)
            wider.hidden.load_state_dict(decoder.hidden.state_dict())
            setattr(self, f"{branch}_decoder", wider)

    @property
    def encoders(self) -> list[ShapeEncoder]:
        """Shape encoders, in the order of `ModelConfig.branches`."""
        return ([self.rigid_encoder] if self.config.rigid else []) + [self.local_encoder]

    @property
    def decoders(self) -> list[Decoder]:
        """Decoders, in the order of `ModelConfig.branches`."""
        return ([self.rigid_decoder] if self.config.rigid else []) + [self.local_decoder]

    def encode(self, shape: tuple[torch.Tensor, torch.Tensor], theta: torch.Tensor) -> torch.Tensor:
        """Maps one shape (points (N, 3), weights (N,)) and (B, P) parameters to (B, state)."""
        return torch.cat(
            [e(e.pool(*shape).expand(len(theta), -1), theta) for e in self.encoders],
            dim=-1,
        )

    def roll_out(self, start: torch.Tensor, theta: torch.Tensor, steps: Sequence[float]) -> torch.Tensor:
        """States (T + 1, B, state) after RK4 steps of these lengths in seconds. The local field depends on the global
        state (paper, III-C); parameters enter as a bias."""
        fields = [self.rigid_field, self.local_field] if self.config.rigid else [self.local_field]
        branches = []
        for field, state in zip(fields, self.config.states, strict=True):
            first, second, last = (layer for layer in field if isinstance(layer, nn.Linear))
            inputs = first.in_features - self.config.parameters
            weight, bias = first.weight[:, :inputs], first.bias + theta @ first.weight[:, inputs:].T
            rate = self.flow / self.time_scale
            branches.append(
                Branch(inputs, state, weight, bias, second.weight, second.bias, last.weight * rate, last.bias * rate)
            )
        return roll_out(start, steps, branches)

    def conditions(self, times: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        """Maps (T,) seconds, (B, P) to (T, B, 1 + P): the clock and the parameters, for the decoders."""
        clock = 2.0 * times / (times + self.config.clock) - 1.0
        shape = len(times), len(theta), -1
        return self.visible_conditions * torch.cat([clock[:, None, None].expand(*shape), theta.expand(*shape)], dim=-1)

    def decode(self, states: torch.Tensor, times: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        """Maps (T, B, state) at (T,) seconds, (B, P) to (T, B, 6 + K) whitened, relative to the first of the T."""
        conditions = self.conditions(times, theta)
        out = [
            decoder.readout(decoder.features(states[..., part], conditions))
            for decoder, part in zip(self.decoders, self.config.states, strict=True)
        ]
        if not self.config.rigid:
            out.insert(0, states.new_zeros(*states.shape[:-1], POSE))
        return torch.cat(out, dim=-1)
