"""The training of how a rolling body is deformed, given its motion: gradient descent on single frames."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import nn

from odeform.models.rolling.readout import SIZE, Readout
from odeform.models.training.descent import cosine_decay, small_batches
from odeform.types import Floats

__all__ = ["ReadoutRows", "fit_readout"]

EPOCHS, FEWEST, BATCH = 90, 400, 512
CONSTANT = 1e-6  # standard deviation below which an input says nothing
RATE, WARM, DECAY = 4e-3, 0.1, 1e-3


@dataclass(frozen=True, eq=False)
class ReadoutRows:
    """One row for each frame of each training motion."""

    inputs: Float[np.ndarray, "rows inputs"]
    patterns: Float[np.ndarray, "rows patterns"]
    """Values that they are to become."""
    weights: Float[np.ndarray, " rows"]


def fit_readout(rows: ReadoutRows, seed: int, fraction: float = 1.0) -> Readout:
    """The network after a training whose length follows from the number of rows: `fraction` of it."""
    mean, scale = rows.inputs.mean(axis=0), rows.inputs.std(axis=0)
    scale[scale < CONSTANT] = 1.0
    size = max(float(rows.patterns.std()), 1e-12)
    inputs, patterns, weights = (
        torch.as_tensor(a, dtype=torch.float32)
        for a in ((rows.inputs - mean) / scale, rows.patterns / size, rows.weights)
    )
    torch.manual_seed(seed)
    layers = [nn.Linear(inputs.shape[1], SIZE), nn.Linear(SIZE, SIZE), nn.Linear(SIZE, patterns.shape[1])]
    network = nn.Sequential(layers[0], nn.SiLU(), layers[1], nn.SiLU(), layers[2])
    optimiser = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=DECAY)
    steps = max(round(fraction * EPOCHS * len(inputs) / BATCH), FEWEST)
    with small_batches():
        for step in range(steps):
            done = step / steps
            optimiser.param_groups[0]["lr"] = RATE * min(1.0, (done + 1e-3) / WARM) * cosine_decay(done)
            some = torch.randint(len(inputs), (BATCH,))
            missed = (network(inputs[some]) - patterns[some]).square().sum(dim=1)
            optimiser.zero_grad()
            (weights[some] * missed).mean().backward()
            optimiser.step()
    (first, one), (middle, two), (last, three) = ((_numpy(of.weight).T, _numpy(of.bias)) for of in layers)
    return Readout(mean, scale, first, one, middle, two, size * last, size * three)


def _numpy(values: torch.Tensor) -> Floats:
    return values.detach().numpy()
