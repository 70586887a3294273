"""What a network that moves each point by itself is: its sizes, what it is asked, and how it wants to be taught.

It is a function of a rest point x, parameters theta and time, and knows nothing of other points: any shape can be
moved, and a point moves alike whatever it is asked with.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

from odeform.models.baselines.arithmetic import Net, Sizes

__all__ = ["PointNet", "Rows", "Trial", "sum_of"]


@dataclass(frozen=True)
class Rows:
    """What networks are asked: points x (B, 3) in units of the body's arm, parameters (B, P) in [-1, 1], and `times`
    (F, B) in windows. `begin` (B, 3) is the displacement at the first of them, in units of the data's scale; `finer`
    that of displacements less their mean over the body, in the same units. Arrays of numpy or tensors of torch."""

    x: Any
    theta: Any
    times: Any
    begin: Any
    finer: float


@dataclass(frozen=True)
class Trial:
    """A setting that validation chooses from."""

    rate: float
    """Learning rate after the warm-up."""
    width: int


class PointNet(ABC):
    """A network of points: its sizes, its prediction, and how it wants to be taught."""

    teaching: Literal["moments", "segments", "whole", "between"]
    """By single moments; by motions from a true state at any frame; by motions from rest; or by those between given
    frames."""
    strides: tuple[int, ...] = (1,)
    """Frames from one to the next that it is taught by, at the start of training to its end."""
    work: int = 8192
    """Rows times frames of a step of training."""
    trials: tuple[Trial, ...] = (Trial(1e-3, 128), Trial(1e-3, 256), Trial(3e-3, 256))

    @abstractmethod
    def sizes(self, parameters: int, width: int) -> Sizes:
        """Of each part, for P parameters."""

    @abstractmethod
    def predict(self, net: Net, rows: Rows) -> list[Any]:
        """Parts (F, B, 3) of the displacement, which is their sum: in all models but one there is one part."""


def sum_of(parts: list[Any]) -> Any:
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
