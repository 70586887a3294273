"""Fast inference of the ODeform network for one object: numpy, a small state, no autograd.

At batch size one a field evaluation is a handful of small matrix-vector products, where the dispatch of a framework
costs more than the arithmetic. `network.py` is the same network for training; a test compares the two.
"""

from collections.abc import Callable

import numpy as np

from odeform.models.latent.config import ModelConfig
from odeform.models.latent.weights import branch_decoders, encoder_statistics, field_layers
from odeform.models.layers import Layers, read_layers
from odeform.motion.reduced_space import POSE
from odeform.solver.method import Field
from odeform.solver.runge_kutta import gemv
from odeform.types import Arrays, Floats

__all__ = [
    "Decoder",
    "Encoder",
    "Field",
    "make_decoder",
    "make_encoder",
    "make_field",
    "pool_shape",
]

Encoder = Callable[[list[Floats], Floats, type], Floats]
"""Pooled shape features of each branch, theta (P,) in [-1, 1] and the precision -> the state at time 0."""
Decoder = Callable[[Floats, Floats], Floats]
"""(T,) seconds, (T, state) -> (T, 6 + K) in metres and radians, not yet relative to the start."""


def _silu(x: Floats) -> Floats:
    # the logistic function by tanh: twice as fast as by exp, and nothing overflows
    return x * (0.5 + 0.5 * np.tanh(0.5 * x))


def _identity(x: Floats) -> Floats:
    return x


def _mlp(layers: Layers, x: Floats, activation: Callable[[Floats], Floats]) -> Floats:
    """x (..., inputs) -> (..., outputs)."""
    for matrix, bias in layers[:-1]:
        x = activation(x @ matrix.T + bias)
    matrix, bias = layers[-1]
    return x @ matrix.T + bias


def pool_shape(weights: Arrays, config: ModelConfig, points: Floats, areas: Floats) -> list[Floats]:
    """Pools the features of a shape for each branch: points (N, 3) in units of the radius of gyration, areas (N,) as
    fractions of the whole.

    They stay zero where no feature counts, as in a model trained on one shape: a million points take seconds.
    """

    def pooled(branch: str) -> Floats:
        scale = weights[f"{branch}_encoder.pooled_gain"]
        if not scale.any():
            return np.zeros(len(scale))
        return areas @ _mlp(read_layers(weights, f"{branch}_encoder.points", np.float64), points, _silu)

    return [pooled(branch) for branch in config.branches]


def make_encoder(weights: Arrays, config: ModelConfig) -> Encoder:
    """Makes the encoder of all branches: features (C,) of each branch and theta (P,) -> the state (L,) at time 0. Of
    many motions: (B, C) and (B, P) -> (B, L)."""
    statistics = encoder_statistics(weights, config)
    heads = [read_layers(weights, f"{branch}_encoder.head", np.float64) for branch in config.branches]

    def encode(pooled: list[Floats], theta: Floats, dtype: type) -> Floats:
        parts = [
            _mlp(head, np.concatenate([(features - mean) * scale, theta], axis=-1), _silu)
            for head, features, (mean, scale) in zip(heads, pooled, statistics, strict=True)
        ]
        return np.concatenate(parts, axis=-1).astype(dtype)

    return encode


def make_field(weights: Arrays, config: ModelConfig, dtype: type) -> Callable[[Floats], Field]:
    """theta (P,) -> the field dz/dt = f(z). Matrices are laid out once; new parameters only change a bias."""
    layers = field_layers(weights, config)
    first, middle, last = (np.asfortranarray(m.astype(dtype)) for m in (layers.first, layers.middle, layers.last))
    middle_bias, last_bias = (bias.astype(dtype) for bias in layers.biases[1:])
    product, tanh = gemv(first.dtype), np.tanh

    def fold(theta: Floats) -> Field:
        first_bias = (layers.biases[0] + layers.conditioning @ theta).astype(dtype)

        # unrolled: a call takes a few microseconds, a tenth of which a loop adds
        def field(_: float, state: Floats) -> Floats:
            x = product(1.0, first, state, 1.0, first_bias)
            x = product(1.0, middle, tanh(x, x), 1.0, middle_bias)
            return product(1.0, last, tanh(x, x), 1.0, last_bias)

        return field

    return fold


def make_decoder(weights: Arrays, config: ModelConfig) -> Callable[[Floats], Decoder]:
    """theta (P,) -> the decoder of both branches, in double precision. With (T, P), each of T states has its own."""
    output_scales = weights["gains"].astype(float)
    branches = branch_decoders(weights, config)

    def fold(theta: Floats) -> Decoder:
        folded = [[_folded(network, theta) for network in branch.networks] for branch in branches]

        def decode(times: Floats, states: Floats) -> Floats:
            clock, out = (2.0 * times / (times + config.clock) - 1.0)[:, None], []
            for branch, networks in zip(branches, folded, strict=True):
                features = states[:, branch.state]
                for index, network in enumerate(networks):
                    inputs = np.concatenate([features, clock], axis=1)
                    # between the two layers of random features there is no activation
                    outputs = _silu(_mlp(network, inputs, _silu if index == 0 else _identity))
                    features = np.concatenate([features, outputs], axis=1)
                out.append(features @ branch.readout.T)
            if not config.rigid:
                out.insert(0, np.zeros((len(states), POSE)))
            return np.concatenate(out, axis=1) * output_scales

        return decode

    return fold


def _folded(layers: Layers, theta: Floats) -> Layers:
    """The same layers without their last inputs, the parameters, which go into a bias."""
    (first, bias), *others = layers
    inputs = first.shape[1] - theta.shape[-1]
    return [(first[:, :inputs], bias + theta @ first[:, inputs:].T), *others]
