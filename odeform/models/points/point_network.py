"""Defines a network that moves each point by itself: layer sizes, a forward pass, and how it is trained.

The network is a function of a rest point x, parameters theta and time, and knows nothing of other points. It can
therefore move any shape, and a point moves the same in every shape.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

from odeform.models.points.arithmetic import Net, Sizes

__all__ = ["PointBatch", "PointNet", "Trial", "sum_of"]


@dataclass(frozen=True)
class PointBatch:
    """Inputs of a network, as arrays of numpy or tensors of torch."""

    x: Any
    """(B, 3) rest points in units of the body's radius of gyration."""
    theta: Any
    """(B, P) parameters in [-1, 1], or what else the network is conditioned on."""
    times: Any
    """(F, B) times in windows."""
    begin: Any
    """(B, 3) displacements at the first time, in units of the data's scale."""
    finer: Any
    """Scale of displacements less their mean over the body, in units of the data's scale: one number."""


@dataclass(frozen=True)
class Trial:
    """Hyperparameters among which validation chooses."""

    rate: float
    """Learning rate after the warm-up."""
    width: int
    """Width of the hidden layers."""


class PointNet(ABC):
    """A network for each point: its layers, its forward pass, and how training samples motions for it."""

    sampling: Literal["moments", "segments", "whole", "between"]
    """Training samples: single frames ("moments"), motions from a true state at any frame ("segments"), motions from
    rest ("whole"), or motions between two observed frames ("between")."""
    strides: tuple[int, ...] = (1,)
    """Frames per step of a "whole" motion, from the start of training to its end."""
    work: int = 8192
    """Points times frames in a training step."""
    trials: tuple[Trial, ...] = (Trial(1e-3, 128), Trial(1e-3, 256), Trial(3e-3, 256))

    @abstractmethod
    def sizes(self, parameters: int, width: int) -> Sizes:
        """Returns the layer widths of each part of the network, for P parameters."""

    @abstractmethod
    def predict(self, net: Net, batch: PointBatch) -> list[Any]:
        """Parts (F, B, 3) of the displacement, which is their sum: a single part in all models but one."""


def sum_of(parts: list[Any]) -> Any:
    """Returns the displacement (F, B, 3) from its parts."""
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
