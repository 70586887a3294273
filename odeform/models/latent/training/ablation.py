"""Trainings of ODeform without one of its parts, to measure what that part gives."""

from collections.abc import Iterable

import torch
from torch import nn

from odeform.models.latent.network import ODeformNet

__all__ = ["ablate", "remove_ablated"]


def ablate(net: ODeformNet, without: Iterable[str]) -> None:
    """Train `net` without the fields, the clock or the parameters of decoders: their values count as zero."""
    left = set(without)
    net.flow.fill_(0.0 if "ode" in left else 1.0)
    net.visible_conditions[0] = 0.0 if "clock" in left else 1.0
    net.visible_conditions[1:] = 0.0 if "parameters" in left else 1.0


@torch.no_grad()
def remove_ablated(net: ODeformNet) -> None:
    """Set the weights of what was zero in training to zero: checkpoints then need no record of it."""
    for field in [net.rigid_field, net.local_field] if net.config.rigid else [net.local_field]:
        for weight in field[-1].parameters():
            weight.mul_(net.flow)
    count = len(net.visible_conditions)
    for decoder in net.decoders:
        for layers in (decoder.hidden, decoder.random):
            first = layers[0] if layers is not None else None
            if isinstance(first, nn.Linear):
                first.weight[:, -count:] *= net.visible_conditions
