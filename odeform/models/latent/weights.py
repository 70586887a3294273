"""The weights of an ODeform network as a checkpoint keeps them: checked, and laid out for inference."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from odeform.models.latent.config import ModelConfig
from odeform.models.layers import Layers, layer_shapes, read_layers
from odeform.motion.reduced_space import POSE
from odeform.types import Arrays, Floats

__all__ = ["BranchDecoder", "FieldLayers", "branch_decoders", "check_weights", "encoder_statistics", "field_layers"]


def check_weights(weights: Arrays, config: ModelConfig) -> None:
    """KeyError or ValueError unless every array of the network is there, finite and of its shape."""
    for name, shape in _shapes(config).items():
        if weights[name].shape != shape:
            raise ValueError(f"{name}: expected shape {shape}, got {weights[name].shape}")
        if not np.isfinite(weights[name]).all():
            raise ValueError(f"{name}: not finite")


def _shapes(config: ModelConfig) -> dict[str, tuple[int, ...]]:
    shapes: dict[str, tuple[int, ...]] = {"gains": (POSE + config.modes,), "time_scale": ()}
    for branch in config.branches:
        sizes = config.sizes(branch)
        inputs, outputs = sizes.pop("decoder.readout")
        shapes[f"{branch}_decoder.readout.weight"] = (outputs, inputs)
        if not config.random_features:
            del sizes["decoder.random"]
        shapes |= layer_shapes({f"{branch}_{part}": widths for part, widths in sizes.items()})
        for statistic in ("pooled_mean", "pooled_gain"):
            shapes[f"{branch}_encoder.{statistic}"] = (config.point_width,)
    return shapes


def encoder_statistics(weights: Arrays, config: ModelConfig) -> list[tuple[Floats, Floats]]:
    """Returns the mean (C,) and scale (C,) of the pooled shape features of each branch, in double precision."""
    names = [(f"{branch}_encoder.pooled_mean", f"{branch}_encoder.pooled_gain") for branch in config.branches]
    return [(weights[mean].astype(float), weights[scale].astype(float)) for mean, scale in names]


@dataclass(frozen=True, eq=False)
class FieldLayers:
    """The fields of both branches as one network, each layer with its bias:

        dz/dt = last tanh(middle tanh(first z + conditioning theta))

    There are zeros where the branches do not depend on each other. Three products take less time than six: at this
    size a call costs more than the zeros.
    """

    first: Floats
    conditioning: Floats
    middle: Floats
    last: Floats
    biases: tuple[Floats, Floats, Floats]


def field_layers(weights: Arrays, config: ModelConfig) -> FieldLayers:
    """Reads the weights in double precision, with time in seconds."""
    rate = 1.0 / float(weights["time_scale"])
    branches = [read_layers(weights, f"{branch}_field", np.float64) for branch in config.branches]
    # each branch depends on the state up to the end of its own part
    widths = [branch[0][0].shape[1] - config.parameters for branch in branches]
    firsts = [(branch[0][0], width) for branch, width in zip(branches, widths, strict=True)]
    first = np.concatenate([np.pad(m[:, :width], ((0, 0), (0, config.state - width))) for m, width in firsts])
    conditioning = np.concatenate([m[:, width:] for m, width in firsts])
    middle, last = (np.asarray(block_diag(*(branch[layer][0] for branch in branches))) for layer in (1, 2))
    one, two, three = (np.concatenate([branch[layer][1] for branch in branches]) for layer in range(3))
    return FieldLayers(first, conditioning, middle, rate * last, (one, two, rate * three))


@dataclass(frozen=True, eq=False)
class BranchDecoder:
    """The decoder of one branch, in double precision: a readout solved for by least squares has large weights that
    cancel. `state` is the branch's part of the latent state, `readout` (outputs, features)."""

    state: slice
    networks: list[Layers]
    readout: Floats


def branch_decoders(weights: Arrays, config: ModelConfig) -> list[BranchDecoder]:
    """Networks of each branch; the second, for random features, may be missing."""
    out = []
    for branch, state in zip(config.branches, config.states, strict=True):
        networks = [read_layers(weights, f"{branch}_decoder.{part}", np.float64) for part in ("hidden", "random")]
        readout = np.asfortranarray(weights[f"{branch}_decoder.readout.weight"].astype(float))
        out.append(BranchDecoder(state, [network for network in networks if network], readout))
    return out
