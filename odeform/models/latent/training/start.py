"""The network before the first training step."""

import numpy as np
import torch
from torch import nn

from odeform.dataset.training_data import TrainingData
from odeform.models.latent.config import ModelConfig
from odeform.models.latent.network import ODeformNet
from odeform.motion.reduced_space import POSE

__all__ = ["build_network", "training_shape"]

CLOCK_SLOPES = (3.0, 30.0)  # of features of the clock, at first: contacts are short, and descent sharpens slowly


def build_network(data: TrainingData, seed: int) -> ODeformNet:
    """Builds a network, whitened by the training data alone."""
    torch.manual_seed(seed)
    train = data.reduced["train"]
    config = ModelConfig(parameters=data.theta["train"].shape[1], modes=train.shape[-1] - POSE)
    net = ODeformNet(config)
    spread = np.sqrt((train**2).mean(axis=(0, 1)))
    scales = np.concatenate(
        [np.full(3, np.linalg.norm(spread[:3])), np.full(3, np.linalg.norm(spread[3:6])), spread[6:]]
    )
    # what does not move, such as the rotation of a ball that falls straight, is not scaled up to one
    floor = 1e-3 * scales[:3].max() / np.repeat([1.0, data.space.gyration_radius, 1.0], [3, 3, len(scales) - POSE])
    floor[POSE:] = 1e-9
    net.gains.copy_(torch.as_tensor(np.maximum(scales, floor)))
    # a field of order one should cross the latent space in a few frames, not in a second
    net.time_scale.fill_(0.05)
    for decoder in net.decoders:
        for layer in decoder.hidden:
            if isinstance(layer, nn.Linear):
                # features must differ before a readout can use them
                layer.weight.data *= 2.0
                nn.init.uniform_(layer.bias, -1.0, 1.0)
        first = decoder.hidden[0]
        assert isinstance(first, nn.Linear)
        (low, high), count = CLOCK_SLOPES, first.out_features
        sharp = low * (high / low) ** torch.rand(count) * torch.randn(count)
        first.weight.data[:, -1 - config.parameters] = sharp
        first.bias.data -= sharp * (2.0 * torch.rand(count) - 1.0)
    shape = training_shape(data)
    for encoder in net.encoders:
        encoder.standardise([shape])
    return net


def training_shape(data: TrainingData) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns the points (N, 3) in units of the radius of gyration, and their weights (N,)."""
    return torch.as_tensor(data.rest / data.space.gyration_radius).float(), torch.as_tensor(data.weights).float()
