"""Layers of the authors' networks, in NumPy and float32: chains of linear layers, and PointNet."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from odeform.types import Arrays, Floats, Points

__all__ = ["CHUNK", "Affine", "Chain", "PointNet", "chunks", "read_chain", "waves"]

CHUNK = 4096  # points that are worked on at once: 16 MB of the widest layer
EPSILON = 1e-5  # added to a variance, as PyTorch's batch norm does
FREQUENCIES = 6

Rows = Float[np.ndarray, "rows _"]


def chunks(count: int) -> Iterator[slice]:
    """Returns slices that split `count` points into chunks of at most `CHUNK`."""
    return (slice(begin, begin + CHUNK) for begin in range(0, count, CHUNK))


def waves(points: Points) -> Rows:
    """Maps (N, 3) to (N, 39): the coordinates, then their sines and cosines at six frequencies, three axes together."""
    phases = [np.float32(2.0**k * np.pi) * points for k in range(FREQUENCIES)]
    return np.concatenate([points, *(f(phase) for phase in phases for f in (np.sin, np.cos))], axis=1)


def relu(x: Floats) -> Floats:
    return np.maximum(x, 0.0, out=x)


def tanh(x: Floats) -> Floats:
    return np.tanh(x, out=x)


@dataclass(frozen=True, eq=False)
class Affine:
    """x -> x W + b. A 1x1 convolution is affine, and so is one followed by batch norm."""

    weight: Float[np.ndarray, "inputs outputs"]
    bias: Float[np.ndarray, " outputs"]

    @classmethod
    def read(cls, arrays: Arrays, name: str, norm: str | None = None) -> "Affine":
        """Reads the layer of that name, followed by the batch norm `norm` with its stored statistics.

        KeyError for missing arrays, ValueError for wrong sizes.
        """
        weight, bias = arrays[f"{name}.weight"], arrays[f"{name}.bias"]
        if weight.ndim not in (2, 3) or weight.shape[2:] not in ((), (1,)) or bias.shape != weight.shape[:1]:
            raise ValueError(f"size of {name}: {weight.shape} and {bias.shape}")
        weight = weight.reshape(weight.shape[:2]).astype(float)
        if norm is not None:
            parts = ("weight", "bias", "running_mean", "running_var")
            scale, shift, mean, variance = (arrays[f"{norm}.{part}"].astype(float) for part in parts)
            if {part.shape for part in (scale, shift, mean, variance)} != {bias.shape} or variance.min() < 0.0:
                raise ValueError(f"size or variance of {norm}")
            factor = scale / np.sqrt(variance + EPSILON)
            weight, bias = weight * factor[:, None], (bias - mean) * factor + shift
        return cls(np.ascontiguousarray(weight.T, dtype=np.float32), bias.astype(np.float32))

    def __call__(self, x: Rows) -> Rows:
        return x @ self.weight + self.bias


@dataclass(frozen=True, eq=False)
class Chain:
    """Affine layers, with an activation after all but the last."""

    layers: tuple[Affine, ...]
    activation: Callable[[Floats], Floats] = relu

    def __post_init__(self) -> None:
        for one, other in pairwise(self.layers):
            if one.weight.shape[1] != other.weight.shape[0]:
                raise ValueError(f"sizes: {one.weight.shape[1]} outputs into {other.weight.shape[0]} inputs")

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return self.layers[0].weight.shape[0]

    @property
    def outputs(self) -> int:
        """Number of outputs."""
        return self.layers[-1].weight.shape[1]

    def __call__(self, x: Rows) -> Rows:
        return self.after(self.layers[0](x))

    def after(self, x: Rows) -> Rows:
        """The rest of the chain, from the output of its first layer, which is overwritten."""
        for layer in self.layers[1:]:
            x = layer(self.activation(x))
        return x


def read_chain(arrays: Arrays, prefix: str, activation: Callable[[Floats], Floats] = relu) -> Chain:
    """The layers `prefix`N in order of N: weights (M, N) and biases (M,). `KeyError` if there is none."""
    found = (re.fullmatch(re.escape(prefix) + r"(\d+)\.weight", name) for name in arrays)
    numbers = sorted(int(match[1]) for match in found if match)
    if not numbers:
        raise KeyError(f"{prefix}0.weight")
    return Chain(tuple(Affine.read(arrays, f"{prefix}{number}") for number in numbers), activation)


@dataclass(frozen=True, eq=False)
class PointNet:
    """The shape times a matrix that depends on the whole shape, then the same chain for each point.

    Qi, Su, Mo and Guibas (CVPR 2017). Batch norms, where there are any, use their stored statistics, so that the output
    for a shape does not depend on the others of a batch.
    """

    features: Chain
    matrix: Chain
    encode: Chain
    normed: bool

    @classmethod
    def read(cls, arrays: Arrays, prefix: str) -> "PointNet":
        """Take the layers of an encoder from the weights of a file; KeyError where one is missing."""
        normed = f"{prefix}bn1.weight" in arrays

        def chain(layers: str, norms: str) -> Chain:
            names = zip(layers.split(), norms.split(), strict=False)
            norm = {layer: f"{prefix}{name}" for layer, name in names} if normed else {}
            return Chain(tuple(Affine.read(arrays, f"{prefix}{name}", norm.get(name)) for name in layers.split()))

        net = cls(
            chain("stn.conv1 stn.conv2 stn.conv3", "stn.bn1 stn.bn2 stn.bn3"),
            chain("stn.fc1 stn.fc2 stn.fc3", "stn.bn4 stn.bn5"),
            chain("conv1 conv2 conv3", "bn1 bn2 bn3"),
            normed,
        )
        if (net.features.inputs, net.features.outputs, net.matrix.outputs) != (3, net.matrix.inputs, 9):
            raise ValueError(f"sizes of {prefix}stn")
        return net

    @property
    def inputs(self) -> int:
        """Number of inputs per point."""
        return self.encode.inputs

    @property
    def outputs(self) -> int:
        """Number of features."""
        return self.encode.outputs

    def transform(self, points: Points) -> Float[np.ndarray, "3 3"]:
        """The matrix by which the points (N, 3) are multiplied from the right."""
        pooled = np.max([relu(self.features(points[part])).max(axis=0) for part in chunks(len(points))], axis=0)
        return self.matrix(relu(pooled)[None]).reshape(3, 3) + np.eye(3, dtype=np.float32)
