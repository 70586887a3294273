"""Describes what a viewer draws for the parameters of a scene."""

import math
from dataclasses import dataclass

from odeform.types import Vector

__all__ = ["Arrow"]


@dataclass(frozen=True, eq=False)
class Arrow:
    """An arrow from `start` (3,) m along `vector` (3,) m, with a short `label`.

    It stands for something that acts from `begin` to `end`, in seconds of the motion's clock.
    """

    start: Vector
    vector: Vector
    label: str
    begin: float
    end: float
    rises: bool = False
    """Whether its strength is sin^2 of its time, from none to that of the label and back; otherwise it is constant."""
    leaves: bool = False
    """Whether it starts in the middle of the body, as a velocity does; otherwise it ends at it, where a force acts."""
    vertex: int | None = None
    """The vertex of the body that its head touches; None for those that are nearest to the head."""

    def strength(self, time: float) -> float:
        """The part of the label's strength that acts at `time` in seconds."""
        if not self.begin <= time <= self.end:
            return 0.0
        return math.sin(math.pi * (time - self.begin) / (self.end - self.begin)) ** 2 if self.rises else 1.0
