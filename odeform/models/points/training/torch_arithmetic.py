"""The arithmetic of point networks in torch, for training; `odeform.models.points.arithmetic` has it in numpy."""

from typing import Any

import torch
from torch.nn.functional import linear, silu

__all__ = ["Torch"]


class Torch:
    """Arithmetic on tensors, differentiable."""

    def linear(self, x: Any, weight: Any, bias: Any) -> Any:
        """Returns x @ weight.T + bias for x (..., inputs): (..., outputs)."""
        return linear(x, weight, bias)

    def join(self, parts: list[Any]) -> Any:
        """Join tensors (..., n) along their last axis."""
        return torch.cat(parts, dim=-1)

    def stack(self, parts: list[Any]) -> Any:
        """Stack tensors (...) of one shape along a new first axis."""
        return torch.stack(parts)

    def largest(self, x: Any) -> Any:
        """Returns the largest of each feature (..., features) over the points of x (..., points, features)."""
        return x.amax(-2)

    def act(self, name: str, x: Any) -> Any:
        """Returns the activation function `name`, elementwise; any shape (...). `AttributeError` for an unknown
        name."""
        return silu(x) if name == "silu" else getattr(torch, name)(x)
