"""Networks as functions of arrays: written once, run by numpy for predictions and by torch for training."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
from scipy.special import expit

from odeform.cancellation import check_cancelled
from odeform.models.layers import Sizes

__all__ = ["CLOCK", "Arithmetic", "Net", "Numpy", "Sizes"]

OCTAVES = 7  # the shortest period of a clock's features is 1/32 of the window: 4.7 frames of 150
CLOCK = 1 + 2 * OCTAVES


@runtime_checkable
class Arithmetic(Protocol):
    """The operations that numpy and torch name differently, on arrays (..., features)."""

    def linear(self, x: Any, weight: Any, bias: Any) -> Any:
        """Returns x @ weight.T + bias for x (..., inputs): (..., outputs)."""
        ...

    def join(self, parts: list[Any]) -> Any:
        """Join arrays (..., n) along their last axis."""
        ...

    def stack(self, parts: list[Any]) -> Any:
        """Stack arrays (...) of one shape along a new axis."""
        ...

    def largest(self, x: Any) -> Any:
        """Returns the largest of each feature (..., features) over the points of x (..., points, features)."""
        ...

    def act(self, name: str, x: Any) -> Any:
        """Returns the activation function `name`, elementwise; any shape (...)."""
        ...


def _silu(x: Any) -> Any:
    return x * expit(x)


def _relu(x: Any) -> Any:
    return np.maximum(x, 0.0)


class Numpy:
    """The arithmetic of predictions."""

    acts: Mapping[str, Any] = {
        "silu": _silu,
        "relu": _relu,
        "tanh": np.tanh,
        "sigmoid": expit,
        "sin": np.sin,
        "cos": np.cos,
    }

    def linear(self, x: Any, weight: Any, bias: Any) -> Any:
        """Returns x @ weight.T + bias for x (..., inputs): (..., outputs)."""
        return x @ weight.T + bias

    def join(self, parts: list[Any]) -> Any:
        """Join arrays (..., n) along their last axis."""
        return np.concatenate(parts, axis=-1)

    def stack(self, parts: list[Any]) -> Any:
        """Stack arrays (...) of one shape along a new first axis."""
        return np.stack(parts)

    def largest(self, x: Any) -> Any:
        """Returns the largest of each feature (..., features) over the points of x (..., points, features)."""
        return x.max(axis=-2)

    def act(self, name: str, x: Any) -> Any:
        """Returns the activation function `name`, elementwise; any shape (...). `KeyError` for an unknown name."""
        return self.acts[name](x)


class Net:
    """Weights by name, as `layer_shapes` names them, and the arithmetic to evaluate them with."""

    def __init__(self, weights: Mapping[str, Any], arithmetic: Arithmetic) -> None:
        self.weights, self.arithmetic = weights, arithmetic
        self.join, self.stack, self.act = arithmetic.join, arithmetic.stack, arithmetic.act
        self.largest = arithmetic.largest

    def layers(self, part: str, x: Any, act: str = "silu") -> Any:
        """Maps (..., inputs) to (..., outputs): linear layers with `act` between them."""
        check_cancelled()
        index = 0
        while True:
            x = self.arithmetic.linear(x, self.weights[f"{part}.{index}.weight"], self.weights[f"{part}.{index}.bias"])
            index += 2
            if f"{part}.{index}.weight" not in self.weights:
                return x
            x = self.act(act, x)

    def clock(self, times: Any) -> Any:
        """Maps (...) times in windows to (..., CLOCK): the time, and its sines and cosines over octaves.

        Contacts last a few frames: without these features a network is too smooth in time at first, and trains slowly.
        """
        time = times[..., None]
        waves = [self.act(wave, np.pi * 2.0**k * time) for k in range(OCTAVES) for wave in ("sin", "cos")]
        return self.join([time, *waves])
