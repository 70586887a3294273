"""Names and shapes of the linear layers of networks, as `torch.nn.Sequential` has them with activations between."""

import itertools
from collections.abc import Iterable, Mapping

import numpy as np

from odeform.types import Arrays, Floats

__all__ = ["Layers", "Sizes", "layer_shapes", "read_layers"]

Sizes = Mapping[str, list[int]]
"""Layer widths of each part of a network, inputs first, outputs last."""
Layers = list[tuple[Floats, Floats]]
"""Weight (outputs, inputs) and bias (outputs,) of each linear layer."""


def layer_shapes(sizes: Sizes) -> Iterable[tuple[str, tuple[int, ...]]]:
    """Names and shapes of all weights of a network: PART.LAYER.weight and PART.LAYER.bias, for even layers."""
    for part, widths in sizes.items():
        for layer, (before, after) in enumerate(itertools.pairwise(widths)):
            yield f"{part}.{2 * layer}.weight", (after, before)
            yield f"{part}.{2 * layer}.bias", (after,)


def read_layers(weights: Arrays, part: str, dtype: type) -> Layers:
    """Weights (M, N) and biases (M,) of a part's layers, N inputs to M outputs, in order; empty if there are none.

    Weights are column-major: the faster order for matrix-vector products.
    """
    out = []
    index = 0
    while f"{part}.{index}.weight" in weights:
        matrix = np.asfortranarray(weights[f"{part}.{index}.weight"].astype(dtype))
        out.append((matrix, weights[f"{part}.{index}.bias"].astype(dtype)))
        index += 2
    return out
