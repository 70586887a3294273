"""Defines what descents minimise, unless a program brings another loss, and the device on which they do."""

from collections.abc import Callable

import torch

from odeform.errors import InputError

__all__ = ["Loss", "mean_square", "torch_device"]

Loss = Callable[[torch.Tensor, torch.Tensor, torch.Tensor], torch.Tensor]
"""(predicted (..., n), true (..., n), weights (...)) -> a scalar tensor.

The n coordinates are in metres: of reduced models shift (3), rotation times the body's radius of gyration (3), and the
coefficients of the modes, so that the sum of their squares is the mean square displacement of the body; of models that
move each point by itself, its displacement (3). Weights are 1 for frames of the data, and less for those that a spline
filled in.
"""


def mean_square(predicted: torch.Tensor, truth: torch.Tensor, weights: torch.Tensor) -> torch.Tensor:
    """The weighted mean over motions and frames (...) of the sum of squares over coordinates (..., n), in m^2."""
    return (weights * (predicted - truth).square().sum(dim=-1)).sum() / weights.sum()


def torch_device(name: str | None) -> torch.device:
    """The device of that name; without one, a GPU if there is one. `InputError` for one that is not there."""
    if name is None:
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:
        raise InputError(f"device: expected one that PyTorch finds here, such as cpu, got {name!r}: {error}") from None
    return device
