"""How a predicted motion changes with its parameters: exact derivatives, carried forward through the ODE.

For two to four parameters and a state of 64 numbers, forward sensitivities are the cheap direction: the variational
equations dS/dt = (df/dz) S + df/dtheta (Hairer, Norsett & Wanner, Solving ODEs I, I.14) are solved with the state, by
the same solver and step control, and a product with 1 + P columns costs hardly more than one with a single column.

A jet (1 + P, ..., n) holds values first and then their derivatives by each of P parameters.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.special import expit

from odeform.models.latent.config import ModelConfig
from odeform.models.latent.weights import branch_decoders, encoder_statistics, field_layers
from odeform.models.layers import Layers, read_layers
from odeform.motion.reduced_space import POSE
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.types import Arrays, Floats, Times

__all__ = ["Sensitivities", "make_sensitivities"]

Sensitivities = Callable[[list[Floats], Floats, SolverSettings, Times], Float[np.ndarray, "jet times y"]]


def _affine(layer: tuple[Floats, Floats], x: Floats) -> Floats:
    matrix, bias = layer
    out = x @ matrix.T
    out[0] += bias
    return out


def _silu(x: Floats) -> Floats:
    gate = expit(x[0])
    x[1:] *= gate * (1.0 + x[0] * (1.0 - gate))
    x[0] *= gate
    return x


def _tanh(x: Floats) -> Floats:
    np.tanh(x[0], out=x[0])
    x[1:] *= 1.0 - x[0] ** 2
    return x


def _mlp(layers: Layers, x: Floats, smooth: bool = True) -> Floats:
    """Layers with SiLU between them; with nothing between them unless `smooth`."""
    for layer in layers[:-1]:
        x = _affine(layer, x)
        x = _silu(x) if smooth else x
    return _affine(layers[-1], x)


def _parameter_jet(theta: Floats) -> Floats:
    """(P,) -> its jet (1 + P, P)."""
    return np.concatenate([theta[None], np.eye(len(theta))])


def _constant(values: Floats, like: Floats) -> Floats:
    """The jet of values that do not depend on the parameters."""
    out = np.zeros((len(like), *values.shape))
    out[0] = values
    return out


def _make_field(weights: Arrays, config: ModelConfig, dtype: type) -> Callable[[Floats], Field]:
    """jet of theta -> the field of jets of the state, flat."""
    layers = field_layers(weights, config)
    bias, *others = layers.biases
    matrices = [np.ascontiguousarray(m.T.astype(dtype)) for m in (layers.first, layers.middle, layers.last)]
    (first, middle, last), (second_bias, last_bias) = matrices, (other.astype(dtype) for other in others)

    def fold(theta: Floats) -> Field:
        conditions = _affine((layers.conditioning, bias), theta).astype(dtype)

        def field(_: float, flat: Floats) -> Floats:
            x = _tanh(flat.reshape(len(theta), -1) @ first + conditions) @ middle
            x[0] += second_bias
            out = _tanh(x) @ last
            out[0] += last_bias
            return out.ravel()

        return field

    return fold


def _make_encoder(weights: Arrays, config: ModelConfig) -> Callable[[list[Floats], Floats], Floats]:
    """(pooled shape features, jet of theta) -> jet of the state at time 0."""
    scales = encoder_statistics(weights, config)
    heads = [read_layers(weights, f"{branch}_encoder.head", np.float64) for branch in config.branches]

    def encode(pooled: list[Floats], theta: Floats) -> Floats:
        parts = [
            _mlp(head, np.concatenate([_constant((features - mean) * scale, theta), theta], axis=1))
            for head, features, (mean, scale) in zip(heads, pooled, scales, strict=True)
        ]
        return np.concatenate(parts, axis=1)

    return encode


def _make_decoder(weights: Arrays, config: ModelConfig) -> Callable[[Floats, Times, Floats], Floats]:
    """(jet of theta, (T,) seconds, jet of states (1 + P, T, state)) -> jet (1 + P, T, 6 + K), not yet relative."""
    branches = branch_decoders(weights, config)
    output_scales = weights["gains"].astype(float)

    def decode(theta: Floats, times: Times, states: Floats) -> Floats:
        clock = _constant((2.0 * times / (times + config.clock) - 1.0)[:, None], theta)
        conditions = np.concatenate([clock, np.repeat(theta[:, None], len(times), axis=1)], axis=2)
        out = [] if config.rigid else [np.zeros((len(theta), len(times), POSE))]
        for branch in branches:
            features = states[..., branch.state]
            for index, network in enumerate(branch.networks):
                inputs = np.concatenate([features, conditions], axis=2)
                features = np.concatenate([features, _silu(_mlp(network, inputs, smooth=index == 0))], axis=2)
            out.append(features @ branch.readout.T)
        return np.concatenate(out, axis=2) * output_scales

    return decode


def make_sensitivities(weights: Arrays, config: ModelConfig) -> Sensitivities:
    """Maps (pooled shape, theta (P,) in [-1, 1], quality, (T,) seconds) to jet (1 + P, T, 6 + K) of reduced
    coordinates.

    NaN from where the integration failed.
    """
    encode, decode = _make_encoder(weights, config), _make_decoder(weights, config)
    fields = {name: _make_field(weights, config, getattr(np, name)) for name in ("float32", "float64")}

    def solve(pooled: list[Floats], theta: Floats, quality: SolverSettings, times: Times) -> Floats:
        jet = _parameter_jet(theta)
        start = encode(pooled, jet).astype(quality.dtype)
        with np.errstate(all="ignore"):
            solution = integrate(fields[quality.dtype](jet), start.ravel(), quality, until=float(times.max()))
            states = solution.sample(times).reshape(len(times), *start.shape).swapaxes(0, 1)
            y = decode(jet, times, states) - decode(jet, np.zeros(1), start[:, None])
        return np.where((times <= solution.end)[:, None], y, np.nan)

    return solve
